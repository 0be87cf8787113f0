/// How animations play: what each format keeps of it, and says of what it loses.
#include <gmock/gmock.h>

#include "common/cores/Motion.h"
#include "common/export/LeavingMotions.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::DoubleNear;
using testing::HasSubstr;
using testing::Not;
using testing::Pointwise;

constexpr const char *kLost = "how often and how fast animations play is left out: ",
                     *kPaused = "animations that are paused play in the file: ",
                     *kTogether = "animations begin again together, when the longest ends: ",
                     *kWaits = "animations that play once wait until an event begins them: ";

/// A triangle at "place NAME" that an animation of this name raises by 1 m.
void addRise(BuiltScene& built, const std::string& name, Animation animation, std::initializer_list<double> times,
             std::initializer_list<double> values) {
    KeyFrames keys;
    keys.target = built.add(Transform());
    keys.field = "translation";
    keys.times = blobOf<double>(times);
    keys.values = blobOf<double>(values);
    animation.channels = {built.add(keys)};
    built.node("a", built.add(triangleGeometry()), built.node("place_" + name, keys.target));
    built.node(name, built.add(animation));
}

Aspect rising() {
    BuiltScene built;
    addRise(built, "fast", {.channels = {}, .speed = 4}, {0, 2}, {0, 0, 0, 0, 1, 0});
    addRise(built, "slow", Animation(), {0, 3}, {0, 0, 0, 0, 1, 0});
    addRise(built, "once", {.channels = {}, .mode = Animation::kOnce}, {0, 1}, {0, 0, 0, 0, 1, 0});
    addRise(built, "held", {.channels = {}, .playing = false, .time = 0.5}, {0, 3}, {0, 0, 0, 0, 1, 0});
    addRise(built, "swing", {.channels = {}, .speed = 2, .mode = Animation::kPingPong}, {0, 1, 3},
            {0, 0, 0, 0, 1, 0, 0, 2, 0});
    addRise(built, "back", {.channels = {}, .speed = -1}, {0, 2, 3}, {0, 0, 0, 0, 1, 0, 0, 2, 0});
    return built.take();
}

std::vector<std::string> notesOf(const std::string& path, const Aspect& scene) {
    const Expected<ExportReport> report = exportScene(path, scene);
    EXPECT_TRUE(report) << (report ? "" : report.error().message);
    return report ? report->notes : std::vector<std::string>();
}

struct Rise {
    std::vector<double> times, heights;
};
/// What moves "place_NAME".
Rise riseOf(const Aspect& scene, const std::string& name) {
    for (const ObjectId id : scene.ids()) {
        const auto* keys = scene.get<KeyFrames>(id);
        if (!keys) continue;
        for (const ObjectId other : scene.ids()) {
            const Node* node = scene.get<Node>(other);
            if (!node || node->core != keys->target || node->name != "place_" + name) continue;
            Rise rise;
            const auto times = keys->times.as<double>(), values = keys->values.as<double>();
            rise.times.assign(times.begin(), times.end());
            for (std::size_t i = 1; i < values.size(); i += 3) rise.heights.push_back(values[i]);
            return rise;
        }
    }
    return {};
}

const Animation* animationOf(const Aspect& scene, const std::string& name) {
    for (const ObjectId id : scene.ids())
        if (const Node* node = scene.get<Node>(id); node && node->name == name)
            if (const auto* animation = scene.coreOf<Animation>(*node)) return animation;
    ADD_FAILURE() << "no animation " << name;
    static const Animation kNone;
    return &kNone;
}

void expectRise(const Rise& rise, const std::vector<double>& times, const std::vector<double>& heights) {
    EXPECT_THAT(rise.times, Pointwise(DoubleNear(1e-5), times));
    EXPECT_THAT(rise.heights, Pointwise(DoubleNear(1e-5), heights));
}

TEST(MotionsLeave, GltfSaysWhichItHasNoWordFor) {
    const Scratch scratch;
    for (const char* out : {"out.glb", "out.gltf"}) {
        const auto notes = notesOf(scratch.path(out), rising());
        EXPECT_THAT(notes, Contains(std::string(kLost) + "/fast, /once, /swing and 1 more"));
        EXPECT_THAT(notes, Contains(std::string(kPaused) + "/held"));
    }
}

