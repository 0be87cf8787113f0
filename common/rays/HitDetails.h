/// What else there is to say of a point on a face.
#pragma once

#include <cstdint>
#include <optional>

#include "common/geometry/Mesh.h"
#include "common/math/Types.h"

namespace tessera {

struct HitDetails {
    Vec3d normal =
        Vec3d::Zero();  ///< world, of length 1, as the face's corners turn there; zero of a face without area
    Vec3d weights = Vec3d::Zero();  ///< barycentric: of the corners; they sum up to 1
    std::optional<Vec2d> texcoord;  ///< of the first set, where the mesh has one
};

/// `face` as the mesh is shown (points: 8 each, without texture coordinates of their own), `point` in world
/// coordinates, near it. Nothing where there is no such face, or its arrays are not here.
[[nodiscard]] std::optional<HitDetails> detailsOf(const MeshArrays& arrays, const Affine3d& world_T_mesh,
                                                  std::uint32_t face, const Vec3d& point);

}  // namespace tessera
