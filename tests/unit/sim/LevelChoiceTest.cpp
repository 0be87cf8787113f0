/// Which level of detail each user sees: by distance and by size, with hysteresis, as a part of the scene; after any
/// history what a fresh look says, at a cost of what moved.
#include "common/cores/DistanceLOD.h"
#include "server/sim/view/LevelChoice.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <random>

#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "server/sim/FrameMaker.h"
#include "server/sim/frame/OutsideActors.h"
#include "server/sim/frame/Simulation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

Blob rangesOf(std::vector<double> ranges) {
    return Blob::of(std::span<const double>(ranges));
}

/// A scene, edited by lists, and who follows it.
struct LevelStage {
    explicit LevelStage(const Wall& wall) : view{.users = wall.users}, choice(wall) { choice.update(scene, nullptr); }

    Aspect scene;
    View view;
    LevelChoice choice;
    ChangeListBuilder edit;
    std::uint64_t nextId = 100;

    ObjectId create(ObjectType type) {
        const ObjectId id{nextId++};
        edit.create(id, type);
        return id;
    }
    ObjectId node(ObjectId core, ObjectId parent = kRootNode) {
        const ObjectId id = create(typeOf<Node>());
        if (core) setField<&Node::core>(edit, id, core);
        if (parent) edit.place(id, parent);
        return id;
    }
    ObjectId lod(std::vector<double> ranges, std::int64_t measure = DistanceLOD::kDistance) {
        const ObjectId id = create(typeOf<DistanceLOD>());
        setField<&DistanceLOD::ranges>(edit, id, rangesOf(std::move(ranges)));
        setField<&DistanceLOD::measure>(edit, id, measure);
        return id;
    }
    ObjectId at(const Vec3d& place) {
        const ObjectId id = create(typeOf<Transform>());
        setField<&Transform::translation>(edit, id, place);
        return id;
    }
    [[nodiscard]] bool apply() { return applied(edit.take()); }
    [[nodiscard]] bool applied(const ChangeList& list) {
        if (!scene.apply(list)) return false;
        choice.update(scene, &list);
        return true;
    }
    /// As a frame does; what was chosen.
    ChangeList frame() {
        const ChangeList list = choice.choose(scene, view);
        EXPECT_TRUE(applied(list));
        return list;
    }
    [[nodiscard]] std::size_t level(ObjectId id, std::size_t user = 0) const {
        return static_cast<std::uint64_t>(scene.get<Node>(id)->levels) >> (8 * (user % kLevelUsers)) & 0xff;
    }
};

TEST(LevelChoice, EachUserSeesTheLevelOfTheirOwnDistance) {
    const Wall wall = test::wallOfUsers(2);
    LevelStage stage(wall);
    const ObjectId thing = stage.node(stage.lod({10, 20}), stage.node(stage.at({0, 0, -5})));
    for (int i = 0; i < 3; ++i) (void)stage.node({}, thing);
    ASSERT_TRUE(stage.apply());
    (void)stage.frame();
    EXPECT_EQ(stage.level(thing, 0), 0u);
    stage.view.users[1].position = Vec3d(0, 0, 10);  // 15 away
    (void)stage.frame();
    EXPECT_EQ(stage.level(thing, 0), 0u);
    EXPECT_EQ(stage.level(thing, 1), 1u);
    stage.view.users[1].position = Vec3d(0, 0, 100);
    (void)stage.frame();
    EXPECT_EQ(stage.level(thing, 1), 2u);
    // Those that this wall does not have see what those see that it has.
    for (std::size_t user = 2; user < 8; ++user) EXPECT_EQ(stage.level(thing, user), stage.level(thing, user % 2));
    EXPECT_TRUE(stage.frame().empty()) << "nothing has moved";
}

TEST(LevelChoice, WhereAllSeeTheSameAllBytesAreTheSame) {
    LevelStage stage(test::wallOfUsers(1));
    const ObjectId thing = stage.node(stage.lod({1, 2}), stage.node(stage.at({0, 0, -1.5})));
    ASSERT_TRUE(stage.apply());
    (void)stage.frame();
    EXPECT_EQ(static_cast<std::uint64_t>(stage.scene.get<Node>(thing)->levels), 0x0101010101010101u);
}

TEST(LevelChoice, OfUsersThatShareAByteTheOneWhoIsNearerCounts) {
    LevelStage stage(test::wallOfUsers(9));
    const ObjectId thing = stage.node(stage.lod({10}), stage.node(stage.at({0, 0, -5})));
    ASSERT_TRUE(stage.apply());
    stage.view.users[0].position = Vec3d(0, 0, 100);
    (void)stage.frame();
    EXPECT_EQ(stage.level(thing, 0), 0u) << "the ninth user stands 5 away";
    stage.view.users[8].position = Vec3d(0, 0, 100);
    (void)stage.frame();
    EXPECT_EQ(stage.level(thing, 0), 1u);
    EXPECT_EQ(stage.level(thing, 1), 0u);
}

