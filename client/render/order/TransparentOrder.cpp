#include "client/render/order/TransparentOrder.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "common/drawable/VolumeArrays.h"

namespace tessera {

// A sweep along the axis on which they are spread most.
void TransparentOrder::findGroups(const RenderScene::Impl& scene) {
    changes_ = scene.transparentChanges;
    groups_.clear();
    groupOf_.assign(scene.items.size(), 0);
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < scene.items.size(); ++i)
        if ((scene.items[i].transparent || scene.items[i].over) && !scene.boxes[i].empty()) order.push_back(i);
    Vec3d sum = Vec3d::Zero(), squares = Vec3d::Zero();
    for (const std::uint32_t i : order) {
        const Vec3d middle = scene.boxes[i].center();
        sum += middle;
        squares += middle.cwiseProduct(middle);
    }
    int axis = 0;
    (squares - sum.cwiseProduct(sum) / static_cast<double>(std::max<std::size_t>(1, order.size()))).maxCoeff(&axis);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return scene.boxes[a].lower[axis] < scene.boxes[b].lower[axis];
    });
    // By place in `order`: the one that it hangs together with, or itself.
    std::vector<std::uint32_t> parents(order.size());
    std::iota(parents.begin(), parents.end(), 0u);
    const auto rootOf = [&](std::uint32_t at) {
        while (parents[at] != at) at = parents[at] = parents[parents[at]];
        return at;
    };
    std::vector<std::uint32_t> open;
    for (std::uint32_t k = 0; k < order.size(); ++k) {
        const Box& box = scene.boxes[order[k]];
        std::erase_if(open,
                      [&](std::uint32_t other) { return scene.boxes[order[other]].upper[axis] < box.lower[axis]; });
        for (const std::uint32_t other : open)
            if (box.overlaps(scene.boxes[order[other]])) parents[rootOf(k)] = rootOf(other);
        open.push_back(k);
    }
    std::vector<std::uint32_t> numbers(order.size(), 0xffffffffu);
    for (std::uint32_t k = 0; k < order.size(); ++k) {
        std::uint32_t& number = numbers[rootOf(k)];
        const ObjectId node = scene.items[order[k]].node;
        if (number == 0xffffffffu) {
            number = static_cast<std::uint32_t>(groups_.size());
            groups_.push_back({Box(), node});
        }
        groups_[number].box.extend(scene.boxes[order[k]]);
        groups_[number].first = std::min(groups_[number].first, node);
        groupOf_[order[k]] = number;
    }
}

void TransparentOrder::append(const RenderScene::Impl& scene, const ScreenCamera& camera,
                              const std::vector<Item>& items, DrawList& list) {
    if (items.empty()) return;
    pieces_.clear();
    const bool byTriangles = scene.transparentTriangles + scene.finerTransparentTriangles <= kMostTriangles;
    if (byTriangles && (changes_ != scene.transparentChanges || groupOf_.size() != scene.items.size()))
        findGroups(scene);
    const Vec3d axis = -camera.eye_T_world.linear().row(2).transpose();
    const double offset = -camera.eye_T_world.translation().z();
    for (std::uint32_t i = 0; i < items.size(); ++i) {
        const Item& item = items[i];
        Piece piece{item.depth, item.drawn.node, item.depth, item.drawn.node, {}, Piece::kWhole, i};
        if (byTriangles) {
            const Group& group = groups_[groupOf_[item.item]];
            piece.groupDepth = axis.dot(group.box.center()) + offset;
            piece.group = group.first;
        }
        const RenderMesh& mesh = *scene.items[item.item].mesh;
        if (mesh.arrays().sorted)
            addParticles(mesh, item, piece, camera);
        else if (mesh.kind() == MeshKind::kSlices)
            addSlices(mesh, item, piece, camera);
        else if (byTriangles && !item.drawn.over && mesh.kind() == MeshKind::kPoints)
            addBalls(mesh, item, piece, camera);
        else if (byTriangles && !item.drawn.over && rowOf(scene.items[item.item].kind).ownTriangles)
            addTriangles(*scene.items[item.item].mesh, item, piece, camera, list.hiddenOf(item.drawn));
        else
            pieces_.push_back(piece);
    }
    // Node ids are unique, so the order is total.
    std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
        return std::tie(b.groupDepth, a.group, b.depth, a.node, a.sides, a.triangle) <
               std::tie(a.groupDepth, b.group, a.depth, b.node, b.sides, b.triangle);
    });
    for (std::size_t i = 0; i < pieces_.size();) {
        const std::uint32_t of = pieces_[i].item;
        DrawItem& drawn = list.transparent.emplace_back(items[of].drawn);
        if (pieces_[i].triangle == Piece::kWhole) {
            ++i;
            continue;
        }
        drawn.sortedFrom = static_cast<std::uint32_t>(list.sortedTriangles.size());
        const bool particles = rowOf(drawn.kind).particles;
        for (; i < pieces_.size() && pieces_[i].item == of && pieces_[i].triangle != Piece::kWhole; ++i) {
            list.sortedTriangles.push_back(pieces_[i].triangle);
            if (particles) list.sortedTriangles.push_back(pieces_[i].triangle + 1);
        }
        drawn.sortedCount = static_cast<std::uint32_t>(list.sortedTriangles.size()) - drawn.sortedFrom;
    }
}

