#include "common/cores/ComponentTransform.h"
#include "common/cores/InverseTransform.h"
#include "common/cores/Switch.h"
#include "common/scene/Action.h"
#include "common/scene/ChildChoice.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

std::vector<std::uint64_t> visited(const Action& prepared, const Aspect& aspect, ObjectId from = kRootNode) {
    std::vector<std::uint64_t> ids;
    Action action = prepared;
    action.onNode([&](const Visit& visit) {
        ids.push_back(visit.nodeId.value);
        return Descend::kInto;
    });
    action.run(aspect, from);
    return ids;
}

TEST(Action, VisitsDepthFirstAndChildrenInOrder) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().node(10, "rope", 3).node(11, "first", 0).under(11, 1, 0).take());
    EXPECT_EQ(visited(Action(), aspect), (std::vector<std::uint64_t>{1, 11, 2, 3, 10, 4}));
    EXPECT_EQ(visited(Action(), aspect, ObjectId(3)), (std::vector<std::uint64_t>{3, 10}));
    EXPECT_TRUE(visited(Action(), aspect, ObjectId(5)).empty()) << "a core is no place to start from";
}

TEST(Action, CallsTheHandlerOfTheCoreWithWhereItStands) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().node(10, "load", 3).coreOfNode(10, 6).take());  // 3 carries the translation (1, 2, 3)
    std::vector<std::pair<std::uint64_t, Vec3d>> seen;
    Action action;
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        EXPECT_EQ(geometry.material, ObjectId(7));
        EXPECT_EQ(visit.depth, visit.nodeId == ObjectId(10) ? 3u : 2u);
        seen.emplace_back(visit.nodeId.value, visit.world_T_node.translation());
        return Descend::kInto;
    });
    action.run(aspect);
    ASSERT_EQ(seen.size(), 2u) << "a shared core is visited at each of its places";
    EXPECT_EQ(seen[0], (std::pair<std::uint64_t, Vec3d>(10, Vec3d(1, 2, 3))));
    EXPECT_EQ(seen[1], (std::pair<std::uint64_t, Vec3d>(4, Vec3d(0, 0, 0))));
}

TEST(Action, ComponentTransformsTurnAndStretchAboutTheirCentre) {
    Aspect aspect = hall();
    ComponentTransform about;
    about.translation = Vec3d(1, 2, 3);
    about.center = Vec3d(4, 5, 6);
    about.rotation = Quatd(0.5, 0.5, 0.5, 0.5);
    about.scaleOrientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitX()));
    about.scale = Vec3d(2, 3, 4);
    Edits edits;
    edits.core<ComponentTransform>(20, 4);
    setAllFields(edits, ObjectId(20), Object::of(about));
    mustApply(aspect, edits.take());
    // One factor after the other, as VRML97 and OpenSG write it.
    const Affine3d wanted = Eigen::Translation3d(about.translation) * Eigen::Translation3d(about.center) *
                            about.rotation * about.scaleOrientation * Eigen::Scaling(about.scale) *
                            about.scaleOrientation.inverse() * Eigen::Translation3d(-about.center);
    EXPECT_TRUE(worldTransform(aspect, ObjectId(4)).isApprox(wanted, 1e-14));
    EXPECT_TRUE((wanted * about.center).isApprox(about.center + about.translation, 1e-14)) << "the centre only moves";
}

TEST(Action, BelowAnInverseTransformIsTheWorld) {
    Aspect aspect = hall();  // 3 carries the translation (1, 2, 3)
    mustApply(aspect, Edits()
                          .node(10, "out", 3)
                          .node(11, "there", 10)
                          .node(12, "far", 11)
                          .core<InverseTransform>(20, 10)
                          .core<Transform>(21, 11)
                          .value<Transform>(21, fieldId<&Transform::translation>, toValue(Vec3d(0, 7, 0)))
                          .take());
    EXPECT_EQ(worldTransform(aspect, ObjectId(10)).matrix(), Mat4d::Identity());
    EXPECT_EQ(worldTransform(aspect, ObjectId(12)).translation(), Vec3d(0, 7, 0));
    Action action;
    std::vector<Vec3d> seen;
    action.onNode([&](const Visit& visit) {
        seen.push_back(visit.world_T_node.translation());
        return Descend::kInto;
    });
    action.run(aspect, ObjectId(3));
    EXPECT_EQ(seen, (std::vector<Vec3d>{{1, 2, 3}, {0, 0, 0}, {0, 7, 0}, {0, 7, 0}}));
}

TEST(Action, PassesByWhatAHandlerDeclines) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().node(10, "load", 3).take());
    Action action;
    action.on<Transform>([](const Visit&, const Transform&) { return Descend::kPast; });
    EXPECT_EQ(visited(action, aspect), (std::vector<std::uint64_t>{1, 2, 3, 4}));
}

TEST(Action, RespectsSwitches) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().core<Switch>(20, 2).take());
    const auto shown = [&](std::int64_t choice, bool hidden = false) {
        mustApply(aspect, Edits().value<Switch>(20, fieldId<&Switch::choice>, choice).take());
        Action action;
        action.visitHidden(hidden);
        return visited(action, aspect);
    };
    EXPECT_EQ(shown(Switch::kAll), (std::vector<std::uint64_t>{1, 2, 3, 4}));
    EXPECT_EQ(shown(1), (std::vector<std::uint64_t>{1, 2, 4}));
    EXPECT_EQ(shown(Switch::kNone), (std::vector<std::uint64_t>{1, 2}));
    EXPECT_EQ(shown(2), (std::vector<std::uint64_t>{1, 2})) << "past the end shows none";
    EXPECT_EQ(shown(Switch::kNone, true), (std::vector<std::uint64_t>{1, 2, 3, 4}));
    const std::vector<std::vector<std::uint64_t>> byMask = {{1, 2}, {1, 2, 3}, {1, 2, 4}, {1, 2, 3, 4}};
    for (std::int64_t mask = 0; mask < 16; ++mask) {
        mustApply(aspect, Edits().value<Switch>(20, fieldId<&Switch::mask>, mask).take());
        EXPECT_EQ(shown(Switch::kMask), byMask[static_cast<std::size_t>(mask % 4)])
            << mask << ": bits beyond the children show nothing";
    }
}

