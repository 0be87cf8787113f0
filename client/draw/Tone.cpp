#include "client/draw/Tone.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

double encodeSrgb(double c) { return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055; }

}  // namespace

Vec3f encodedColor(const Vec3f& linear) {
    Vec3d c = linear.cast<double>().cwiseMax(0.0);
    const double peak = c.maxCoeff();
    if (peak > 0.8) {
        const double newPeak = 1.0 - 0.04 / (peak - 0.6);
        const double whiter = 1.0 - 1.0 / (0.15 * (peak - newPeak) + 1.0);
        c = (1.0 - whiter) * (c * (newPeak / peak)) + whiter * Vec3d::Constant(newPeak);
    }
    return {static_cast<float>(encodeSrgb(c.x())), static_cast<float>(encodeSrgb(c.y())),
            static_cast<float>(encodeSrgb(c.z()))};
}

}  // namespace tessera
