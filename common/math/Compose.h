/// The matrix of a transform. In a header of its own: what it needs of Eigen is compiled where it is used, not wherever
/// vectors are.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// translation · rotation · scale, the order of every transform in a scene.
[[nodiscard]] inline Affine3d composeTransform(const Vec3d& translation, const Quatd& rotation, const Vec3d& scale) {
    Affine3d m = Affine3d::Identity();
    // Number by number: so the matrix stays in registers. In pairs it would be written singly and read back in twos,
    // and processors wait for that.
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
