// What USD's prims become: shapes, meshes and their values, places, materials, lights, motion.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Environment.h"
#include "common/cores/Glyphs.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SpotLight.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/Switch.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/GlyphArrays.h"
#include "common/geometry/MeshCopies.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

std::string xform(const std::string& ops, const std::string& order, const std::string& inside) {
    return "def Xform \"X\" {\n" + ops + "\n uniform token[] xformOpOrder = [" + order + "]\n" + inside + "\n}\n";
}

TEST(UsdPlace, IsTheProductOfItsOperationsInTheirOrder) {
    const UsdScene scene(xform(R"( double3 xformOp:translate = (1, 2, 3)
 float3 xformOp:rotateXYZ = (90, 0, 90)
 double3 xformOp:translate:pivot = (0, 0, 1)
 float3 xformOp:scale = (2, 1, 1))",
                               R"("xformOp:translate", "xformOp:translate:pivot", "xformOp:rotateXYZ", "xformOp:scale",
 "!invert!xformOp:translate:pivot")",
                               "def Mesh \"M\" {" + kUsdTriangle + "}"));
    // (1, 0, 0) - pivot = (1, 0, -1); scaled (2, 0, -1); about X (2, 1, 0); about Z (-1, 2, 0); + pivot, moved.
    const std::vector<Vec3d> corners = scene.corners();
    ASSERT_EQ(corners.size(), 3u);
    expectNear(corners[1], Vec3d(0, 4, 4));
}

TEST(UsdPlace, OfAMatrixIsForRowVectorsAndAResetForgetsTheParents) {
    const UsdScene scene(xform(" double3 xformOp:translate = (100, 0, 0)", "\"xformOp:translate\"",
                               "def Mesh \"M\" {" + kUsdTriangle + R"(
 matrix4d xformOp:transform = ((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1))
 uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:transform"] })"));
    const std::vector<Vec3d> corners = scene.corners();
    ASSERT_EQ(corners.size(), 3u);
    expectNear(corners[0], Vec3d(5, 6, 7));
    expectNear(corners[1], Vec3d(5, 7, 7));
    expectNear(corners[2], Vec3d(4, 6, 7));
}

TEST(UsdPlace, FollowsUnitAndUpAxis) {
    const Scratch scratch;
    const std::string body = "def Cube \"C\" { double size = 200 }\n";
    const auto read = [&](const std::string& head) {
        Expected<ImportedScene> scene =
            importUsd(scratch.write("model.usda", "#usda 1.0\n(\n" + head + "\n)\n" + body));
        EXPECT_TRUE(scene) << messageOf(scene);
        Box box;
        const bool said = scene && hasNote(*scene, "does not say its unit");
        const ImportedAspect aspect(scene ? std::move(*scene) : ImportedScene());
        for (const Vec3d& corner : shownCorners(*aspect)) box.extend(corner);
        return std::pair(box.size().x(), said);
    };
    EXPECT_EQ(read("metersPerUnit = 0.01").first, 2);
    EXPECT_FALSE(read("metersPerUnit = 1").second);
    const auto [unsaid, noted] = read("upAxis = \"Z\"");
    EXPECT_EQ(unsaid, 2) << "centimetres";
    EXPECT_TRUE(noted);
    EXPECT_EQ(read("metersPerUnit = -1").first, 200);
    // A file that is placed stands +Y up.
    ImportOptions options = importOptions();
    options.placing.emplace();
    Expected<ImportedScene> scene = importScene(scratch.write("model.usda",
                                                              "#usda 1.0\n(\n metersPerUnit = 1\n upAxis = \"Z\"\n)\n"
                                                              "def Cylinder \"C\" { double height = 10 }\n"),
                                                kRootNode, options);
    ASSERT_TRUE(scene) << messageOf(scene);
    Box box;
    const ImportedAspect aspect(std::move(*scene));
    for (const Vec3d& corner : shownCorners(*aspect)) box.extend(corner);
    EXPECT_NEAR(box.size().y(), 10, 1e-4);
}

