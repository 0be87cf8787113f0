/// Do two surfaces in the world meet? The predicates are evaluated in the frame of the one with more faces (of as many:
/// A's), on the other's vertices mapped to it: whoever asks about a pair, in whatever order, gets the same answer, to
/// the last bit, and the large one is not mapped anywhere.
#pragma once

#include "server/collision/query/TouchFront.h"

namespace tessera {

/// A surface in its place.
struct PlacedTree {
    const TriangleTree& tree;
    const Affine3d& world;
};

[[nodiscard]] Touch surfacesTouching(const PlacedTree& a, const PlacedTree& b, QueryWork& work);
/// Ascending by faces of A, then of B.
[[nodiscard]] FacePairs surfaceFacesTouching(const PlacedTree& a, const PlacedTree& b, QueryWork& work);
/// One pair that meets; `front` belongs to this pair of surfaces.
[[nodiscard]] TouchedPair firstSurfacesTouching(const PlacedTree& a, const PlacedTree& b, TouchFront& front,
                                                QueryWork& work);

}  // namespace tessera
