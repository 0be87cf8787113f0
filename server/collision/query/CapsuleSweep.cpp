#include "server/collision/query/CapsuleSweep.h"

#include <cmath>

#include "common/math/Box.h"
#include "server/collision/mesh/TriangleContact.h"

namespace tessera {
namespace {

/// As much of the radius as a contact may be away: Newton's last step need not be taken.
constexpr double kCapsuleTouch = 1e-6;
/// Of a way, what rounding may make of a component that is none.
constexpr double kCapsuleSlope = 1e-9;
/// A way that grazes converges slowly; what has not after so many steps is taken for a contact where it is.
constexpr int kCapsuleSteps = 100;

Box boxOfTriangle(const Triangle& t) {
    Box box;
    for (const Vec3d& corner : t) box.extend(corner);
    return box;
}

/// Newton's way to the first contact with one obstacle, before `limit`.
std::optional<CapsuleHit> firstTouch(const Capsule& body, const Vec3d& way, double length, const Triangle& obstacle,
                                     double limit) {
    double t = 0;
    for (int step = 0; step < kCapsuleSteps; ++step) {
        const SegmentGap gap = gapBetween(body.a + t * way, body.b + t * way, obstacle);
        // Later only rounding brings them together: they were apart before.
        if (gap.distance == 0)
            return t == 0 ? std::nullopt : std::optional(CapsuleHit{.t = t, .normal = -way / length});
        const double slope = gap.normal.dot(way), free = gap.distance - body.radius;
        if (slope >= -kCapsuleSlope * length) return std::nullopt;
        if (free <= kCapsuleTouch * body.radius) return CapsuleHit{.t = t, .normal = gap.normal};
        t += free / -slope;
        if (!(t <= limit)) return std::nullopt;
    }
    return CapsuleHit{.t = t, .normal = gapBetween(body.a + t * way, body.b + t * way, obstacle).normal};
}

}  // namespace

SegmentGap gapBetween(const Vec3d& a, const Vec3d& b, const Triangle& t) {
    const Vec3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    const double sideA = normal.dot(a - t[0]), sideB = normal.dot(b - t[0]);
    // Only what lies on both sides of the plane, or so near it that rounding cannot tell, may pass through.
    const double slack = 1e-12 * normal.norm() * ((a - t[0]).norm() + (b - t[0]).norm());
    if (!(sideA > slack && sideB > slack) && !(sideA < -slack && sideB < -slack) && trianglesIntersect({a, b, b}, t))
        return {};
    SegmentGap best{.distance = std::numeric_limits<double>::infinity()};
    const auto take = [&](const Vec3d& onSegment, const Vec3d& onTriangle) {
        const Vec3d between = onSegment - onTriangle;
        const double distance = between.norm();
        if (!(distance < best.distance)) return;
        best.distance = distance;
        best.normal = distance > 0 ? Vec3d(between / distance) : Vec3d(Vec3d::Zero());
    };
    take(a, nearestOnTriangle(t, a));
    if (a != b) {
        take(b, nearestOnTriangle(t, b));
        for (std::size_t i = 0; i < 3; ++i) {
            const NearestPoints near = nearestOnSegments(a, b, t[i], t[(i + 1) % 3]);
            take(near.onA, near.onB);
        }
    }
    return best;
}

std::optional<CapsuleHit> sweepCapsule(const Capsule& body, const Vec3d& way, std::span<const Triangle> obstacles) {
    const double length = way.norm();
    if (!(length > 0)) return std::nullopt;
    std::optional<CapsuleHit> first;
    double limit = 1;
    const auto swept = [&] {
        Box box;
        for (const Vec3d& end : {body.a, body.b}) {
            box.extend(end);
            box.extend(Vec3d(end + limit * way));
        }
        const Vec3d reach = Vec3d::Constant(body.radius * (1 + 2 * kCapsuleTouch));
        box.lower -= reach;
        box.upper += reach;
        return box;
    };
    Box box = swept();
    for (std::size_t i = 0; i < obstacles.size(); ++i) {
        if (!box.overlaps(boxOfTriangle(obstacles[i]))) continue;
        const std::optional<CapsuleHit> hit = firstTouch(body, way, length, obstacles[i], limit);
        if (!hit || (first && hit->t >= first->t)) continue;
        first = hit;
        first->obstacle = i;
        limit = hit->t;
        box = swept();
    }
    return first;
}

}  // namespace tessera
