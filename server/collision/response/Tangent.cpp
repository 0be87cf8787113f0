#include "server/collision/response/Tangent.h"

#include <algorithm>

namespace tessera {

Vec3d tangent(const Vec3d& wanted, std::span<const Vec3d> waysOut) {
    // So little into a surface is rounding of its normal; the gap to it is larger.
    const double slack = 1e-9 * wanted.norm();
    const auto goesIn = [&](const Vec3d& d) {
        return std::any_of(waysOut.begin(), waysOut.end(), [&](const Vec3d& out) { return out.dot(d) < -slack; });
    };
    if (!goesIn(wanted)) return wanted;
    // The nearest point of a cone: on one of its sides, else on one of its edges, else its tip.
    Vec3d best = Vec3d::Zero();
    const auto offer = [&](const Vec3d& d) {
        // Of projections of one vector the longest is the nearest.
        if (d.squaredNorm() > best.squaredNorm() * (1 + 1e-12) && !goesIn(d)) best = d;
    };
    for (const Vec3d& out : waysOut)
        if (out.dot(wanted) < 0) offer(wanted - out * out.dot(wanted));
    if (!best.isZero(0)) return best;
    for (std::size_t i = 0; i < waysOut.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const Vec3d crease = waysOut[i].cross(waysOut[j]);
            constexpr double kParallel = 1e-6;
            if (crease.norm() < kParallel) continue;
            const Vec3d along = crease.normalized();
            offer(along * along.dot(wanted));
        }
    return best;
}

}  // namespace tessera