TEST(UsdMesh, HasValuesPerFaceVertexAndCorner) {
    const UsdScene scene(R"(
def Mesh "M" {
    int[] faceVertexCounts = [4, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 2, 2, 4, 1]
    int[] holeIndices = [2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)]
    normal3f[] normals = [(0, 0, 1)] ( interpolation = "constant" )
    texCoord2f[] primvars:st = [(0, 0), (0.5, 0.25)] ( interpolation = "faceVarying" )
    int[] primvars:st:indices = [0, 1, 1, 0, 1, 1, 1, 0, 0, 0]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] ( interpolation = "uniform" )
    uniform token subdivisionScheme = "none"
}
)");
    const auto meshes = scene.all<Geometry>();
    ASSERT_EQ(meshes.size(), 1u);
    const Geometry& mesh = *meshes.front();
    EXPECT_EQ(mesh.indices.sizeBytes() / 12, 3u) << "two of the quad, one triangle; the hole is none";
    // The quad's four corners, and the triangle's three in another colour.
    EXPECT_EQ(mesh.positions.sizeBytes() / 12, 7u);
    const auto colors = mesh.colors.as<std::uint8_t>();
    EXPECT_EQ(std::vector<std::uint8_t>(colors.begin(), colors.begin() + 4),
              (std::vector<std::uint8_t>{255, 0, 0, 255}));
    EXPECT_EQ(colors[4 * 4 + 1], 255);
    EXPECT_EQ(mesh.texcoords.sizeBytes(), 0u) << "nobody has a texture";
}

TEST(UsdMesh, TurnsFacesOfLeftHandedOnes) {
    const auto normal = [](const UsdScene& scene) {
        const std::vector<Vec3d> c = scene.corners();
        return c.size() < 3 ? Vec3d(Vec3d::Zero()) : Vec3d((c[1] - c[0]).cross(c[2] - c[0]));
    };
    EXPECT_GT(normal(UsdScene("def Mesh \"M\" {" + kUsdTriangle + "}")).z(), 0);
    EXPECT_LT(normal(UsdScene("def Mesh \"M\" {" + kUsdTriangle + "uniform token orientation = \"leftHanded\" }")).z(),
              0);
}

TEST(UsdMesh, OfSubdivisionIsASmoothSurfaceWhereItCanBeOne) {
    const std::string cube = R"(
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 2, 3, 5, 4, 4, 5, 7, 6, 6, 7, 1, 0, 1, 7, 5, 3, 6, 0, 2, 4]
    point3f[] points = [(-1, -1, 1), (1, -1, 1), (-1, 1, 1), (1, 1, 1), (-1, 1, -1), (1, 1, -1),
        (-1, -1, -1), (1, -1, -1)]
    int[] creaseIndices = [0, 1, 3]
    int[] creaseLengths = [3]
    float[] creaseSharpnesses = [2.5]
    int[] cornerIndices = [6]
    float[] cornerSharpnesses = [10]
)";
    const UsdScene smooth("def Mesh \"M\" {" + cube + "}");
    const auto surfaces = smooth.all<SubdivisionSurface>();
    ASSERT_EQ(surfaces.size(), 1u);
    EXPECT_EQ(surfaces.front()->scheme, SubdivisionSurface::kCatmullClark);
    EXPECT_EQ(surfaces.front()->boundary, SubdivisionSurface::kEdgeAndCorner);
    EXPECT_EQ(surfaces.front()->creases.sizeBytes() / 8, 2u);
    EXPECT_EQ(surfaces.front()->corners.sizeBytes() / 4, 1u);
    const UsdScene colored("def Mesh \"M\" {" + cube + "color3f[] primvars:displayColor = [(1, 0, 0)] }");
    EXPECT_TRUE(colored.all<SubdivisionSurface>().empty());
    EXPECT_WORDS(colored.notes());
    EXPECT_EQ(colored.corners().size(), 36u);
}

