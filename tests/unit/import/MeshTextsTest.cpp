/// OFF and STL in text: what their lines say is shown as they say it, and a line that says nothing that can be is
/// named.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"
#include "server/import/reader/BeforeAssimp.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

/// What one file by itself shows, in the plane of X and Y.
struct MeshText {
    std::uint64_t triangles = 0;
    double area = 0;  ///< of all triangles, those that face down counted against those that face up
    std::vector<std::uint8_t> colors;
    std::size_t texcoords = 0, normals = 0;
    Box box;
    std::string said;  ///< notes, or why it is refused
    bool refused = false;
    [[nodiscard]] bool says(std::string_view part) const { return said.find(part) != std::string::npos; }
};
MeshText meshTextOf(const std::string& name, const std::string& text) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write(name, text), kRootNode, importOptions());
    if (!scene) return {.said = messageOf(scene), .refused = true};
    MeshText mesh{.triangles = scene->triangles, .said = fmt::format("{}", fmt::join(scene->notes, "\n"))};
    const ImportedAspect aspect(std::move(*scene));
    for (const Geometry* geometry : allOf<Geometry>(aspect)) {
        const auto places = geometry->positions.as<float>();
        const auto corners = geometry->indices.as<std::uint32_t>();
        const auto at = [&](std::size_t corner) {
            return Vec2d(places[std::size_t{3} * corners[corner]], places[std::size_t{3} * corners[corner] + 1]);
        };
        for (std::size_t i = 0; i + 3 <= corners.size(); i += 3) {
            const Vec2d a = at(i + 1) - at(i), b = at(i + 2) - at(i);
            mesh.area += 0.5 * (a.x() * b.y() - a.y() * b.x());
        }
        const auto colors = geometry->colors.as<std::uint8_t>();
        mesh.colors.insert(mesh.colors.end(), colors.begin(), colors.end());
        mesh.texcoords += geometry->texcoords.sizeBytes();
        mesh.normals += geometry->normals.sizeBytes();
        mesh.box.extend(boundsOf(places));
    }
    return mesh;
}
std::string squareOff(const std::string& faces) {
    return "OFF\n# a square\n4 " + std::to_string(std::ranges::count(faces, '\n')) +
           " 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n" + faces;
}

TEST(OffFiles, FacesOfVerticesThatDoNotExistAreLeftOutAndCounted) {
    const MeshText shown = meshTextOf("a.off", squareOff("3 0 1 2\n3 1 9 2\n3 1 3 2\n3 1 -3 2\n3 0 1 4\n"));
    EXPECT_EQ(shown.triangles, 2u) << shown.said;
    EXPECT_EQ(shown.area, 1);
    EXPECT_WORDS(shown.said);
    EXPECT_FALSE(meshTextOf("a.off", squareOff("3 0 1 2\n3 1 3 2\n")).says("left out"));
    const MeshText none = meshTextOf("a.off", squareOff("3 0 1 7\n"));
    EXPECT_TRUE(none.refused);
    EXPECT_WORDS(none.said);
}

TEST(OffFiles, FacesThatAreNoneAreLeftOutAndCounted) {
    for (const char* const face : {"4 1 3 2", "0", "three 1 3 2", "3 1 x 2", "-3 1 3 2"}) {
        const MeshText shown = meshTextOf("a.off", squareOff(std::string("3 0 1 2\n") + face + "\n3 1 3 2\n"));
        EXPECT_EQ(shown.triangles, 2u) << face << ": " << shown.said;
        EXPECT_WORDS(shown.said) << face;
    }
    // With a line break behind it, it is no end of a file that was cut.
    const MeshText last = meshTextOf("a.off", squareOff("3 0 1 2\n4 1 3 2\n"));
    EXPECT_WORDS(last.said);
    EXPECT_FALSE(last.says("cut off")) << last.said;
}

