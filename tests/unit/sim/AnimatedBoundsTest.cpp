/// How large scenes get while they play, beside what is drawn in frame after frame; and that the first view shows it.
#include "server/sim/view/AnimatedBounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numbers>

#include "common/drawable/Drawable.h"
#include "common/drawable/SceneBounds.h"
#include "common/scene/Action.h"
#include "server/import/Importer.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/view/ViewSource.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;

ObjectId channelOf(ListMaker& make, ObjectId target, const std::string& field, const std::vector<double>& times,
                   const std::vector<double>& values, std::int64_t interpolation = KeyFrames::kLinear) {
    const ObjectId id = make.create<KeyFrames>();
    setField<&KeyFrames::target>(make.builder, id, target);
    setField<&KeyFrames::field>(make.builder, id, field);
    setField<&KeyFrames::times>(make.builder, id, Blob::of(std::span<const double>(times)));
    setField<&KeyFrames::values>(make.builder, id, Blob::of(std::span<const double>(values)));
    setField<&KeyFrames::interpolation>(make.builder, id, interpolation);
    return id;
}

ObjectId playerOf(ListMaker& make, const RefList& channels) {
    const ObjectId id = make.create<Animation>();
    setField<&Animation::channels>(make.builder, id, channels);
    make.node("take", kRootNode, id);
    return id;
}

/// Beyond the box, in parts of its diagonal; at most 0: within.
double beyond(const Box& inner, const Box& outer) {
    if (inner.empty()) return 0;
    return std::max((outer.lower - inner.lower).maxCoeff(), (inner.upper - outer.upper).maxCoeff()) /
           std::max(outer.size().norm(), 1e-30);
}

/// Of what is drawn, vertex by vertex: sceneBounds looks at boxes that turn with their nodes.
Box verticesOf(const Aspect& scene) {
    Box box;
    Action action;
    action.onNode([&](const Visit& visit) {
        if (const Drawable drawable = drawableOf(scene, visit.node)) {
            const MeshArrays arrays = drawable.arrays();
            const auto p = arrays.positions.as<float>();
            for (std::size_t i = 0; i + 2 < p.size(); i += 3)
                box.extend(Vec3d(visit.world_T_node * Vec3d(p[i], p[i + 1], p[i + 2])));
        }
        return Descend::kInto;
    });
    action.run(scene);
    return box;
}

/// Whether all corners of the triangles that are drawn lie in the picture, for each tile shape.
void expectWithinThePicture(const Aspect& scene, const Wall& wall, const View& view) {
    const std::vector<Tile> tiles = layoutTiles(wall);
    Action action;
    action.onNode([&](const Visit& visit) {
        if (const Drawable drawable = drawableOf(scene, visit.node)) {
            const MeshArrays arrays = drawable.arrays();
            const auto p = arrays.positions.as<float>();
            for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
                const Vec3d at = visit.world_T_node * Vec3d(p[i], p[i + 1], p[i + 2]);
                const bool seen = std::ranges::any_of(tiles, [&](const Tile& tile) {
                    const ScreenCamera camera = tileCamera(wall, tile, view);
                    const Eigen::Vector4d clip = (camera.clip_T_eye * camera.eye_T_world.matrix()) * at.homogeneous();
                    return clip.w() > 0 && std::abs(clip.x()) <= clip.w() * (1 + 1e-9) &&
                           std::abs(clip.y()) <= clip.w() * (1 + 1e-9);
                });
                EXPECT_TRUE(seen) << at.transpose();
            }
        }
        return Descend::kInto;
    });
    action.run(scene);
}

Wall screenOf(double width, double height) {
    Wall wall = test::wallOfOne();
    wall.screens[0].lowerLeft = Vec3d(-width / 2, 0.5, 0);
    wall.screens[0].lowerRight = Vec3d(width / 2, 0.5, 0);
    wall.screens[0].upperLeft = Vec3d(-width / 2, 0.5 + height, 0);
    wall.users[0].position = Vec3d(0, 0.5 + height / 2, 2);
    return wall;
}

double from(Random& random, double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
}

Quatd someTurn(Random& random) {
    return Quatd(from(random, -1, 1), from(random, -1, 1), from(random, -1, 1), from(random, -1, 1) + 1e-3)
        .normalized();
}

