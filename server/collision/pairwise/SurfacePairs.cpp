#include "server/collision/pairwise/SurfacePairs.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/Regions.h"
#include "server/collision/query/TouchQuery.h"

namespace tessera::surface_pairs {
namespace {

/// The larger mesh's frame is that of the predicates, so that an answer does not depend on who is called A.
bool inFrameOfB(const PlacedShape& a, const PlacedShape& b) {
    return b.shape.mesh().faceCount() > a.shape.mesh().faceCount();
}

Affine3d a_T_b(const PlacedShape& a, const PlacedShape& b) {
    return a.world.inverse() * b.world;
}

struct Trees {
    Trees(const CollisionShape& shapeA, const CollisionShape& shapeB)
        : a(shapeA.tree(commonVolume(shapeA, shapeB))), b(shapeB.tree(commonVolume(shapeA, shapeB))) {}
    const TriangleTree &a, &b;
};

}  // namespace

PairTouch touch(const PlacedShape& a, const PlacedShape& b, PairHints& hints, QueryWork& work) {
    const Trees trees(a.shape, b.shape);
    TouchedPair found;
    if (inFrameOfB(a, b)) {
        found = hints.front.firstTouching(trees.b, trees.a, a_T_b(b, a), work);
        std::swap(found.faces.a, found.faces.b);
    } else {
        found = hints.front.firstTouching(trees.a, trees.b, a_T_b(a, b), work);
    }
    PairTouch out;
    out.touch = found.touch;
    out.complete = found.touch != Touch::kUnknown;
    if (found.touch != Touch::kYes) return out;
    out.count = 1;
    out.faces = {found.faces};
    return out;
}

PairTouch contacts(const PlacedShape& a, const PlacedShape& b, std::size_t most, PairHints&, QueryWork& work) {
    const Trees trees(a.shape, b.shape);
    const bool swap = inFrameOfB(a, b);
    FacePairs found =
        swap ? allTouching(trees.b, trees.a, a_T_b(b, a), work) : allTouching(trees.a, trees.b, a_T_b(a, b), work);
    if (swap) {
        for (FacePair& faces : found.pairs) std::swap(faces.a, faces.b);
        std::ranges::sort(found.pairs);
    }
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
    PairHints none;
    const PairTouch found = contacts(a, b, ~std::size_t{0}, none, work);
    PairDepth out;
    if (!found.complete) return out;
    if (found.faces.empty()) {
        out.depth = 0;
        return out;
    }
    return deepestOf(regionsOf(a, b, found.faces));
}

}  // namespace tessera::surface_pairs