TEST(OffFiles, VerticesThatAreNoneAreRefusedByTheirLine) {
    const auto said = [](const std::string& kind, const std::string& vertex) {
        return meshTextOf("a.off", kind + "\n3 1 0\n0 0 0 0 0 1 0 0\n" + vertex + "\n0 1 0 0 0 1 0 0\n3 0 1 2\n");
    };
    for (const auto& [kind, vertex] : {std::pair("OFF", "1 x 0"), std::pair("OFF", "1 0"), std::pair("OFF", "1 0 0y"),
                                       std::pair("NOFF", "1 0 0 0 1"), std::pair("STOFF", "1 0 0 1"),
                                       std::pair("4OFF", "1 0 0"), std::pair("COFF", "1 0 0 1 1")}) {
        const MeshText refused = said(kind, vertex);
        EXPECT_TRUE(refused.refused) << kind << " " << vertex << ": " << refused.said;
        EXPECT_WORDS(refused.said) << kind << " " << vertex;
    }
    for (const char* number : {"1", "+1", "1.", ".5", "-.5e-2", "1E3", "1e-400", "0,5"})
        EXPECT_FALSE(said("OFF", std::string(number) + " 0 0").refused) << number;
}

TEST(OffFiles, RemarksAndBlankLinesAreNoVerticesAndNoFaces) {
    for (const char* between : {"# remark\n", "  \n", "\t# 1 2 3\n\n", "\r\n"}) {
        const MeshText shown = meshTextOf(
            "a.off",
            fmt::format("OFF\n4 2 5\n0 0 0\n1 0 0\n{0}0 1 0\n1 1 0\n3 0 1 2 # the first\n{0}3 1 3 2\n", between));
        EXPECT_EQ(shown.triangles, 2u) << shown.said;
        EXPECT_EQ(shown.area, 1) << shown.said;
        EXPECT_FALSE(shown.says("left out")) << shown.said;
    }
}

TEST(OffFiles, OfEachKindAreReadAsTheirHeaderSays) {
    const auto of = [](const std::string& head, const std::string& behind,
                       const std::string& corners = "3 0 1 2\n3 1 3 2\n") {
        const auto vertex = [&](const char* place) { return place + behind + "\n"; };
        return meshTextOf("a.off",
                          head + "\n4 2 0\n" + vertex("0 0") + vertex("2 0") + vertex("0 2") + vertex("2 2") + corners);
    };
    for (const auto& [head, behind, area] :
         {std::tuple("OFF", " 0", 4.0), std::tuple("nOFF\n3", " 0", 4.0), std::tuple("nOFF 2", "", 4.0),
          std::tuple("4OFF", " 0 2", 1.0), std::tuple("NOFF", " 0 0 0 1", 4.0), std::tuple("COFF", " 0 1 0 0 1", 4.0),
          std::tuple("STOFF", " 0 0.5 0.5", 4.0), std::tuple("STCN4OFF", " 0 2 0 0 1 1 0 0 1 0.5 0.5", 1.0)}) {
        const MeshText shown = of(head, behind);
        EXPECT_EQ(shown.triangles, 2u) << head << ": " << shown.said;
        EXPECT_EQ(shown.area, area) << head;
        EXPECT_EQ(shown.texcoords > 0, std::string_view(head).starts_with("ST")) << head;
        EXPECT_EQ(shown.colors.size() > 0, std::string_view(head).find('C') != std::string_view::npos) << head;
        EXPECT_FALSE(shown.says("left out")) << shown.said;
    }
    // Colours of 0 to 1 or of 0 to 255, with an opacity or without.
    for (const char* color : {" 0 1 0 0.2 1", " 0 1 0 0.2", " 0 255 0 51 255", " 0 255 0 51"}) {
        const MeshText shown = of("COFF", color);
        ASSERT_EQ(shown.colors.size(), 16u) << color << ": " << shown.said;
        EXPECT_EQ(std::vector<std::uint8_t>(shown.colors.begin(), shown.colors.begin() + 4),
                  (std::vector<std::uint8_t>{255, 0, 51, 255}))
            << color;
    }
    const MeshText uncounted = meshTextOf("a.off", "OFF\n4 2\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n");
    EXPECT_EQ(uncounted.triangles, 2u) << "edges need not be counted: " << uncounted.said;
}

