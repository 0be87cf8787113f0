// OBJ, STL and PLY of a few bytes that would take minutes or gigabytes, and words about what is wrong with others.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kSquareOfObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const std::string kFacetOfStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
    "a\n";

std::string capitals(std::string text) {
    for (char& letter : text)
        if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
    return text;
}

class MeshBounds : public testing::Test {
protected:
    Expected<ImportedScene> load(const std::string& file, const std::string& text, std::size_t mebibytes = 1024) {
        ImportOptions options = importOptions();
        options.maxCpuTime = std::chrono::seconds(2);
        options.maxMemoryBytes = mebibytes << 20;
        return importScene(scratch_.write(file, text), kRootNode, options);
    }
    void expectSaid(const std::string& file, const std::string& text) {
        const Expected<ImportedScene> scene = load(file, text);
        EXPECT_WORDS(scene ? notesIn(*scene) : scene.error().message) << file;
    }
    const Scratch scratch_;
};

TEST_F(MeshBounds, AnObjMayHaveVeryManyMaterialsAndGroups) {
    constexpr std::size_t kMany = 30'000;
    std::string materials = kSquareOfObj, groups = kSquareOfObj, library;
    for (std::size_t i = 0; i < kMany; ++i) {
        materials += fmt::format("usemtl a{}\nf 1 2 3\n", i);
        groups += fmt::format("g a{}\nf 1 2 3\n", i);
        library += fmt::format("newmtl a{}\nKd 1 {} 0\n", i, i % 2);
    }
    for (const std::string& text : {materials, groups}) {
        const Expected<ImportedScene> scene = load("a.obj", text);
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_EQ(scene->triangles, kMany);
    }
    (void)scratch_.write("a.mtl", library);
    const Expected<ImportedScene> scene = load("b.obj", "mtllib a.mtl\n" + materials);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, kMany);
    EXPECT_WORDS(fmt::format("{}", fmt::join(scene->notes, "\n")));
}

TEST_F(MeshBounds, MoreGroupsOfAnObjThanItsBytesBearAreRefused) {
    std::string text = kSquareOfObj;
    for (int i = 0; i < 300'000; ++i) text += fmt::format("usemtl a{}\nf 1 2 3\n", i);
    expectSaid("a.obj", text);
}

TEST_F(MeshBounds, LinesOfVeryManyGroupsCostNoMoreThanTheirEnds) {
    std::string text;
    for (int i = 0; i < 300'000; ++i) text += "v 0 0 0\n";
    for (int i = 0; i < 20'000; ++i) text += fmt::format("usemtl a{}\nl 1 -1\n", i);
    const Expected<ImportedScene> scene = load("a.obj", text);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 20'000u);
}

TEST_F(MeshBounds, AnObjsLineMayNameSeveralLibraries) {
    (void)scratch_.write("red.mtl", "newmtl one\nKd 1 0 0\n");
    (void)scratch_.write("with blanks.mtl", "newmtl two\nKd 0 0 1\n");
    (void)scratch_.write("green.mtl", "newmtl three\nKd 0 1 0\n");
    const Expected<ImportedScene> scene =
        load("a.obj", kSquareOfObj +
                          "usemtl one\nf 1 2 3\nmtllib red.mtl green.mtl\nmtllib with blanks.mtl\nusemtl two\nf 1 "
                          "2 3\nusemtl three\nf 1 2 3\n");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
    const ImportedAspect aspect(*scene);
    std::set<std::string> colors;
    for (const ObjectId id : aspect->ids())
        if (const auto* const material = aspect->get<Material>(id))
            colors.insert(
                fmt::format("{} {} {}", material->baseColor.x(), material->baseColor.y(), material->baseColor.z()));
    EXPECT_EQ(colors, (std::set<std::string>{"1 0 0", "0 1 0", "0 0 1"}));
}

TEST_F(MeshBounds, AnStlMayHaveVeryManySolids) {
    std::string text;
    for (int i = 0; i < 100'000; ++i) text += "solid\nendsolid\n";
    const Expected<ImportedScene> scene = load("a.stl", text + kFacetOfStl, 512);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 1u);
}

TEST_F(MeshBounds, AnStlMayBeInCapitals) {
    for (const bool verbatim : {false, true}) {
        ImportOptions options = importOptions();
        options.verbatim = verbatim;
        const Expected<ImportedScene> scene =
            importScene(scratch_.write("a.stl", capitals(kFacetOfStl)), kRootNode, options);
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_EQ(scene->triangles, 1u);
    }
    expectSaid("b.stl", capitals(kFacetOfStl.substr(0, 60)));
    const Expected<ImportedScene> marked = load("c.stl", "\xef\xbb\xbf" + kFacetOfStl);
    EXPECT_TRUE(marked && marked->triangles == 1) << messageOf(marked);
}

TEST_F(MeshBounds, LettersOfTwoBytesAreNamed) {
    const std::string ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n";
    for (const auto& [file, text] : {std::pair<const char*, std::string>("a.stl", kFacetOfStl), {"a.ply", ply}}) {
        std::string little = "\xff\xfe", big = "\xfe\xff";
        for (const char letter : text) {
            little += {letter, '\0'};
            big += {'\0', letter};
        }
        expectSaid(file, little);
        expectSaid(file, big);
    }
}

TEST_F(MeshBounds, CountsAndNumbersOfAPlyThatAreNoneAreCalledSo) {
    const auto ply = [](const char* format, const char* types, const std::string& face) {
        std::string places;
        for (const float number : {0, 0, 0, 1, 0, 0, 0, 1, 0})
            places.append(reinterpret_cast<const char*>(&number), sizeof(number));
        const bool isText = std::string_view(format) == "ascii";
        return fmt::format(
                   "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
                   "z\nelement "
                   "face 1\nproperty list {} vertex_indices\nend_header\n",
                   format, types) +
               (isText ? "0 0 0\n1 0 0\n0 1 0\n" : places) + face;
    };
    const auto bytes = [](auto number) { return std::string(reinterpret_cast<const char*>(&number), sizeof(number)); };
    expectSaid("a.ply", ply("binary_little_endian", "int int", bytes(-1) + bytes(0) + bytes(1) + bytes(2)));
    expectSaid("b.ply", ply("binary_little_endian", "double double", bytes(std::nan("")) + std::string(24, '\0')));
    expectSaid("c.ply", ply("ascii", "uchar int", "3 0 1 -1\n"));
    expectSaid("d.ply", ply("ascii", "uchar uint", "3 0 1 4000000000\n"));
}

}  // namespace
}  // namespace tessera
