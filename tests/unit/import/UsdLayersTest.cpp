// Layers of USD composed: who overrides whom, and what leads nowhere.
#include <fmt/format.h>

#include "common/cores/Animation.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

TEST(UsdLayers, OfTextCrateAndPackageAreTheSameScene) {
    std::vector<StateHash> hashes;
    for (const char* ending : {"usda", "usdc", "usdz"}) {
        Expected<ImportedScene> scene = importUsd(kUsdFiles + "cart." + ending);
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
        const ImportedAspect aspect(std::move(*scene));
        EXPECT_EQ(allOf<Animation>(aspect).size(), 1u);
        EXPECT_EQ(allOf<Image>(aspect).size(), 1u);
        EXPECT_TRUE(findNode(*aspect, "/cart/Cart/Load"));
        hashes.push_back(aspect->stateHash());
    }
    EXPECT_EQ(hashes[0], hashes[1]) << "the crate says the same as the text";
    EXPECT_EQ(hashes[0], hashes[2]) << "and the package";
}

TEST(UsdLayers, AboveOverrideThoseBelow) {
    const UsdScene scene("#usda 1.0\n(\n metersPerUnit = 1\n subLayers = [@strong.usda@, @weak.usda@]\n)\n",
                         {{"strong.usda", "over \"Ball\" { double radius = 3 }"},
                          {"weak.usda", "def Sphere \"Ball\" { double radius = 5\n double other = 1 }"}});
    expectNear(scene.bounds().upper, Vec3d::Constant(3), 0.02);
}

TEST(UsdLayers, ReferencesBringWhatIsBelowAndMapItsPaths) {
    const UsdScene scene(
        R"(
def Xform "A" (prepend references = @asset.usda@) {
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def "B" (references = @sub/../asset.usda@</Thing>) {}
)",
        {{"asset.usda", "def Xform \"Other\" {}\ndef Xform \"Thing\" {\n def Mesh \"M\" {" + kUsdTriangle +
                            R"( rel material:binding = </Thing/Red> }
 def Material "Red" { token outputs:surface.connect = </Thing/Red/S.outputs:surface>
  def Shader "S" { uniform token info:id = "UsdPreviewSurface"
   color3f inputs:diffuseColor = (1, 0, 0) } } })"}});
    EXPECT_TRUE(scene.has("/B/M"));
    EXPECT_FALSE(scene.has("/A/M")) << "the first prim is taken, as there is no default one";
    EXPECT_WORDS(scene.notes());
    const auto materials = scene.all<Material>();
    ASSERT_EQ(materials.size(), 1u);
    EXPECT_EQ(materials.front()->baseColor, Vec4f(1, 0, 0, 1));
}

TEST(UsdLayers, PlacedOftenShareMeshAndMaterial) {
    std::string text;
    for (int i = 0; i < 20; ++i) text += fmt::format("def \"P{}\" (references = @asset.usda@</Thing>) {{}}\n", i);
    const UsdScene scene(text, {{"asset.usda", "def Xform \"Thing\" {\n def Mesh \"M\" {" + kUsdTriangle +
                                                   R"( rel material:binding = </Thing/Red> }
 def Material "Red" { token outputs:surface.connect = </Thing/Red/S.outputs:surface>
  def Shader "S" { uniform token info:id = "UsdPreviewSurface" } } })"}});
    EXPECT_EQ(scene.corners().size(), 60u);
    EXPECT_EQ(scene.all<Geometry>().size(), 1u);
    EXPECT_EQ(scene.all<Material>().size(), 1u);
}

TEST(UsdLayers, InheritsVariantsAndPayloadsCountInTheirOrder) {
    const UsdScene scene(R"(
class "Size" { double radius = 2 }
def Sphere "Inherits" (inherits = </Size> payload = @far.usda@</Far>) {}
def Sphere "Local" (inherits = </Size>) { double radius = 7 }
def "Chosen" (variants = { string size = "small" } variantSets = "size" references = @far.usda@</Far>) {
    variantSet "size" = {
        "small" { double radius = 0.5 }
        "large" { double radius = 50 }
    }
}
def Sphere "Weak" (specializes = </Size> references = @far.usda@</Far>) {}
over "Nothing" { def Sphere "Hidden" {} }
def Sphere "Inactive" (active = false) {}
)",
                         {{"far.usda", "def Sphere \"Far\" { double radius = 4 }"}});
    const auto radius = [&](const char* name) {
        const auto* geometry = scene.aspect().core<Geometry>(std::string("/model/") + name);
        return geometry == nullptr ? 0.0 : boundsOf(geometry->positions.as<float>()).upper.y();
    };
    EXPECT_NEAR(radius("Inherits"), 2, 0.02) << "a class is stronger than a payload";
    EXPECT_NEAR(radius("Local"), 7, 0.05);
    EXPECT_NEAR(radius("Chosen"), 0.5, 0.01) << "a variant is stronger than a reference";
    EXPECT_NEAR(radius("Weak"), 4, 0.05) << "what is specialized is the weakest";
    for (const char* none : {"/Nothing", "/Inactive", "/Size"}) EXPECT_FALSE(scene.has(none)) << none;
}

TEST(UsdLayers, AChosenVariantBringsReferencesAndSetsOfItsOwn) {
    const UsdScene scene(R"(
def "A" (variants = { string outer = "on" } variantSets = "outer") {
    variantSet "outer" = {
        "on" (variants = { string inner = "b" } prepend variantSets = "inner" references = @far.usda@</Far>) {
            variantSet "inner" = {
                "a" { def Sphere "InA" {} }
                "b" { def Sphere "InB" {} }
            }
        }
    }
}
def "None" (variantSets = "free") { variantSet "free" = { "x" { def Sphere "X" {} } } }
)",
                         {{"far.usda", "def Xform \"Far\" { def Sphere \"Child\" {} }"}});
    EXPECT_TRUE(scene.has("/A/InB"));
    EXPECT_TRUE(scene.has("/A/Child"));
    EXPECT_FALSE(scene.has("/A/InA"));
    EXPECT_WORDS(scene.notes());
}