TEST(OffFiles, WhatIsBehindVerticesAndCornersIsNamed) {
    const MeshText faces = meshTextOf("a.off", squareOff("3 0 1 2 255 0 0\n3 1 3 2\n"));
    EXPECT_EQ(faces.triangles, 2u) << faces.said;
    EXPECT_WORDS(faces.said);
    const MeshText vertices = meshTextOf("a.off", "OFF\n3 1 0\n0 0 0 1\n1 0 0 1\n0 1 0\n3 0 1 2\n");
    EXPECT_EQ(vertices.triangles, 1u) << vertices.said;
    EXPECT_WORDS(vertices.said);
}

TEST(OffFiles, FacesOfManyCornersAreShown) {
    std::string vertices;
    constexpr int kCorners = 40;  // of a wheel; and of a comb, whose teeth no fan would leave apart
    std::string wheel = std::to_string(kCorners), comb = wheel;
    for (int i = 0; i < kCorners; ++i) {
        vertices +=
            fmt::format("{} {} 0\n", std::cos(2 * EIGEN_PI * i / kCorners), std::sin(2 * EIGEN_PI * i / kCorners));
        wheel += fmt::format(" {}", i);
        comb += fmt::format(" {}", kCorners + i);
    }
    for (int i = 0; i < kCorners - 2; ++i) vertices += fmt::format("{} {} 0\n", kCorners - 2 - i, i % 2 == 0 ? 10 : 1);
    vertices += fmt::format("0 0 0\n{} 0 0\n", kCorners - 2);
    const MeshText round =
        meshTextOf("a.off", fmt::format("OFF\n{} 2 0\n{}{}\n3 0 1 2\n", 2 * kCorners, vertices, wheel));
    EXPECT_EQ(round.triangles, kCorners - 2u + 1u) << round.said;
    EXPECT_NEAR(round.area,
                0.5 * kCorners * std::sin(2 * EIGEN_PI / kCorners) +
                    0.5 * (2 * std::sin(2 * EIGEN_PI / kCorners) - std::sin(4 * EIGEN_PI / kCorners)),
                1e-5);
    const MeshText toothed = meshTextOf("a.off", fmt::format("OFF\n{} 1 0\n{}{}\n", 2 * kCorners, vertices, comb));
    EXPECT_EQ(toothed.triangles, kCorners - 2u) << toothed.said;
    double area = 0;  // under the teeth, from 38 down to 1, then down to the origin
    for (int i = 0; i < kCorners - 3; ++i) area += 5.5;
    EXPECT_NEAR(toothed.area, area + 0.5 * 1, 1e-4);
    EXPECT_FALSE(toothed.says("left out")) << toothed.said;
}

TEST(OffFiles, WhatIsMadeOfThemIsSound) {
    std::string many = squareOff("3 0 1 2\n# remark\n3 1 9 2\n11 0 1 3 2 0 1 3 2 0 1 3 1 0 0\n" +
                                 std::string(5000, '3') + " 1\n3 1 3 2 " + std::string(5000, '1') + "\n");
    many.replace(many.find("4 6 0"), 5, "4 5 0");
    const ByteSpan span = asBytes(many);
    Bytes bytes(span.begin(), span.end());
    std::vector<std::string> notes, again;
    const Expected<bool> mended = mendOff(bytes, notes);
    ASSERT_TRUE(mended && *mended) << (mended ? "" : mended.error().message);
    EXPECT_EQ(notes.size(), 2u) << fmt::format("{}", fmt::join(notes, "\n"));
    const Expected<bool> changed = mendOff(bytes, again);
    EXPECT_TRUE(changed && !*changed) << "nobody has anything to say of it";
    EXPECT_TRUE(again.empty());
    EXPECT_EQ(meshTextOf("a.off", many).triangles, 2u + 9u);
}

