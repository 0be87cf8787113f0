#include "server/collision/pipeline/SceneHits.h"

#include <numbers>

#include "common/math/Decompositions.h"

namespace tessera {
namespace {

double roundingOf(const Box& box, const Vec3d& place) {
    constexpr double kRounding = 1e-12;
    return kRounding * (box.lower.norm() + box.upper.norm() + place.norm());
}

}  // namespace

double nearestOf(const Box& box, const Vec3d& place) {
    const Vec3d beyond = (box.lower - place).cwiseMax(place - box.upper).cwiseMax(0.0);
    return beyond.norm() - roundingOf(box, place);
}

double farthestOf(const Box& box, const Vec3d& place) {
    return (place - box.lower).cwiseAbs().cwiseMax((place - box.upper).cwiseAbs()).norm() + roundingOf(box, place);
}

double errorOf(const MeshArrays& arrays, const CollisionShape& shape, std::uint32_t face,
               const Affine3d& world_T_mesh) {
    if (arrays.kind != MeshKind::kPoints) return 0;
    const Triangle corners = shape.mesh().triangle(face);
    const double radius = (corners[1] - corners[0]).norm() / std::numbers::sqrt2;
    return radius * (1 - 1 / std::numbers::sqrt3) * singularStretchOf(world_T_mesh.linear()).most;
}

}  // namespace tessera