/// Some chains of boxes, each led by an animation of its own, at any speed, in any mode, by any keys.
ChangeList someMovingScene(Random& random) {
    ListMaker make;
    const std::size_t chains = below(random, 3) + 1;
    for (std::size_t c = 0; c < chains; ++c) {
        RefList channels;
        ObjectId parent = kRootNode;
        const double length = from(random, 0.1, 4);
        const std::size_t links = below(random, 4) + 1;
        for (std::size_t link = 0; link < links; ++link) {
            const ObjectId place = make.transform(Vec3d(from(random, -3, 3), from(random, -3, 3), from(random, -3, 3)));
            parent = make.node("link", parent, place);
            const Vec3d size(from(random, 0.1, 2), from(random, 0.1, 2), from(random, 0.1, 2));
            if (below(random, 2) > 0 || link + 1 == links) make.node("box", parent, make.box(size));
            for (const char* field : {"translation", "rotation", "scale"}) {
                if (below(random, 3) == 0) continue;
                const auto interpolation = static_cast<std::int64_t>(below(random, 3));
                const std::size_t keys = below(random, 5) + 1, width = field[0] == 'r' ? 4 : 3;
                std::vector<double> times, values;
                for (std::size_t k = 0; k < keys; ++k) {
                    times.push_back(k + 1 == keys ? length
                                                  : length * (static_cast<double>(k) + from(random, 0, 0.9)) /
                                                        static_cast<double>(keys));
                    for (int part = 0; part < (interpolation == KeyFrames::kSpline ? 3 : 1); ++part) {
                        const Quatd turn = someTurn(random);
                        if (width == 4) values.insert(values.end(), {turn.w(), turn.x(), turn.y(), turn.z()});
                        for (std::size_t i = 0; i < 3 && width == 3; ++i)
                            values.push_back(field[0] == 's' ? from(random, 0.3, 2) : from(random, -20, 20));
                    }
                }
                // What steps at the very end is seen by who seeks there, and in no loop.
                if (interpolation == KeyFrames::kStep && keys > 1)
                    std::copy_n(&values[(keys - 2) * width], width, &values[(keys - 1) * width]);
                channels.push_back(channelOf(make, place, field, times, values, interpolation));
            }
        }
        if (channels.empty()) continue;
        const ObjectId player = playerOf(make, channels);
        // Once: from its beginning, so that all of it is seen.
        const bool once = oneIn(random, 3);
        setField<&Animation::mode>(make.builder, player,
                                   once               ? Animation::kOnce
                                   : oneIn(random, 2) ? Animation::kLoop
                                                      : Animation::kPingPong);
        setField<&Animation::speed>(make.builder, player,
                                    !once && oneIn(random, 4) ? -from(random, 1, 3) : from(random, 1, 3));
        if (!once) setField<&Animation::time>(make.builder, player, from(random, 0, length));
    }
    return make.builder.take();
}

/// A room of a few corners, turned, around a sheet of many: whoever takes each so-many-th sees the sheet alone.
TEST(AnimatedBounds, SamplesKnowWhatIsOutermost) {
    ListMaker make;
    const ObjectId turn = make.create<Transform>();
    setField<&Transform::rotation>(make.builder, turn, Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized())));
    make.node("sheet", kRootNode, make.sheet(255));
    make.node("room", make.node("turned", kRootNode, turn), make.box(Vec3d(2000, 600, 1000)));
    Simulation simulation;
    ASSERT_TRUE(simulation.load({make.builder.take()}));
    Box sampled;
    for (const Vec3d& place : animatedBounds(simulation.scene()).samples) sampled.extend(place);
    const Box all = verticesOf(simulation.scene());
    EXPECT_LT((sampled.lower - all.lower).norm() + (sampled.upper - all.upper).norm(), 1e-9);
}

