// What USD's specification says of strength: lists over layers, classes, variants, times, specifiers, and what a person
// chooses.
#include <fmt/format.h>

#include "common/cores/Animation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

/// The radius of a sphere at this path; 0: there is none.
double radiusAt(const UsdScene& scene, const std::string& path) {
    const auto* geometry = scene.aspect().core<Geometry>("/model" + path);
    return geometry == nullptr ? 0.0 : boundsOf(geometry->positions.as<float>()).upper.y();
}

std::vector<std::string> childrenOf(const UsdScene& scene, const std::string& path) {
    std::vector<std::string> names;
    const auto node = findNode(*scene.aspect(), "/model" + path);
    if (node)
        for (const ObjectId child : scene.aspect()->get<Node>(*node)->children)
            names.push_back(scene.aspect()->get<Node>(child)->name);
    return names;
}

TEST(UsdStrength, ListsOverLayersAreAddedToTakenFromAndOrdered) {
    // Of what the weak layer refers to the strong one takes one away, adds one that counts first, one that counts
    // last, and one that is there already and stays where it is.
    const std::string strong = R"(
over "A" (
    delete references = @b.usda@</B>
    prepend references = @first.usda@</B>
    append references = @last.usda@</B>
    add references = @c.usda@</B>
) {}
over "Ordered" ( reorder references = [@c.usda@</B>, @b.usda@</B>] ) {}
)";
    const std::string weak = R"(
def Xform "A" ( prepend references = [@b.usda@</B>, @c.usda@</B>] ) {}
def Xform "Ordered" ( prepend references = [@b.usda@</B>, @c.usda@</B>, @b.usda@</B>] ) {}
)";
    const auto layer = [](const char* own, double size) {
        return fmt::format("def Xform \"B\" {{ def Sphere \"S\" {{ double radius = {} }} def Xform \"{}\" {{}} }}",
                           size, own);
    };
    const UsdScene scene("#usda 1.0\n(\n metersPerUnit = 1\n subLayers = [@sub/strong.usda@, @sub/weak.usda@]\n)\n",
                         {{"sub/strong.usda", strong},
                          {"sub/weak.usda", weak},
                          {"sub/b.usda", layer("InB", 2)},
                          {"sub/c.usda", layer("InC", 3)},
                          {"sub/first.usda", layer("InFirst", 4)},
                          {"sub/last.usda", layer("InLast", 5)}});
    EXPECT_NEAR(radiusAt(scene, "/A/S"), 4, 0.05) << "what is prepended is the strongest";
    EXPECT_FALSE(scene.has("/A/InB")) << "deleted, though another layer names it";
    EXPECT_EQ(childrenOf(scene, "/A"), (std::vector<std::string>{"S", "InLast", "InC", "InFirst"}));
    EXPECT_NEAR(radiusAt(scene, "/Ordered/S"), 3, 0.05);
    EXPECT_EQ(childrenOf(scene, "/Ordered"), (std::vector<std::string>{"S", "InB", "InC"})) << "each once";
}

TEST(UsdStrength, ChildrenStandInTheOrderThatLayersSay) {
    const UsdScene scene(R"(
def Xform "P" {
    reorder nameChildren = ["C", "A"]
    def Xform "A" {}
    def Xform "B" {}
    def Sphere "C" {}
}
)");
    EXPECT_EQ(childrenOf(scene, "/P"), (std::vector<std::string>{"C", "A", "B"}));
}

TEST(UsdStrength, ReferencesOfASublayerHaveItsTimes) {
    const UsdScene scene(
        "#usda 1.0\n(\n metersPerUnit = 1\n timeCodesPerSecond = 10\n subLayers = [@sub.usda@ (offset = 5; scale = "
        "2)]\n"
        ")\ndef Xform \"Fix\" { double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 1: (1, 0, 0) }\n"
        " uniform token[] xformOpOrder = [\"xformOp:translate\"]\n def Sphere \"S\" {} }\n",
        {{"sub.usda",
          "#usda 1.0\n(\n timeCodesPerSecond = 10\n)\ndef \"A\" (references = @moving.usda@</M> (offset = 1)) {}"},
         {"moving.usda", R"(#usda 1.0
(
    timeCodesPerSecond = 10
)
def Xform "M" { double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (1, 0, 0) }
 uniform token[] xformOpOrder = ["xformOp:translate"]
 def Sphere "S" {} })"}});
    std::vector<double> lasts;
    for (const KeyFrames* frames : scene.all<KeyFrames>()) lasts.push_back(frames->times.as<double>().back());
    std::ranges::sort(lasts);
    // (10 + 1) · 2 + 5 codes of ten a second.
    EXPECT_EQ(lasts, (std::vector<double>{0.1, 2.7}));
}

TEST(UsdStrength, VariantSetsCountInTheirNamesOrder) {
    const auto chosen = [](const std::string& names) {
        return radiusAt(
            UsdScene("def Sphere \"A\" (variants = { string a = \"x\"\n string b = \"x\" }\n" + names + R"() {
    variantSet "a" = { "x" { double radius = 2 } }
    variantSet "b" = { "x" { double radius = 3 } }
})"),
            "/A");
    };
    EXPECT_NEAR(chosen("variantSets = [\"b\", \"a\"]"), 3, 0.05);
    EXPECT_NEAR(chosen("variantSets = [\"a\", \"b\"]"), 2, 0.05);
    EXPECT_NEAR(chosen("variantSets = [\"b\"]"), 3, 0.05) << "a set that is not named does not count";
    EXPECT_NEAR(chosen(""), 1, 0.05);
}

