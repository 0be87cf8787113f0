/// One geometry in the world.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Box.h"
#include "server/collision/pairwise/CollisionShape.h"

namespace tessera {

/// A geometry-bearing node that takes part in an interest.
struct Part {
    ObjectId node;
    std::uint32_t place = 0;                      ///< index into ObjectHandler::places()
    std::uint32_t body = 0;                       ///< index into ObjectHandler::bodies()
    std::shared_ptr<const CollisionShape> shape;  ///< null: nothing to collide with (absent or malformed)
    Affine3d world = Affine3d::Identity();        ///< world_T_part
    Box worldBox;                                 ///< empty where the part meets nothing
    /// Never the same for two poses or shapes of one part; survives tables made anew where pose and shape stay.
    std::uint64_t poseVersion = 0;

    /// Has triangles, and a pose that does not flatten them.
    [[nodiscard]] bool solid() const { return !worldBox.empty(); }
};

/// The vertices of a deforming part are about to be elsewhere.
struct PartDeformation {
    std::uint32_t part = 0;
    std::uint32_t first = 0;
    std::vector<Vec3d> end;  ///< of the vertices of the shape's mesh from `first` on, in the part's frame; others stay
};

}  // namespace tessera