TEST(UsdShapes, AreAsLargeAsTheySayAlongTheirAxes) {
    const auto size = [](const std::string& prim) { return UsdScene("def " + prim).bounds().size(); };
    expectNear(size("Cube \"A\" {}"), Vec3d(2, 2, 2));
    expectNear(size("Sphere \"A\" {}"), Vec3d(2, 2, 2), 0.02);
    expectNear(size("Cylinder \"A\" { uniform token axis = \"X\"\n double height = 6 }"), Vec3d(6, 2, 2), 0.02);
    expectNear(size("Cone \"A\" { double height = 5 }"), Vec3d(2, 2, 5), 0.02);
    expectNear(size("Capsule \"A\" { uniform token axis = \"Y\" }"), Vec3d(1, 2, 1), 0.02);
    expectNear(size("Plane \"A\" { double width = 4\n double length = 6 }"), Vec3d(4, 6, 0), 1e-5);
    for (const char* prim : {"Cone \"A\" {}", "Capsule \"A\" {}"}) {
        // Closed, and facing outwards: the volume says so.
        const std::vector<Vec3d> c = UsdScene(std::string("def ") + prim).corners();
        double volume = 0;
        for (std::size_t i = 0; i + 2 < c.size(); i += 3) volume += c[i].dot(c[i + 1].cross(c[i + 2])) / 6;
        const double exact = prim[1] == 'o' ? std::numbers::pi * 2 / 3 : std::numbers::pi * (0.25 + 0.5 / 3);
        EXPECT_NEAR(volume, exact, 0.02 * exact) << prim;
    }
}

TEST(UsdShapes, OfPointsAndLinesAreThese) {
    const UsdScene scene(R"(
def Points "P" { point3f[] points = [(0, 0, 0), (1, 0, 0)]
 float[] widths = [0.5] (interpolation = "constant") }
def BasisCurves "C" { uniform token type = "linear"
 int[] curveVertexCounts = [3, 2]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1)] }
def BasisCurves "Cubic" { int[] curveVertexCounts = [4]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 1)] }
def NurbsPatch "N" {}
def Skeleton "Bones" {}
def Sphere "Guide" { uniform token purpose = "guide" }
)");
    const auto* points = scene.aspect().core<Geometry>("/model/P");
    ASSERT_NE(points, nullptr);
    EXPECT_EQ(points->primitive, Geometry::kPoints);
    EXPECT_DOUBLE_EQ(points->pointRadius, 0.25);
    const auto* lines = scene.aspect().core<Geometry>("/model/C");
    ASSERT_NE(lines, nullptr);
    EXPECT_EQ(lines->primitive, Geometry::kLines);
    EXPECT_EQ(lines->indices.sizeBytes() / 8, 3u);
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

TEST(UsdInstancer, PlacesPrototypesThatShareTheirMesh) {
    const UsdScene scene(R"(
def PointInstancer "I" {
    int[] protoIndices = [0, 1, 0, 0]
    point3f[] positions = [(0, 0, 0), (10, 0, 0), (20, 0, 0), (30, 0, 0)]
    quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (0.7071, 0, 0, 0.7071), (1, 0, 0, 0)]
    float3[] scales = [(1, 1, 1), (1, 1, 1), (2, 1, 1), (1, 1, 1)]
    int64[] invisibleIds = [3]
    rel prototypes = [</I/Protos/A>, </I/Protos/B>]
    over "Protos" {
        over "A" (references = </Lib/Box>) {}
        def Cube "B" { double size = 4 }
    }
}
class "Lib" { def Cube "Box" { double size = 2 } }
)");
    EXPECT_EQ(scene.all<Geometry>().size(), 2u) << "shared";
    EXPECT_EQ(scene.corners().size(), 3u * 36u) << "the prototypes themselves are not shown";
    // Turned about Z by a right angle: its doubled side lies along Y.
    expectNear(scene.bounds().upper, Vec3d(21, 2, 2), 1e-2);
    expectNear(scene.bounds().lower, Vec3d(-1, -2, -2), 1e-2);
}