TEST(MotionsLeave, UsdHasSpeedsAndWaysBackInItsTimes) {
    const Scratch scratch;
    const std::string path = scratch.path("out.usda");
    const auto notes = notesOf(path, rising());
    EXPECT_THAT(notes, Contains(std::string(kLost) + "/once"));
    EXPECT_THAT(notes, Contains(std::string(kPaused) + "/held"));
    EXPECT_THAT(notes, Contains(std::string(kTogether) + "/fast"));
    const ImportedAspect again = readBack(path);
    EXPECT_NEAR(riseOf(*again, "fast").times.at(1), 0.5, 1e-5);
    const Rise swing = riseOf(*again, "swing");
    expectRise(swing, {0, 0.5, 1.5, 2.5, 3}, {0, 1, 2, 1, 0});
    expectRise(riseOf(*again, "back"), {0, 1, 3}, {2, 1, 0});
}

TEST(MotionsLeave, VrmlHasAClockForEach) {
    const Scratch scratch;
    const std::string first = scratch.path("out.wrl"), second = scratch.path("again.wrl");
    for (const std::string& path : {first, second}) {
        const auto notes = path == first ? notesOf(path, rising()) : notesOf(path, *readBack(first));
        for (const char* never : {kLost, kPaused, kTogether})
            EXPECT_THAT(notes, Not(Contains(HasSubstr(never)))) << path;
        EXPECT_THAT(notes, Contains(std::string(kWaits) + "/once"));
        const ImportedAspect again = readBack(path);
        expectRise(riseOf(*again, "fast"), {0, 0.5}, {0, 1});
        expectRise(riseOf(*again, "slow"), {0, 3}, {0, 1});
        expectRise(riseOf(*again, "once"), {0, 1}, {0, 1});
        expectRise(riseOf(*again, "held"), {0, 3}, {0, 1});
        expectRise(riseOf(*again, "swing"), {0, 0.5, 1.5, 2.5, 3}, {0, 1, 2, 1, 0});
        expectRise(riseOf(*again, "back"), {0, 1, 3}, {2, 1, 0});
        for (const char* name : {"fast", "slow", "held", "swing", "back"}) {
            EXPECT_EQ(animationOf(*again, name)->mode, Animation::kLoop) << name;
            EXPECT_EQ(animationOf(*again, name)->playing, std::string(name) != "held") << name;
        }
        EXPECT_EQ(animationOf(*again, "once")->mode, Animation::kOnce);
    }
}

TEST(MotionsLeave, VrmlKeepsTheirNames) {
    const Scratch scratch;
    BuiltScene built;
    addRise(built, "crane ride", Animation(), {0, 1}, {0, 0, 0, 0, 1, 0});
    addRise(built, "1st ride", Animation(), {0, 1}, {0, 0, 0, 0, 1, 0});
    addRise(built, "grün", Animation(), {0, 1}, {0, 0, 0, 0, 1, 0});
    ASSERT_TRUE(exportScene(scratch.path("out.wrl"), built.take()));
    const ImportedAspect again = readBack(scratch.path("out.wrl"));
    for (const char* name : {"crane ride", "1st ride", "grün"}) animationOf(*again, name);
}

TEST(MotionsLeave, WhatIsTooSlowStands) {
    const Scratch scratch;
    for (const double speed : {0.0, 1e-300, -1e-300}) {
        BuiltScene built;
        addRise(built, "still", {.channels = {}, .speed = speed, .mode = Animation::kPingPong}, {0, 2},
                {0, 0, 0, 0, 1, 0});
        const Aspect scene = built.take();
        for (const char* out : {"out.glb", "out.usda"})
            EXPECT_THAT(notesOf(scratch.path(out), scene), Contains(std::string(kLost) + "/still")) << out;
        EXPECT_THAT(notesOf(scratch.path("out.wrl"), scene), Contains(HasSubstr("are paused: /still")));
        const ImportedAspect again = readBack(scratch.path("out.wrl"));
        EXPECT_FALSE(animationOf(*again, "still")->playing);
        expectRise(riseOf(*again, "still"), {0, 2}, {0, 1});
    }
}

