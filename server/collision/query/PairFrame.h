/// The relative pose of two trees as the kernels take it.
#pragma once

#include "server/collision/query/TouchQuery.h"
#include "server/collision/tree/KernelTypes.h"
#include "server/collision/volume/KDop.h"

namespace tessera {

/// Of the k-DOPs of a tree; the axes' of all else.
[[nodiscard]] DirectionSet directionsOf(VolumeKind kind);

/// Of trees that are not empty. For maps that no float can hold, the slack is so large that every volume and every pair
/// of triangles passes: slow, but the answers stay right.
[[nodiscard]] kernel::PairFrame pairFrame(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                          Realignment realignment = Realignment::kThreePlanes);

/// Of trees' contents; neither is empty, and only their own coordinates and the kind of volume count.
[[nodiscard]] kernel::PairFrame pairFrame(const TreeStorage& a, const TreeStorage& b, const Affine3d& a_T_b,
                                          Realignment realignment = Realignment::kThreePlanes);

/// For walks by table: B's profiles in A's frame. Of trees that are not empty, B's with profiles.
[[nodiscard]] kernel::ProfileLookups profileLookups(const TriangleTree& a, const TriangleTree& b,
                                                    const Affine3d& a_T_b);

/// For deciding about pairs of faces in double. Where it overflows, `doubt` is infinite and nothing is decided.
[[nodiscard]] kernel::PairMap pairMap(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b);
/// For triangles within these boxes, each in its own frame.
[[nodiscard]] kernel::PairMap pairMap(const Box& boundsA, const Box& boundsB, const Affine3d& a_T_b);
[[nodiscard]] kernel::MeshView meshView(const TriangleMesh& mesh);

}  // namespace tessera
