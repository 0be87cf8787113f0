#include "server/collision/pairwise/HullPairs.h"

#include <algorithm>
#include <vector>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/SurfacePairs.h"

namespace tessera::hull_pairs {
namespace {

constexpr std::uint64_t kMostSupports = 100'000;

/// Some of a surface within a hull. Asked only of surfaces that do not meet: then each face is in it as a whole or not
/// at all.
Touch inside(const CollisionShape& outer, const CollisionShape& inner, const Affine3d& outer_T_inner, QueryWork& work) {
    const ConvexHull& hull = *outer.hull();
    const Affine3d inner_T_outer = outer_T_inner.inverse();
    if (!inner_T_outer.matrix().allFinite()) return Touch::kNo;  // flat: it would have met the hull's faces
    const Box near = boxAround(inner_T_outer, hull.bounds());
    if (!near.overlaps(inner.bounds())) return Touch::kNo;
    std::vector<std::uint32_t> faces;
    if (!facesNear(inner, near, work, faces)) return Touch::kUnknown;
    const bool any = std::ranges::any_of(faces, [&](std::uint32_t face) {
        const Vec3d p = outer_T_inner * inner.triangle(face)[0];
        return hull.bounds().contains(p) && hull.contains(p);
    });
    return any ? Touch::kYes : Touch::kNo;
}

/// Of surfaces that do not meet.
Touch inside(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, bool hullIsA, QueryWork& work) {
    return hullIsA ? inside(a, b, a_T_b, work) : inside(b, a, a_T_b.inverse(), work);
}

PairTouch withInside(PairTouch found, const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                     QueryWork& work) {
    if (found.touch != Touch::kNo) return found;
    found.touch = inside(a, b, a_T_b, a.hull() != nullptr, work);
    found.complete = found.touch != Touch::kUnknown;
    found.count = found.touch == Touch::kYes ? 1 : 0;
    return found;
}

}  // namespace

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    ConvexWork convex{.limit = kMostSupports};
    PairTouch out;
    out.touch = hullsTouching(*a.hull(), *b.hull(), a_T_b, convex, effort.hints ? &effort.hints->hulls : nullptr);
    effort.work.triangleTests += convex.supports;
    out.complete = out.touch != Touch::kUnknown;
    out.count = out.touch == Touch::kYes ? 1 : 0;
    return out;
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t,
                   const PairEffort& effort) {
    return touch(a, b, a_T_b, effort);
}

Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                  const DistanceOptions& options) {
    ConvexWork convex{.limit = kMostSupports};
    const HullDistance found = hullDistance(*a.hull(), *b.hull(), a_T_b, convex);
    work.triangleTests += convex.supports;
    Distance out;
    out.distance = found.distance;
    out.onA = found.onA;
    out.onB = found.onB;
    out.complete = found.complete;
    out.faces = {kWhole, kWhole};
    if (found.complete && found.distance > options.upperBound) {
        out.farther = true;
        out.distance = options.upperBound;
    }
    return out;
}

PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    ConvexWork convex{.limit = kMostSupports};
    const HullDepth found = hullDepth(*a.shape.hull(), *b.shape.hull(), a.world.inverse() * b.world, convex);
    work.triangleTests += convex.supports;
    PairDepth out;
    out.point = a.world * (0.5 * (found.onA + found.onB));
    const Vec3d form = a.world.linear().inverse().transpose() * found.normal;
    const double unit = form.stableNorm();
    if (unit > 0) out.normal = form / unit;
    if (!found.touching)
        out.depth = 0;
    else if (found.complete && unit > 0)
        out.depth = std::max(0.0, found.depth) / unit;
    return out;
}

PairTouch touchSurface(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                       const PairEffort& effort) {
    return withInside(surfaceMethods(a, b).touch(a, b, a_T_b, effort), a, b, a_T_b, effort.work);
}

PairTouch contactsWithSurface(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                              const PairEffort& effort) {
    return withInside(surfaceMethods(a, b).contacts(a, b, a_T_b, most, effort), a, b, a_T_b, effort.work);
}

Distance distanceToSurface(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                           const DistanceOptions& options) {
    return orWithin(surfaceMethods(a, b).distance(a, b, a_T_b, work, options), a, b, a_T_b, work);
}

Distance orWithin(Distance out, const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                  QueryWork& work) {
    if (!out.complete || out.distance == 0) return out;
    const Touch within = inside(a, b, a_T_b, a.hull() != nullptr, work);
    if (within == Touch::kUnknown) out.complete = false;
    if (within != Touch::kYes) return out;
    out.distance = out.error = 0;
    out.farther = false;
    out.faces = {kWhole, kWhole};
    const ConvexHull& hull = a.hull() != nullptr ? *a.hull() : *b.hull();
    out.onA = out.onB = a.hull() != nullptr ? hull.centre() : Vec3d(a_T_b * hull.centre());
    return out;
}

}  // namespace tessera::hull_pairs
