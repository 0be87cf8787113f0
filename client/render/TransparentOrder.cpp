#include "client/render/TransparentOrder.h"

#include <algorithm>
#include <tuple>

namespace tessera {

void TransparentOrder::append(const RenderScene::Impl& scene, const ScreenCamera& camera,
                              const std::vector<Item>& items, DrawList& list) {
    pieces_.clear();
    const bool byTriangles = scene.transparentTriangles <= kMostTriangles;
    for (std::uint32_t i = 0; i < items.size(); ++i) {
        const Item& item = items[i];
        if (byTriangles && item.item->mesh->primitive == Primitive::kTriangles)
            addTriangles(item, i, camera, list.hiddenOf(item.drawn));
        else
            pieces_.push_back({item.depth, item.drawn.node, Piece::kWhole, i});
    }
    // Node ids are unique, so the order is total.
    std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
        return std::tie(b.depth, a.node, a.triangle) < std::tie(a.depth, b.node, b.triangle);
    });
    for (std::size_t i = 0; i < pieces_.size();) {
        const std::uint32_t of = pieces_[i].item;
        DrawItem& drawn = list.transparent.emplace_back(items[of].drawn);
        if (pieces_[i].triangle == Piece::kWhole) {
            ++i;
            continue;
        }
        drawn.sortedFrom = static_cast<std::uint32_t>(list.sortedTriangles.size());
        for (; i < pieces_.size() && pieces_[i].item == of; ++i) list.sortedTriangles.push_back(pieces_[i].triangle);
        drawn.sortedCount = static_cast<std::uint32_t>(list.sortedTriangles.size()) - drawn.sortedFrom;
    }
}

void TransparentOrder::addTriangles(const Item& item, std::uint32_t index, const ScreenCamera& camera,
                                    ClusterBits hidden) {
    const RenderMesh& mesh = *item.item->mesh;
    const Affine3d eye_T_item = camera.eye_T_world * item.drawn.world_T_item;
    const Vec3d axis = -eye_T_item.linear().row(2).transpose() / 3;
    const double offset = -eye_T_item.translation().z();
    const std::span<const float> positions = mesh.positions.as<float>();
    const std::span<const std::uint32_t> indices = mesh.indices.as<std::uint32_t>();
    for (std::uint32_t t = 0; t < mesh.triangles; ++t) {
        if (hasBit(hidden, t / MeshCluster::kTriangles)) continue;
        Vec3d sum = Vec3d::Zero();
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const float* p = &positions[3 * std::size_t{indices[3 * std::size_t{t} + corner]}];
            sum += Vec3d(p[0], p[1], p[2]);
        }
        pieces_.push_back({axis.dot(sum) + offset, item.drawn.node, t, index});
    }
}

}  // namespace tessera