/// Readers of VRML take no cycles of more than 1e9 s, ours too.
TEST(MotionsLeave, WhatTakesTooLongStands) {
    const Scratch scratch;
    BuiltScene built;
    addRise(built, "swing", {.channels = {}, .mode = Animation::kPingPong}, {0, 6e8}, {0, 0, 0, 0, 1, 0});
    Motion motion;
    motion.target = built.add(Transform());
    motion.keys = blobOf<double>({0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 2e9, 0, 1, 0, 1, 0, 0, 0, 1, 1, 1});
    motion.mode = Motion::kLoop;
    built.node("a", built.add(triangleGeometry()), built.node("place_aeon", motion.target));
    built.node("aeon", built.add(motion));
    addRise(built, "longest", Animation(), {0, 1e9}, {0, 0, 0, 0, 1, 0});
    const Aspect scene = built.take();
    for (const char* out : {"out.glb", "out.usda"}) {
        const bool isGltf = std::string(out) == "out.glb";
        EXPECT_EQ(std::ranges::count(notesOf(scratch.path(out), scene),
                                     "animations that take more than 1e9 s are left out: /aeon"),
                  isGltf ? 1 : 0);
        expectRise(riseOf(*readBack(scratch.path(out)), "longest"), {0, 1e9}, {0, 1});
    }
    EXPECT_THAT(notesOf(scratch.path("out.wrl"), scene), Contains(HasSubstr("are paused: /swing, /aeon")));
    const ImportedAspect again = readBack(scratch.path("out.wrl"));
    for (const char* name : {"swing", "aeon"}) EXPECT_FALSE(animationOf(*again, name)->playing) << name;
    EXPECT_TRUE(animationOf(*again, "longest")->playing);
    expectRise(riseOf(*again, "swing"), {0, 6e8}, {0, 1});
    expectRise(riseOf(*again, "aeon"), {0, 1e9}, {0, 1});
}

/// Our own importer takes no keys beyond.
TEST(MotionsLeave, KeysBeyondWhatReadersTakeAreLeftOut) {
    const Scratch scratch;
    BuiltScene built;
    addRise(built, "near", Animation(), {0, 1}, {0, 0, 0, 0, 1, 0});
    addRise(built, "far", Animation(), {0, 1}, {0, 0, 0, 0, 1e39, 0});
    const Aspect scene = built.take();
    for (const char* out : {"out.glb", "out.usda", "out.wrl"}) {
        EXPECT_THAT(notesOf(scratch.path(out), scene), Contains(HasSubstr("(keep their keys within 1e15 m): /far")));
        const ImportedAspect again = readBack(scratch.path(out));
        expectRise(riseOf(*again, "near"), {0, 1}, {0, 1});
        EXPECT_TRUE(riseOf(*again, "far").times.empty()) << out;
    }
}

/// Ours repeat from the last key to the first one, whenever that is.
TEST(MotionsLeave, MotionsBeginAtTheirFirstKey) {
    const Scratch scratch;
    BuiltScene built;
    const auto addMotion = [&](const std::string& name, double first, std::int64_t mode) {
        Motion motion;
        motion.target = built.add(Transform());
        motion.keys = blobOf<double>({first, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, first + 2, 0, 1, 0, 1, 0, 0, 0, 1, 1, 1});
        motion.mode = mode;
        built.node("a", built.add(triangleGeometry()), built.node("place_" + name, motion.target));
        built.node(name, built.add(motion));
    };
    addMotion("swing", 1, Motion::kPingPong);
    addMotion("late", 1, Motion::kLoop);
    addMotion("early", -1, Motion::kLoop);
    const Aspect scene = built.take();
    for (const char* out : {"out.wrl", "out.usda", "out.glb"}) {
        ASSERT_TRUE(exportScene(scratch.path(out), scene));
        const ImportedAspect again = readBack(scratch.path(out));
        const bool isGltf = std::string(out) == "out.glb";  // which has no ways back
        expectRise(riseOf(*again, "swing"), isGltf ? std::vector<double>{0, 2} : std::vector<double>{0, 2, 4},
                   isGltf ? std::vector<double>{0, 1} : std::vector<double>{0, 1, 0});
        for (const char* name : {"late", "early"}) expectRise(riseOf(*again, name), {0, 2}, {0, 1});
    }
}

