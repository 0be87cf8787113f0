// What USD's prims look like: values that they inherit, materials that are bound, pictures and their colours, curves.
#include <fmt/format.h>

#include <cmath>

#include "common/cores/Environment.h"
#include "common/cores/Glyphs.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SubdivisionSurface.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

std::string triangle(const std::string& name, const std::string& more) {
    return "def Mesh \"" + name + "\" {" + kUsdTriangle + more + "}\n";
}

std::vector<std::uint8_t> colorsOf(const UsdScene& scene, const std::string& path) {
    const auto* geometry = scene.aspect().core<Geometry>("/model" + path);
    if (geometry == nullptr) return {};
    const auto colors = geometry->colors.as<std::uint8_t>();
    return {colors.begin(), colors.end()};
}

TEST(UsdLooks, ValuesThatAreTheSameForAllAreInherited) {
    const std::string inside = triangle("Heir", "") + triangle("Own", " color3f[] primvars:displayColor = [(0, 0, 1)]");
    const UsdScene scene(
        "def Xform \"A\" { color3f[] primvars:displayColor = [(0, 1, 0), (1, 0, 0)]\n"
        " int[] primvars:displayColor:indices = [1]\n def Scope \"S\" {\n" +
        inside + "} }\ndef Xform \"B\" { color3f[] primvars:displayColor = [(1, 0, 0)] (\n" +
        "  interpolation = \"vertex\" )\n" + inside + "}\n");
    const auto first = [&](const char* path) {
        const std::vector<std::uint8_t> colors = colorsOf(scene, path);
        return colors.empty() ? colors : std::vector<std::uint8_t>(colors.begin(), colors.begin() + 4);
    };
    EXPECT_EQ(first("/A/S/Heir"), (std::vector<std::uint8_t>{255, 0, 0, 255}));
    EXPECT_EQ(first("/A/S/Own"), (std::vector<std::uint8_t>{0, 0, 255, 255}));
    EXPECT_EQ(first("/B/Heir"), std::vector<std::uint8_t>()) << "what varies over a prim is that one's own";
}

std::string material(const std::string& name, const std::string& color) {
    return fmt::format(
        "def Material \"{0}\" {{ token outputs:surface.connect = </{0}/S.outputs:surface>\n"
        " def Shader \"S\" {{ uniform token info:id = \"UsdPreviewSurface\"\n"
        "  color3f inputs:diffuseColor = {1} }} }}\n",
        name, color);
}

TEST(UsdLooks, OfSeveralMaterialsTheOneToLookAtIsShownAndTheStrongerHolds) {
    const UsdScene scene(
        material("Red", "(1, 0, 0)") + material("Blue", "(0, 0, 1)") +
        triangle("P", " rel material:binding = </Red>\n rel material:binding:preview = </Blue>") +
        "def Xform \"X\" { rel material:binding = </Red> ( bindMaterialAs = \"strongerThanDescendants\""
        " )\n" +
        triangle("M", R"( rel material:binding = </Blue>
 def GeomSubset "S" { int[] indices = [0]
  uniform token elementType = "face"
  rel material:binding = </Blue> })") +
        "}\n" + triangle("C", " rel material:binding:collection:all = [</C.x>, </Red>]"));
    const auto colorOf = [&](const char* path) {
        const auto* geometry = scene.aspect().core<Geometry>(path);
        const auto* worn = geometry ? scene.aspect()->get<Material>(geometry->material) : nullptr;
        return worn ? Vec4f(worn->baseColor) : Vec4f(Vec4f::Zero());
    };
    EXPECT_EQ(colorOf("/model/P"), Vec4f(0, 0, 1, 1));
    EXPECT_EQ(colorOf("/model/X/M"), Vec4f(1, 0, 0, 1));
    EXPECT_WORDS(scene.notes());
}

