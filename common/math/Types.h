/// Eigen under Tessera's names. Column vectors, radians, right-handed, +Y up, -Z forward. `parent_T_child` maps child
/// coordinates to the parent's. Transforms are double; vertices are float.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

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

/// Whether a quaternion of this squared length tells a rotation: neither so short nor so long that normalising it loses
/// its direction. False of what is not a number. Without branches, for many at a time.
[[nodiscard]] constexpr bool tellsRotation(double squaredNorm) {
    return static_cast<int>(squaredNorm >= 1e-100) & static_cast<int>(squaredNorm < 1e100);
}

/// translation · rotation · scale, the order of every transform in a scene.
[[nodiscard]] inline Affine3d composeTransform(const Vec3d& translation, const Quatd& rotation, const Vec3d& scale) {
    Affine3d m = Affine3d::Identity();
    // Number by number: so the matrix stays in registers. In pairs it would be written singly and read back in twos, and
    // processors wait for that.
    const Mat3d r = rotation.normalized().toRotationMatrix();
    m(0, 0) = r(0, 0) * scale[0];
    m(1, 0) = r(1, 0) * scale[0];
    m(2, 0) = r(2, 0) * scale[0];
    m(0, 1) = r(0, 1) * scale[1];
    m(1, 1) = r(1, 1) * scale[1];
    m(2, 1) = r(2, 1) * scale[1];
    m(0, 2) = r(0, 2) * scale[2];
    m(1, 2) = r(1, 2) * scale[2];
    m(2, 2) = r(2, 2) * scale[2];
    m.translation() = translation;
    return m;
}

}  // namespace tessera