// A ball of 0.1 four metres away, on a screen of 500 pixels a metre two metres away: 2 · 0.1 / 4 · 2 · 500 = 50 pixels.
TEST(LevelChoice, SizesAreDiametersInPixelsOfTheUsersScreen) {
    LevelStage stage(test::wallOfUsers(1));
    std::vector<ObjectId> things;
    for (const double range : {40.0, 60.0}) {
        const ObjectId core = stage.lod({range}, DistanceLOD::kSize);
        setField<&DistanceLOD::radius>(stage.edit, core, 0.05);
        setField<&DistanceLOD::center>(stage.edit, core, Vec3d(0, 0, -1));
        const ObjectId twice = stage.create(typeOf<Transform>());
        setField<&Transform::scale>(stage.edit, twice, Vec3d(2, 2, 2));
        setField<&Transform::translation>(stage.edit, twice, Vec3d(0, 0, -2));
        things.push_back(stage.node(core, stage.node(twice)));
    }
    ASSERT_TRUE(stage.apply());
    (void)stage.frame();
    EXPECT_EQ(stage.level(things[0]), 0u);
    EXPECT_EQ(stage.level(things[1]), 1u);
    stage.view.users[0].position = Vec3d(0, 0, -3.95);  // within the ball
    (void)stage.frame();
    EXPECT_EQ(stage.level(things[1]), 0u);
}

// An eye that jitters about a range by less than the share: one step to where it stays, and no other, whatever the
// numbers.
TEST(LevelChoice, WhoStandsAtARangeSeesNoFlicker) {
    const char* said = std::getenv("TESSERA_SEED");
    const unsigned first = said ? static_cast<unsigned>(std::strtoul(said, nullptr, 10)) : 1;
    for (unsigned seed = first; seed < (said ? first + 1 : 2000); ++seed) {
        std::mt19937 random(seed);
        const auto uniform = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        DistanceLOD lod;
        lod.measure = seed % 2 ? DistanceLOD::kDistance : DistanceLOD::kSize;
        lod.hysteresis = seed % 5 == 0 ? 0.9 : uniform(1e-6, 0.9);
        std::vector<double> ranges{std::exp(uniform(-20, 20))};
        while (ranges.size() < 1 + seed % 7)
            ranges.push_back(ranges.back() *
                             (lod.measure == DistanceLOD::kSize ? uniform(0.1, 0.999) : uniform(1.001, 9)));
        lod.ranges = rangesOf(ranges);
        ASSERT_TRUE(checkRanges(lod));
        const double range = ranges[random() % ranges.size()];
        std::size_t level = random() % 256, changes = 0;
        for (int frame = 0; frame < 200; ++frame) {
            const std::size_t next = nextLevel(lod, level, range * (1 + lod.hysteresis * uniform(-0.999, 0.999)));
            ASSERT_LT(next, ranges.size() + 1);
            if (frame > 0) changes += next != level;
            level = next;
        }
        // Other ranges may lie within the jitter, which then goes farther than their own shares: one that it cannot
        // pass twice is its own.
        const bool alone = ranges.size() == 1;
        ASSERT_TRUE(!alone || changes == 0) << "TESSERA_SEED=" << seed << " unit_sim --gtest_filter='LevelChoice.*'";
        ASSERT_EQ(nextLevel(lod, level, std::numeric_limits<double>::quiet_NaN()), level);
    }
}

TEST(LevelChoice, FarEnoughPastARangeTheLevelIsAnotherAtOnceHoweverMany) {
    DistanceLOD lod;
    lod.ranges = rangesOf({1, 2, 3});
    EXPECT_EQ(nextLevel(lod, 0, 100), 3u);
    EXPECT_EQ(nextLevel(lod, 3, 0.1), 0u);
    EXPECT_EQ(nextLevel(lod, 200, 2.5), 2u) << "a level that there is not is the last one";
    lod.ranges = {};
    EXPECT_EQ(nextLevel(lod, 7, 5), 0u);
}

TEST(LevelChoice, RangesThatMeanNothingAreRefusedInWords) {
    DistanceLOD lod;
    const auto wordsFor = [&](std::vector<double> ranges) {
        lod.ranges = rangesOf(std::move(ranges));
        const Expected<void> good = checkRanges(lod);
        return good ? std::string() : good.error().message;
    };
    EXPECT_EQ(wordsFor({}), "");
    EXPECT_EQ(wordsFor({0, 1, 2}), "");
    EXPECT_WORDS(wordsFor({1, 1}));
    EXPECT_WORDS(wordsFor({2, 1}));
    EXPECT_WORDS(wordsFor({-1}));
    EXPECT_WORDS(wordsFor({std::numeric_limits<double>::quiet_NaN()}));
    EXPECT_WORDS(wordsFor({std::numeric_limits<double>::infinity()}));
    std::vector<double> many(256);
    for (std::size_t i = 0; i < many.size(); ++i) many[i] = static_cast<double>(i);
    EXPECT_WORDS(wordsFor(many));
    many.pop_back();
    EXPECT_EQ(wordsFor(many), "");
    lod.measure = DistanceLOD::kSize;
    EXPECT_EQ(wordsFor({2, 1}), "");
    EXPECT_WORDS(wordsFor({1, 2}));
}

