#include "common/math/Frustum.h"

namespace tessera {

Frustum Frustum::fromClipMatrix(const Mat4d& clip) {
    Frustum frustum;
    for (int axis = 0; axis < 3; ++axis) {
        for (int side = 0; side < 2; ++side) {
            const double sign = side == 0 ? 1.0 : -1.0;
            const Vec4d row = clip.row(3).transpose() + sign * clip.row(axis).transpose();
            const double length = row.head<3>().norm();
            Plane& plane = frustum.planes_[static_cast<std::size_t>(2 * axis + side)];
            if (length > 0) {
                plane.normal = row.head<3>() / length;
                plane.offset = row.w() / length;
            } else {
                // A plane at infinity: everything is in front of it.
                plane.normal = Vec3d::Zero();
                plane.offset = 1;
            }
        }
    }
    return frustum;
}

Frustum::Result Frustum::classify(const Box& box, Mask planes) const {
    Result result;
    if (box.empty()) return {.outside = true, .undecided = 0};
    for (unsigned i = 0; i < 6; ++i) {
        const auto bit = static_cast<Mask>(1u << i);
        if (!(planes & bit)) continue;
        const Plane& plane = planes_[i];
        // By its corners: the middle of a box that reaches very far is rounded to more than what lies at its near end.
        const Vec3d lower = plane.normal.cwiseProduct(box.lower), upper = plane.normal.cwiseProduct(box.upper);
        if (lower.cwiseMax(upper).sum() + plane.offset < 0) return {.outside = true, .undecided = 0};
        if (lower.cwiseMin(upper).sum() + plane.offset < 0) result.undecided |= bit;
    }
    return result;
}

}  // namespace tessera