TEST(UsdStrength, AClassMakesNoClassOfWhoInheritsIt) {
    const UsdScene scene(R"(
class "Round" { double radius = 2 }
over "A" (inherits = </Round> references = @far.usda@</Far>) {}
class "B" (references = @far.usda@</Far>) {}
)",
                         {{"far.usda", "def Sphere \"Far\" {}"}});
    EXPECT_NEAR(radiusAt(scene, "/A"), 2, 0.05);
    EXPECT_FALSE(scene.has("/B"));
}

TEST(UsdStrength, ClassesOfReferencedFilesCanBeOverriddenHere) {
    const UsdScene scene(R"(
class "_class_Ball" { double radius = 3 }
def "A" (references = @ball.usda@</Ball>) {}
def "B" (references = @ball.usda@</Ball>) { double radius = 5 }
def "C" (references = @inner.usda@</Inner>) { over "_class_Part" { double radius = 7 } }
def "D" (references = @twice.usda@</Twice>) {}
)",
                         {{"ball.usda",
                           "class \"_class_Ball\" { double radius = 2 }\n"
                           "def Sphere \"Ball\" (inherits = </_class_Ball>) {}"},
                          {"inner.usda",
                           "def Xform \"Inner\" { class \"_class_Part\" { double radius = 2 }\n"
                           " def Sphere \"Part\" (inherits = </Inner/_class_Part>) {} }"},
                          {"twice.usda", "def \"Twice\" (references = @ball.usda@</Ball>) {}"}});
    EXPECT_NEAR(radiusAt(scene, "/A"), 3, 0.05) << "a class of the whole file has the same name here";
    EXPECT_NEAR(radiusAt(scene, "/B"), 5, 0.05) << "what is said here is stronger";
    EXPECT_NEAR(radiusAt(scene, "/C/Part"), 7, 0.05) << "one within the prim is named as the prim is here";
    EXPECT_NEAR(radiusAt(scene, "/D"), 3, 0.05) << "through two files";
}

TEST(UsdStrength, WhatIsSpecializedIsAsWeakAsWhoSaysIt) {
    const UsdScene scene(R"(
class "_c" { double radius = 3 }
class "_d" { double radius = 9 }
class "_e" { double radius = 4 }
def "A" (references = @ball.usda@</Ball>) {}
def "E" (specializes = </_d> references = @ball.usda@</Ball>) {}
def "N" (references = @nest.usda@</N>) {}
def "V" (references = @var.usda@</V>) {}
)",
                         {{"ball.usda",
                           "class \"_c\" { double radius = 2 }\n"
                           "def Sphere \"Ball\" (specializes = </_c>) {}"},
                          {"nest.usda", "def Xform \"N\" { def \"I\" (references = @ball.usda@</Ball>) {} }"},
                          {"var.usda",
                           "class \"_e\" { double radius = 1 }\n"
                           "def Sphere \"V\" (variants = { string s = \"a\" } variantSets = \"s\") {\n"
                           " variantSet \"s\" = { \"a\" (inherits = </_e>) { double radius = 2 } } }"}});
    EXPECT_NEAR(radiusAt(scene, "/A"), 3, 0.05);
    EXPECT_NEAR(radiusAt(scene, "/E"), 3, 0.05) << "what a reference specializes is before what the prim does";
    EXPECT_NEAR(radiusAt(scene, "/N/I"), 3, 0.05);
    EXPECT_NEAR(radiusAt(scene, "/V"), 4, 0.05) << "a class that a variant inherits is before the variant's reference";
}