/// What is looked at grows with the meshes, not with where they stand.
TEST(AnimatedBounds, SamplesLookAtEachMeshOnce) {
    std::uint64_t measured[2] = {};
    for (const int places : {1, 1000}) {
        ListMaker make;
        const ObjectId sheet = make.sheet(255);
        for (int i = 0; i < places; ++i) {
            const ObjectId at = make.create<Transform>();
            setField<&Transform::translation>(make.builder, at, Vec3d(i, 0, 0));
            make.node("sheet", make.node("place", kRootNode, at), sheet);
        }
        Simulation simulation;
        ASSERT_TRUE(simulation.load({make.builder.take()}));
        const AnimatedBounds bounds = animatedBounds(simulation.scene());
        measured[places > 1] = bounds.measured;
        Box sampled;
        for (const Vec3d& place : bounds.samples) sampled.extend(place);
        EXPECT_LT((sampled.upper - verticesOf(simulation.scene()).upper).norm(), 1e-9);
    }
    EXPECT_GT(measured[0], 0u);
    EXPECT_EQ(measured[0], measured[1]);
}

TEST(AnimatedBounds, HoldWhatRandomAnimationsShowInEveryFrame) {
    std::size_t moved = 0, frames = 0;
    forSeeds(100, [&](Random& random) {
        Simulation simulation;
        ASSERT_TRUE(simulation.load({someMovingScene(random)}));
        const AnimatedBounds all = animatedBounds(simulation.scene());
        Box first, seen = sceneBounds(simulation.scene());  // as it stood before anything played
        for (int frame = 0; frame < 500; ++frame) {
            (void)simulation.step(frame == 0, {});
            const Box now = sceneBounds(simulation.scene());
            if (frame == 0) first = now;
            seen.extend(now);
            ++frames;
            moved += (now.lower - first.lower).norm() > 0.01;
            // What is at its most between two looks, a sixtieth of a second apart, by splines that swing through 100
            // units a second.
            ASSERT_LT(beyond(now, all.box), 2e-3) << "frame " << frame;
        }
        // Not just anything large, though half a turn between two looks counts as an arc.
        EXPECT_LT(all.box.size().norm(), 3 * seen.size().norm());
    });
    EXPECT_GT(moved, frames / 2);
}

TEST(AnimatedBounds, TheFirstViewShowsAnAnimationThatLeavesItsPlaceFarBehindOnEveryShapeOfTile) {
    for (const auto& [width, height] : {std::pair(4.0, 1.0), {1.0, 1.0}, {0.5, 3.0}}) {
        ListMaker make;
        const ObjectId place = make.transform(Vec3d::Zero());
        make.node("box", make.node("far", kRootNode, place), make.box(Vec3d::Ones()));
        const double half = std::sqrt(0.5);
        playerOf(make, {channelOf(make, place, "translation", {0, 1, 2}, {0, 0, 0, 90, 10, -40, 0, 30, 0}),
                        channelOf(make, place, "rotation", {0, 2}, {1, 0, 0, 0, half, 0, half, 0})});
        Simulation simulation;
        ASSERT_TRUE(simulation.load({make.builder.take()}));
        const Wall wall = screenOf(width, height);
        ViewSource source(wall, "");
        source.update(simulation.scene(), nullptr);
        const View view = source.view(simulation.scene()).value();
        ASSERT_GT(sceneBounds(simulation.scene()).size().norm(), 0);
        for (int frame = 0; frame < 130; ++frame) {
            (void)simulation.step(frame == 0, {});
            expectWithinThePicture(simulation.scene(), wall, view);
        }
    }
}

TEST(AnimatedBounds, AnimationsThatStandCountAsIfSomebodyPlayedThem) {
    ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    make.node("box", make.node("far", kRootNode, place), make.box(Vec3d::Ones()));
    playerOf(make, {channelOf(make, place, "translation", {0, 1}, {0, 0, 0, 10, 0, 0})});
    const ObjectId other = playerOf(make, {channelOf(make, place, "translation", {0, 1}, {0, 0, 0, 0, -20, 0})});
    setField<&Animation::playing>(make.builder, other, false);
    const ObjectId motion = make.motion(place, {{0.0, 0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 30.0}});
    setField<&Motion::playing>(make.builder, motion, false);
    make.node("motion", kRootNode, motion);
    Simulation simulation;
    ASSERT_TRUE(simulation.load({make.builder.take()}));
    const Box box = animatedBounds(simulation.scene()).box;
    EXPECT_NEAR(box.upper.x(), 10.5, 1e-6);
    EXPECT_NEAR(box.lower.y(), -20.5, 1e-6);
    EXPECT_NEAR(box.upper.z(), 30.5, 1e-6);
    EXPECT_NEAR(box.lower.x(), -0.5, 1e-6);
}

