/// How far is a body of blocks from a tree? For the queries of this folder.
#pragma once

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/representation/BodyParts.h"

namespace tessera {

/// A body of blocks, in its own frame and not empty.
struct BlockBody {
    const NumberedParts& parts;
    const Box& bounds;
};

/// How near two triangles are, the first of A, the second of B mapped to A's frame.
using MeasureFaces = NearestPoints (*)(const Triangle& a, const Triangle& b);

/// As nearestPair (PartPairs.h), for trees of spheres and boxes. Blocks of leaves are made small trees when they are
/// looked at, the nearest first, so that the kernels of trees (tree/kernel) can find what of them is near.
[[nodiscard]] Distance nearestToTree(const BlockBody& blocks, const TriangleTree& tree, bool treeIsA,
                                     const Affine3d& a_T_b, QueryWork& work, const DistanceOptions& options,
                                     double enough, MeasureFaces measure);
[[nodiscard]] bool canBeNearestTo(const TriangleTree& tree);

}  // namespace tessera
