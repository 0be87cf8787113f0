/// What an opaque pixel of a linear colour becomes, by the formulas themselves (client/draw approximates them in
/// shaders): Khronos PBR Neutral (2024) without its toe, then IEC 61966-2-1.
#pragma once

#include <cmath>

#include "common/math/Types.h"

namespace tessera::test {

[[nodiscard]] inline Vec3f encodedColor(const Vec3f& linear) {
    Vec3d c = linear.cast<double>().cwiseMax(0.0);
    const double peak = c.maxCoeff();
    if (peak > 0.8) {
        const double newPeak = 1.0 - 0.04 / (peak - 0.6);
        const double whiter = 1.0 - 1.0 / (0.15 * (peak - newPeak) + 1.0);
        c = (1.0 - whiter) * (c * (newPeak / peak)) + whiter * Vec3d::Constant(newPeak);
    }
    const auto encode = [](double v) {
        return static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055);
    };
    return {encode(c.x()), encode(c.y()), encode(c.z())};
}

}  // namespace tessera::test
