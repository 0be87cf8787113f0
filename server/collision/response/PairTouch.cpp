#include "server/collision/response/PairTouch.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

bool inFrameOfB(const PlacedTree& a, const PlacedTree& b) {
    return b.tree.mesh().faceCount() > a.tree.mesh().faceCount();
}

Affine3d a_T_b(const PlacedTree& a, const PlacedTree& b) {
    return a.world.inverse() * b.world;
}

}  // namespace

Touch surfacesTouching(const PlacedTree& a, const PlacedTree& b, QueryWork& work) {
    return inFrameOfB(a, b) ? anyTouching(b.tree, a.tree, a_T_b(b, a), work)
                            : anyTouching(a.tree, b.tree, a_T_b(a, b), work);
}

FacePairs surfaceFacesTouching(const PlacedTree& a, const PlacedTree& b, QueryWork& work) {
    if (!inFrameOfB(a, b)) return allTouching(a.tree, b.tree, a_T_b(a, b), work);
    FacePairs found = allTouching(b.tree, a.tree, a_T_b(b, a), work);
    for (FacePair& faces : found.pairs) std::swap(faces.a, faces.b);
    std::ranges::sort(found.pairs);
    return found;
}

TouchedPair firstSurfacesTouching(const PlacedTree& a, const PlacedTree& b, TouchFront& front, QueryWork& work) {
    if (!inFrameOfB(a, b)) return front.firstTouching(a.tree, b.tree, a_T_b(a, b), work);
    TouchedPair found = front.firstTouching(b.tree, a.tree, a_T_b(b, a), work);
    std::swap(found.faces.a, found.faces.b);
    return found;
}

}  // namespace tessera
