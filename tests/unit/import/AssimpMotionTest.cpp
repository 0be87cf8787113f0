/// Bones, morph targets and animations of formats that assimp reads: what they become, and what is said of those that make no sense.
#include <fmt/format.h>

#include <algorithm>

#include "common/drawable/Drawable.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

/// A triangle that a bone moves, as DirectX has it in text, with parts that tests replace. Ten ticks are a second.
struct XFile {
    std::string named = "Bone", offset = "1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1", weights = "1,1,1";
    std::string animated = "Bone", ticks = "10", keys = "2; 3; 0;3;0,0,0;;, 10;3;0,2,0;;, 20;3;4,2,0;;;";
    std::string more;

    [[nodiscard]] std::string text() const {
        const char* unit = "1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1;;";
        return fmt::format("xof 0303txt 0032\n"
                           "AnimTicksPerSecond {{ {}; }}\n"
                           "Frame Root {{\n FrameTransformMatrix {{ {} }}\n"
                           " Frame Bone {{ FrameTransformMatrix {{ {} }} }}\n"
                           " Mesh Flag {{\n  3; 0;0;0;, 1;0;0;, 0;1;0;;\n  1; 3;0,1,2;;\n"
                           "  XSkinMeshHeader {{ 1; 1; 1; }}\n"
                           "  SkinWeights {{ \"{}\"; 3; 0,1,2; {}; {};; }}\n }}\n}}\n"
                           "AnimationSet Walk {{ Animation {{ {{{}}} AnimationKey {{ {} }} }} }}\n{}",
                           ticks, unit, unit, named, weights, offset, animated, keys, more);
    }
};

struct Read {
    ImportedAspect aspect;
    std::vector<std::string> notes;
};

Read readText(const std::string& name, const std::string& text) {
    Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write(name, text), kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    if (!scene) return {ImportedAspect(ImportedScene()), {}};
    std::vector<std::string> notes = scene->notes;
    return {ImportedAspect(std::move(*scene)), std::move(notes)};
}
Read readX(const XFile& file) { return readText("flag.x", file.text()); }

bool says(const Read& read, const std::string& part) {
    return std::ranges::any_of(read.notes, [&](const std::string& note) { return note.find(part) != std::string::npos; });
}
std::string allNotes(const Read& read) {
    std::string all;
    for (const std::string& note : read.notes) all += note + "\n";
    return all;
}

template <typename Core>
std::vector<const Core*> allOf(const Read& read) {
    std::vector<const Core*> all;
    for (const ObjectId id : read.aspect->ids())
        if (const auto* core = read.aspect->get<Core>(id)) all.push_back(core);
    return all;
}

/// The key frames of a field, of the only animation.
const KeyFrames* channel(const Read& read, const std::string& field) {
    for (const KeyFrames* frames : allOf<KeyFrames>(read))
        if (frames->field == field) return frames;
    return nullptr;
}
std::vector<double> numbersIn(const Blob& blob) {
    const auto numbers = blob.as<double>();
    return {numbers.begin(), numbers.end()};
}

