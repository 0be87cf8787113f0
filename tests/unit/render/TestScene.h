/// Small scenes for the tests of culling, built the only way there is: by change lists.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/render/order/RenderAction.h"
#include "client/render/scene/ShadowCasters.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "tests/unit/render/DepthFake.h"

namespace tessera {

class TestScene {
public:
    ChangeListBuilder edit;
    Aspect aspect;
    std::uint64_t nextId = 100;

    ObjectId create(ObjectType type) {
        const ObjectId id{nextId++};
        edit.create(id, type);
        return id;
    }
    ObjectId node(ObjectId core = {}, ObjectId parent = kRootNode) {
        const ObjectId id = create(typeOf<Node>());
        if (core) edit.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        edit.place(id, parent);
        return id;
    }
    ObjectId transform(const Vec3d& translation, const Quatd& rotation = Quatd::Identity(),
                       const Vec3d& scale = Vec3d::Ones()) {
        const ObjectId id = create(typeOf<Transform>());
        place(id, translation, rotation, scale);
        return id;
    }
    void place(ObjectId id, const Vec3d& translation, const Quatd& rotation, const Vec3d& scale) {
        edit.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(translation));
        edit.set(id, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(rotation));
        edit.set(id, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(scale));
    }
    ObjectId geometry(const MeshData& mesh, ObjectId material = {}) {
        const MeshArrays arrays = mesh.toArrays();
        const ObjectId id = create(typeOf<Geometry>());
        const ObjectType type = typeOf<Geometry>();
        edit.set(id, type, fieldId<&Geometry::positions>, toValue(arrays.positions));
        edit.set(id, type, fieldId<&Geometry::normals>, toValue(arrays.normals));
        edit.set(id, type, fieldId<&Geometry::colors>, toValue(arrays.colors));
        edit.set(id, type, fieldId<&Geometry::texcoords>, toValue(arrays.texcoords));
        edit.set(id, type, fieldId<&Geometry::indices>, toValue(arrays.indices));
        if (mesh.primitive == Primitive::kPoints) {
            edit.set(id, type, fieldId<&Geometry::primitive>, toValue(Geometry::kPoints));
            edit.set(id, type, fieldId<&Geometry::pointRadius>, toValue(mesh.pointRadius));
        }
        if (material) edit.set(id, type, fieldId<&Geometry::material>, toValue(material));
        return id;
    }
    ObjectId material(float alpha) {
        const ObjectId id = create(typeOf<Material>());
        edit.set(id, typeOf<Material>(), fieldId<&Material::baseColor>, toValue(Vec4f(0.5f, 0.6f, 0.7f, alpha)));
        return id;
    }
    /// The node of the geometry, below a node with a transform.
    ObjectId put(ObjectId geometryCore, const Vec3d& translation, const Quatd& rotation = Quatd::Identity(),
                 const Vec3d& scale = Vec3d::Ones(), ObjectId parent = kRootNode) {
        return node(geometryCore, node(transform(translation, rotation, scale), parent));
    }
    ObjectId box(const Vec3d& center, const Vec3d& size) { return put(geometry(makeBox(size)), center); }

    /// Commits the edits so far.
    ChangeList apply() {
        ChangeList list = edit.take();
        const Expected<void> done = aspect.apply(list);
        EXPECT_TRUE(done) << (done ? "" : done.error().message);
        return list;
    }
};

/// A screen of `columns` × `rows` tiles, two metres wide, an eye two metres before its middle, looking along the
/// world's -Z.
struct TestCamera {
    Screen screen;
    User user;
    View view;

    explicit TestCamera(int widthPx = 320, int heightPx = 200, int columns = 1, int rows = 1) {
        screen.name = "front";
        const double halfHeight = static_cast<double>(heightPx * rows) / (widthPx * columns);
        screen.lowerLeft = {-1, -halfHeight, 0};
        screen.lowerRight = {1, -halfHeight, 0};
        screen.upperLeft = {-1, halfHeight, 0};
        screen.grid.columns = columns;
        screen.grid.rows = rows;
        screen.grid.tileWidthPx = widthPx;
        screen.grid.tileHeightPx = heightPx;
        user.name = "viewer";
        user.position = {0, 0, 2};
        // The eye itself at the world's origin.
        view.position = {0, 0, -2};
    }
    [[nodiscard]] ScreenCamera camera(Eye eye = Eye::kCenter) const { return screenCamera(screen, user, eye, view); }
    [[nodiscard]] PixelRect tile(int column = 0, int row = 0) const {
        const int w = screen.grid.tileWidthPx;
        const int h = screen.grid.tileHeightPx;
        return {column * w, row * h, w, h};
    }
};

/// Each once, where it comes first.
[[nodiscard]] inline std::vector<ObjectId> nodesOf(const std::vector<DrawItem>& items) {
    std::vector<ObjectId> ids;
    std::set<ObjectId> known;
    for (const DrawItem& item : items)
        if (known.insert(item.node).second) ids.push_back(item.node);
    return ids;
}
/// What is transparent, triangle by triangle; of what is drawn as a whole no triangle is named.
struct DrawnPart {
    ObjectId node;
    std::optional<std::uint32_t> triangle;
    bool operator==(const DrawnPart&) const = default;
};
[[nodiscard]] inline std::vector<DrawnPart> transparentParts(const DrawList& list) {
    std::vector<DrawnPart> parts;
    for (const DrawItem& item : list.transparent) {
        if (item.sortedCount == 0) parts.push_back({item.node, std::nullopt});
        for (std::uint32_t i = 0; i < item.sortedCount; ++i)
            parts.push_back({item.node, list.sortedTriangles[item.sortedFrom + i]});
    }
    return parts;
}
[[nodiscard]] inline std::vector<ObjectId> nodesOf(const DrawList& list) {
    std::vector<ObjectId> ids = nodesOf(list.opaque);
    for (const ObjectId id : nodesOf(list.transparent)) ids.push_back(id);
    return ids;
}
/// What casts a view's shadows: what rests, and what moves.
[[nodiscard]] inline std::vector<DrawItem> itemsOf(const ShadowView& view) {
    std::vector<DrawItem> items;
    view.still->all.each([](const PixelRect&) { return true; },
                         [&](const ShadowCaster& caster) { items.push_back(caster.item); });
    for (const ShadowCaster& caster : view.moving) items.push_back(caster.item);
    return items;
}
[[nodiscard]] inline bool draws(const DrawList& list, ObjectId node) {
    for (const ObjectId id : nodesOf(list))
        if (id == node) return true;
    return false;
}

/// Whether `part` is `whole` with some elements left away.
template <typename T>
[[nodiscard]] bool isSubsequence(const std::vector<T>& part, const std::vector<T>& whole) {
    std::size_t next = 0;
    for (const T& element : whole) {
        if (next < part.size() && part[next] == element) ++next;
    }
    return next == part.size();
}

[[nodiscard]] inline DrawList cull(const TestScene& scene, CullerKind kind, const TestCamera& camera,
                                   CullCounts* counts = nullptr) {
    RenderScene all;
    all.update(scene.aspect, nullptr);
    DepthFake device(scene.aspect);
    auto list = RenderAction(kind).run(all, camera.camera(), camera.tile(), &device, counts);
    EXPECT_TRUE(list);
    return list ? *list : DrawList();
}

}  // namespace tessera
