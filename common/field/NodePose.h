/// What a core does to the coordinates of its node.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// A core that moves what is below its node has a member `NodePose pose() const`; the table of types finds it there.
struct NodePose {
    Affine3d matrix = Affine3d::Identity();
    /// The matrix is world_T_node itself, whatever stands above; else it is parent_T_node.
    bool absolute = false;

    /// world_T_node. `world_T_parent` is another object. The same bits as the product of the two, written where it is wanted.
    void placeBelow(const Affine3d& world_T_parent, Affine3d& world_T_node) const {
        if (absolute) {
            world_T_node = matrix;
            return;
        }
        world_T_node.linear().noalias() = world_T_parent.linear() * matrix.linear();
        world_T_node.translation().noalias() = world_T_parent.linear() * matrix.translation() + world_T_parent.translation();
        world_T_node.makeAffine();
    }
};

}  // namespace tessera
