// Lines, of each format that has them.
#include <fmt/format.h>

#include "common/cores/Geometry.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importedText(const std::string& name, const std::string& content) {
    const Scratch scratch;
    return importScene(scratch.write(name, content), kRootNode, importOptions());
}

/// The one geometry of lines in it.
Geometry linesOf(Expected<ImportedScene> scene) {
    EXPECT_TRUE(scene) << messageOf(scene);
    Geometry found;
    if (!scene) return found;
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
    const ImportedAspect aspect(std::move(*scene));
    for (const ObjectId id : aspect->ids())
        if (const auto* geometry = aspect->get<Geometry>(id); geometry && geometry->primitive == Geometry::kLines)
            found = *geometry;
    return found;
}

std::vector<std::uint32_t> endsOf(const Geometry& geometry) {
    const auto ends = geometry.indices.as<std::uint32_t>();
    return {ends.begin(), ends.end()};
}

using Ends = std::vector<std::uint32_t>;

TEST(Lines, OfGltfListsLoopsAndStrips) {
    const auto read = [](int mode, bool indexed) {
        GltfText gltf;
        const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1}, "VEC3", 3);
        const int order = gltf.add(std::vector<std::uint8_t>{4, 2, 0}, 5121, "SCALAR", 3);
        const std::string indices = indexed ? fmt::format(R"(,"indices":{})", order) : "";
        return endsOf(linesOf(importedText(
            "lines.gltf",
            gltf.text(fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],)"
                                  R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}},"mode":{}{}}}]}}])",
                                  positions, mode, indices)))));
    };
    EXPECT_EQ(read(1, false), (Ends{0, 1, 2, 3})) << "the fifth is alone";
    EXPECT_EQ(read(2, false), (Ends{0, 1, 1, 2, 2, 3, 3, 4, 4, 0}));
    EXPECT_EQ(read(3, false), (Ends{0, 1, 1, 2, 2, 3, 3, 4}));
    EXPECT_EQ(read(3, true), (Ends{4, 2, 2, 0}));
}

TEST(Lines, OfObjAloneAndBesideFaces) {
    const std::string vertices = "v 0 0 0\nv 3 0 0\nv 0 3 0\nv 9 9 9\n";
    const Geometry alone = linesOf(importedText("alone.obj", vertices + "l 1 2 3\n"));
    EXPECT_EQ(endsOf(alone).size(), 4u);
    const Geometry beside = linesOf(importedText("beside.obj", vertices + "f 1 2 3\nl 1 4\n"));
    EXPECT_EQ(endsOf(beside).size(), 2u);
}

TEST(Lines, OfSceneTextWithTheirWidth) {
    const auto text = [](const std::string& mesh) {
        return importedText("lines.tsct", "mesh { name: \"m\" primitive: LINES position: [0,0,0, 1,0,0, 1,1,0] " +
                                              mesh + " } node { geometry { mesh: \"m\" } }");
    };
    const Geometry lines = linesOf(text("index: [0,1, 1,2] line_width: 2.5"));
    EXPECT_EQ(endsOf(lines), (Ends{0, 1, 1, 2}));
    EXPECT_EQ(lines.lineWidth, 2.5f);
    EXPECT_EQ(linesOf(text("index: [0,1]")).lineWidth, 1.0f);
    for (const char* const wrong :
         {"index: [0,1,2]", "index: [0,3]", "index: [0,1] line_width: 65", "index: [0,1] line_width: -1", ""}) {
        const auto scene = text(wrong);
        ASSERT_FALSE(scene) << wrong;
        EXPECT_WORDS(scene.error().message);
    }
}

}  // namespace
}  // namespace tessera