TEST(UsdInstancer, MayStandInAPrototypeOfAnother) {
    const UsdScene scene(R"(
def PointInstancer "Forest" {
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (100, 0, 0)]
    rel prototypes = [</Forest/Tree>]
    def Xform "Tree" {
        def Cube "Trunk" { double size = 2 }
        def PointInstancer "Leaves" {
            int[] protoIndices = [0, 0, 0]
            point3f[] positions = [(0, 10, 0), (0, 20, 0), (0, 30, 0)]
            rel prototypes = [</Forest/Tree/Leaves/Leaf>]
            def Cube "Leaf" { double size = 1 }
        }
    }
}
)");
    EXPECT_EQ(scene.corners().size(), 2u * 4u * 36u) << "two trees of a trunk and three leaves";
    expectNear(scene.bounds().upper, Vec3d(101, 30.5, 1), 1e-6);
    expectNear(scene.bounds().lower, Vec3d(-1, -1, -1), 1e-6);
}

TEST(UsdInstancer, OfVeryManyPlacesOfASmallMeshIsGlyphs) {
    std::string indices, positions, scales;
    for (int i = 0; i < 20'000; ++i) {
        indices += "0,";
        positions += fmt::format("({}, 0, 0),", i);
        scales += i % 2 == 0 ? "(1, 1, 1)," : "(1, 2, 3),";
    }
    const UsdScene scene("def PointInstancer \"I\" {\n int[] protoIndices = [" + indices +
                         "]\n point3f[] positions = [" + positions + "]\n float3[] scales = [" + scales +
                         "]\n rel prototypes = [</I/P>]\n def Cube \"P\" { double size = 0.5 } }\n");
    const auto glyphs = scene.all<Glyphs>();
    ASSERT_EQ(glyphs.size(), 1u);
    EXPECT_EQ(glyphs.front()->positions.sizeBytes() / 12, 10'000u);
    EXPECT_TRUE(glyphs.front()->turns.empty());
    EXPECT_EQ(scene.all<Geometry>().size(), 1u) << "those that no glyph can stand for share a mesh";
    EXPECT_TRUE(scene.has("/I/instance 1"));
    EXPECT_FALSE(scene.has("/I/instance 2"));
}

/// Trees of two meshes, turned freely, higher or wider or slimmer: each corner of each where USD's formula puts it.
TEST(UsdInstancer, GlyphsStandAsTheirPlacesSay) {
    constexpr std::size_t kPlaces = 12'000;
    Random random(11);
    const auto number = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    std::string indices, positions, scales, orientations;
    std::vector<Quatd> turns;
    std::vector<Vec3d> sizes;
    for (std::size_t i = 0; i < kPlaces; ++i) {
        indices += "0,";
        positions += fmt::format("({}, {}, 0),", i, i % 7);
        turns.push_back(Quatd(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1)).normalized());
        const Vec4d q = turns.back().coeffs();
        orientations += fmt::format("({}, {}, {}, {}),", q[3], q[0], q[1], q[2]);
        const double size = static_cast<float>(number(0.5, 2)), odd = static_cast<float>(number(0.5, 2));
        sizes.push_back(Vec3d::Constant(size));
        if (i % 4 < 3) sizes.back()[static_cast<Eigen::Index>(i % 4)] = odd;
        scales += fmt::format("({}, {}, {}),", sizes[i].x(), sizes[i].y(), sizes[i].z());
    }
    const auto mesh = [](const char* name, const std::string& points, const char* place) {
        return fmt::format(
            "def Mesh \"{}\" {{ int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n "
            "uniform token subdivisionScheme = \"none\"\n point3f[] points = [{}]\n {} }}\n",
            name, points, place);
    };
    const UsdScene scene(
        "def PointInstancer \"I\" {\n int[] protoIndices = [" + indices + "]\n point3f[] positions = [" + positions +
        "]\n quatf[] orientationsf = [" + orientations + "]\n float3[] scales = [" + scales +
        "]\n rel prototypes = [</I/P>]\n def Xform \"P\" {\n" + mesh("Trunk", "(0, 0, 0), (1, 0, 0), (0, 1, 0)", "") +
        mesh("Leaves", "(0, 0, 0), (2, 0, 0), (0, 0, 3)",
             "double3 xformOp:translate = (0, 5, 0)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]") +
        "} }\n");
    EXPECT_TRUE(scene.all<Geometry>().empty());
    const std::array<std::array<Vec3d, 3>, 2> parts = {
        std::array<Vec3d, 3>{Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 1, 0)},
        std::array<Vec3d, 3>{Vec3d(0, 5, 0), Vec3d(2, 5, 0), Vec3d(0, 5, 3)}};
    std::array<std::size_t, 2> seen{};
    for (const Glyphs* glyphs : scene.all<Glyphs>()) {
        const MeshArrays arrays = drawableOf(Object::of(*glyphs)).at(kGlyphsOnScreens).arrays();
        const std::span<const float> corners = arrays.positions.as<float>();
        ASSERT_EQ(corners.size(), 9u);
        const std::size_t part = std::abs(Vec3f(corners[0], corners[1], corners[2]).norm()) < 1e-6F ? 0 : 1;
        for (const MeshCopy& copy : arrays.copies.as<MeshCopy>()) {
            const auto i = static_cast<std::size_t>(std::lround(copy.place[0]));
            ++seen[part];
            const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const float* const p = &corners[3 * corner];
                const Vec3d at = Vec3d(copy.place[0], copy.place[1], copy.place[2]) +
                                 turn * Vec3d(copy.width * p[0], copy.length * p[1], copy.width * p[2]);
                const Vec3d expected = Vec3d(static_cast<double>(i), static_cast<double>(i % 7), 0) +
                                       turns[i] * sizes[i].cwiseProduct(parts[part][corner]);
                ASSERT_LT((at - expected).norm(), 1e-5) << "place " << i << ", part " << part;
            }
        }
    }
    EXPECT_EQ(seen, (std::array<std::size_t, 2>{kPlaces, kPlaces}));
}