TEST(AssimpMotion, TicksBecomeSecondsAndBonesJoints) {
    const Read read = readX({});
    EXPECT_EQ(allNotes(read), "");
    ASSERT_EQ(allOf<Skin>(read).size(), 1u);
    const Skin& skin = *allOf<Skin>(read).front();
    ASSERT_EQ(skin.joints.size(), 1u);
    EXPECT_EQ(read.aspect->get<Node>(skin.joints.front())->name, "Bone");
    EXPECT_EQ(skin.jointWeights.as<float>()[0], 1.0f);
    ASSERT_EQ(allOf<Animation>(read).size(), 1u);
    EXPECT_TRUE(allOf<Animation>(read).front()->playing);
    const KeyFrames* places = channel(read, "translation");
    ASSERT_NE(places, nullptr);
    EXPECT_EQ(numbersIn(places->times), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(numbersIn(places->values), (std::vector<double>{0, 0, 0, 0, 2, 0, 4, 2, 0}));
}

TEST(AssimpMotion, NoTicksASecondAreTwentyFive) {
    const Read read = readX({.ticks = "0"});
    const KeyFrames* places = channel(read, "translation");
    ASSERT_NE(places, nullptr);
    EXPECT_NEAR(numbersIn(places->times).back(), 20.0 / 25, 1e-12);
}

TEST(AssimpMotion, ABoneWithoutItsNodeLeavesItsVerticesWhereTheMeshIs) {
    const Read read = readX({.named = "Ghost"});
    EXPECT_TRUE(says(read, "bones that no node is called after move nothing (1, the first of 'Ghost')")) << allNotes(read);
    const Skin& skin = *allOf<Skin>(read).front();
    ASSERT_EQ(skin.joints.size(), 1u);
    const auto shown = drawableOf(Object::of(skin)).arrays().positions;
    ASSERT_EQ(shown.as<float>().size(), 9u);
    EXPECT_EQ(shown.as<float>()[3], 1.0f);
}

TEST(AssimpMotion, OffsetMatricesThatCannotBeUndoneMoveNothing) {
    for (const char* offset : {"0,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1", "1,0,0,0, 0,1,0,0, 0,0,1,0, 1e30,0,0,1"}) {
        const Read read = readX({.offset = offset});
        EXPECT_TRUE(says(read, "bones whose offset matrix is singular or no numbers move nothing")) << allNotes(read);
        ASSERT_EQ(allOf<Skin>(read).size(), 1u);
        EXPECT_EQ(read.aspect->get<Node>(allOf<Skin>(read).front()->joints.front())->name, "at rest");
    }
}

TEST(AssimpMotion, VerticesThatFollowNobodyStay) {
    const Read read = readX({.weights = "1,0,-1"});
    EXPECT_TRUE(says(read, "weights of joints that are below zero or no numbers count as zero")) << allNotes(read);
    const Skin& skin = *allOf<Skin>(read).front();
    ASSERT_EQ(skin.joints.size(), 2u);
    const auto joints = skin.jointIndices.as<std::uint16_t>();
    const auto weights = skin.jointWeights.as<float>();
    std::size_t atRest = 0;
    for (std::size_t v = 0; v < 3; ++v) atRest += joints[4 * v] == 1 && weights[4 * v] == 1.0f;
    EXPECT_EQ(atRest, 2u);
}

TEST(AssimpMotion, AChannelThatNamesNoNodeIsLeftOutAndSaid) {
    const Read read = readX({.animated = "Ghost", .more = "Frame Other { }\n"});
    EXPECT_TRUE(says(read, "channels of an animation that name no node are left out (1, the first of 'Ghost')")) << allNotes(read);
    EXPECT_TRUE(allOf<Animation>(read).empty());
    EXPECT_EQ(allOf<Skin>(read).size(), 1u) << "the rest is there";
}

TEST(AssimpMotion, KeysOutOfOrderArePlayedInTheOrderOfTime) {
    const Read read = readX({.keys = "2; 3; 20;3;4,2,0;;, 0;3;0,0,0;;, 10;3;0,2,0;;;"});
    EXPECT_TRUE(says(read, "not in the order of time")) << allNotes(read);
    const KeyFrames* places = channel(read, "translation");
    ASSERT_NE(places, nullptr);
    EXPECT_EQ(numbersIn(places->times), (std::vector<double>{0, 1, 2}));
    EXPECT_EQ(numbersIn(places->values), (std::vector<double>{0, 0, 0, 0, 2, 0, 4, 2, 0}));
}

TEST(AssimpMotion, TwoKeysOfOneTimeAreAJump) {
    const Read read = readX({.keys = "2; 4; 0;3;0,0,0;;, 10;3;0,2,0;;, 10;3;9,9,9;;, 20;3;4,2,0;;;"});
    const KeyFrames* places = channel(read, "translation");
    ASSERT_NE(places, nullptr);
    const std::vector<double> times = numbersIn(places->times);
    ASSERT_EQ(times.size(), 4u);
    EXPECT_EQ(times[1], 1);
    EXPECT_GT(times[2], 1);
    EXPECT_LT(times[2], 1 + 1e-9);
}

TEST(AssimpMotion, KeysThatAreNoNumbersAreLeftOutAndTheOthersPlay) {
    const Read read = readX({.keys = "2; 3; 0;3;0,0,0;;, 10;3;1e38,1e39,0;;, 20;3;4,2,0;;;"});
    EXPECT_TRUE(says(read, "keys of an animation with numbers that are not finite")) << allNotes(read);
    const KeyFrames* places = channel(read, "translation");
    ASSERT_NE(places, nullptr);
    EXPECT_EQ(numbersIn(places->times), (std::vector<double>{0, 2}));
}

TEST(AssimpMotion, ARotationOfLengthZeroIsNone) {
    const Read read = readX({.keys = "0; 2; 0;4;0,0,0,0;;, 10;4;0,1,0,0;;;"});
    EXPECT_TRUE(says(read, "a rotation of length zero")) << allNotes(read);
    ASSERT_NE(channel(read, "rotation"), nullptr);
}

TEST(AssimpMotion, SeveralAnimationsComeAndTheFirstPlays) {
    const Read read = readX({.more = "AnimationSet Run { Animation { {Bone} AnimationKey { 2; 2; 0;3;0,0,0;;, 5;3;0,2,0;;; } } }\n"});
    EXPECT_TRUE(says(read, "of several animations, the first is played")) << allNotes(read);
    ASSERT_EQ(allOf<Animation>(read).size(), 2u);
    EXPECT_EQ(std::ranges::count_if(allOf<Animation>(read), &Animation::playing), 1);
}

TEST(AssimpMotion, MoreThanAMillionKeysOfAChannelAreLeftOutAndSaid) {
    std::string keys = "2; 1000001;";
    for (int k = 0; k <= 1'000'000; ++k) keys += fmt::format(" {};3;{},0,0;;{}", k, k % 7, k < 1'000'000 ? "," : ";");
    const Read read = readX({.keys = keys});
    EXPECT_TRUE(says(read, "more than a million keys are left out (1, the first of 'Bone')")) << allNotes(read);
    EXPECT_EQ(allOf<Skin>(read).size(), 1u);
}

/// An array of Collada, as numbers of `params`.
std::string source(const std::string& id, const std::string& kind, const std::string& numbers, std::size_t count, const std::string& params) {
    const std::string name = R"(" type="float"/>)";
    std::string said;
    for (const char param : params) said += fmt::format(R"(<param name="{}{})", param, name);
    if (kind == "IDREF") said = R"(<param name="MORPH_TARGET" type="IDREF"/>)";
    return fmt::format(R"(<source id="{0}"><{1}_array id="{0}-a" count="{2}">{3}</{1}_array><technique_common>)", id, kind, count, numbers) +
           fmt::format(R"(<accessor source="#{}-a" count="{}" stride="{}">{}</accessor></technique_common></source>)", id, count / params.size(),
                       params.size(), said);
}
std::string geometry(const std::string& id, const std::string& positions) {
    return fmt::format(R"(<geometry id="{0}" name="{0}"><mesh>{1}<vertices id="{0}-v"><input semantic="POSITION" source="#{0}-p"/></vertices>)", id,
                       source(id + "-p", "float", positions, 9, "XYZ")) +
           fmt::format(R"(<triangles count="1"><input semantic="VERTEX" source="#{}-v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>)", id);
}
/// A triangle whose tip a target lifts by (0, 0, 2), at rest by a quarter of that; its weight is animated from 0 to 1 in two seconds.
std::string morphingDae(const std::string& method, const std::string& target) {
    return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><up_axis>Y_UP</up_axis></asset>)"
           "<library_geometries>" + geometry("base", "0 0 0 1 0 0 0 1 0") + geometry("lifted", target) + "</library_geometries>" +
           R"(<library_controllers><controller id="shape"><morph source="#base" method=")" + method + "\">" + source("targets", "IDREF", "lifted", 1, "T") +
           source("weights", "float", "0.25", 1, "W") + R"(<targets><input semantic="MORPH_TARGET" source="#targets"/>)"
           R"(<input semantic="MORPH_WEIGHT" source="#weights"/></targets></morph></controller></library_controllers>)"
           R"(<library_animations><animation id="lift">)" + source("lift-in", "float", "0 2", 2, "T") + source("lift-out", "float", "0 1", 2, "W") +
           R"(<sampler id="lift-s"><input semantic="INPUT" source="#lift-in"/><input semantic="OUTPUT" source="#lift-out"/></sampler>)"
           R"x(<channel source="#lift-s" target="face-morph-weights(0)"/></animation></library_animations>)x"
           R"(<library_visual_scenes><visual_scene id="scene"><node id="face" name="face"><instance_controller url="#shape"/></node></visual_scene>)"
           R"(</library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>)";
}

