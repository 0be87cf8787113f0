/// What a core does to the coordinates of its node.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// A core that moves what is below its node has a member `NodePose pose() const`, defined in Poses.cpp; the table of
/// types finds it there.
struct NodePose {
    Affine3d matrix = Affine3d::Identity();
    /// The matrix is world_T_node itself, whatever stands above; else it is parent_T_node.
    bool absolute = false;
};

/// world_T_node of a NodePose, or of a core that has such a member, below a parent; the same bits as the product of the
/// two matrices, in one piece. `world_T_parent` is another object. Defined for each such core in
/// common/cores/Poses.cpp.
template <typename Core>
void placeBelow(const Core& core, const Affine3d& world_T_parent, Affine3d& world_T_node);

}  // namespace tessera
