/// How animations play: what each format keeps of it, and says of what it loses.
#include <gmock/gmock.h>

#include "common/cores/Motion.h"
#include "common/export/LeavingMotions.h"
#include "common/export/NodeTracks.h"
#include "tests/support/words/Words.h"
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
    EXPECT_THAT(notes, Contains("animations are one in the file, without their names: /fast, /slow, /once and 3 more"));
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
        for (const std::string& note : notesOf(scratch.path("out.wrl"), scene)) EXPECT_WORDS(note);
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
    for (const std::string& note : notesOf(scratch.path("out.wrl"), scene)) EXPECT_WORDS(note);
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
        for (const std::string& note : notesOf(scratch.path(out), scene)) EXPECT_WORDS(note);
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
        for (const std::string& note : notesOf(scratch.path(out), scene)) EXPECT_WORDS(note) << out;
    }
}

/// `places` of them bear the same Transform, which goes up, and in the last fifth to 1 m and back again.
void addSpline(BuiltScene& built, const std::string& name, double length, int places = 1,
               std::int64_t mode = Animation::kLoop) {
    KeyFrames keys;
    keys.target = built.add(Transform());
    keys.field = "translation";
    keys.interpolation = KeyFrames::kSpline;
    const double slope = 4 / (0.2 * length);
    keys.times = blobOf<double>({0, 0.8 * length, length});
    keys.values =
        blobOf<double>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, slope, 0, 0, -slope, 0, 0, 0, 0, 0, 0, 0});
    Animation animation;
    animation.mode = mode;
    animation.channels = {built.add(keys)};
    for (int i = 0; i < places; ++i) built.node("a", built.add(triangleGeometry()), built.node("place", keys.target));
    built.node(name, built.add(animation));
}

struct LeavingTracks {
    NodeTracks all;
    std::vector<std::string> notes;
    std::size_t values = 0;
};
LeavingTracks tracksOf(const Aspect& scene) {
    ExportNotes notes;
    const Expected<Selection> selection = selectNodes(scene, "", notes);
    EXPECT_TRUE(selection);
    LeavingTracks made{.all = nodeTracks(scene, *selection, planTree(scene, *selection, notes), notes), .notes = {}};
    made.notes = notes.lines(scene);
    for (const NodeTrack& track : made.all.tracks) {
        EXPECT_EQ(track.times.size(), track.values.size());
        EXPECT_TRUE(std::ranges::is_sorted(track.times));
        made.values += track.values.size();
    }
    return made;
}
double longestLine(const NodeTrack& track) {
    double longest = 0;
    for (std::size_t i = 1; i < track.times.size(); ++i)
        longest = std::max(longest, track.times[i] - track.times[i - 1]);
    return longest;
}
double highest(const NodeTrack& track) {
    double height = 0;
    for (const std::array<double, 4>& value : track.values) height = std::max(height, value[1]);
    return height;
}

TEST(MotionsLeave, LongSplinesAreCoarserAndCurvedToTheirEnds) {
    BuiltScene built;
    addSpline(built, "short", 10), addSpline(built, "long", 5000);
    const LeavingTracks made = tracksOf(built.take());
    EXPECT_THAT(made.notes, testing::ElementsAre("long splines are straight lines of up to 0.05 s: /long"));
    ASSERT_EQ(made.all.tracks.size(), 2u);
    EXPECT_NEAR(longestLine(made.all.tracks[0]), 1.0 / 60, 1e-9);
    EXPECT_NEAR(longestLine(made.all.tracks[1]), 0.05, 1e-3);
    for (const NodeTrack& track : made.all.tracks) EXPECT_NEAR(highest(track), 1, 1e-3);
}

