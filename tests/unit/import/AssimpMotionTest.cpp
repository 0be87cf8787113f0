/// Bones, morph targets and animations of formats that assimp reads: what they become, and what is said of those that
/// make no sense.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

#include "common/cores/Animation.h"
#include "common/cores/Skin.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "tests/support/words/Words.h"
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
        const std::string written = fmt::format(
            "xof 0303txt 0032\n"
            "AnimTicksPerSecond {{ {}; }}\n"
            "Frame Root {{\n FrameTransformMatrix {{ {} }}\n"
            " Frame Bone {{ FrameTransformMatrix {{ {} }} }}\n"
            " Mesh Flag {{\n  3; 0;0;0;, 1;0;0;, 0;1;0;;\n  1; 3;0,1,2;;\n"
            "  XSkinMeshHeader {{ 1; 1; 1; }}\n"
            "  SkinWeights {{ \"{}\"; 3; 0,1,2; {}; {};; }}\n }}\n}}\n"
            "AnimationSet Walk {{ Animation {{ {{{}}} AnimationKey {{ {} }} }} }}\n{}",
            ticks, unit, unit, named, weights, offset, animated, keys, more);
        std::string apart;  // assimp takes a comma before a digit as the beginning of decimals
        for (const char c : written) apart += c == ',' ? std::string(", ") : std::string(1, c);
        return apart;
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
Read readX(const XFile& file) {
    return readText("flag.x", file.text());
}

bool says(const Read& read, const std::string& part) {
    return std::ranges::any_of(read.notes,
                               [&](const std::string& note) { return note.find(part) != std::string::npos; });
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
    EXPECT_WORDS(allNotes(read));
    EXPECT_FALSE(says(readX({}), "no pace"));
    const Read two =
        readX({.ticks = "0", .more = "AnimationSet Run { Animation { {Bone} AnimationKey { 2; 1; 0;3;0,0,1;;; } } }"});
    EXPECT_EQ(allOf<Animation>(two).size(), 2u);
    EXPECT_WORDS(allNotes(two)) << "once";
}

TEST(AssimpMotion, ABoneWithoutItsNodeLeavesItsVerticesWhereTheMeshIs) {
    const Read read = readX({.named = "Ghost"});
    EXPECT_WORDS(allNotes(read));
    const Skin& skin = *allOf<Skin>(read).front();
    ASSERT_EQ(skin.joints.size(), 1u);
    const auto shown = drawableOf(Object::of(skin)).arrays().positions;
    ASSERT_EQ(shown.as<float>().size(), 9u);
    EXPECT_EQ(shown.as<float>()[3], 1.0f);
}

TEST(AssimpMotion, OffsetMatricesThatCannotBeUndoneMoveNothing) {
    for (const char* offset : {"0,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1", "1,0,0,0, 0,1,0,0, 0,0,1,0, 1e30,0,0,1"}) {
        const Read read = readX({.offset = offset});
        EXPECT_WORDS(allNotes(read));
        ASSERT_EQ(allOf<Skin>(read).size(), 1u);
        EXPECT_EQ(read.aspect->get<Node>(allOf<Skin>(read).front()->joints.front())->name, "at rest");
    }
}

TEST(AssimpMotion, VerticesThatFollowNobodyStay) {
    const Read read = readX({.weights = "1,0,-1"});
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
    EXPECT_WORDS(allNotes(read));
    EXPECT_TRUE(allOf<Animation>(read).empty());
    EXPECT_EQ(allOf<Skin>(read).size(), 1u) << "the rest is there";
}

TEST(AssimpMotion, KeysOutOfOrderArePlayedInTheOrderOfTime) {
    const Read read = readX({.keys = "2; 3; 10;3;0,2,0;;, 0;3;0,0,0;;, 20;3;4,2,0;;;"});
    EXPECT_WORDS(allNotes(read));
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
    EXPECT_WORDS(allNotes(read));
    const KeyFrames* places = channel(read, "translation");
    ASSERT_NE(places, nullptr);
    EXPECT_EQ(numbersIn(places->times), (std::vector<double>{0, 2}));
}

