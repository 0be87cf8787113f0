/// Which triangles of one mesh run into each other? For bodies that deform.
#pragma once

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

struct SelfTouchOptions {
    /// Corners at equal positions are one corner: for meshes whose vertices were split along seams of texture or
    /// normals. Else corners are shared where their indices are equal.
    bool weldEqualPositions = false;
};

/// Does face a touch face b of the same mesh beyond what their common corners make natural? With S the positions of the
/// corners that they share (touching counts throughout, as in trianglesIntersect; a triangle without area is the
/// segment or point that it is):
///
/// - S empty: they touch. So a vertex that lies on an edge of a neighbour without being its corner (a T-junction)
/// counts.
/// - one position: they have another point in common besides it.
/// - two: they have a point in common that is not on the edge between them: one is folded onto the other, exactly.
/// - three: they are the same triangle; it counts if it has area.
///
/// Exact on the coordinates of the mesh. Symmetric.
[[nodiscard]] bool touchBeyondAdjacency(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b,
                                        const SelfTouchOptions& options = {});

/// All pairs a < b for which that holds, as the mesh is now: call it after TriangleTree::refit. None for a surface that
/// is closed, welded and free of self-intersections. Independent of the tree's kind and of the processor; work is
/// counted as by allTouching of the tree with itself.
[[nodiscard]] FacePairs selfTouching(const TriangleTree& tree, QueryWork& work, const SelfTouchOptions& options = {});

}  // namespace tessera
