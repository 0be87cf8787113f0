/// Eigen under Tessera's names. Column vectors, radians, right-handed, +Y up, -Z forward. `parent_T_child` maps child
/// coordinates to the parent's. Transforms are double; vertices are float.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

namespace tessera {

using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec4f = Eigen::Vector4f;
using Vec2d = Eigen::Vector2d;
using Vec3d = Eigen::Vector3d;
using Vec4d = Eigen::Vector4d;
using Mat3d = Eigen::Matrix3d;
using Mat4d = Eigen::Matrix4d;
using Mat4f = Eigen::Matrix4f;
using Quatd = Eigen::Quaterniond;
using Affine3d = Eigen::Affine3d;
using Isometry3d = Eigen::Isometry3d;

/// Whether a float has this very value.
[[nodiscard]] constexpr bool isFloat(double x) {
    return x <= static_cast<double>(std::numeric_limits<float>::max()) &&
           x >= -static_cast<double>(std::numeric_limits<float>::max()) &&
           static_cast<double>(static_cast<float>(x)) == x;
}

/// Whether a quaternion of this squared length tells a rotation: neither so short nor so long that normalising it loses
/// its direction. False of what is not a number. Without branches, for many at a time.
[[nodiscard]] constexpr bool tellsRotation(double squaredNorm) {
    return static_cast<int>(squaredNorm >= 1e-100) & static_cast<int>(squaredNorm < 1e100);
}

}  // namespace tessera
