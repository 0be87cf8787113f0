#include "server/collision/pairwise/SurfacePairs.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/FoundFaces.h"
#include "server/collision/pairwise/Regions.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/spherical_bezier/DeformingTouch.h"

namespace tessera::surface_pairs {
namespace {

struct Trees {
    Trees(const CollisionShape& shapeA, const CollisionShape& shapeB)
        : a(shapeA.tree(commonVolume(shapeA, shapeB))), b(shapeB.tree(commonVolume(shapeA, shapeB))) {}
    const TriangleTree &a, &b;
};

/// One that follows by groups, and another that is not so large that to walk along all its groups would cost more than
/// the tree's refit.
bool byGroups(const CollisionShape& a, const CollisionShape& b) {
    constexpr std::size_t kMostTimesLarger = 16;
    if (!a.followsByGroups() && !b.followsByGroups()) return false;
    if (!a.hasGroups() || !b.hasGroups()) return false;
    const std::size_t follows =
        std::max(a.followsByGroups() ? a.faceCount() : 0, b.followsByGroups() ? b.faceCount() : 0);
    return std::max(a.faceCount(), b.faceCount()) <= kMostTimesLarger * follows;
}

/// What a walk makes on its way is kept for the next one of the thread.
DeformingTouch& walkOfThread() {
    thread_local DeformingTouch walk;
    return walk;
}

TouchOptions optionsOf(const PairEffort& effort) {
    return {.realignment = effort.realignment, .placed = effort.placed, .workers = effort.workers};
}

TouchedPair firstOf(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    if (byGroups(a, b)) return walkOfThread().first(a.groups(), b.groups(), a_T_b, effort.work);
    const Trees trees(a, b);
    const TouchOptions options = optionsOf(effort);
    return effort.hints != nullptr ? effort.hints->front.firstTouching(trees.a, trees.b, a_T_b, effort.work, options)
                                   : firstTouching(trees.a, trees.b, a_T_b, effort.work, options);
}

FacePairs allOf(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    if (byGroups(a, b)) return walkOfThread().all(a.groups(), b.groups(), a_T_b, effort.work);
    const Trees trees(a, b);
    return allTouching(trees.a, trees.b, a_T_b, effort.work, optionsOf(effort));
}

}  // namespace

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    return foundTouch(firstOf(a, b, a_T_b, effort));
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                   const PairEffort& effort) {
    return foundContacts(allOf(a, b, a_T_b, effort), most);
}

Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                  const DistanceOptions& options) {
    const Trees trees(a, b);
    return distanceBetween(trees.a, trees.b, a_T_b, work, options);
}

Impact firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                    const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options) {
    const Trees trees(a, b);
    return timeOfImpact(trees.a, motionA, trees.b, motionB, work, options);
}

PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    const FacePairs found = surfaceFacesTouching(a, b, work);
    PairDepth out;
    if (!found.complete) return out;
    if (found.pairs.empty()) {
        out.depth = 0;
        return out;
    }
    return deepestOf(regionsOf(a, b, found.pairs));
}

}  // namespace tessera::surface_pairs