TEST(UsdInstancer, InColoursIsGlyphsHoweverFewWhereNoMaterialSaysOtherwise) {
    const auto fileOf = [](const char* material) {
        return fmt::format(
            R"(def PointInstancer "I" {{
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (3, 0, 0)]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 0.5)] (interpolation = "vertex")
    rel prototypes = [</I/P>]
    def Cube "P" {{ {}
        double3 xformOp:scale = (0.0001, 0.0001, 0.0001)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }}
}}
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{ uniform token info:id = "UsdPreviewSurface"
 token outputs:surface }}
}}
)",
            material);
    };
    const UsdScene bare(fileOf(""));
    ASSERT_EQ(bare.all<Glyphs>().size(), 1u);
    const std::span<const std::uint8_t> colors = bare.all<Glyphs>().front()->colors.as<std::uint8_t>();
    EXPECT_EQ(std::vector<std::uint8_t>(colors.begin(), colors.end()),
              (std::vector<std::uint8_t>{255, 0, 0, 255, 0, 0, 188, 255}));
    const UsdScene worn(fileOf("rel material:binding = </M>"));
    ASSERT_EQ(worn.all<Glyphs>().size(), 1u);
    EXPECT_TRUE(worn.all<Glyphs>().front()->colors.empty()) << "as the material says";
    const UsdScene own(fileOf("color3f[] primvars:displayColor = [(1, 1, 0)]"));
    ASSERT_EQ(own.all<Glyphs>().size(), 1u);
    EXPECT_EQ(own.all<Glyphs>().front()->colors.as<std::uint8_t>()[4], 255) << "as the prototype says";
}