// Random histories: who follows the lists chooses what somebody chooses who has just come, and both what a walk says.
TEST(LevelChoice, FollowingTheSceneIsStartingAnew) {
    const char* said = std::getenv("TESSERA_SEED");
    const unsigned first = said ? static_cast<unsigned>(std::strtoul(said, nullptr, 10)) : 1;
    std::size_t written = 0, bearersSeen = 0;
    for (unsigned seed = first; seed < (said ? first + 1 : 60); ++seed) {
        const std::string again = "TESSERA_SEED=" + std::to_string(seed) + " unit_sim --gtest_filter='LevelChoice.*'";
        std::mt19937 random(seed);
        const auto pick = [&](std::size_t n) { return random() % n; };
        const auto place = [&] {
            return Vec3d(static_cast<double>(pick(40)) - 20, static_cast<double>(pick(9)),
                         static_cast<double>(pick(40)) - 20);
        };
        const Wall wall = test::wallOfUsers(1 + seed % 10);
        LevelStage stage(wall);
        std::vector<ObjectId> nodes{kRootNode}, poses, cores;
        for (int step = 0; step < 60; ++step) {
            for (std::size_t edits = 1 + pick(4); edits > 0; --edits) {
                const ObjectId node = nodes[pick(nodes.size())];
                switch (pick(9)) {
                    case 0:
                        poses.push_back(stage.at(place()));
                        nodes.push_back(stage.node(poses.back(), pick(6) ? node : ObjectId()));
                        break;
                    case 1:
                        cores.push_back(stage.lod(pick(2) ? std::vector<double>{5, 12, 30} : std::vector<double>{8}));
                        nodes.push_back(stage.node(cores.back(), node));
                        break;
                    case 2:
                        if (!cores.empty())
                            nodes.push_back(stage.node(cores[pick(cores.size())], pick(6) ? node : ObjectId()));
                        break;
                    case 3:
                        if (!poses.empty())
                            setField<&Transform::translation>(stage.edit, poses[pick(poses.size())],
                                                              pick(9) ? place() : Vec3d(1e308, 1e308, 1));
                        break;
                    case 4:
                        if (!cores.empty())
                            setField<&DistanceLOD::center>(stage.edit, cores[pick(cores.size())], place());
                        break;
                    case 5:
                        if (!cores.empty()) {
                            const ObjectId core = cores[pick(cores.size())];
                            const bool size = pick(2);
                            setField<&DistanceLOD::measure>(stage.edit, core,
                                                            size ? DistanceLOD::kSize : DistanceLOD::kDistance);
                            setField<&DistanceLOD::ranges>(stage.edit, core,
                                                           size ? rangesOf({900, 200, 50}) : rangesOf({3, 20}));
                        }
                        break;
                    case 6:
                        stage.edit.place(node, nodes[pick(nodes.size())]);
                        break;
                    case 7:
                        stage.edit.detach(node);
                        break;
                    default:
                        setField<&Node::levels>(stage.edit, node, static_cast<std::int64_t>(random()));
                        break;
                }
            }
            // What makes a circle, moves the root or names what is not there is refused whole.
            (void)stage.apply();
            std::erase_if(nodes, [&](ObjectId id) { return !stage.scene.get<Node>(id); });
            std::erase_if(poses, [&](ObjectId id) { return !stage.scene.find(id); });
            std::erase_if(cores, [&](ObjectId id) { return !stage.scene.find(id); });
            if (pick(3) == 0) stage.view.users[pick(stage.view.users.size())].position = 0.1 * place();
            if (pick(5) == 0) stage.view.position = place();
            written += stage.frame().changeCount();

            LevelChoice anew(wall);
            anew.update(stage.scene, nullptr);
            ASSERT_EQ(anew.count(), stage.choice.count()) << again;
            ASSERT_TRUE(anew.choose(stage.scene, stage.view).empty()) << "step " << step << " of " << again;
            Action action;
            action.visitHidden(true);
            action.on<DistanceLOD>([&](const Visit& visit, const DistanceLOD& lod) {
                const double distance = (visit.world_T_node * lod.center -
                                         stage.view.world_T_wall() * stage.view.users[0].eye(Eye::kCenter))
                                            .norm();
                if (lod.measure != DistanceLOD::kDistance || wall.users.size() > 8 || !std::isfinite(distance))
                    return Descend::kInto;
                ++bearersSeen;
                const std::size_t level = stage.level(visit.nodeId);
                const std::span<const double> ranges = lod.ranges.as<double>();
                EXPECT_LE(level, ranges.size());
                const double from = level > 0 ? 0.8999999 * ranges[level - 1] : 0.0,
                             to = level < ranges.size() ? 1.1000001 * ranges[level] : 1e300;
                EXPECT_TRUE(from <= distance && distance <= to) << distance << ", " << again;
                return Descend::kInto;
            });
            action.run(stage.scene);
            if (HasFailure()) return;
        }
    }
    if (said) return;
    EXPECT_GT(written, 1000u);
    EXPECT_GT(bearersSeen, 1000u);
}