TEST(UsdLayers, TimesOfReferencesAreMovedAndStretched) {
    const UsdScene scene(R"(#usda 1.0
(
    metersPerUnit = 1
    timeCodesPerSecond = 10
)
def "A" (references = @moving.usda@</M> (offset = 20; scale = 2)) {}
)",
                         {{"moving.usda", R"(#usda 1.0
(
    timeCodesPerSecond = 10
)
def Xform "M" { double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (1, 0, 0) }
 uniform token[] xformOpOrder = ["xformOp:translate"]
 def Sphere "S" {} })"}});
    const auto frames = scene.all<KeyFrames>();
    ASSERT_EQ(frames.size(), 1u);
    const auto times = frames.front()->times.as<double>();
    ASSERT_EQ(times.size(), 2u);
    EXPECT_DOUBLE_EQ(times[0], 0) << "an animation begins where its first key is";
    EXPECT_DOUBLE_EQ(times[1], 2);
}

TEST(UsdLayers, ThatGoInCirclesAreNamedAndTheRestIsShown) {
    const UsdScene scene(
        "#usda 1.0\n(\n metersPerUnit = 1\n subLayers = [@model.usda@, @a.usda@]\n)\n"
        "def Sphere \"Good\" {}\n"
        "def \"Self\" (references = </Self>) {}\n"
        "def \"Up\" { def \"Down\" (references = </Up>) {} }\n"
        "def \"Far\" (references = @b.usda@</B>) {}\n",
        {{"a.usda", "#usda 1.0\n(\n subLayers = [@a.usda@]\n)\ndef Sphere \"InA\" {}\n"},
         {"b.usda", "def \"B\" (references = @c.usda@</C>) {}"},
         {"c.usda", "def Sphere \"C\" (references = @b.usda@</B>) {}"}});
    EXPECT_TRUE(scene.has("/Good"));
    EXPECT_TRUE(scene.has("/InA"));
    EXPECT_TRUE(scene.has("/Far"));
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

TEST(UsdLayers, ThatAreNotThereOrLeadOutAreNamed) {
    const UsdScene scene(
        "def Sphere \"Good\" {}\n"
        "def \"Missing\" (references = @none.usda@) {}\n"
        "def \"Out\" (references = @../../etc/passwd@) {}\n"
        "def \"Root\" (payload = @/etc/passwd@) {}\n"
        "def \"Wrong\" (references = @bad.usda@) {}\n"
        "def \"NoPrim\" (references = </Nowhere>) {}\n",
        {{"bad.usda", "#usda 1.0\ndef Sphere \"X\" {\n  double radius = \n}\n"}});
    EXPECT_TRUE(scene.has("/Good"));
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

TEST(UsdLayers, OfWhichNothingIsLeftSayWhatIsMissing) {
    for (const char* const text :
         {"def \"Missing\" (references = @none.usda@) {}\n", "#usda 1.0\n(\n subLayers = [@gone.usda@]\n)\n",
          "def \"Out\" (payload = @/etc/passwd@) {}\n"}) {
        const Scratch scratch;
        const Expected<ImportedScene> scene = importUsd(scratch.write("model.usda", usda(text)));
        ASSERT_FALSE(scene) << text;
        EXPECT_WORDS(scene.error().message);
    }
}

TEST(UsdLayers, BelowEachOtherBeyondTheBoundAreNamed) {
    std::vector<std::pair<std::string, std::string>> below;
    for (int i = 0; i < 110; ++i)
        below.emplace_back(fmt::format("c{}.usda", i),
                           fmt::format("#usda 1.0\n(\n subLayers = [@c{}.usda@]\n)\n", i + 1));
    below.emplace_back("c110.usda", "#usda 1.0\n");
    const UsdScene scene("#usda 1.0\n(\n subLayers = [@c0.usda@]\n)\ndef Sphere \"Good\" {}\n", below);
    EXPECT_TRUE(scene.has("/Good"));
    EXPECT_WORDS(scene.notes());
}

TEST(UsdLayers, AreNamedWithLineAndColumnWhereTheyAreWrong) {
    const Scratch scratch;
    for (const char* const text :
         {"#usda 1.0\ndef Sphere \"A\" {\n  double radius = big\n}\n",
          "#usda 1.0\ndef Sphere \"A\" {\n  float3 x = (1, 2)\n}\n", "#usda 1.0\ndef Sphere \"A\" {\n",
          "#usda 1.0\ndef Sphere \"A {\n", "#usda 1.0\ndef Sphere \"a/b\" {}\n", "hello"}) {
        const std::string path = scratch.write("wrong.usda", text);
        const Expected<ImportedScene> scene = importUsd(path);
        ASSERT_FALSE(scene) << text;
        EXPECT_WORDS(scene.error().message);
        EXPECT_TRUE(scene.error().message.starts_with(path)) << scene.error().message;
    }
}

}  // namespace
}  // namespace tessera