std::string facetOf(const std::vector<const char*>& corners) {
    return fmt::format("facet normal 0 0 1\n outer loop\n  vertex {}\n endloop\nendfacet\n",
                       fmt::join(corners, "\n  vertex "));
}

TEST(StlFiles, AFacetOfMoreThanThreeCornersIsShownWhole) {
    const std::string first = "solid of mine\n" + facetOf({"0 0 0", "1 0 0", "1 1 0", "0 1 0"}) +
                              facetOf({"0 0 0", "0 -1 0", "1 0 0"}) + "endsolid of mine\n";
    const MeshText square = meshTextOf("a.stl", first);
    EXPECT_EQ(square.triangles, 3u) << square.said;
    EXPECT_EQ(square.area, 1.5);
    // An L, which a fan from its first corner would leave; in the second solid.
    const MeshText two = meshTextOf(
        "a.stl", first + "solid\n" + facetOf({"7 0 0", "7 1 0", "6 1 0", "6 2 0", "5 2 0", "5 0 0"}) + "endsolid\n");
    EXPECT_EQ(two.triangles, 7u) << two.said;
    EXPECT_EQ(two.area, 1.5 + 3);
    // Cut off, it is whole facets still.
    const MeshText cut = meshTextOf("a.stl", first.substr(0, first.find("vertex 0 -1")));
    EXPECT_EQ(cut.triangles, 2u) << cut.said;
    const MeshText bad = meshTextOf("a.stl", "solid\n" + facetOf({"0 0 0", "1 0 0", "1 1 0", "0 x 0"}) + "endsolid\n");
    EXPECT_TRUE(bad.refused) << bad.said;
    EXPECT_WORDS(bad.said);
}

// Assimp joins what is nearer than 1e-5 to each other.
/// Names in UTF-8 stay; of those in an older encoding nobody knows which letters they are.
TEST(ObjFiles, KeepTheirNamesInUtf8) {
    const auto nameOfFirst = [](const std::string& name) {
        const Scratch scratch;
        Expected<ImportedScene> scene = importScene(
            scratch.write("a.obj", "o " + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), kRootNode, importOptions());
        EXPECT_TRUE(scene) << messageOf(scene);
        if (!scene) return std::string();
        const ImportedAspect aspect(std::move(*scene));
        for (const std::string& wanted : {std::string("Geh\xc3\xa4use"), std::string("Geh_use")})
            if (findNode(*aspect, "/a/" + wanted)) return wanted;
        return std::string();
    };
    EXPECT_EQ(nameOfFirst("Geh\xc3\xa4use"), "Geh\xc3\xa4use");
    EXPECT_EQ(nameOfFirst("Geh\xe4use"), "Geh_use");
}

TEST(ObjFiles, VerticesThatDifferStayApartHoweverSmallTheModelIs) {
    constexpr int kSide = 5;
    for (const double spacing : {1.0, 1e-4, 1e-5, 1e-6, 1e-8, 1e6}) {
        std::string text;
        for (int i = 0; i < kSide; ++i)
            for (int j = 0; j < kSide; ++j) text += fmt::format("v {} {} 0\n", i * spacing, j * spacing);
        for (int i = 0; i + 1 < kSide; ++i)
            for (int j = 1; j < kSide; ++j) {
                const int at = i * kSide + j;
                text +=
                    fmt::format("f {} {} {}\nf {} {} {}\n", at, at + kSide, at + 1, at + 1, at + kSide, at + kSide + 1);
            }
        const MeshText shown = meshTextOf("a.obj", text);
        EXPECT_EQ(shown.triangles, 32u) << spacing;
        EXPECT_NEAR(shown.area / spacing / spacing, 16, 1e-5) << spacing;
        EXPECT_EQ(shown.normals, std::size_t{12} * kSide * kSide) << spacing << ": equal ones are joined";
    }
}

}  // namespace
}  // namespace tessera
