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
    const Vec3d center = box.center();
    const Vec3d half = 0.5 * box.size();
    for (unsigned i = 0; i < 6; ++i) {
        const auto bit = static_cast<Mask>(1u << i);
        if (!(planes & bit)) continue;
        const Plane& plane = planes_[i];
        const double distance = plane.normal.dot(center) + plane.offset;
        const double reach = plane.normal.cwiseAbs().dot(half);
        if (distance < -reach) return {.outside = true, .undecided = 0};
        if (distance < reach) result.undecided |= bit;
    }
    return result;
}

}  // namespace tessera
