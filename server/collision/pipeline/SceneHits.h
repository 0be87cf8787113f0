/// What a ray hits, what is nearest to a place, and how long somebody may look for it.
#pragma once

#include <cstdint>
#include <optional>

#include "common/change/Value.h"
#include "common/math/Box.h"
#include "common/math/Types.h"
#include "common/rays/HitDetails.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/objects/ShapeCache.h"

namespace tessera {

struct NearestSurface {
    ObjectId node;                ///< the node that bears the geometry
    std::uint32_t face = 0;       ///< as of PickHit
    Vec3d point = Vec3d::Zero();  ///< world
    double distance = 0;          ///< world units
    double error = 0;  ///< the truth is within it; 0: exact to rounding. Points are balls, and looked at as octahedra
    HitDetails details = {};
};

struct PickHit {
    ObjectId node;                ///< the node that bears the geometry
    std::uint32_t face = 0;       ///< triangle index in the geometry; of points, 8 for each (common/geometry/Points.h)
    Vec3d point = Vec3d::Zero();  ///< world
    double t = 0;                 ///< in lengths of the ray's direction
    HitDetails details = {};      ///< normal, barycentric weights, texture coordinate
};

/// No point of the box is nearer, whatever rounding does. Below 0 where that may be nothing at all.
[[nodiscard]] double nearestOf(const Box& box, const Vec3d& place);
/// No point of the box is farther away.
[[nodiscard]] double farthestOf(const Box& box, const Vec3d& place);
/// NearestSurface::error of a face of these arrays' shape. The octahedra that stand for points have their corners on
/// the balls; the middles of their faces are the farthest from them.
[[nodiscard]] double errorOf(const MeshArrays& arrays, const CollisionShape& shape, std::uint32_t face,
                             const Affine3d& world_T_mesh);

/// What somebody who may wait lets a question take at once. Where it takes more there is no answer; then AsideQuery.
struct PickPatience {
    /// Of geometries whose trees are not there, all together. What has more is put down here.
    std::size_t maxMadeFaces = 2048;
    QueryWork work = {};
    std::optional<UnmadeShape> unmade = {};
    [[nodiscard]] bool over() const { return unmade || work.exhausted(); }
};

}  // namespace tessera