void TransparentOrder::addTriangles(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera,
                                    ClusterBits hidden) {
    const Affine3d eye_T_item = camera.eye_T_world * item.drawn.world_T_item;
    const Vec3d axis = -eye_T_item.linear().row(2).transpose() / 3;
    const double offset = -eye_T_item.translation().z();
    const std::span<const float> positions = mesh.arrays().positions.as<float>();
    const std::span<const std::uint32_t> indices = mesh.arrays().indices.as<std::uint32_t>();
    for (std::uint32_t t = 0; t < indices.size() / 3; ++t) {
        if (hasBit(hidden, t / MeshCluster::kTriangles)) continue;
        Vec3d sum = Vec3d::Zero();
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const float* p = &positions[3 * std::size_t{indices[3 * std::size_t{t} + corner]}];
            sum += Vec3d(p[0], p[1], p[2]);
        }
        piece.depth = axis.dot(sum) + offset;
        piece.triangle = t;
        pieces_.push_back(piece);
    }
}

// Two pieces each: the half that is seen from inside, and the one in front of it. As far away as such a half is on the
// average.
void TransparentOrder::addBalls(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera) {
    const Affine3d eye_T_item = camera.eye_T_world * item.drawn.world_T_item;
    const Vec3d axis = -eye_T_item.linear().row(2).transpose();
    const double half = 2.0 / 3 * mesh.shownRadius * axis.norm();
    const std::span<const float> centres = mesh.arrays().positions.as<float>();
    for (std::uint32_t i = 0; i < centres.size() / 3; ++i) {
        const double depth =
            axis.dot(Vec3d(centres[3 * i], centres[3 * i + 1], centres[3 * i + 2])) - eye_T_item.translation().z();
        for (const std::uint32_t side : {0u, 1u}) {
            piece.depth = side == 0 ? depth + half : depth - half;
            piece.triangle = 2 * i + side;
            pieces_.push_back(piece);
        }
    }
}

// Each lies on one side of all planes before its own. Where two of them differ first, what is beyond that plane comes
// before what is in it, and that before what is on the eye's side. Depths never grow along that order, so that nothing
// between them, by its own depth, turns it around.
void TransparentOrder::addSlices(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera) {
    const Affine3d eye_T_item = camera.eye_T_world * item.drawn.world_T_item;
    const Vec3d axis = -eye_T_item.linear().row(2).transpose() / 3, eye = eye_T_item.inverse().translation();
    const double offset = -eye_T_item.translation().z();
    const std::span<const float> positions = mesh.arrays().positions.as<float>(),
                                 texcoords = mesh.arrays().texcoords.as<float>();
    const std::span<const std::uint32_t> indices = mesh.arrays().indices.as<std::uint32_t>();
    const auto cornerOf = [&](std::size_t t, std::size_t corner) {
        const float* p = &positions[3 * std::size_t{indices[3 * t + corner]}];
        return Vec3d(p[0], p[1], p[2]);
    };
    const auto sliceOf = [&](std::size_t t) {
        return std::min(kMostVolumePlanes - 1,
                        static_cast<std::size_t>(std::max(0.0f, texcoords[2 * std::size_t{indices[3 * t]} + 1])));
    };
    // By its largest triangle.
    struct SlicePlane {
        Vec3d normal = Vec3d::Zero(), at = Vec3d::Zero();
        [[nodiscard]] double off(const Vec3d& p) const { return normal.dot(p - at); }
    };
    std::array<SlicePlane, kMostVolumePlanes> planes;
    const std::size_t count = indices.size() / 3;
    for (std::size_t t = 0; t < count; ++t) {
        const Vec3d at = cornerOf(t, 0), normal = (cornerOf(t, 1) - at).cross(cornerOf(t, 2) - at);
        if (SlicePlane& plane = planes[sliceOf(t)]; normal.squaredNorm() > plane.normal.squaredNorm())
            plane = {normal, at};
    }
    const std::size_t first = pieces_.size();
    for (std::size_t t = 0; t < count; ++t) {
        const Vec3d sum = cornerOf(t, 0) + cornerOf(t, 1) + cornerOf(t, 2);
        piece.sides = {};
        const std::size_t own = sliceOf(t);
        for (std::size_t k = 0; k <= own; ++k) {
            const bool beside = planes[k].off(sum / 3) * planes[k].off(eye) > 0;
            piece.sides[k / 32] |= std::uint64_t{k == own ? 1u : beside ? 2u : 0u} << (62 - 2 * (k % 32));
        }
        piece.depth = axis.dot(sum) + offset;
        piece.triangle = static_cast<std::uint32_t>(t);
        pieces_.push_back(piece);
    }
    const auto from = pieces_.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(from, pieces_.end(), [](const Piece& a, const Piece& b) {
        return std::tie(a.sides, a.triangle) < std::tie(b.sides, b.triangle);
    });
    for (std::size_t i = first + 1; i < pieces_.size(); ++i)
        pieces_[i].depth = std::min(pieces_[i].depth, pieces_[i - 1].depth);
}

// A piece each, for both of its triangles, as far away as its middle.
void TransparentOrder::addParticles(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera) {
    const Affine3d eye_T_item = camera.eye_T_world * item.drawn.world_T_item;
    const std::span<const float> numbers = mesh.arrays().positions.as<float>();
    const std::size_t places = mesh.kind() == MeshKind::kStreaks ? 2 : 1;
    const Vec3d axis = -eye_T_item.linear().row(2).transpose() / static_cast<double>(places);
    const double offset = -eye_T_item.translation().z();
    for (std::size_t i = 0; i < numbers.size() / (3 * places); ++i) {
        Vec3d sum = Vec3d::Zero();
        for (std::size_t k = 0; k < places; ++k) {
            const float* p = &numbers[3 * (places * i + k)];
            sum += Vec3d(p[0], p[1], p[2]);
        }
        piece.depth = axis.dot(sum) + offset;
        piece.triangle = static_cast<std::uint32_t>(2 * i);
        pieces_.push_back(piece);
    }
}

}  // namespace tessera
