#include "common/rays/AimedRay.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::rays {

namespace {

/// Floats around a double: where it lies between two, one or two further on.
float notAbove(double value) {
    const float near = static_cast<float>(value);
    return double{near} > value ? near - std::abs(near) * 0x1p-23f - std::numeric_limits<float>::denorm_min() : near;
}
float notBelow(double value) {
    return -notAbove(-value);
}

}  // namespace

std::optional<AimedRay> aim(const Ray& ray, double maxT, double reach) {
    if (!(maxT >= 0) || !ray.origin.allFinite() || !ray.direction.allFinite() || ray.direction.isZero(0))
        return std::nullopt;
    AimedRay out;
    // A direction of denormal length has no inverse; divided it is as good as any other. By a power of two: that rounds
    // nothing.
    const double longestPart = ray.direction.cwiseAbs().maxCoeff();
    if (longestPart < 0.5 || longestPart > 2) {
        int exponent = 0;
        std::frexp(longestPart, &exponent);
        out.length = std::ldexp(1.0, exponent - 1);
    }
    const Vec3d direction = out.length == 1 ? ray.direction : Vec3d(ray.direction / out.length);
    out.limit = maxT * out.length;
    Vec3d origin = ray.origin;
    // From afar it begins near the mesh instead: its floats are good enough there, and so are its triangles' doubles.
    if (origin.cwiseAbs().maxCoeff() > 16 * reach) {
        double enters = 0, leaves = out.limit;
        for (int k = 0; k < 3; ++k) {
            const double far = 2 * reach + std::abs(origin[k]) * 1e-15;
            if (direction[k] == 0) {
                if (std::abs(origin[k]) > far) return std::nullopt;
                continue;
            }
            const double a = (-far - origin[k]) / direction[k], b = (far - origin[k]) / direction[k];
            enters = std::max(enters, std::min(a, b));
            leaves = std::min(leaves, std::max(a, b));
        }
        if (!(enters <= leaves)) return std::nullopt;
        out.before = enters;
        out.limit -= enters;
        origin += enters * direction;
    }
    Eigen::Index longest = 0;
    direction.cwiseAbs().maxCoeff(&longest);
    const auto z = static_cast<unsigned>(longest);
    const unsigned axis[3] = {(z + 1) % 3, (z + 2) % 3, z};
    for (unsigned i = 0; i < 3; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        out.ray.origin[i] = origin[k];
        out.ray.originUp[i] = notBelow(origin[k]);
        out.ray.originDown[i] = notAbove(origin[k]);
        out.ray.inverse[i] = std::abs(direction[k]) < 1e-30 ? std::copysign(1e30f, static_cast<float>(direction[k]))
                                                            : 1.0f / static_cast<float>(direction[k]);
        const bool forward = !std::signbit(direction[k]);
        out.ray.nearRow[i] = forward ? i : i + 3;
        out.ray.farRow[i] = forward ? i + 3 : i;
        out.ray.axis[i] = axis[i];
    }
    const double inverse = 1 / direction[longest];
    out.ray.shear[0] = direction[static_cast<Eigen::Index>(axis[0])] * inverse;
    out.ray.shear[1] = direction[static_cast<Eigen::Index>(axis[1])] * inverse;
    out.ray.shear[2] = inverse;
    return out;
}

}  // namespace tessera::rays
