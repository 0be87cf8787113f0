#include "common/export/WorldMeshes.h"

#include <algorithm>
#include <cmath>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/Environment.h"
#include "common/cores/Motion.h"
#include "common/export/LeavingMeshes.h"
#include "common/math/Srgb.h"

namespace tessera {

Vec3f WorldMesh::position(std::size_t vertex) const {
    const float* p = arrays.positions.as<float>().data() + 3 * vertex;
    return (node->world_T_node * Vec3d(p[0], p[1], p[2])).cast<float>();
}

Vec3f WorldMesh::normal(std::size_t vertex) const {
    const float* n = arrays.normals.as<float>().data() + 3 * vertex;
    const Vec3d turned = normals_ * Vec3d(n[0], n[1], n[2]);
    const double length = turned.norm();
    return length > 1e-30 && std::isfinite(length) ? Vec3f((turned / length).cast<float>()) : Vec3f(Vec3f::UnitY());
}

std::array<std::uint32_t, 3> WorldMesh::corners(std::size_t triangle) const {
    const std::uint32_t* c = arrays.indices.as<std::uint32_t>().data() + 3 * triangle;
    return mirrors() ? std::array{c[0], c[2], c[1]} : std::array{c[0], c[1], c[2]};
}

namespace {

/// What formats without nodes have no word for.
void noteTreeless(const SelectedNode& node, ExportNotes& notes) {
    if (node.isWay || !node.core) return;
    if (node.core.info().light != nullptr) notes.add("lights are left out", node.id);
    if (node.core.is<Camera>()) notes.add("cameras are left out", node.id);
    if (node.core.is<Animation>() || node.core.is<Motion>()) notes.add("animations are left out", node.id);
    if (node.core.is<Environment>()) notes.add("surroundings are left out", node.id);
}

}  // namespace

Expected<std::vector<WorldMesh>> worldMeshes(const LeavingScene& leaving) {
    std::vector<WorldMesh> all;
    LeavingMeshes meshes(leaving.scene, leaving.options.tolerance, leaving.notes);
    for (const SelectedNode& node : leaving.selection.nodes) {
        noteTreeless(node, leaving.notes);
        Expected<MeshArrays> arrays = meshes.of(node);
        if (arrays && arrays->kind == MeshKind::kGlyphs) arrays = expandedCopies(*arrays);
        if (!arrays) return tl::unexpected(arrays.error());
        if (arrays->positions.empty()) continue;
        if (arrays->kind != MeshKind::kTriangles && arrays->kind != MeshKind::kPoints &&
            arrays->kind != MeshKind::kLines) {
            leaving.notes.add("particles are left out", node.id);
            continue;
        }
        WorldMesh& made = all.emplace_back();
        made.node = &node;
        made.arrays = std::move(*arrays);
        made.material = node.materialFor(drawableOf(node.core).material());
        const Mat3d m = node.world_T_node.linear();
        made.normals_.col(0) = m.col(1).cross(m.col(2));
        made.normals_.col(1) = m.col(2).cross(m.col(0));
        made.normals_.col(2) = m.col(0).cross(m.col(1));
        if (made.mirrors()) made.normals_ = -made.normals_;
        for (std::size_t v = 0; v < made.vertices(); ++v)
            if (!made.position(v).allFinite()) {
                leaving.notes.add("shapes that reach beyond 3e38 m are left out (make them smaller)", node.id);
                all.pop_back();
                break;
            }
    }
    return all;
}

Vec3f faceNormal(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3d ab = (b - a).cast<double>(), ac = (c - a).cast<double>();
    const Vec3d normal = ab.cross(ac);
    const double length = normal.norm();
    return length > 0 && std::isfinite(length) ? Vec3f((normal / length).cast<float>()) : Vec3f(Vec3f::Zero());
}

Material materialOf(const Aspect& scene, ObjectId id) {
    const auto* known = id ? scene.get<Material>(id) : nullptr;
    return known ? *known : Material();
}

std::array<std::uint8_t, 4> colorBytes(const Vec4f& linear) {
    std::array<std::uint8_t, 4> bytes{};
    for (int i = 0; i < 4; ++i) {
        const float part = std::clamp(linear[i], 0.0f, 1.0f);
        bytes[static_cast<std::size_t>(i)] =
            static_cast<std::uint8_t>(std::lround(255 * (i == 3 ? part : srgbOfLinear(part))));
    }
    return bytes;
}

}  // namespace tessera
