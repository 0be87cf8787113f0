#include "server/collision/response/Reach.h"

#include <algorithm>

namespace tessera {

/// p(f) = t(f) + R(f)·S(f)·u(f): |R'| <= θ, |R''| <= θ² for a slerp over θ; t and S are linear. The product rule for
/// what is below.
Reach onWay(const Reach& below, const Way& way) {
    const double angle = way.start.rotation.normalized().angularDistance(way.end.rotation.normalized());
    const double size = std::max(way.start.scale.cwiseAbs().maxCoeff(), way.end.scale.cwiseAbs().maxCoeff());
    const double growth = (way.end.scale - way.start.scale).cwiseAbs().maxCoeff();
    const double shift = (way.end.translation - way.start.translation).norm();
    const double turn = angle * size + growth;                            // |(RS)'|
    const double turnOfTurn = angle * angle * size + 2 * angle * growth;  // |(RS)''|
    Reach out;
    out.radius = std::max(way.start.translation.norm(), way.end.translation.norm()) + size * below.radius;
    out.speed = shift + turn * below.radius + size * below.speed;
    out.acceleration = turnOfTurn * below.radius + 2 * turn * below.speed + size * below.acceleration;
    out.bow = turnOfTurn * below.radius + size * below.bow;
    out.drift = shift + size * below.drift;
    return out;
}

Reach through(const Reach& below, const Affine3d& fixed) {
    const double stretch = stretchOf(fixed.linear());
    return {fixed.translation().norm() + stretch * below.radius, stretch * below.speed, stretch * below.acceleration,
            stretch * below.bow, stretch * below.drift};
}

double radiusOf(const Box& box, const Affine3d& map) {
    double radius = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d p((corner & 1) ? box.upper.x() : box.lower.x(), (corner & 2) ? box.upper.y() : box.lower.y(),
                      (corner & 4) ? box.upper.z() : box.lower.z());
        radius = std::max(radius, (map * p).norm());
    }
    return radius;
}

}  // namespace tessera