TEST(AssimpMotion, SeveralAnimationsComeAndTheFirstPlays) {
    const Read read =
        readX({.more = "AnimationSet Run { Animation { {Bone} AnimationKey { 2; 2; 0;3;0,0,0;;, 5;3;0,2,0;;; } } }\n"});
    EXPECT_WORDS(allNotes(read));
    ASSERT_EQ(allOf<Animation>(read).size(), 2u);
    EXPECT_EQ(std::ranges::count_if(allOf<Animation>(read), &Animation::playing), 1);
}

TEST(AssimpMotion, MoreThanAMillionKeysOfAChannelAreLeftOutAndSaid) {
    std::string keys = "2; 1000001;";
    for (int k = 0; k <= 1'000'000; ++k) keys += fmt::format(" {};3;{},0,0;;{}", k, k % 7, k < 1'000'000 ? "," : ";");
    const Read read = readX({.keys = keys});
    EXPECT_WORDS(allNotes(read));
    EXPECT_EQ(allOf<Skin>(read).size(), 1u);
}

/// A triangle whose tip a target lifts by (0, 0, 2); its weight is animated from 0 to 1 in two seconds.
const char* const kMorphingFbx = R"(; FBX 7.4.0 project file
FBXHeaderExtension:  {
 FBXHeaderVersion: 1003
 FBXVersion: 7400
}
GlobalSettings:  {
 Version: 1000
 Properties70:  {
  P: "UpAxis", "int", "Integer", "",1
 }
}
Objects:  {
 Geometry: 100, "Geometry::Face", "Mesh" {
  Vertices: *9 {
   a: 0,0,0,1,0,0,0,1,0
  }
  PolygonVertexIndex: *3 {
   a: 0,1,-3
  }
  GeometryVersion: 124
 }
 Geometry: 101, "Geometry::Up", "Shape" {
  Version: 100
  Indexes: *1 {
   a: 2
  }
  Vertices: *3 {
   a: 0,0,2
  }
  Normals: *3 {
   a: 0,0,0
  }
 }
 Model: 200, "Model::face", "Mesh" {
  Version: 232
  Properties70:  {
   P: "Lcl Translation", "Lcl Translation", "", "A",0,0,0
  }
 }
 Deformer: 300, "Deformer::Shapes", "BlendShape" {
  Version: 100
 }
 Deformer: 301, "SubDeformer::Up", "BlendShapeChannel" {
  Version: 100
  DeformPercent: 25
  FullWeights: *1 {
   a: 100
  }
 }
 AnimationStack: 400, "AnimStack::Lift", "" {
  Properties70:  {
   P: "LocalStop", "KTime", "Time", "",92372316000
  }
 }
 AnimationLayer: 401, "AnimLayer::Base", "" {
 }
 AnimationCurveNode: 402, "AnimCurveNode::DeformPercent", "" {
  Properties70:  {
   P: "d|DeformPercent", "Number", "", "A",0
  }
 }
 AnimationCurve: 403, "AnimCurve::", "" {
  Default: 0
  KeyVer: 4008
  KeyTime: *2 {
   a: 0,92372316000
  }
  KeyValueFloat: *2 {
   a: 0,100
  }
  KeyAttrFlags: *1 {
   a: 24836
  }
  KeyAttrDataFloat: *4 {
   a: 0,0,255790911,0
  }
  KeyAttrRefCount: *1 {
   a: 2
  }
 }
}
Connections:  {
 C: "OO",200,0
 C: "OO",100,200
 C: "OO",300,100
 C: "OO",301,300
 C: "OO",101,301
 C: "OO",401,400
 C: "OO",402,401
 C: "OP",402,301,"DeformPercent"
 C: "OP",403,402,"d|DeformPercent"
}
)";