TEST(Action, OfAMaskChildrenUpToThe63rdAreShown) {
    Aspect aspect;
    Edits e;
    e.core<Switch>(200, 0);
    e.value<Switch>(200, fieldId<&Switch::choice>, Switch::kMask)
        .value<Switch>(200, fieldId<&Switch::mask>, std::numeric_limits<std::int64_t>::max());
    mustApply(aspect, e.take());
    std::size_t count = seenChildren(aspect.find(ObjectId{200}), 100)->size();
    EXPECT_EQ(count, 63u);
}

TEST(Action, AccumulatesTransformsAsWorldTransformDoesToTheLastBit) {
    Aspect aspect;
    Edits e;
    for (std::uint64_t i = 0; i < 50; ++i) {
        e.node(10 + i, "joint", i == 0 ? 1 : 9 + i).core<Transform>(100 + i, 10 + i);
        e.value<Transform>(100 + i, fieldId<&Transform::translation>, toValue(Vec3d(0.1 * double(i), 1.0 / 3, -7)));
        e.value<Transform>(100 + i, fieldId<&Transform::rotation>, toValue(Quatd(0.9, 0.1 * double(i % 7), 0.2, -0.3)));
        e.value<Transform>(100 + i, fieldId<&Transform::scale>, toValue(Vec3d(1, 0.97, 1.01)));
    }
    mustApply(aspect, e.take());
    std::size_t nodes = 0;
    const auto compare = [&](const Visit& visit) {
        ++nodes;
        EXPECT_EQ(visit.world_T_node.matrix(), worldTransform(aspect, visit.nodeId).matrix());
        return Descend::kInto;
    };
    Action action;
    action.onNode(compare);
    action.run(aspect);
    action.run(aspect, ObjectId(30));  // from the middle of the chain: the ancestors count too
    EXPECT_EQ(nodes, 51u + 30u);
}

// More inner nodes than are remembered, asked for in any order: the bits of worldTransform.
TEST(Action, WorldTransformsOfManyAreThoseOfEach) {
    Aspect aspect;
    Edits e;
    std::mt19937 random(3);
    const std::uint64_t count = 400;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint64_t parent = i == 0 ? 1 : 10 + random() % i;
        e.node(10 + i, "joint", parent);
        if (i % 9 == 4) {
            e.core<InverseTransform>(1000 + i, 10 + i);
            continue;
        }
        if (i % 7 == 3) continue;
        e.core<Transform>(1000 + i, 10 + i);
        e.value<Transform>(1000 + i, fieldId<&Transform::translation>, toValue(Vec3d(0.1 * double(i), 1.0 / 3, -7)));
        e.value<Transform>(1000 + i, fieldId<&Transform::rotation>,
                           toValue(Quatd(0.9, 0.1 * double(i % 7), 0.2, -0.3)));
        e.value<Transform>(1000 + i, fieldId<&Transform::scale>, toValue(Vec3d(1, 0.97, 1.01)));
    }
    mustApply(aspect, e.take());
    WorldTransforms worlds(aspect);
    for (int turn = 0; turn < 4000; ++turn) {
        const ObjectId node(10 + random() % count);
        ASSERT_EQ(worlds.of(node).matrix(), worldTransform(aspect, node).matrix()) << node.value;
    }
    EXPECT_EQ(worlds.of(kRootNode).matrix(), Affine3d::Identity().matrix());
    EXPECT_EQ(worlds.of(ObjectId(1003)).matrix(), Affine3d::Identity().matrix()) << "a core is no node";
    EXPECT_EQ(worlds.of(ObjectId(99999)).matrix(), Affine3d::Identity().matrix());
}

// place() is the product of pose() and what is above, to the bit.
TEST(Action, PlacingBelowIsTheProduct) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> number(-3, 3);
    const auto vector = [&] { return Vec3d(number(random), number(random), number(random)); };
    const TypeInfo& type = allTypes()[kTypeIndex<Transform>];
    for (int turn = 0; turn < 2000; ++turn) {
        Transform core;
        core.translation = vector();
        core.rotation = Quatd(number(random), number(random), number(random), number(random));
        core.scale = turn % 5 == 0 ? Vec3d(0, -1, 1e-300) : vector();
        Affine3d above = Affine3d::Identity();
        above.linear() << vector(), vector(), vector();
        above.translation() = vector() * (turn % 3 == 0 ? 1e200 : 1.0);
        Affine3d below;
        type.place(&core, above, below);
        const Affine3d local = Eigen::Translation3d(core.translation) *
                               Affine3d(core.rotation.normalized().toRotationMatrix() * core.scale.asDiagonal());
        EXPECT_EQ(below.matrix(), (above * core.pose().matrix).matrix());
        EXPECT_EQ(core.pose().matrix.matrix(), local.matrix());
    }
}

}  // namespace
}  // namespace tessera