TEST(MotionsLeave, AllSplinesTogetherAreBounded) {
    BuiltScene built;
    addSpline(built, "short", 10);
    for (int i = 0; i < 200; ++i)
        addSpline(built, "long", 1e6, i == 0 ? 100 : 1, i == 1 ? Animation::kPingPong : Animation::kLoop);
    const Aspect scene = built.take();
    const LeavingTracks made = tracksOf(scene);
    ASSERT_EQ(made.all.tracks.size(), 300u);
    EXPECT_LT(made.values, kMostSplineValues + 5 * 300);
    EXPECT_GT(made.values, 0.95 * kMostSplineValues);
    ASSERT_EQ(made.notes.size(), 1u);
    EXPECT_WORDS(made.notes.front());
    EXPECT_NEAR(longestLine(made.all.tracks[0]), 1.0 / 60, 1e-9);
    for (const NodeTrack& track : made.all.tracks) EXPECT_NEAR(highest(track), 1, 1e-3);
}

/// How high "place_NAME" stands.
double heightOf(const Aspect& scene, const std::string& name) {
    for (const ObjectId id : scene.ids())
        if (const Node* node = scene.get<Node>(id); node && node->name == "place_" + name)
            return worldTransform(scene, id).translation().y();
    return -1;
}

TEST(MotionsLeave, ThatTakeNoTimeHoldTheirPlaces) {
    const Scratch scratch;
    BuiltScene built;
    addRise(built, "one", Animation(), {0}, {0, 9, 0});
    addRise(built, "later", Animation(), {-3, -1}, {0, 9, 0, 0, 7, 0});
    addRise(built, "held", {.channels = {}, .playing = false}, {0}, {0, 5, 0});
    Motion motion;
    motion.target = built.add(Transform());
    motion.keys = blobOf<double>({4, 0, 3, 0, 1, 0, 0, 0, 1, 1, 1});
    built.node("a", built.add(triangleGeometry()), built.node("place_motion", motion.target));
    built.node("motion", built.add(motion));
    KeyFrames curve;
    curve.target = built.add(Transform());
    curve.field = "translation";
    curve.interpolation = KeyFrames::kSpline;
    curve.times = blobOf<double>({0});
    curve.values = blobOf<double>({0, 0, 0, 0, 2, 0, 0, 0, 0});
    Animation animation;
    animation.channels = {built.add(curve)};
    built.node("a", built.add(triangleGeometry()), built.node("place_curve", curve.target));
    built.node("curve", built.add(animation));
    const Aspect scene = built.take();
    EXPECT_THAT(notesOf(scratch.path("out.wrl"), scene),
                Contains("animations that take no time are written as the places that they hold: /one, /later, /held "
                         "and 2 more"));
    const ImportedAspect vrml = readBack(scratch.path("out.wrl"));
    for (const auto& [name, height] :
         {std::pair("one", 9.0), {"later", 7.0}, {"held", 0.0}, {"motion", 3.0}, {"curve", 2.0}})
        EXPECT_NEAR(heightOf(*vrml, name), height, 1e-6) << name;
    ASSERT_TRUE(exportScene(scratch.path("out.glb"), scene));
    const Validated said = validated({scratch.path("out.glb")});
    EXPECT_TRUE(said.good || !said.there) << said.said;
    const ImportedAspect gltf = readBack(scratch.path("out.glb"));
    for (const auto& [name, height] : {std::pair("one", 9.0), {"later", 7.0}, {"curve", 2.0}})
        expectRise(riseOf(*gltf, name), {0}, {height});
    // As it was, and with one sample at 0 s.
    ASSERT_TRUE(exportScene(scratch.path("out.usda"), scene));
    EXPECT_NEAR(heightOf(*readBack(scratch.path("out.usda")), "later"), 7, 1e-6);
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
        for (const std::string& note : notesOf(scratch.path(out), scene)) EXPECT_WORDS(note) << out;
    }
    const ImportedAspect again = readBack(scratch.path("out.wrl"));
    EXPECT_EQ(animationOf(*again, "lift")->mode, Animation::kOnce);
}

}  // namespace
}  // namespace tessera
