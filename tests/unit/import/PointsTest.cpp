// Scans: files of points become point geometry, with a radius that the file says or that follows from their spacing.

#include <cmath>
#include <cstring>

#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

std::vector<float> numbers(const Blob& blob) {
    const auto all = blob.as<float>();
    return {all.begin(), all.end()};
}
const std::vector<float> kThree = {0, 0, 0, 2, 0, 0, 2, 2, 0};

Expected<ImportedScene> imported(const std::string& name, const std::string& content) {
    const Scratch scratch;
    return importScene(scratch.write(name, content), kRootNode, importOptions());
}

/// The one point geometry of a file, with what was noted.
struct Scan {
    Geometry geometry;
    std::vector<std::string> notes;
    std::uint64_t triangles = 0;
    std::size_t geometries = 0;
};
Scan scanOf(Expected<ImportedScene> scene) {
    Scan scan;
    EXPECT_TRUE(scene) << messageOf(scene);
    if (!scene) return scan;
    scan.notes = scene->notes;
    scan.triangles = scene->triangles;
    const ImportedAspect aspect(std::move(*scene));
    for (const ObjectId id : aspect->ids())
        if (const auto* geometry = aspect->get<Geometry>(id)) {
            ++scan.geometries;
            if (geometry->primitive == Geometry::kPoints) scan.geometry = *geometry;
        }
    return scan;
}

std::string gltfOf(const GltfText& gltf, const std::string& primitives, const std::string& ofMesh = "",
                   const std::string& ofNode = "") {
    return gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0{}}}],"meshes":[{{"primitives":[{}]{}}}])", ofNode,
        primitives, ofMesh));
}

TEST(GltfPoints, ArePointGeometryWithHalfTheirSpacing) {
    GltfText gltf;
    const int positions = gltf.floats(kThree, "VEC3", 3);
    const int colors = gltf.floats({1, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC3", 3);
    const Scan scan = scanOf(imported(
        "model.gltf",
        gltfOf(gltf, fmt::format(R"({{"attributes":{{"POSITION":{},"COLOR_0":{}}},"mode":0}})", positions, colors))));
    EXPECT_EQ(numbers(scan.geometry.positions), kThree);
    EXPECT_TRUE(scan.geometry.indices.empty());
    EXPECT_TRUE(scan.geometry.normals.empty()) << "none are made up";
    EXPECT_EQ(scan.geometry.colors.as<std::uint8_t>()[5], 255);
    EXPECT_EQ(scan.geometry.pointRadius, 1.0);
    EXPECT_EQ(scan.triangles, 24u) << "as they are drawn";
    EXPECT_TRUE(scan.notes.empty());
}

TEST(GltfPoints, ByIndicesAreThoseAlone) {
    GltfText gltf;
    const int positions = gltf.floats(kThree, "VEC3", 3);
    const int bytes = gltf.add(std::vector<std::uint8_t>{2, 0, 2}, 5121, "SCALAR", 3);
    const Scan scan = scanOf(imported(
        "model.gltf",
        gltfOf(gltf, fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{},"mode":0}})", positions, bytes))));
    EXPECT_EQ(numbers(scan.geometry.positions), (std::vector<float>{2, 2, 0, 0, 0, 0}));
    EXPECT_DOUBLE_EQ(scan.geometry.pointRadius, std::sqrt(2.0));
}

TEST(GltfPoints, HaveTheRadiusThatTheNearestExtrasSay) {
    GltfText gltf;
    const int positions = gltf.floats(kThree, "VEC3", 3);
    const auto radius = [&](const std::string& ofPrimitive, const std::string& ofMesh, const std::string& ofNode) {
        const std::string primitive =
            fmt::format(R"({{"attributes":{{"POSITION":{}}},"mode":0{}}})", positions, ofPrimitive);
        return scanOf(imported("model.gltf", gltfOf(gltf, primitive, ofMesh, ofNode))).geometry.pointRadius;
    };
    const auto says = [](const std::string& value) { return R"(,"extras":{"pointRadius":)" + value + "}"; };
    EXPECT_EQ(radius("", says("0.25"), ""), 0.25);
    EXPECT_EQ(radius("", says("0.25"), says("0.5")), 0.5);
    EXPECT_EQ(radius(says("3"), says("0.25"), says("0.5")), 3);
    EXPECT_EQ(radius("", says("-1"), says("\"large\"")), 1) << "what is no radius is passed over";
}

TEST(GltfPoints, StandBesideTrianglesAndLines) {
    GltfText gltf;
    const int positions = gltf.floats(kThree, "VEC3", 3);
    const auto mode = [&](int number) {
        return fmt::format(R"({{"attributes":{{"POSITION":{}}},"mode":{}}})", positions, number);
    };
    const Scan scan = scanOf(imported("model.gltf", gltfOf(gltf, mode(0) + "," + mode(1) + "," + mode(4))));
    EXPECT_EQ(scan.geometries, 3u);
    EXPECT_EQ(scan.triangles, 25u);
    EXPECT_TRUE(scan.notes.empty());
}

constexpr const char* kPointsHead =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n";
constexpr const char* kPlyPoints = "0 0 0 255 0 0\n0.5 0 0 0 255 0\n0.5 0.5 0 0 0 255\n0 0.5 0 9 9 9\n";

TEST(PlyPoints, ArePointGeometryWithTheirColours) {
    for (const std::string& faces :
         {std::string(), std::string("element face 0\nproperty list uchar int vertex_indices\n")}) {
        const Scan scan = scanOf(imported("scan.ply", kPointsHead + faces + "end_header\n" + kPlyPoints));
        EXPECT_EQ(numbers(scan.geometry.positions),
                  (std::vector<float>{0, 0, 0, 0.5f, 0, 0, 0.5f, 0.5f, 0, 0, 0.5f, 0}));
        const auto colors = scan.geometry.colors.as<std::uint8_t>();
        ASSERT_EQ(colors.size(), 16u);
        EXPECT_EQ(std::vector<std::uint8_t>(colors.begin() + 4, colors.begin() + 8),
                  (std::vector<std::uint8_t>{0, 255, 0, 255}));
        EXPECT_EQ(scan.geometry.pointRadius, 0.25);
        EXPECT_TRUE(scan.geometry.material) << "a material of their own, as meshes have";
    }
}

TEST(PlyPoints, OfABinaryFileWithNormals) {
    std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n";
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) file += std::string("property float ") + name + "\n";
    file += "end_header\n";
    const std::vector<float> values = {1, 2, 3, 0, 2, 0, 1, 2, 7, 0, 0, 1};
    file.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    const Scan scan = scanOf(imported("scan.ply", file));
    EXPECT_EQ(numbers(scan.geometry.positions), (std::vector<float>{1, 2, 3, 1, 2, 7}));
    EXPECT_EQ(numbers(scan.geometry.normals), (std::vector<float>{0, 1, 0, 0, 0, 1})) << "of unit length";
    EXPECT_EQ(scan.geometry.pointRadius, 2);
}

TEST(PlyPoints, AFileWithFacesIsTrianglesAsBefore) {
    const Scan scan = scanOf(imported(
        "mesh.ply", std::string(kPointsHead) + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                        kPlyPoints + "3 0 1 2\n"));
    EXPECT_EQ(scan.triangles, 1u);
    EXPECT_EQ(scan.geometry.primitive, Geometry::kTriangles);
}

TEST(ObjPoints, OfFacesOfOneCornerAndOfBareVertices) {
    const std::string vertices = "v 0 0 0\nv 3 0 0\nv 0 3 0\nv 9 9 9\n";
    Scan scan = scanOf(imported("points.obj", vertices + "p 1 2\n"));
    EXPECT_EQ(numbers(scan.geometry.positions), (std::vector<float>{0, 0, 0, 3, 0, 0}));
    EXPECT_EQ(scan.geometry.pointRadius, 1.5);
    scan = scanOf(imported("bare.obj", vertices));
    EXPECT_EQ(scan.geometry.positions.sizeBytes(), 4u * 12);
    scan = scanOf(imported("all.obj", vertices + "f 1 2 3\np 4\np 3\nl 1 2\n"));
    EXPECT_EQ(scan.geometries, 3u);
    EXPECT_EQ(scan.triangles, 1u + 16);
    EXPECT_TRUE(scan.notes.empty());
}

TEST(ScanFile, OfTooManyPointsIsRefusedByName) {
    const std::size_t count = MeshLimits().maxPoints + 1;
    std::string file = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", count);
    for (const char* name : {"x", "y", "z"}) file += std::string("property float ") + name + "\n";
    file += "end_header\n" + std::string(count * 12, '\0');
    const Expected<ImportedScene> scene = imported("scan.ply", file);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::kLimit);
    EXPECT_WORDS(scene.error().message);
}

