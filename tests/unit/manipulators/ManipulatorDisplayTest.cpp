/// Handles as nodes: they are there, where their target is, as large as they should be, and nobody's but the server's.
#include "server/manipulators/ManipulatorDisplay.h"

#include <gtest/gtest.h>

#include <set>

#include "common/drawable/SceneBounds.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/Edits.h"
#include "common/scene/ServerNodes.h"
#include "tests/property/Seeds.h"
#include "tests/unit/manipulators/ManipulatorScene.h"

namespace tessera {
namespace {

/// A box of 2 on a Transform, and a manipulator beside it.
struct Table : ManipulatorScene {
    explicit Table(std::int64_t kind = Manipulator::kMove, const Pose& pose = {}) {
        core = transform(pose);
        target = node(core);
        (void)box(target, Vec3d(2, 2, 2));
        manipulate(kind, target);
        apply();
    }
    [[nodiscard]] std::optional<ObjectId> top() const {
        const Node* bearer = scene.get<Node>(manipulatorNode);
        for (std::size_t i = 0; bearer && i < bearer->children.size(); ++i)
            if (scene.get<Node>(bearer->children[i])->ofServer) return bearer->children[i];
        return std::nullopt;
    }
    /// World bounds of the handles alone.
    [[nodiscard]] Box seen() const { return top() ? sceneBounds(scene, *top()) : Box(); }
    /// The least difference between two boxes' corners.
    static double apart(const Box& a, const Box& b) {
        return std::max((a.lower - b.lower).norm(), (a.upper - b.upper).norm());
    }
    void move(const Vec3d& to) {
        setField<&Transform::translation>(edit, core, to);
        apply();
        frame();
    }
};

TEST(ManipulatorDisplay, HandlesComeFollowTheirTargetAndGoWithIt) {
    Table table;
    EXPECT_FALSE(table.top());
    table.frame();
    ASSERT_TRUE(table.top());
    const Box first = table.seen();
    EXPECT_GT(first.upper.minCoeff(), 1.3) << "out of the box that they move";
    EXPECT_LT(first.lower.maxCoeff(), 0) << "from its middle";
    const std::size_t objects = table.scene.objectCount();
    const Vec3d way(3, -2, 5);
    table.move(way);
    EXPECT_LT((table.seen().center() - first.center() - way).norm(), 1e-5);
    EXPECT_EQ(table.scene.objectCount(), objects) << "values alone travel";
    EXPECT_TRUE(table.display.update(table.scene).empty()) << "nothing more to say";
    // Twice as large a thing has handles twice as large; a size that is said has not.
    setField<&Transform::scale>(table.edit, table.core, Vec3d(2, 2, 2));
    table.apply();
    table.frame();
    EXPECT_NEAR(table.seen().size().x(), 2 * first.size().x(), 1e-5);
    setField<&Manipulator::size>(table.edit, table.manipulator, 0.5);
    table.apply();
    table.frame();
    EXPECT_LT((table.seen().upper - way - Vec3d::Constant(0.25)).norm(), 1e-5) << "half of it each way";
    // Without a target there are none.
    setField<&Manipulator::target>(table.edit, table.manipulator, ObjectId());
    table.apply();
    table.frame();
    EXPECT_FALSE(table.top());
}

/// After any edits of targets, parents, kinds and sizes the handles that have followed are those that would be made
/// anew.
TEST(ManipulatorDisplay, WhatHasFollowedIsWhatIsMadeAnew) {
    forSeeds(100, [](Random& random) {
        ManipulatorScene stage;
        const ObjectId parentCore = stage.transform(randomPose(random)), parent = stage.node(parentCore);
        stage.core = stage.transform(randomPose(random));
        stage.target = stage.node(stage.core, parent);
        (void)stage.box(stage.target, Vec3d(1, 2, 3));
        stage.manipulate(Manipulator::kMove, stage.target);
        stage.apply();
        stage.frame();
        for (int i = 0; i < 20; ++i) {
            const ObjectId which = oneIn(random, 2) ? parentCore : stage.core;
            const Pose pose = randomPose(random);
            switch (below(random, 8)) {
                case 0:
                    setField<&Transform::translation>(stage.edit, which, pose.translation);
                    break;
                case 1:
                    setField<&Transform::rotation>(stage.edit, which, pose.rotation);
                    break;
                case 2:
                    setField<&Transform::scale>(stage.edit, which, pose.scale);
                    break;
                case 3:
                    setField<&Manipulator::size>(stage.edit, stage.manipulator,
                                                 oneIn(random, 2) ? 0.0 : uniform(random, 0.1, 4));
                    break;
                case 4:
                    setField<&Manipulator::world>(stage.edit, stage.manipulator, oneIn(random, 2));
                    break;
                case 5: {
                    std::vector<float> sizes(1 + below(random, 8));
                    for (float& size : sizes) size = static_cast<float>(uniform(random, 0.1, 4));
                    stage.seenAs(sizes);
                    break;
                }
                case 6:
                    setField<&Manipulator::pixels>(stage.edit, stage.manipulator, 0.0);
                    break;
                default: {
                    constexpr std::array kShownKinds{
                        Manipulator::kMove,        Manipulator::kRotate,    Manipulator::kScale,
                        Manipulator::kTrackball,   Manipulator::kTabBox,    Manipulator::kJack,
                        Manipulator::kTransformer, Manipulator::kHandleBox, Manipulator::kTransformBox};
                    setField<&Manipulator::kind>(stage.edit, stage.manipulator,
                                                 kShownKinds[below(random, kShownKinds.size())]);
                }
            }
            stage.apply();
            if (oneIn(random, 2)) stage.frame();
            const std::optional<PlacedManipulator> placed = stage.display.place(stage.scene, stage.manipulatorNode);
            const std::optional<Vec3d> origin = stage.display.originOf(stage.scene, stage.manipulatorNode);
            ASSERT_EQ(origin.has_value(), placed.has_value());
            if (placed) {
                EXPECT_EQ(*origin, placed->frame.world_T_frame.translation());
            }
        }
        stage.frame();
        const auto boxOf = [&] {
            return sceneBounds(stage.scene, stage.scene.get<Node>(stage.manipulatorNode)->children[0]);
        };
        const Box followed = boxOf();
        ASSERT_EQ(stage.scene.get<Node>(stage.manipulatorNode)->children.size(), 1u);
        stage.apply(removalOf(stage.scene, std::array{stage.scene.get<Node>(stage.manipulatorNode)->children[0]}));
        stage.display = ManipulatorDisplay();
        stage.display.sceneChanged(stage.scene, nullptr);
        stage.frame();
        const Box anew = boxOf();
        EXPECT_LT(Table::apart(followed, anew), 1e-6 * (1 + anew.size().norm() + anew.center().norm()));
    });
}

/// Of a size on the screen: each user sees a child, as Node::levels says it; whose boxes have knobs of that size.
TEST(ManipulatorDisplay, EachUserSeesHandlesOfTheirOwnSize) {
    Table table;
    table.seenAs(std::array{0.5f, 2.0f, 1.0f});
    table.apply();
    table.frame();
    const auto users = [&] {
        const Node* at = table.scene.get<Node>(*table.top());
        for (int i = 0; i < 4; ++i) at = table.scene.get<Node>(at->children[0]);
        return at;
    };
    ASSERT_EQ(users()->children.size(), 3u);
    EXPECT_EQ(static_cast<std::uint64_t>(users()->levels), 0x0100020100020100u);
    const auto reachOf = [&](std::size_t user) {
        return sceneBounds(table.scene, users()->children[levelOf(*users(), user)]).upper.x();
    };
    EXPECT_NEAR(reachOf(0), 0.25, 1e-5) << "half of it each way";
    EXPECT_NEAR(reachOf(1), 1, 1e-5);
    EXPECT_NEAR(reachOf(2), 0.5, 1e-5);
    EXPECT_NEAR(reachOf(3), 0.25, 1e-5) << "a user that the wall does not have";
    const std::size_t objects = table.scene.objectCount();
    table.seenAs(std::array{0.5f, 3.0f, 1.0f});
    table.apply();
    table.frame();
    EXPECT_NEAR(reachOf(1), 1.5, 1e-5);
    EXPECT_EQ(table.scene.objectCount(), objects) << "values alone travel";
    EXPECT_TRUE(table.display.update(table.scene).empty()) << "nothing more to say";
    // Of boxes knobs and edges, not the box.
    for (const std::int64_t kind :
         {Manipulator::kTabBox, Manipulator::kTransformer, Manipulator::kHandleBox, Manipulator::kTransformBox}) {
        setField<&Manipulator::kind>(table.edit, table.manipulator, kind);
        table.apply();
        table.frame();
        const PlacedManipulator placed = table.placed();
        const Handles& small = placed.seenBy(0).handles;
        const Handles& large = placed.seenBy(1).handles;
        ASSERT_EQ(small.pieces.size(), large.pieces.size());
        for (std::size_t i = 0; i < small.pieces.size(); ++i) {
            if (small.pieces[i].shape == HandleShape::kRod) {
                EXPECT_NEAR(large.pieces[i].pose.scale.x(), 6 * small.pieces[i].pose.scale.x(), 1e-9);
            }
            if (small.of[static_cast<std::size_t>(small.pieces[i].handle - 1)].deed != HandleDeed::kScaleAll) continue;
            EXPECT_EQ(small.pieces[i].pose.translation.cwiseAbs(), Vec3d::Ones()) << "at the corners";
            EXPECT_EQ(large.pieces[i].pose.translation, small.pieces[i].pose.translation);
            EXPECT_NEAR(large.pieces[i].pose.scale.x(), 6 * small.pieces[i].pose.scale.x(), 1e-9);
        }
    }
    // Where nobody has said yet how large, and where pixels are none, `size` counts.
    setField<&Manipulator::kind>(table.edit, table.manipulator, Manipulator::kMove);
    setField<&Manipulator::pixels>(table.edit, table.manipulator, 0.0);
    setField<&Manipulator::size>(table.edit, table.manipulator, 3.0);
    table.apply();
    table.frame();
    EXPECT_EQ(table.placed().sights(), 1u);
    EXPECT_NEAR(table.seen().upper.x(), 1.5, 1e-5);
}

TEST(ManipulatorDisplay, WhatPeopleDoToHandlesIsMadeGood) {
    Table table;
    table.frame();
    const Box first = table.seen();
    // One is bent away, one is taken out of the tree.
    const ObjectId turn = table.scene.get<Node>(table.scene.get<Node>(*table.top())->children[0])->core;
    setField<&Transform::translation>(table.edit, turn, Vec3d(9, 9, 9));
    table.apply();
    table.frame();
    EXPECT_LT(Table::apart(table.seen(), first), 1e-6);
    table.apply(removalOf(table.scene, std::array{table.scene.get<Node>(*table.top())->children[0]}));
    table.frame();
    EXPECT_LT(Table::apart(table.seen(), first), 1e-6);
    // What somebody hangs among them stays theirs.
    const ObjectId hat = table.box(*table.top(), Vec3d(0.1, 0.1, 0.1));
    table.apply();
    table.apply(removalOf(table.scene, std::array{table.scene.get<Node>(*table.top())->children[0]}));
    table.frame();
    table.frame();
    ASSERT_TRUE(table.scene.get<Node>(hat));
    EXPECT_EQ(table.scene.get<Node>(hat)->parent, table.manipulatorNode);
    EXPECT_LT(Table::apart(table.seen(), first), 1e-6);
}

/// Whoever takes hold and lets go leaves the scene as it was, ids included: hosts draw what lies upon each other in the
/// order of ids.
TEST(ManipulatorDisplay, HoldingAHandleChangesColoursAlone) {
    for (const std::int64_t kind :
         {Manipulator::kMove, Manipulator::kRotate, Manipulator::kScale, Manipulator::kTrackball, Manipulator::kTabBox,
          Manipulator::kJack, Manipulator::kTransformer, Manipulator::kHandleBox, Manipulator::kTransformBox}) {
        Table table(kind);
        table.frame();
        const StateHash before = table.scene.stateHash();
        std::set<std::int64_t> handles;
        for (const HandlePiece& piece : table.placed().handles.pieces)
            if (piece.shown) handles.insert(piece.handle);
        for (const std::int64_t handle : handles) {
            setField<&Manipulator::held>(table.edit, table.manipulator, handle);
            table.apply();
            const ChangeList painted = table.display.update(table.scene);
            ASSERT_FALSE(painted.empty()) << "kind " << kind << ", handle " << handle;
            EXPECT_TRUE(painted.creations.empty() && painted.destructions.empty() && painted.placements.empty());
            table.apply(painted);
            EXPECT_TRUE(table.display.update(table.scene).empty()) << "nothing more to say";
            setField<&Manipulator::held>(table.edit, table.manipulator, std::int64_t{0});
            table.apply();
            table.frame();
            ASSERT_EQ(table.scene.stateHash(), before) << "kind " << kind << ", handle " << handle;
        }
    }
}

TEST(ManipulatorDisplay, HandlesMakeNoSceneLarger) {
    Table table;
    const Box bare = sceneBounds(table.scene);
    table.frame();
    ASSERT_GT(table.seen().upper.minCoeff(), bare.upper.maxCoeff());
    EXPECT_EQ(Table::apart(sceneBounds(table.scene), bare), 0) << "first views and fits are of the scene";
    // Where they are all that there is, they are what can be looked at.
    EXPECT_EQ(Table::apart(sceneBounds(table.scene, table.manipulatorNode), table.seen()), 0);
    // A node that is only called so is no handle.
    (void)table.box(kRootNode, Vec3d(40, 1, 1));
    setField<&Node::name>(table.edit, ObjectId(table.nextId - 1), std::string("handles"));
    table.apply();
    EXPECT_NEAR(sceneBounds(table.scene).size().x(), 40, 1e-5);
}

}  // namespace
}  // namespace tessera