TEST(AssimpMotion, MorphTargetsOfFbxMoveAndAreAnimated) {
    const Read read = readText("face.fbx", kMorphingFbx);
    ASSERT_EQ(allOf<Skin>(read).size(), 1u) << allNotes(read);
    EXPECT_WORDS(allNotes(read));
    Skin skin = *allOf<Skin>(read).front();
    ASSERT_EQ(skin.weights.as<float>().size(), 1u);
    EXPECT_EQ(skin.weights.as<float>()[0], 0.0f);
    const KeyFrames* weights = channel(read, "weights");
    ASSERT_NE(weights, nullptr) << allNotes(read);
    EXPECT_EQ(numbersIn(weights->times), (std::vector<double>{0, 2}));
    EXPECT_EQ(numbersIn(weights->values), (std::vector<double>{0, 1}));
    for (const float weight : {0.0f, 0.25f, 1.0f}) {
        skin.weights = Blob::of(std::span<const float>(&weight, 1));
        const Blob shown = drawableOf(Object::of(skin)).arrays().positions;
        float highest = 0;
        for (std::size_t i = 2; i < shown.as<float>().size(); i += 3) highest = std::max(highest, shown.as<float>()[i]);
        EXPECT_NEAR(highest, 2 * weight, 1e-6f);
    }
}

/// Bones of a Half-Life model as its file has them (studio.h of Half-Life's SDK: 112 bytes each; a name, the parent's
/// number, and from byte 64 on a place and turns about X, Y, Z): where each stands at rest.
std::map<std::string, Vec3d> bonesInFile(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const auto read = [&]<typename T>(T, std::size_t at) {
        T value{};
        std::memcpy(&value, bytes.data() + at, sizeof value);
        return value;
    };
    std::map<std::string, Vec3d> places;
    std::vector<Affine3d> worlds;
    const int count = read(int(), 140), first = read(int(), 144);
    for (int b = 0; b < count; ++b) {
        const std::size_t at = static_cast<std::size_t>(first + 112 * b);
        const int parent = read(int(), at + 32);
        const auto value = [&](std::size_t i) { return static_cast<double>(read(float(), at + 64 + 4 * i)); };
        Affine3d local = Affine3d::Identity();
        local.translation() = Vec3d(value(0), value(1), value(2));
        local.linear() = (Eigen::AngleAxisd(value(5), Vec3d::UnitZ()) * Eigen::AngleAxisd(value(4), Vec3d::UnitY()) *
                          Eigen::AngleAxisd(value(3), Vec3d::UnitX()))
                             .toRotationMatrix();
        worlds.push_back(parent < 0 ? local : worlds[static_cast<std::size_t>(parent)] * local);
        places[std::string(bytes.data() + at)] = worlds.back().translation();
    }
    return places;
}

/// Assimp lists all bones below one node.
TEST(AssimpMotion, BonesOfHalfLifeModelsComeBelowTheirParentsAndPlayAsLongAsTheirKeys) {
    const std::string path = std::string(kDebianModels) + "/MDL/MDL (HL1)/man.mdl";
    const std::map<std::string, Vec3d> right = bonesInFile(path);
    ASSERT_EQ(right.size(), 8u);
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    std::map<std::string, Vec3d> places;
    double longest = 0;
    for (const ObjectId id : aspect->ids()) {
        if (const Node* node = aspect->get<Node>(id))
            places.emplace(node->name, worldTransform(*aspect, id).translation());
        if (const auto* keys = aspect->get<KeyFrames>(id))
            for (const double time : keys->times.as<double>()) longest = std::max(longest, time);
    }
    // Assimp turns the whole; distances between bones it leaves.
    for (const auto& [a, at] : right)
        for (const auto& [b, other] : right) {
            ASSERT_TRUE(places.contains(a)) << a;
            EXPECT_NEAR((places[a] - places[b]).norm(), (at - other).norm(), 1e-4) << a << ' ' << b;
        }
    EXPECT_GT(longest, 0.5);
    EXPECT_LT(longest, 10) << "26 frames at 30 a second are no 26 s";
}

}  // namespace
}  // namespace tessera