TEST(UsdMaterial, HasItsPicturesAndTheirPlaces) {
    const std::string material = R"(
def Mesh "M" {
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    texCoord2f[] primvars:uv = [(0, 0), (1, 0), (0, 0.25)] (interpolation = "vertex")
    uniform token subdivisionScheme = "none"
    uniform bool doubleSided = 1
    rel material:binding = </Look>
}
def Material "Look" {
    float inputs:shine = 0.25
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Look/Color.outputs:rgb>
        float inputs:opacity.connect = </Look/Color.outputs:a>
        float inputs:opacityThreshold = 0.5
        float inputs:clearcoat.connect = </Look.inputs:shine>
        float inputs:roughness.connect = </Look/Rough.outputs:r>
        float inputs:ior = 1.25
    }
    def Shader "Color" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @color.tga@
        float4 inputs:scale = (0.5, 1, 1, 1)
        token inputs:wrapS = "mirror"
        float2 inputs:st.connect = </Look/Move.outputs:result>
    }
    def Shader "Rough" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @rough.tga@
        float2 inputs:st.connect = </Look/Read.outputs:result>
    }
    def Shader "Move" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </Look/Read.outputs:result>
        float inputs:rotation = 90
        float2 inputs:scale = (2, 3)
        float2 inputs:translation = (0.5, 0.25)
    }
    def Shader "Read" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "uv"
    }
}
)";
    const UsdScene scene(material, {{"color.tga", pictureOf({{1, 2, 3, 4}, {5, 6, 7, 8}})},
                                    {"rough.tga", pictureOf({{64, 0, 0, 255}})}});
    const auto materials = scene.all<Material>();
    ASSERT_EQ(materials.size(), 1u);
    const Material& made = *materials.front();
    EXPECT_TRUE(made.doubleSided);
    EXPECT_EQ(made.alphaMode, Material::kMask);
    EXPECT_FLOAT_EQ(made.baseColor.x(), 0.5F);
    EXPECT_FLOAT_EQ(made.clearcoat, 0.25F);
    EXPECT_FLOAT_EQ(made.ior, 1.25F);
    const auto* color = scene.aspect()->get<Image>(made.baseColorImage);
    ASSERT_NE(color, nullptr);
    EXPECT_EQ(color->wrapU, Image::kMirror);
    // USD: (s, t) → turned by 90° (2 s, 3 t) + move = (-3 t + 0.5, 2 s + 0.25), t upwards. Ours, v = 1 - t.
    const double u = 0.3, v = 0.8, t = 1 - v;
    const double c = std::cos(color->rotation), s = std::sin(color->rotation);
    EXPECT_NEAR(c * color->scale.x() * u + s * color->scale.y() * v + color->offset.x(), -3 * t + 0.5, 1e-5);
    EXPECT_NEAR(-s * color->scale.x() * u + c * color->scale.y() * v + color->offset.y(), 1 - (2 * u + 0.25), 1e-5);
    const auto* rough = scene.aspect()->get<Image>(made.metallicRoughnessImage);
    ASSERT_NE(rough, nullptr);
    EXPECT_EQ(rough->pixels.as<std::uint8_t>()[1], 64) << "the red of a picture of roughness alone is our green";
    const auto meshes = scene.all<Geometry>();
    ASSERT_EQ(meshes.size(), 1u);
    EXPECT_FLOAT_EQ(meshes.front()->texcoords.as<float>()[5], 0.75F) << "from the upper edge";
}