TEST(AssimpMotion, MorphTargetsOfColladaMoveAndAreAnimated) {
    for (const auto& [method, target] : {std::pair("NORMALIZED", "0 0 0 1 0 0 0 1 2"), {"RELATIVE", "0 0 0 0 0 0 0 0 2"}}) {
        SCOPED_TRACE(method);
        const Read read = readText("face.dae", morphingDae(method, target));
        ASSERT_EQ(allOf<Skin>(read).size(), 1u) << allNotes(read);
        const Skin& skin = *allOf<Skin>(read).front();
        ASSERT_EQ(skin.weights.as<float>().size(), 1u);
        EXPECT_EQ(skin.weights.as<float>()[0], 0.25f);
        const Blob shown = drawableOf(Object::of(skin)).arrays().positions;
        float highest = 0;
        for (std::size_t i = 2; i < shown.as<float>().size(); i += 3) highest = std::max(highest, shown.as<float>()[i]);
        EXPECT_NEAR(highest, 0.5f, 1e-6f);
        const KeyFrames* weights = channel(read, "weights");
        ASSERT_NE(weights, nullptr) << allNotes(read);
        EXPECT_EQ(numbersIn(weights->times), (std::vector<double>{0, 2}));
        EXPECT_EQ(numbersIn(weights->values), (std::vector<double>{0, 1}));
    }
}

}  // namespace
}  // namespace tessera