TEST(UsdLooks, PicturesHaveTheColoursThatTheFileSays) {
    const auto texture = [](const std::string& input, const std::string& space) {
        return UsdScene(triangle("M",
                                 " texCoord2f[] primvars:map = [(0, 0), (1, 0), (0, 1)] "
                                 "(interpolation = \"vertex\")\n rel material:binding = </L>") +
                            R"(def Material "L" { token outputs:surface.connect = </L/S.outputs:surface>
 token inputs:name = "map"
 def Shader "S" { uniform token info:id = "UsdPreviewSurface"
  )" + input + R"(.connect = </L/T.outputs:rgb> }
 def Shader "T" { uniform token info:id = "UsdUVTexture"
  asset inputs:file = @grey.tga@
  token inputs:sourceColorSpace = ")" +
                            space + R"("
  float2 inputs:st.connect = </L/G.outputs:result> }
 def NodeGraph "G" { float2 outputs:result.connect = </L/G/R.outputs:result>
  def Shader "R" { uniform token info:id = "UsdPrimvarReader_float2"
   token inputs:varname.connect = </L.inputs:name> } } })",
                        {{"grey.tga", pictureOf({{128, 128, 128, 255}})}});
    };
    const auto red = [](const UsdScene& scene) {
        const auto images = scene.all<Image>();
        return images.size() == 1 ? int{images.front()->pixels.as<std::uint8_t>()[0]} : -1;
    };
    EXPECT_EQ(red(texture("color3f inputs:diffuseColor", "sRGB")), 128);
    EXPECT_EQ(red(texture("color3f inputs:diffuseColor", "raw")), 188) << "linear ones, in sRGB";
    EXPECT_EQ(red(texture("normal3f inputs:normal", "raw")), 128);
    EXPECT_EQ(red(texture("normal3f inputs:normal", "sRGB")), 55) << "sRGB, made linear";
    const UsdScene scene = texture("color3f inputs:diffuseColor", "auto");
    ASSERT_EQ(scene.all<Geometry>().size(), 1u);
    EXPECT_EQ(scene.all<Geometry>().front()->texcoords.sizeBytes() / 8, 3u) << "by the primvar that the graph names";
}

TEST(UsdLooks, OpacitiesHaveTheScaleOfTheirChannel) {
    const auto colorWith = [](const std::string& color, const std::string& opacity) {
        const UsdScene scene(triangle("M",
                                      " texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1)] "
                                      "(interpolation = \"vertex\")\n rel material:binding = </L>") +
                                 R"(def Material "L" { token outputs:surface.connect = </L/S.outputs:surface>
 def Shader "S" { uniform token info:id = "UsdPreviewSurface"
  color3f inputs:diffuseColor.connect = )" +
                                 color + "\n  float inputs:opacity.connect = " + opacity + R"( }
 def Shader "T" { uniform token info:id = "UsdUVTexture"
  asset inputs:file = @a.tga@
  float4 inputs:scale = (1, 0.5, 1, 0.25)
  float2 inputs:st.connect = </L/R.outputs:result> }
 def Shader "R" { uniform token info:id = "UsdPrimvarReader_float2"
  string inputs:varname = "st" } })",
                             {{"a.tga", pictureOf({{128, 64, 32, 200}})}});
        const auto materials = scene.all<Material>();
        return materials.size() == 1 ? Vec4f(materials.front()->baseColor) : Vec4f(Vec4f::Zero());
    };
    EXPECT_EQ(colorWith("</L/T.outputs:rgb>", "</L/T.outputs:a>"), Vec4f(1, 0.5f, 1, 0.25f));
    EXPECT_EQ(colorWith("</L/T.outputs:rgb>", "</L/T.outputs:g>"), Vec4f(1, 0.5f, 1, 0.5f));
}

TEST(UsdLooks, ShapesHaveTwoRadiiAndPlanesTheirWidthAcross) {
    const auto size = [](const std::string& prim) { return UsdScene("def " + prim).bounds().size(); };
    expectNear(size("Plane \"A\" { uniform token axis = \"X\"\n double width = 4\n double length = 6 }"),
               Vec3d(0, 6, 4));
    expectNear(size("Plane \"A\" { uniform token axis = \"Y\"\n double width = 4\n double length = 6 }"),
               Vec3d(4, 0, 6));
    const UsdScene plane("def Plane \"A\" {}");
    ASSERT_EQ(plane.all<Material>().size(), 1u);
    EXPECT_TRUE(plane.all<Material>().front()->doubleSided);
    const std::vector<Vec3d> c =
        UsdScene("def Cylinder_1 \"A\" { double radiusBottom = 2\n double radiusTop = 1\n double height = 3 }")
            .corners();
    double volume = 0;
    for (std::size_t i = 0; i + 2 < c.size(); i += 3) volume += c[i].dot(c[i + 1].cross(c[i + 2])) / 6;
    EXPECT_NEAR(volume, std::numbers::pi * 3 / 3 * (4 + 2 + 1), 0.3) << "a frustum, closed and facing outwards";
}

/// Of a BasisCurves' lines: its vertices.
std::vector<Vec3d> curve(const std::string& says, std::size_t* lines = nullptr) {
    const UsdScene scene("def BasisCurves \"C\" { " + says + " }\ndef Sphere \"S\" {}\n");
    const auto* geometry = scene.aspect().core<Geometry>("/model/C");
    std::vector<Vec3d> out;
    if (geometry == nullptr) return out;
    const auto xyz = geometry->positions.as<float>();
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) out.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
    if (lines != nullptr) *lines = geometry->indices.sizeBytes() / 8;
    return out;
}

