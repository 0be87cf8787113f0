#include "server/collision/convex/ConvexQuery.h"

#include <algorithm>
#include <limits>

#include "server/collision/convex/Descent.h"
#include "server/collision/convex/ExpandingPolytope.h"

namespace tessera {

namespace {

/// A point of both hulls, for a simplex that has the origin in it.
Vec3d commonPoint(const DescentResult& met) {
    std::array<double, 4> weights = met.weights;
    if (!met.exact) {
        // Four points around the origin: the volume opposite each.
        const auto& p = met.simplex.points;
        const auto volume = [&](std::size_t i, std::size_t j, std::size_t k) {
            return std::abs(p[i].w.dot(p[j].w.cross(p[k].w)));
        };
        weights = {volume(1, 2, 3), volume(0, 2, 3), volume(0, 1, 3), volume(0, 1, 2)};
    }
    Vec3d point = Vec3d::Zero();
    double total = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(met.simplex.size); ++i) {
        // The middle of the two: rounding parts them.
        point += weights[i] * 0.5 * (met.simplex.points[i].a + met.simplex.points[i].b);
        total += weights[i];
    }
    return total > 0 ? Vec3d(point / total) : met.simplex.points[0].a;
}

NearestPoints pointsApart(const DescentResult& apart) {
    NearestPoints near = nearestOf(apart.simplex);
    // Proven apart, however near: never 0.
    near.distance = std::max(near.distance, std::numeric_limits<double>::min());
    return near;
}

}  // namespace

Touch hullsTouching(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, ConvexWork& work,
                    ConvexCache* cache) {
    switch (descend(MinkowskiDifference(a, b, a_T_b), false, work, cache).end) {
        case DescentEnd::kApart:
            return Touch::kNo;
        case DescentEnd::kMeet:
            return Touch::kYes;
        case DescentEnd::kUnknown:
            break;
    }
    return Touch::kUnknown;
}

HullDistance hullDistance(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, ConvexWork& work,
                          ConvexCache* cache) {
    const DescentResult result = descend(MinkowskiDifference(a, b, a_T_b), true, work, cache);
    switch (result.end) {
        case DescentEnd::kApart: {
            const NearestPoints near = pointsApart(result);
            return {near.distance, near.onA, near.onB, true};
        }
        case DescentEnd::kMeet: {
            const Vec3d common = commonPoint(result);
            return {0, common, common, true};
        }
        case DescentEnd::kUnknown:
            break;
    }
    return {result.lowerBound, Vec3d::Zero(), Vec3d::Zero(), false};
}

HullDepth hullDepth(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, ConvexWork& work,
                    ConvexCache* cache, const HullDepthOptions& options) {
    const MinkowskiDifference difference(a, b, a_T_b);
    const DescentResult result = descend(difference, true, work, cache);
    HullDepth depth;
    if (result.end == DescentEnd::kApart) {
        const NearestPoints near = pointsApart(result);
        depth.depth = -near.distance;
        depth.onA = near.onA;
        depth.onB = near.onB;
        const Vec3d gap = near.onB - near.onA;
        const double length = gap.stableNorm();
        // A gap of rounding size has no direction of its own; the simplex's is as good as any.
        if (length > difference.margin())
            depth.normal = gap / length;
        else if (result.nearest.direction.stableNorm() > 0)
            depth.normal = -result.nearest.direction.stableNormalized();
        return depth;
    }
    depth.touching = true;
    if (result.end == DescentEnd::kUnknown) {
        depth.depth = std::numeric_limits<double>::infinity();
        depth.complete = false;
        return depth;
    }
    const DepthOfOrigin origin = depthOfOrigin(difference, result.simplex, work, options);
    depth.depth = origin.depth;
    depth.normal = origin.normal;
    depth.complete = origin.complete;
    depth.onA = origin.onA;
    depth.onB = origin.onB;
    if (depth.depth <= difference.margin()) depth.onA = depth.onB = commonPoint(result);
    return depth;
}

}  // namespace tessera
