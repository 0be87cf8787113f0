#include "server/collision/pairwise/SurfacePairs.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/Regions.h"
#include "server/collision/query/TouchQuery.h"

namespace tessera::surface_pairs {
namespace {

struct Trees {
    Trees(const CollisionShape& shapeA, const CollisionShape& shapeB)
        : a(shapeA.tree(commonVolume(shapeA, shapeB))), b(shapeB.tree(commonVolume(shapeA, shapeB))) {}
    const TriangleTree &a, &b;
};

}  // namespace

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    const Trees trees(a, b);
    const TouchOptions options{.workers = effort.workers};
    const TouchedPair found = effort.hints != nullptr
                                  ? effort.hints->front.firstTouching(trees.a, trees.b, a_T_b, effort.work, options)
                                  : firstTouching(trees.a, trees.b, a_T_b, effort.work, options);
    PairTouch out;
    out.touch = found.touch;
    out.complete = found.touch != Touch::kUnknown;
    if (found.touch != Touch::kYes) return out;
    out.count = 1;
    out.faces = {found.faces};
    return out;
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                   const PairEffort& effort) {
    const Trees trees(a, b);
    FacePairs found = allTouching(trees.a, trees.b, a_T_b, effort.work, {.workers = effort.workers});
    PairTouch out;
    out.touch = !found.pairs.empty() ? Touch::kYes : found.complete ? Touch::kNo : Touch::kUnknown;
    out.complete = found.complete;
    out.count = found.pairs.size();
    out.faces = std::move(found.pairs);
    out.faces.resize(std::min(out.faces.size(), most));
    out.faces.shrink_to_fit();
    return out;
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
