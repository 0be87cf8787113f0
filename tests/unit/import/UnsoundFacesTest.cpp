/// Faces of vertices that do not exist, or stand nowhere: the rest is shown, and a note counts them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

struct ShownFaces {
    std::vector<std::string> notes;
    std::uint64_t triangles = 0;
    Box box;
    std::string error;
    [[nodiscard]] bool says(std::string_view part) const {
        return std::ranges::any_of(notes,
                                   [&](const std::string& note) { return note.find(part) != std::string::npos; });
    }
    [[nodiscard]] std::string said() const { return fmt::format("{}", fmt::join(notes, "\n")); }
};
ShownFaces shownOf(const std::string& name, const std::string& bytes) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write(name, bytes), kRootNode, importOptions());
    if (!scene) return {.error = messageOf(scene)};
    ShownFaces shown{.notes = scene->notes, .triangles = scene->triangles};
    const ImportedAspect aspect(std::move(*scene));
    for (const Geometry* geometry : allOf<Geometry>(aspect))
        shown.box.extend(boundsOf(geometry->positions.as<float>()));
    return shown;
}

void expectLeftOut(const ShownFaces& shown, std::uint64_t triangles) {
    EXPECT_EQ(shown.error, "");
    EXPECT_EQ(shown.triangles, triangles);
    EXPECT_WORDS(shown.said());
    // Whatever was left out extends nothing.
    EXPECT_EQ(shown.box.lower, Vec3d(0, 0, 0));
    EXPECT_EQ(shown.box.upper, Vec3d(1, 1, 0));
}

TEST(UnsoundFaces, OfAnObjAreNamedByTheirLine) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    expectLeftOut(shownOf("a.obj", square + "f 1 2 3\nf 2 4 3\nf 1 2 9\nf 1 2 -5\nf 1 2 0\n"), 2);
    expectLeftOut(shownOf("b.obj", square + "v nan 0 5\nv 1e99 0 5\nf 1 2 3\nf 2 4 3\nf 1 2 \\\n 5\nf 6 1 2\n"), 2);
    expectLeftOut(shownOf("c.obj", square + "vt 0 0\nf 1/1 2/1 3/1\nf 2/1 4/1 3/1\nf 1/1 2/2 3/1\n"), 2);
    // Small numbers are numbers; what is named before it comes is named.
    const ShownFaces sound = shownOf(
        "d.obj", "f 1 2 3\nf -0 2 3\n" + square + "v 1e-99 0 0\nv 1e-999 1 0\nf -6 -5 -4 # nan\nf 2 4 3\nf 6 2 3\n");
    EXPECT_EQ(sound.triangles, 4u) << sound.error;
    EXPECT_WORDS(sound.said());
    // Of nothing but faces that are left out the vertices stay, as points.
    EXPECT_WORDS(shownOf("e.obj", square + "f 1 2 7\n").said());
}

TEST(UnsoundFaces, OfAnObjWhoseNumbersBeginWithAPointThereAreNone) {
    const ShownFaces shown =
        shownOf("a.obj", "v 0 0 0\nv .5 0 0\nv 0 .5 0\nv 1 1 .0\nvt .5 .5\nf 1/1 2/1 3/1\nf 2/1 4/1 3/1\n");
    EXPECT_EQ(shown.triangles, 2u) << shown.error;
    EXPECT_FALSE(shown.says("left out")) << fmt::format("{}", fmt::join(shown.notes, "\n"));
}

TEST(UnsoundFaces, OfStlPlyAndOffAreCounted) {
    const auto facet = [](const std::string& x) {
        return "facet normal 0 0 1\nouter loop\nvertex " + x + " 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    };
    const auto upper =
        std::string("facet normal 0 0 1\nouter loop\nvertex 1 1 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n");
    expectLeftOut(shownOf("a.stl", "solid s\n" + facet("0") + facet("nan") + upper + "endsolid s\n"), 2);
    const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n1 1 0\ninf 0 9\n", faces = "3 0 1 2\n3 1 3 2\n3 1 4 2\n";
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face "
        "3\n"
        "property list uchar int vertex_indices\nend_header\n";
    expectLeftOut(shownOf("a.ply", head + vertices + faces), 2);
    expectLeftOut(shownOf("b.ply", head + "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 0\n3 0 1 2\n3 1 3 2\n3 1 99 2\n"), 2);
    expectLeftOut(shownOf("a.off", "OFF\n5 3 0\n" + vertices + faces), 2);
    EXPECT_WORDS(shownOf("all.stl", "solid s\n" + facet("nan") + "endsolid s\n").error);
}

/// A primitive of glTF: a square and one vertex more.
std::string gltfOf(const std::string& mode, float last, const std::vector<std::uint16_t>& indices) {
    const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, last, 0, 0};
    std::string bytes(reinterpret_cast<const char*>(positions.data()), positions.size() * 4);
    bytes.append(reinterpret_cast<const char*>(indices.data()), indices.size() * 2);
    std::string json = fmt::format(
        R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1{}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"}},
{{"bufferView":1,"componentType":5123,"count":{},"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":60}},{{"buffer":0,"byteOffset":60,"byteLength":{}}}],
"buffers":[{{"byteLength":{}}}]}})",
        mode, indices.size(), indices.size() * 2, bytes.size());
    json.resize((json.size() + 3) / 4 * 4, ' ');
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    const auto number = [](std::size_t value) {
        const auto word = static_cast<std::uint32_t>(value);
        return std::string(reinterpret_cast<const char*>(&word), 4);
    };
    const std::string head = "glTF" + number(2) + number(28 + json.size() + bytes.size());
    return head + number(json.size()) + "JSON" + json + number(bytes.size()) + std::string("BIN\0", 4) + bytes;
}

TEST(UnsoundFaces, OfGltfAreCountedWhateverThePrimitive) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    expectLeftOut(shownOf("a.glb", gltfOf("", 0, {0, 1, 2, 1, 3, 2, 1, 9, 2})), 2);
    expectLeftOut(shownOf("b.glb", gltfOf("", nan, {0, 1, 2, 1, 3, 2, 4, 1, 2})), 2);
    expectLeftOut(shownOf("strip.glb", gltfOf(R"(,"mode":5)", nan, {0, 1, 2, 3, 4})), 2);
    expectLeftOut(shownOf("lines.glb", gltfOf(R"(,"mode":1)", nan, {0, 3, 1, 4, 1, 77})), 0);
    const ShownFaces points = shownOf("points.glb", gltfOf(R"(,"mode":0)", nan, {0, 3, 4, 77}));
    EXPECT_WORDS(points.said()) << points.error;
    EXPECT_EQ(points.box.upper, Vec3d(1, 1, 0));
}

}  // namespace
}  // namespace tessera