TEST(UsdStrength, NothingInAnInstanceIsOverridden) {
    const UsdScene scene(R"(
class Xform "Lib" { def Sphere "S" {} }
def Xform "A" (instanceable = true references = </Lib>) { over "S" { double radius = 9 } def Sphere "More" {} }
def Xform "B" (references = </Lib>) { over "S" { double radius = 9 } }
def Xform "C" (instanceable = true) { def Sphere "S" { double radius = 9 } }
)");
    EXPECT_NEAR(radiusAt(scene, "/A/S"), 1, 0.05);
    EXPECT_FALSE(scene.has("/A/More"));
    EXPECT_NEAR(radiusAt(scene, "/B/S"), 9, 0.1);
    EXPECT_NEAR(radiusAt(scene, "/C/S"), 9, 0.1) << "without arcs it is no instance";
}

TEST(UsdStrength, PurposesAreInheritedUnlessAPrimHasItsOwn) {
    const UsdScene scene(R"(
def Xform "P" { uniform token purpose = "proxy"
 def Sphere "S" {}
 def Xform "X" { def Sphere "D" { uniform token purpose = "default" } }
 def Sphere "R" { uniform token purpose = "render" } }
def Xform "Q" { uniform token purpose = "guide"
 def Sphere "S" {} }
)");
    EXPECT_NEAR(radiusAt(scene, "/P/X/D"), 1, 0.05);
    EXPECT_NEAR(radiusAt(scene, "/P/R"), 1, 0.05);
    EXPECT_FALSE(findNode(*scene.aspect(), "/model/P/S") && radiusAt(scene, "/P/S") > 0);
    EXPECT_FALSE(scene.has("/Q"));
    EXPECT_WORDS(scene.notes());
}

TEST(UsdStrength, FilesInOtherUnitsAreNamed) {
    const UsdScene scene(
        "def \"A\" (references = @far.usda@</Far>) {}\n",
        {{"far.usda", "#usda 1.0\n(\n metersPerUnit = 0.01\n upAxis = \"Z\"\n)\ndef Sphere \"Far\" {}"}});
    EXPECT_WORDS(scene.notes());
}

TEST(UsdStrength, APersonChoosesVariants) {
    const Scratch scratch;
    scratch.write("far.usda",
                  usda("def Xform \"Far\" (variants = { string size = \"small\" } variantSets = \"size\") {\n"
                       " variantSet \"size\" = { \"small\" { def Sphere \"Small\" {} }\n"
                       "  \"large\" (variantSets = \"color\") { def Sphere \"Large\" {}\n"
                       "   variantSet \"color\" = { \"red\" { def Sphere \"Red\" {} } } } } }"));
    const std::string path = scratch.write("model.usda", usda("def Xform \"World\" {\n"
                                                              " def \"A\" (references = @far.usda@</Far>) {}\n"
                                                              " def \"B\" (references = @far.usda@</Far>) {} }\n"));
    const auto read = [&](const std::vector<std::string>& variants, bool placed) {
        ImportOptions options = importOptions();
        if (placed)
            options.placing = Placing{.variants = variants};
        else
            options.variants = variants;
        return importScene(path, kRootNode, options);
    };
    for (const bool placed : {false, true}) {
        Expected<ImportedScene> scene = read({"/World/A:size=large", "/World/A:color=red"}, placed);
        ASSERT_TRUE(scene) << messageOf(scene);
        const ImportedAspect aspect(std::move(*scene));
        for (const char* there : {"/A/Large", "/A/Red", "/B/Small"})
            EXPECT_TRUE(findNode(*aspect, std::string("/model/World") + there)) << there;
        EXPECT_FALSE(findNode(*aspect, "/model/World/A/Small"));
        EXPECT_FALSE(findNode(*aspect, "/model/World/B/Large")) << "of one prim alone";
    }
    for (const char* const said :
         {"/World/C:size=large", "/World/A:shape=large", "/World/A:size=huge", "/World:size=huge"}) {
        const Expected<ImportedScene> scene = read({said}, false);
        ASSERT_FALSE(scene) << said;
        EXPECT_EQ(scene.error().code, ErrorCode::kNotFound) << said;
        EXPECT_WORDS(scene.error().message);
    }
    EXPECT_FALSE(read({"size=large"}, true)) << "that is no variant of a prim";
    ImportOptions options = importOptions();
    options.variants = {"/A:b=c"};
    const Expected<ImportedScene> other = importScene(kEngine, kRootNode, options);
    ASSERT_TRUE(other) << messageOf(other);
    EXPECT_WORDS(notesIn(*other));
}

}  // namespace
}  // namespace tessera