TEST(UsdMotion, TurnsAsFarAsTheFileSays) {
    const UsdScene scene(xform(" float xformOp:rotateY.timeSamples = { 0: 0, 48: 360 }", "\"xformOp:rotateY\"",
                               "def Mesh \"M\" {" + kUsdTriangle + "}"));
    ASSERT_EQ(scene.all<Animation>().size(), 1u);
    const auto frames = scene.all<KeyFrames>();
    ASSERT_EQ(frames.size(), 1u);
    const auto times = frames.front()->times.as<double>(), values = frames.front()->values.as<double>();
    EXPECT_EQ(frames.front()->field, "rotation");
    EXPECT_DOUBLE_EQ(times.back(), 2) << "24 codes a second";
    ASSERT_GT(times.size(), 4u) << "between the ends there are keys, or it would not turn at all";
    for (std::size_t i = 0; i < times.size(); ++i) {
        const double half = std::numbers::pi * times[i] / 2;  // of the angle
        EXPECT_NEAR(std::abs(values[4 * i]), std::abs(std::cos(half)), 1e-9);
    }
}

TEST(UsdMotion, ShowsAndHides) {
    const UsdScene scene(R"(
def Sphere "Blinks" { token visibility.timeSamples = { 0: "inherited", 12: "invisible", 24: "inherited" } }
def Xform "Hidden" { token visibility = "invisible"
 def Sphere "Child" {} }
)");
    EXPECT_EQ(scene.all<Switch>().size(), 2u);
    EXPECT_EQ(scene.all<KeyFrames>().size(), 1u);
    EXPECT_WORDS(scene.notes());
}

TEST(UsdLights, AndCamerasArrive) {
    const UsdScene scene(R"(
def Sphere "S" {}
def DistantLight "Sun" { float inputs:angle = 0
 float inputs:intensity = 3.14159265
 color3f inputs:color = (1, 0.5, 0.25) }
def RectLight "Window" { float inputs:width = 2
 float inputs:height = 3 }
def DomeLight "Sky" { float inputs:intensity = 0.5 }
def Camera "Eye" { float focalLength = 35
 float verticalAperture = 24
 double3 xformOp:translate = (0, 0, 10)
 uniform token[] xformOpOrder = ["xformOp:translate"] }
)");
    const auto suns = scene.all<DirectionalLight>();
    ASSERT_EQ(suns.size(), 1u);
    EXPECT_NEAR(suns.front()->intensity, 1, 1e-5) << "so much makes a white surface white";
    EXPECT_EQ(scene.all<SpotLight>().size(), 1u);
    ASSERT_EQ(scene.all<Environment>().size(), 1u);
    EXPECT_EQ(scene.all<Environment>().front()->sky, Vec3f(0.5F, 0.5F, 0.5F));
    EXPECT_EQ(scene.all<Camera>().size(), 1u);
}

/// Chromaticities of CIE 15:2004: illuminant A; Planck's of 6500 K and of 10,000 K (Wyszecki and Stiles, Color
/// Science).
TEST(UsdLights, HaveTheColoursOfTheirTemperatures) {
    struct Known {
        double kelvin, x, y;
    };
    Mat3d xyz_T_rgb;
    xyz_T_rgb << 0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041;
    for (const Known& known : {Known{2856, 0.4476, 0.4074}, Known{6500, 0.3135, 0.3237}, Known{10000, 0.2807, 0.2884},
                               Known{99999, 0.2807, 0.2884}}) {
        const UsdScene scene(
            fmt::format("def Sphere \"S\" {{}}\ndef DistantLight \"Sun\" {{ bool inputs:enableColorTemperature = 1\n "
                        "float inputs:colorTemperature = {} }}\n",
                        known.kelvin));
        const auto suns = scene.all<DirectionalLight>();
        ASSERT_EQ(suns.size(), 1u);
        const Vec3d seen = xyz_T_rgb * suns.front()->color.cast<double>();
        EXPECT_NEAR(seen.x() / seen.sum(), known.x, 0.005) << known.kelvin;
        EXPECT_NEAR(seen.y() / seen.sum(), known.y, 0.005) << known.kelvin;
        EXPECT_NEAR(seen.y(), 1, 1e-3) << "as bright as without";
    }
}

}  // namespace
}  // namespace tessera
