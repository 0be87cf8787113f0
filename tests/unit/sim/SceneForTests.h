/// A small scene by hand: a crane with a hook box on a motion, and a wall in its way.
#pragma once

#include <string>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Motion.h"
#include "common/cores/Node.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "common/wall/Wall.h"

namespace tessera::test {

/// One host with one small tile.
inline Wall wallOfOne() {
    Wall wall;
    wall.name = "test";
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = Vec3d(-1, 0, 0);
    screen.lowerRight = Vec3d(1, 0, 0);
    screen.upperLeft = Vec3d(-1, 1, 0);
    screen.grid.tileWidthPx = screen.grid.tileHeightPx = 16;
    wall.screens = {screen};
    wall.users = {User{.name = "viewer"}};
    wall.hosts = {{"only", {{"front", 0, 0, Eye::kCenter, "viewer"}}}};
    return wall;
}

/// A wall two metres wide of 1,000 pixels for each user; heads stand at the origin.
inline Wall wallOfUsers(std::size_t users) {
    Wall wall;
    wall.name = "users";
    wall.hosts = {{"only", {}}};
    for (std::size_t i = 0; i < users; ++i) {
        const std::string name = "user" + std::to_string(i);
        Screen screen;
        screen.name = "screen" + std::to_string(i);
        screen.lowerLeft = Vec3d(-1, -1, -2);
        screen.lowerRight = Vec3d(1, -1, -2);
        screen.upperLeft = Vec3d(-1, 1, -2);
        screen.grid.tileWidthPx = screen.grid.tileHeightPx = 1000;
        wall.screens.push_back(screen);
        wall.users.push_back(User{.name = name, .position = Vec3d::Zero()});
        wall.hosts[0].tiles.push_back({screen.name, 0, 0, Eye::kCenter, name});
    }
    return wall;
}

/// Hands out placeholders and remembers nothing else.
class ListMaker {
public:
    ObjectId create(ObjectType type) {
        const ObjectId id{kFirstPlaceholder + next_++};
        builder.create(id, type);
        return id;
    }
    template <typename Core>
    ObjectId create() {
        return create(typeOf<Core>());
    }
    /// A node with a core (none: a plain one) below `parent`.
    ObjectId node(const std::string& name, ObjectId parent, ObjectId core = {}) {
        const ObjectId id = create<Node>();
        builder.set(id, typeOf<Node>(), fieldId<&Node::name>, name);
        if (core) builder.set(id, typeOf<Node>(), fieldId<&Node::core>, core);
        builder.place(id, parent);
        return id;
    }
    ObjectId transform(const Vec3d& translation) {
        const ObjectId id = create<Transform>();
        builder.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(translation));
        return id;
    }
    ObjectId box(const Vec3d& size) {
        const MeshArrays arrays = makeBox(size).toArrays();
        const ObjectId id = create<Geometry>();
        builder.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, arrays.positions);
        builder.set(id, typeOf<Geometry>(), fieldId<&Geometry::normals>, arrays.normals);
        builder.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, arrays.indices);
        return id;
    }
    /// side x side squares of two triangles each, from the origin along x and y.
    ObjectId sheet(std::uint32_t side) {
        std::vector<float> places;
        std::vector<std::uint32_t> corners;
        for (std::uint32_t y = 0; y <= side; ++y)
            for (std::uint32_t x = 0; x <= side; ++x) {
                for (const std::uint32_t v : {x, y, 0u}) places.push_back(static_cast<float>(v));
                const std::uint32_t at = y * (side + 1) + x;
                if (x < side && y < side)
                    for (const auto c : {0u, 1u, side + 1, 1u, side + 2, side + 1}) corners.push_back(at + c);
            }
        const ObjectId shape = create<Geometry>();
        setField<&Geometry::positions>(builder, shape, Blob::of(std::span<const float>(places)));
        setField<&Geometry::indices>(builder, shape, Blob::of(std::span<const std::uint32_t>(corners)));
        return shape;
    }
    ObjectId motion(ObjectId target, const std::vector<std::array<double, 4>>& timeAndPlace) {
        std::vector<double> keys;
        for (const auto& [t, x, y, z] : timeAndPlace)
            for (const double v : {t, x, y, z, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0}) keys.push_back(v);
        const ObjectId id = create<Motion>();
        builder.set(id, typeOf<Motion>(), fieldId<&Motion::target>, target);
        builder.set(id, typeOf<Motion>(), fieldId<&Motion::keys>, Blob::of(std::span<const double>(keys)));
        return id;
    }
    ChangeListBuilder builder;

private:
    std::uint64_t next_ = 0;
};

/// /crane (a Transform driven from x = 0 to x = 6 in one second) carries /crane/hook, a box of 1; /wall is a box of
/// 1 × 4 × 4 at x = 4. The interest stops the crane at the wall.
inline ChangeList craneScene(bool withInterest = true) {
    ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    const ObjectId crane = make.node("crane", kRootNode, place);
    make.node("hook", crane, make.box(Vec3d::Ones()));
    const ObjectId wallPlace = make.node("wall", kRootNode, make.transform(Vec3d(4, 0, 0)));
    make.node("bricks", wallPlace, make.box(Vec3d(1, 4, 4)));
    make.node("motion", kRootNode, make.motion(place, {{0, 0, 0, 0}, {1, 6, 0, 0}}));
    if (withInterest) {
        const ObjectId interest = make.create<Interest>();
        make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, crane);
        make.node("interest", kRootNode, interest);
    }
    return make.builder.take();
}

/// The Transform core of the node at `path`.
inline ObjectId transformAt(const Aspect& scene, const std::string& path) {
    return scene.get<Node>(findNode(scene, path).value())->core;
}
inline Vec3d placeOf(const Aspect& scene, const std::string& path) {
    return scene.get<Transform>(transformAt(scene, path))->translation;
}
/// A list that moves one Transform.
inline ChangeList moveTo(ObjectId transform, const Vec3d& translation) {
    ChangeListBuilder builder;
    builder.set(transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(translation));
    return builder.take();
}

}  // namespace tessera::test