TEST(SceneTextPoints, AreListedOrOnASurfaceOrAMesh) {
    Expected<ImportedScene> scene = imported("scene.tsct", R"(
        mesh { name: "four" primitive: POINTS point_radius: 0.125 position: [0,0,0, 1,0,0, 1,1,0, 0,1,0] }
        mesh { name: "none said" primitive: POINTS position: [0,0,0, 1,0,0] }
        node { name: "listed" points { radius: 0.5 point { x: 1 } point { y: 2 z: 3 } } }
        node { name: "on" points { spacing: 0.1 box { size { x: 1 y: 1 z: 1 } } } }
        node { name: "mesh" geometry { mesh: "four" } }
        node { name: "other" geometry { mesh: "none said" } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 8u * (2 + 600 + 4 + 2));
    const ImportedAspect aspect(std::move(*scene));
    const auto* listed = aspect.core<Geometry>("/listed");
    ASSERT_NE(listed, nullptr);
    EXPECT_EQ(listed->primitive, Geometry::kPoints);
    EXPECT_EQ(listed->pointRadius, 0.5);
    EXPECT_EQ(numbers(listed->positions), (std::vector<float>{1, 0, 0, 0, 2, 3}));
    const auto* on = aspect.core<Geometry>("/on");
    EXPECT_EQ(on->normals.sizeBytes(), 600u * 12);
    EXPECT_GT(on->pointRadius, 0.02);
    EXPECT_LE(on->pointRadius, 0.05);
    for (const float x : numbers(on->positions)) EXPECT_LE(std::abs(x), 0.5f);
    EXPECT_EQ(aspect.core<Geometry>("/mesh")->pointRadius, 0.125);
    EXPECT_EQ(aspect.core<Geometry>("/other")->pointRadius, 0.5) << "half of what lies between them";
}

TEST(Glyphs, AMillionOfThemAreNoSurfaceOfMillionsOfTriangles) {
    std::string places;
    for (int i = 0; i < 1'000'000; ++i) places += "0,1,2,";
    places.pop_back();
    const auto read = [&](const std::string& more) {
        return imported("glyphs.tsct", "node { name: \"a\" glyphs { positions: [" + places + more + "] shape: BOX } }");
    };
    const Expected<ImportedScene> million = read("");
    ASSERT_TRUE(million) << messageOf(million);
    EXPECT_EQ(million->triangles, 12'000'000u);
    const Expected<ImportedScene> more = read(",0,1,2");
    ASSERT_FALSE(more);
    EXPECT_WORDS(more.error().message);
}

}  // namespace
}  // namespace tessera
