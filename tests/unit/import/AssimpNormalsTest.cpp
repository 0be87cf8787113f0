// What assimp reads without normals and colours, or loses: edges stay edges, nothing is black, losses are said.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/cores/Geometry.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

std::string amfVolume(int first) {
    return fmt::format("<volume><triangle><v1>{0}</v1><v2>{1}</v2><v3>{2}</v3></triangle></volume>", first, first + 1,
                       first + 2);
}
std::string amfOf(const std::string& volumes) {
    std::string text = "<?xml version=\"1.0\"?><amf><object id=\"1\"><mesh><vertices>";
    for (int i = 0; i < 5; ++i)
        text += fmt::format("<vertex><coordinates><x>{}</x><y>{}</y><z>{}</z></coordinates></vertex>", i, i * i, i % 2);
    return text + "</vertices>" + volumes + "</mesh></object></amf>";
}

TEST(AssimpNormals, OfACubeWithSharedVerticesHaveEdges) {
    const Scratch scratch;
    const std::string file = scratch.write("cube.off",
                                           "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                                           "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
    const Expected<ImportedScene> scene = importScene(file, kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    const ImportedAspect aspect{ImportedScene(*scene)};
    const std::vector<const Geometry*> all = allOf<Geometry>(aspect);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0]->positions.sizeBytes() / 12, 24u) << "three normals at each corner of the cube";
    const auto normals = all[0]->normals.as<float>();
    for (std::size_t at = 0; at + 2 < normals.size(); at += 3) {
        std::array<float, 3> sizes = {std::abs(normals[at]), std::abs(normals[at + 1]), std::abs(normals[at + 2])};
        std::ranges::sort(sizes);
        EXPECT_NEAR(sizes[2], 1, 1e-6);
        EXPECT_NEAR(sizes[1], 0, 1e-6);
    }
}

TEST(AssimpNormals, AnAmfWithoutColoursHasNone) {
    const Scratch scratch;
    const std::string file = scratch.write("plain.amf", amfOf(amfVolume(0)));
    const Expected<ImportedScene> scene = importScene(file, kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_TRUE(scene->notes.empty() || scene->notes[0].find("triangles are shown") == std::string::npos);
    const ImportedAspect aspect{ImportedScene(*scene)};
    for (const Geometry* geometry : allOf<Geometry>(aspect)) EXPECT_EQ(geometry->colors.sizeBytes(), 0u);
}

TEST(AssimpNormals, VolumesOfAmfThatAreLostAreCounted) {
    const Scratch scratch;
    const std::string file = scratch.write("two.amf", amfOf(amfVolume(0) + amfVolume(1) + amfVolume(2)));
    const Expected<ImportedScene> scene = importScene(file, kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    const auto said = [&](const std::string& note) {
        return note.find("1 of its 3 triangles are shown") != std::string::npos;
    };
    EXPECT_TRUE(std::ranges::any_of(scene->notes, said));
}

}  // namespace
}  // namespace tessera
