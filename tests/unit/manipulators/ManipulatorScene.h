/// A scene with one thing to move, edited by lists, and who follows it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>

#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "server/manipulators/ManipulatorDrags.h"

namespace tessera {

struct ManipulatorScene {
    Aspect scene;
    ManipulatorDisplay display;
    ManipulatorDrags drags;
    std::uint64_t nextId = 100;
    ChangeListBuilder edit;
    ObjectId target, core, manipulator, manipulatorNode;

    ObjectId create(ObjectType type) {
        const ObjectId id{nextId++};
        edit.create(id, type);
        return id;
    }
    ObjectId node(ObjectId coreId, ObjectId parent = kRootNode) {
        const ObjectId id = create(typeOf<Node>());
        if (coreId) setField<&Node::core>(edit, id, coreId);
        edit.place(id, parent);
        return id;
    }
    ObjectId transform(const Pose& pose) {
        const ObjectId id = create(typeOf<Transform>());
        setField<&Transform::translation>(edit, id, pose.translation);
        setField<&Transform::rotation>(edit, id, pose.rotation);
        setField<&Transform::scale>(edit, id, pose.scale);
        return id;
    }
    ObjectId box(ObjectId parent, const Vec3d& size) {
        const MeshArrays arrays = makeBox(size).toArrays();
        const ObjectId id = create(typeOf<Geometry>());
        setField<&Geometry::positions>(edit, id, arrays.positions);
        setField<&Geometry::indices>(edit, id, arrays.indices);
        return node(id, parent);
    }
    void manipulate(std::int64_t kind, ObjectId what, ObjectId parent = kRootNode) {
        manipulator = create(typeOf<Manipulator>());
        setField<&Manipulator::kind>(edit, manipulator, kind);
        setField<&Manipulator::target>(edit, manipulator, what);
        manipulatorNode = node(manipulator, parent);
    }
    /// As the server says it to so many users; 1: to all.
    void seenAs(std::span<const float> sizes) {
        Vec4f first = Vec4f::Zero(), rest = Vec4f::Zero();
        for (std::size_t i = 0; i < sizes.size(); ++i)
            (i < 4 ? first : rest)[static_cast<Eigen::Index>(i % 4)] = sizes[i];
        setField<&Manipulator::pixels>(edit, manipulator, 100.0);
        setField<&Manipulator::sizes>(edit, manipulator, first);
        setField<&Manipulator::moreSizes>(edit, manipulator, rest);
    }
    /// Placeholders become ids, as the committer makes them.
    void apply(ChangeList list) {
        replaceIds(list, [&](ObjectId id) {
            return id.value >= kFirstPlaceholder ? ObjectId{nextId + id.value - kFirstPlaceholder} : id;
        });
        for (const Creation& creation : list.creations) nextId = std::max(nextId, creation.id.value + 1);
        const Expected<void> applied = scene.apply(list);
        ASSERT_TRUE(applied) << applied.error().message;
        display.sceneChanged(scene, &list);
    }
    void apply() { apply(edit.take()); }
    void frame() {
        if (ChangeList list = display.update(scene); !list.empty()) apply(std::move(list));
    }
    [[nodiscard]] PlacedManipulator placed() { return *display.place(scene, manipulatorNode); }
};

inline double uniform(std::mt19937_64& random, double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(random);
}
inline Vec3d randomVector(std::mt19937_64& random, double size) {
    return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}
inline Quatd randomRotation(std::mt19937_64& random) {
    return Quatd(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1, 1))
        .normalized();
}
/// Uneven, and mirrored as often as not.
inline Pose randomPose(std::mt19937_64& random) {
    Pose pose{.translation = randomVector(random, 3), .rotation = randomRotation(random), .scale = Vec3d::Ones()};
    for (int i = 0; i < 3; ++i) pose.scale[i] = uniform(random, 0.4, 2) * (random() % 2 == 0 ? 1 : -1);
    return pose;
}

}  // namespace tessera
