/// USD in text: what other programs need to see everything, and what it lacks.
#include "common/cores/Image.h"
#include "common/cores/PointLight.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

std::size_t countOf(const std::string& path, std::string_view words) {
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(words, at)) != std::string::npos; at += words.size()) ++count;
    return count;
}

std::size_t geometriesOf(const Aspect& scene) {
    const std::vector<ObjectId> ids = scene.ids();
    return static_cast<std::size_t>(
        std::ranges::count_if(ids, [&](ObjectId id) { return scene.get<Geometry>(id) != nullptr; }));
}

TEST(Usda, SharedShapesStandInFullWhereverTheyAreUsed) {
    const Scratch scratch;
    BuiltScene built;
    Material red;
    red.doubleSided = true;
    Geometry geometry = triangleGeometry();
    geometry.material = built.add(red);
    const ObjectId core = built.add(geometry);
    for (const char* name : {"a", "b", "two words"}) built.node(name, core);
    const std::string path = scratch.path("out.usda");
    const Expected<ExportReport> report = exportScene(path, built.take());
    ASSERT_TRUE(report);
    EXPECT_EQ(countOf(path, "point3f[] points"), 3u);
    EXPECT_EQ(countOf(path, "references"), 0u);
    EXPECT_TRUE(report->notes.empty()) << report->notes.front();
    const ImportedAspect again = readBack(path);
    EXPECT_EQ(geometriesOf(*again), 1u);
    EXPECT_EQ(again->get<Node>(again->root().children.back())->name, "two words");
}

/// 9 MB of text: the second is said again, the third would be beyond 16 MiB of that.
TEST(Usda, LargeSharedShapesAreReferencesToTheFirstAndSaidToBe) {
    const Scratch scratch;
    BuiltScene built;
    Geometry geometry;
    std::vector<float> corners;
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < 300'000; ++i) {
        corners.insert(corners.end(), {static_cast<float>(i % 7), static_cast<float>(i) * 1.0001f, 0.33333f});
        indices.push_back(i);
    }
    geometry.positions = Blob::of(std::span<const float>(corners));
    geometry.indices = Blob::of(std::span<const std::uint32_t>(indices));
    const ObjectId core = built.add(geometry);
    for (const char* name : {"first of all", "b", "c", "d"}) built.node(name, core);
    const std::string path = scratch.path("out.usda");
    const Expected<ExportReport> report = exportScene(path, built.take());
    ASSERT_TRUE(report);
    EXPECT_EQ(countOf(path, "point3f[] points"), 2u);
    EXPECT_EQ(countOf(path, "prepend references = </out/first_of_all>"), 2u);
    ASSERT_EQ(report->notes.size(), 1u);
    EXPECT_EQ(report->notes.front(), "shared meshes are references, which some programs do not follow: /c, /d");
    const ImportedAspect again = readBack(path);
    EXPECT_EQ(geometriesOf(*again), 1u);
    std::vector<std::string> names;
    for (const ObjectId top : again->root().children) names.push_back(again->get<Node>(top)->name);
    EXPECT_EQ(names, (std::vector<std::string>{"first of all", "b", "c", "d"}));
}

TEST(Usda, EachLossIsNoted) {
    const Scratch scratch;
    BuiltScene built;
    const auto wear = [&](const char* name, const Material& material) {
        Geometry geometry = triangleGeometry();
        geometry.material = built.add(material);
        built.node(name, built.add(geometry));
    };
    Material phong, edges, coarse, tinted, glass;
    phong.shading = Material::kPhong;
    edges.fill = Material::kEdges;
    coarse.coarser = built.add(Material());
    tinted.specular = 0.5f;
    glass.transmission = 0.5f;
    wear("phong", phong), wear("edges", edges), wear("coarse", coarse), wear("tinted", tinted), wear("glass", glass);
    PointLight lamp;
    lamp.on = false;
    lamp.range = 3;
    built.node("lamp", built.add(lamp));
    Geometry lines = triangleGeometry();
    lines.indices = {};
    lines.primitive = Geometry::kLineLoop;
    lines.lineWidth = 4;
    built.node("lines", built.add(lines));
    Geometry faint = triangleGeometry();
    faint.colors = blobOf<std::uint8_t>({255, 0, 0, 128, 255, 0, 0, 128, 255, 0, 0, 128});
    built.node("faint", built.add(faint));
    const Expected<ExportReport> report = exportScene(scratch.path("out.usda"), built.take());
    ASSERT_TRUE(report);
    EXPECT_EQ(report->notes,
              (std::vector<std::string>{"Phong's highlights are written as roughness: /phong",
                                        "edges and corners of materials are written as surfaces: /edges",
                                        "coarser materials for far away are left out: /coarse",
                                        "how much what is no metal reflects, and how tinted, is left out: /tinted",
                                        "light that goes through materials is left out: /glass",
                                        "lights that are off have no intensity: /lamp",
                                        "ranges of lights are left out: /lamp", "widths of lines are left out: /lines",
                                        "opacities of vertices are left out: /faint"}));
}

}  // namespace
}  // namespace tessera
