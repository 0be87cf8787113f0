/// What is known of a point of a smooth surface, whatever the surface is made of.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// In the surface's own frame and units. `du`, `dv`: derivatives by the face's or patch's parameters, zero vectors
/// where there are none (a cusp, a collapsed edge). `normal`: of length 1 along du × dv, its limit where that is zero;
/// a zero vector where there is no limit.
struct SurfacePoint {
    Vec3d point = Vec3d::Zero(), du = Vec3d::Zero(), dv = Vec3d::Zero(), normal = Vec3d::Zero();
    double error = 0;  ///< the surface is no farther from `point` than this, rounding aside; 0: exact
};

/// Of length 1 along du × dv, however long they are; zero where they span no area to speak of.
[[nodiscard]] inline Vec3d normalAlong(const Vec3d& du, const Vec3d& dv) {
    const double lengthU = du.cwiseAbs().maxCoeff(), lengthV = dv.cwiseAbs().maxCoeff();
    if (!(lengthU > 0 && lengthV > 0)) return Vec3d::Zero();
    const Vec3d alongU = du / lengthU, alongV = dv / lengthV, across = alongU.cross(alongV);
    const double area = across.norm();
    return area > 1e-10 * alongU.norm() * alongV.norm() ? Vec3d(across / area) : Vec3d::Zero();
}

}  // namespace tessera
