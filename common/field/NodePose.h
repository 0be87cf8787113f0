/// What a core does to the coordinates of its node.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// A core that moves what is below its node has a member `NodePose pose() const`; the table of types finds it there.
struct NodePose {
    Affine3d matrix = Affine3d::Identity();
    /// The matrix is world_T_node itself, whatever stands above; else it is parent_T_node.
    bool absolute = false;

    [[nodiscard]] Affine3d below(const Affine3d& world_T_parent) const {
        return absolute ? matrix : Affine3d(world_T_parent * matrix);
    }
};

}  // namespace tessera