TEST(MotionsLeave, KeysThatFilesCannotHaveAreCalledWhatTheyAre) {
    const Scratch scratch;
    BuiltScene built;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto addKeys = [&](const std::string& name, const char* field, std::initializer_list<double> values) {
        KeyFrames keys;
        keys.target = built.add(Transform());
        keys.field = field;
        keys.times = blobOf<double>({0, 1});
        keys.values = blobOf<double>(values);
        Animation animation;
        animation.channels = {built.add(keys)};
        built.node("a", built.add(triangleGeometry()), built.node("place_" + name, keys.target));
        built.node(name, built.add(animation));
    };
    const auto addMotion = [&](const std::string& name, double height, double scale, double begin = 0) {
        Motion motion;
        motion.target = built.add(Transform());
        motion.keys = blobOf<double>({begin, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0, height, 0, 1, 0, 0, 0, scale, 1, 1});
        built.node("a", built.add(triangleGeometry()), built.node("place_" + name, motion.target));
        built.node(name, built.add(motion));
    };
    addKeys("unfinite", "translation", {0, 0, 0, 0, nan, 0});
    addKeys("grown", "scale", {1, 1, 1, 1, 1e16, 1});
    addKeys("turned", "rotation", {1, 0, 0, 0, 0, 1e16, 0, 0});
    addMotion("unfinite motion", nan, 1);
    addMotion("far motion", 1e16, 1);
    addMotion("grown motion", 1, 1e16);
    addMotion("endless motion", 1, 1, -std::numeric_limits<double>::max());
    const Aspect scene = built.take();
    for (const char* out : {"out.glb", "out.usda", "out.wrl"}) {
        const auto notes = notesOf(scratch.path(out), scene);
        EXPECT_THAT(notes, Contains("animations with keys that are not finite are left out: /unfinite, "
                                    "/unfinite motion"))
            << out;
        EXPECT_THAT(notes, Contains("animations of a scale with numbers beyond 1e15 are left out (keep these within "
                                    "1e15): /grown, /grown motion"));
        EXPECT_THAT(notes, Contains(HasSubstr("animations of a rotation with numbers beyond 1e15")));
        EXPECT_THAT(notes, Contains(HasSubstr("(keep their keys within 1e15 m): /far motion")));
        EXPECT_THAT(notes, Contains(HasSubstr("that take more than 1e15 s are left out")));
    }
}

TEST(MotionsLeave, OfMotionsTheSameIsSaid) {
    const Scratch scratch;
    BuiltScene built;
    Motion motion;
    motion.target = built.add(Transform());
    motion.keys = blobOf<double>({0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 2, 0, 1, 0, 1, 0, 0, 0, 1, 1, 1});
    built.node("a", built.add(triangleGeometry()), built.node("place_lift", motion.target));
    built.node("lift", built.add(motion));
    built.node("lost", built.add([] {
        Motion bad;
        bad.keys = blobOf<double>({0, 1});
        return bad;
    }()));
    const Aspect scene = built.take();
    for (const char* out : {"out.glb", "out.usda", "out.wrl"}) {
        const auto notes = notesOf(scratch.path(out), scene);
        const bool isVrml = std::string(out) == "out.wrl";
        EXPECT_THAT(notes, Contains(std::string(isVrml ? kWaits : kLost) + "/lift")) << out;
        EXPECT_THAT(notes, Contains(HasSubstr("that cannot play are left out: /lost"))) << out;
    }
    const ImportedAspect again = readBack(scratch.path("out.wrl"));
    EXPECT_EQ(animationOf(*again, "lift")->mode, Animation::kOnce);
}

}  // namespace
}  // namespace tessera