TEST(UsdLooks, CubicCurvesAreLinesAlongThem) {
    const std::string four =
        "int[] curveVertexCounts = [4]\n point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]";
    const std::vector<Vec3d> bezier = curve("uniform token basis = \"bezier\"\n" + four);
    ASSERT_EQ(bezier.size(), 13u);
    expectNear(bezier.front(), Vec3d(0, 0, 0));
    expectNear(bezier[6], Vec3d(0.75, 0.5, 0));
    expectNear(bezier.back(), Vec3d(0, 1, 0));
    const std::vector<Vec3d> spline = curve("uniform token basis = \"bspline\"\n" + four);
    ASSERT_EQ(spline.size(), 13u);
    expectNear(spline.front(), Vec3d(5.0 / 6, 1.0 / 6, 0));
    const std::vector<Vec3d> through = curve("uniform token basis = \"catmullRom\"\n" + four);
    ASSERT_EQ(through.size(), 13u);
    expectNear(through.front(), Vec3d(1, 0, 0));
    expectNear(through.back(), Vec3d(1, 1, 0));
    for (const char* basis : {"bspline", "catmullRom"}) {
        const std::vector<Vec3d> pinned =
            curve(fmt::format("uniform token basis = \"{}\"\nuniform token wrap = \"pinned\"\n", basis) + four);
        ASSERT_EQ(pinned.size(), 3u * 12 + 1) << basis;
        expectNear(pinned.front(), Vec3d(0, 0, 0));
        expectNear(pinned.back(), Vec3d(0, 1, 0));
    }
    std::size_t lines = 0;
    const std::vector<Vec3d> ring =
        curve("uniform token basis = \"bspline\"\nuniform token wrap = \"periodic\"\n" + four, &lines);
    EXPECT_EQ(ring.size(), 4u * 12);
    EXPECT_EQ(lines, 4u * 12) << "closed";
}

TEST(UsdLooks, ColoursOfCurvesFollowThem) {
    const auto colors = [](const std::string& more) {
        return colorsOf(UsdScene(R"(def BasisCurves "C" { uniform token type = "linear"
 int[] curveVertexCounts = [2, 2]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
 color3f[] primvars:displayColor = [)" +
                                 more + "\n}"),
                        "/C");
    };
    std::vector<std::uint8_t> made = colors("(1, 0, 0), (0, 0, 1)] (interpolation = \"uniform\")");
    ASSERT_EQ(made.size(), 16u);
    EXPECT_EQ(made[4], 255);
    EXPECT_EQ(made[8], 0) << "the second curve has a colour of its own";
    EXPECT_EQ(made[10], 255);
    made = colors("(1, 0, 0), (0, 0, 1), (0, 1, 0), (1, 1, 1)] (interpolation = \"varying\")");
    ASSERT_EQ(made.size(), 16u);
    EXPECT_EQ(made[4], 0);
    EXPECT_EQ(made[9], 255);
}

TEST(UsdLooks, MatricesWithAWeightAreDividedByIt) {
    const auto corner = [](const std::string& last) {
        return UsdScene(
                   "def Xform \"X\" { matrix4d xformOp:transform = ((2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (4, 0, "
                   "0, " +
                   last + "))\n uniform token[] xformOpOrder = [\"xformOp:transform\"]\n" + triangle("M", "") + "}")
            .corners()
            .front();
    };
    expectNear(corner("1"), Vec3d(4, 0, 0));
    expectNear(corner("2"), Vec3d(2, 0, 0));
}

TEST(UsdLooks, InvisibleDomesShineNot) {
    const UsdScene scene(
        "def Sphere \"S\" {}\ndef Xform \"X\" { token visibility = \"invisible\"\n"
        " def DomeLight \"D\" {} }\n");
    EXPECT_TRUE(scene.all<Environment>().empty());
    EXPECT_WORDS(scene.notes());
}

TEST(UsdLooks, SmoothSurfacesThatStandOftenAreOne) {
    std::string text =
        "class Mesh \"Smooth\" { int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n"
        " point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)] }\n";
    for (int i = 0; i < 20; ++i) text += fmt::format("def \"P{}\" (inherits = </Smooth>) {{}}\n", i);
    const UsdScene scene(text);
    EXPECT_EQ(scene.all<SubdivisionSurface>().size(), 1u);
    EXPECT_EQ(scene.scene().triangles, 20 * scene.scene().trianglesStored);
    EXPECT_TRUE(scene.has("/P19"));
}

TEST(UsdLooks, GlyphsCountAsWhatTheyShow) {
    std::string indices, positions;
    for (int i = 0; i < 20'000; ++i) {
        indices += "0,";
        positions += fmt::format("({}, 0, 0),", i);
    }
    const UsdScene scene("def PointInstancer \"I\" {\n int[] protoIndices = [" + indices +
                         "]\n point3f[] positions = [" + positions + "]\n rel prototypes = [</I/P>]\n" +
                         triangle("P", "") + "}\n");
    ASSERT_EQ(scene.all<Glyphs>().size(), 1u);
    EXPECT_EQ(scene.scene().triangles, 20'000u);
}

}  // namespace
}  // namespace tessera