TEST(AnimatedBounds, ASceneWithoutAnimationsIsAsLargeAsItIs) {
    ListMaker make;
    make.node("box", make.node("there", kRootNode, make.transform(Vec3d(3, 4, 5))), make.box(Vec3d::Ones()));
    Simulation simulation;
    ASSERT_TRUE(simulation.load({make.builder.take()}));
    const AnimatedBounds all = animatedBounds(simulation.scene());
    const Box now = sceneBounds(simulation.scene());
    EXPECT_EQ(all.box.lower, now.lower);
    EXPECT_EQ(all.box.upper, now.upper);
    EXPECT_EQ(all.looks, 0u);
}

TEST(AnimatedBounds, CostABoundedNumberOfPlacesHoweverLongAndLarge) {
    for (const std::size_t boxes : {100u, 10'000u, 200'000u}) {
        ListMaker make;
        const ObjectId place = make.transform(Vec3d::Zero());
        const ObjectId top = make.node("far", kRootNode, place), box = make.box(Vec3d::Ones());
        for (std::size_t i = 0; i < boxes; ++i) make.node("b", top, box);
        std::vector<double> times, values;
        for (int k = 0; k < 20'000; ++k) {
            times.push_back(k * 0.1);
            for (const double x : {10 * std::sin(k * 0.01), 0.0, 0.0}) values.push_back(x);
        }
        playerOf(make, {channelOf(make, place, "translation", times, values)});
        Aspect scene;
        ChangeList list = make.builder.take();
        replaceIds(list, [](ObjectId id) {
            return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
        });
        ASSERT_TRUE(scene.apply(list));
        const auto before = std::chrono::steady_clock::now();
        const AnimatedBounds all = animatedBounds(scene);
        const auto took =
            std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - before);
        EXPECT_LE(all.placed, std::max(kMostPlaced, kFewestLooks * (boxes + 1)));
        EXPECT_GE(all.looks, kFewestLooks);
        EXPECT_GT(all.box.upper.x(), boxes < 10'000 ? 10.499 : 9.0);
        RecordProperty("placed_" + std::to_string(boxes), static_cast<int>(all.placed));
        RecordProperty("looks_" + std::to_string(boxes), static_cast<int>(all.looks));
        RecordProperty("ms_" + std::to_string(boxes), static_cast<int>(took.count()));
    }
}

/// Real characters: joints, morph targets, several takes.
TEST(AnimatedBounds, HoldEveryVertexOfCharactersAndNotMuchMore) {
    const char* set = std::getenv("TESSERA_TEST_DATA");
    const std::string data = set ? set : std::string(TESSERA_SOURCE_DIR) + "/../shared/data",
                      models = "/usr/share/assimp/models/";
    std::vector<std::string> files = {models + "FBX/huesitos.fbx", models + "X/Testwuson.X", models + "BVH/01_01.bvh",
                                      TESSERA_SOURCE_DIR "/tests/data/models/arm.glb"};
    for (const char* name : {"BoxAnimated.glb", "RiggedFigure.glb", "Fox.glb", "AnimatedMorphCube.glb"})
        if (std::filesystem::exists(data + "/gltf/" + name)) files.push_back(data + "/gltf/" + name);
    for (const std::string& path : files) {
        SCOPED_TRACE(path);
        ImportOptions options;
        options.importerProgram = std::string(TESSERA_BIN_DIR) + "/tessera-import";
        Expected<ImportedScene> imported = importScene(path, kRootNode, options);
        ASSERT_TRUE(imported) << imported.error().message;
        Simulation simulation;
        ASSERT_TRUE(simulation.load({std::move(imported->list)}));
        const Box all = animatedBounds(simulation.scene()).box;
        Box seen;
        for (int frame = 0; frame < 240; ++frame) {
            (void)simulation.step(frame == 0, {});
            const Box now = verticesOf(simulation.scene());
            seen.extend(now);
            ASSERT_LT(beyond(now, all), 1e-5) << "frame " << frame;
        }
        RecordProperty(std::filesystem::path(path).stem().string() + "_times_as_large",
                       std::to_string(all.size().norm() / seen.size().norm()));
    }
}

}  // namespace
}  // namespace tessera