TEST(LevelChoice, AFrameCostsWhatHasMoved) {
    LevelStage stage(test::wallOfUsers(2));
    std::vector<ObjectId> poses;
    for (int i = 0; i < 2000; ++i) {
        poses.push_back(stage.at(Vec3d(0, 0, i)));
        (void)stage.node(stage.lod({100}), stage.node(poses.back()));
    }
    const ObjectId other = stage.at(Vec3d(1, 0, 0));
    (void)stage.node(other);
    ASSERT_TRUE(stage.apply());
    (void)stage.frame();
    (void)stage.frame();
    const std::uint64_t before = stage.choice.work();
    EXPECT_TRUE(stage.frame().empty());
    EXPECT_EQ(stage.choice.work(), before);
    setField<&Transform::translation>(stage.edit, other, Vec3d(2, 0, 0));
    ASSERT_TRUE(stage.apply());
    EXPECT_TRUE(stage.frame().empty());
    EXPECT_EQ(stage.choice.work(), before);
    setField<&Transform::translation>(stage.edit, poses[3], Vec3d(2, 0, 0));
    ASSERT_TRUE(stage.apply());
    (void)stage.frame();
    EXPECT_LE(stage.choice.work(), before + 8);
}

// It is scene state, but nobody's step: undo takes back what a person did.
TEST(LevelChoice, AFrameWritesItAndUndoDoesNot) {
    const Wall wall = test::wallOfUsers(1);
    Simulation simulation;
    ViewSource view(wall, "");
    BlobStore blobs;
    Report report(wall, "");
    Log log("test");
    ManipulatorDrags drags;
    OutsideActors outside(wall, drags, {});
    simulation.actWith(outside);
    FrameMaker maker({.simulation = simulation, .view = view, .blobs = blobs, .report = report, .log = log});
    test::ListMaker made;
    const ObjectId core = made.create<DistanceLOD>();
    setField<&DistanceLOD::ranges>(made.builder, core, rangesOf({1}));
    setField<&DistanceLOD::center>(made.builder, core, Vec3d(0, 0, -5));
    made.node("thing", kRootNode, core);
    std::vector<Edit> edits(1);
    edits[0].list = made.builder.take();
    ViewWish stand;
    stand.position = Vec3d::Zero();
    stand.worldUnitsPerMetre = 1;
    ASSERT_TRUE(view.set(simulation.scene(), stand));
    (void)maker.make(FrameNumber(0), std::move(edits), {}, {});
    const ObjectId node = simulation.scene().get<Node>(kRootNode)->children[0];
    const FrameResult chosen = maker.make(FrameNumber(1), {}, {}, {});
    ASSERT_TRUE(chosen.commit.list);
    EXPECT_EQ(levelOf(*simulation.scene().get<Node>(node), 0), 0u) << "it has no children";
    EXPECT_EQ(static_cast<std::uint64_t>(simulation.scene().get<Node>(node)->levels), 0x0101010101010101u);
    EXPECT_FALSE(maker.make(FrameNumber(2), {}, {}, {}).commit.list);
    std::vector<Edit> undo(1);
    undo[0].kind = Edit::Kind::kUndo;
    ASSERT_TRUE(maker.make(FrameNumber(3), std::move(undo), {}, {}).outcomes[0].result);
    EXPECT_FALSE(simulation.scene().get<Node>(node)) << "the one step was the node's coming";
    std::vector<Edit> bad(1);
    test::ListMaker wrong;
    setField<&DistanceLOD::ranges>(wrong.builder, wrong.create<DistanceLOD>(), rangesOf({2, 1}));
    bad[0].list = wrong.builder.take();
    const FrameResult refused = maker.make(FrameNumber(4), std::move(bad), {}, {});
    ASSERT_FALSE(refused.outcomes[0].result);
    EXPECT_WORDS(refused.outcomes[0].result.error().message);
}

}  // namespace
}  // namespace tessera
