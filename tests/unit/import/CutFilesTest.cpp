/// Files that hold less than they announce, or end within something: what is whole is shown, and a note says how many
/// of how many; and those that hold more.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "common/cores/Geometry.h"
#include "server/import/reader/BeforeAssimp.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

/// Of one file by itself.
struct CutOutcome {
    std::uint64_t triangles = 0, points = 0;
    std::string said;  ///< notes, or why it is refused
    bool refused = false;
    [[nodiscard]] bool says(std::string_view part) const { return said.find(part) != std::string::npos; }
};
CutOutcome outcomeOf(const std::string& name, const std::string& bytes, bool verbatim = false) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    options.verbatim = verbatim;
    Expected<ImportedScene> scene = importScene(scratch.write(name, bytes), kRootNode, options);
    if (!scene) return {.said = messageOf(scene), .refused = true};
    CutOutcome outcome{.triangles = scene->triangles, .said = fmt::format("{}", fmt::join(scene->notes, "\n"))};
    const ImportedAspect aspect(std::move(*scene));
    for (const Geometry* geometry : allOf<Geometry>(aspect))
        if (geometry->primitive == Geometry::kPoints) outcome.points += geometry->positions.sizeBytes() / 12;
    return outcome;
}

template <typename Number>
void put(std::string& bytes, Number number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

/// Triangles side by side; the header announces as many as it is told.
std::string binaryStl(std::uint32_t announced, std::uint32_t there, const std::string& head = "made by hand") {
    std::string bytes = head;
    bytes.resize(80, ' ');
    put(bytes, announced);
    for (std::uint32_t t = 0; t < there; ++t) {
        const auto x = static_cast<float>(t);
        for (const float number : {0.0f, 0.0f, 1.0f, x, 0.0f, 0.0f, x + 1, 0.0f, 0.0f, x, 1.0f, 0.0f})
            put(bytes, number);
        put(bytes, std::uint16_t{0});
    }
    return bytes;
}

TEST(CutFiles, ABinaryStlIsShownAsFarAsItGoes) {
    const CutOutcome whole = outcomeOf("a.stl", binaryStl(5, 5));
    EXPECT_EQ(whole.triangles, 5u) << whole.said;
    EXPECT_FALSE(whole.says("cut")) << whole.said;
    for (const char* head : {"made by hand", "solid made by hand"}) {
        const std::string cut = binaryStl(5, 5, head).substr(0, 84 + 3 * 50 + 21);
        const CutOutcome shown = outcomeOf("a.stl", cut);
        EXPECT_EQ(shown.triangles, 3u) << shown.said;
        EXPECT_WORDS(shown.said);
    }
    EXPECT_WORDS(outcomeOf("a.stl", binaryStl(2, 1)).said);
    const CutOutcome none = outcomeOf("a.stl", binaryStl(5, 5).substr(0, 100));
    EXPECT_TRUE(none.refused) << none.said;
    EXPECT_WORDS(none.said);
    const CutOutcome head = outcomeOf("a.stl", binaryStl(5, 5).substr(0, 83));
    EXPECT_TRUE(head.refused) << head.said;
    EXPECT_WORDS(head.said);
}

TEST(CutFiles, WhatABinaryStlHasBehindItsTrianglesIsCounted) {
    const CutOutcome more = outcomeOf("a.stl", binaryStl(2, 3) + "remark");
    EXPECT_EQ(more.triangles, 2u) << more.said;
    EXPECT_WORDS(more.said);
    const CutOutcome words = outcomeOf("a.stl", binaryStl(4, 4) + std::string(50, 'x'));  // no numbers of a triangle
    EXPECT_EQ(words.triangles, 4u) << words.said;
    EXPECT_WORDS(words.said);
    const CutOutcome uncounted = outcomeOf("a.stl", binaryStl(0, 3));
    EXPECT_EQ(uncounted.triangles, 3u) << uncounted.said;
    EXPECT_WORDS(uncounted.said);
}

TEST(CutFiles, WhatIsNoStlIsNotTakenForACutOne) {
    const std::string page = "<!DOCTYPE html><html><head><title>404 Not Found</title></head><body>" +
                             std::string(400, ' ') + "</body></html>";
    std::string noise(3000, '\0');
    for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<char>(i * 2654435761u >> 13);
    for (const std::string& other : {page, noise}) {
        const CutOutcome outcome = outcomeOf("a.stl", other);
        EXPECT_TRUE(outcome.refused) << outcome.said;
        EXPECT_FALSE(outcome.says("triangles")) << outcome.said;
    }
}

std::string facet(int number) {
    return fmt::format(
        "facet normal 0 0 1\n outer loop\n  vertex {0} 0 0\n  vertex {1} 0 0\n  vertex {0} 1 0\n endloop\nendfacet\n",
        number, number + 1);
}

TEST(CutFiles, AnStlInTextEndsWithAWholeTriangle) {
    const std::string text = "solid of mine\n" + facet(0) + facet(1) + facet(2) + "endsolid of mine\n";
    EXPECT_EQ(outcomeOf("a.stl", text).triangles, 3u);
    EXPECT_FALSE(outcomeOf("a.stl", text).says("cut")) << outcomeOf("a.stl", text).said;
    const std::size_t third = text.find("endfacet", text.find("vertex 1 1 0")) + 9;
    for (const auto& [end, triangles] :
         {std::pair(text.find("vertex 2 1 0") + 8, 2u), std::pair(text.rfind("endfacet"), 2u), std::pair(third, 2u),
          std::pair(text.find("facet normal") + 130, 1u)}) {
        const CutOutcome shown = outcomeOf("a.stl", text.substr(0, end));
        EXPECT_WORDS(shown.said) << end;
        EXPECT_EQ(shown.triangles, triangles) << end;
        const CutOutcome bare = outcomeOf("a.stl", text.substr(0, end), true);
        EXPECT_TRUE(bare.refused) << "whoever computes with it wants all of it: " << bare.said;
    }
    EXPECT_WORDS(outcomeOf("a.stl", text.substr(0, third), true).said);
    const CutOutcome none = outcomeOf("a.stl", text.substr(0, 60));
    EXPECT_TRUE(none.refused) << none.said;
    EXPECT_WORDS(none.said);
    // Two solids, the second one cut; what nobody reads; all in one line.
    const CutOutcome two = outcomeOf("a.stl", text + "solid next\n" + facet(7) + facet(8).substr(0, 50));
    EXPECT_EQ(two.triangles, 4u) << two.said;
    EXPECT_WORDS(two.said);
    const CutOutcome more = outcomeOf("a.stl", text + "shell next\n" + facet(7) + "endshell\n");
    EXPECT_EQ(more.triangles, 3u) << more.said;
    EXPECT_WORDS(more.said);
    std::string line = text;
    std::replace(line.begin() + 20, line.end(), '\n', ' ');
    EXPECT_FALSE(outcomeOf("a.stl", line).says("cut")) << outcomeOf("a.stl", line).said;
    std::string one = text;
    std::ranges::replace(one, '\n', ' ');
    for (const bool verbatim : {false, true}) {
        EXPECT_EQ(outcomeOf("a.stl", one, verbatim).triangles, 3u) << outcomeOf("a.stl", one, verbatim).said;
        EXPECT_FALSE(outcomeOf("a.stl", one, verbatim).says("cut"));
    }
    EXPECT_WORDS(outcomeOf("a.stl", one.substr(0, one.rfind("vertex"))).said);
    std::replace(line.begin(), line.end(), '\n', '\r');
    EXPECT_FALSE(outcomeOf("a.stl", line).says("cut")) << outcomeOf("a.stl", line).said;
}

/// Four corners, two faces; `lists`: of a length of one byte and corners of four.
std::string plyOf(const std::string& format) {
    std::string bytes = "ply\nformat " + format +
                        " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face "
                        "2\nproperty list uchar int vertex_indices\n"
                        "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n";
    if (format == "ascii") return bytes + "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n0 3\n";
    const auto number = [&](auto value) {
        std::string raw;
        put(raw, value);
        if (format == "binary_big_endian") std::ranges::reverse(raw);
        bytes += raw;
    };
    for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}) number(x);
    for (const std::array<int, 3>& corners : {std::array{0, 1, 2}, std::array{1, 3, 2}}) {
        bytes += '\3';
        for (const int corner : corners) number(corner);
    }
    number(0);
    number(3);
    return bytes;
}

TEST(CutFiles, APlyIsShownAsFarAsItGoes) {
    for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        SCOPED_TRACE(format);
        const std::string all = plyOf(format);
        const bool text = std::string_view(format) == "ascii";
        const std::size_t head = all.find("end_header\n") + 11, ofVertices = text ? 24 : 48, ofFace = text ? 8 : 13,
                          ofEdge = text ? 4 : 8;
        ASSERT_EQ(all.size(), head + ofVertices + 2 * ofFace + ofEdge);
        const CutOutcome whole = outcomeOf("a.ply", all);
        EXPECT_EQ(whole.triangles, 2u) << whole.said;
        EXPECT_FALSE(whole.says("cut")) << whole.said;
        const CutOutcome edge = outcomeOf("a.ply", all.substr(0, all.size() - ofEdge + 1));
        EXPECT_EQ(edge.triangles, 2u);
        EXPECT_WORDS(edge.said);
        for (const std::size_t end : {ofFace, ofFace + 3, 2 * ofFace - 3}) {
            const CutOutcome shown = outcomeOf("a.ply", all.substr(0, head + ofVertices + end));
            EXPECT_EQ(shown.triangles, 1u) << shown.said;
            EXPECT_WORDS(shown.said);
        }
        const CutOutcome none = outcomeOf("a.ply", all.substr(0, head + ofVertices + 3));
        EXPECT_TRUE(none.refused) << none.said;
        EXPECT_WORDS(none.said);
        const CutOutcome corners = outcomeOf("a.ply", all.substr(0, head + ofVertices - 4));
        EXPECT_TRUE(corners.refused) << corners.said;
        EXPECT_WORDS(corners.said);
    }
}

TEST(CutFiles, OfACutCloudTheOthersArePoints) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 1000\nproperty float x\nproperty float y\nproperty float "
        "z\nend_header\n";
    const CutOutcome shown = outcomeOf("a.ply", head + "0 0 0\n1 0 0\n0 1 0\n1 1");
    EXPECT_EQ(shown.points, 3u) << shown.said;
    EXPECT_WORDS(shown.said);
    EXPECT_TRUE(outcomeOf("a.ply", head).refused);
    // However far apart they are.
    EXPECT_EQ(outcomeOf("a.ply", head + "0 0 0\n1e15 0 0\n0 3e15 0\n").points, 3u);
}

TEST(CutFiles, AnOffIsShownAsFarAsItGoes) {
    const std::string text = "OFF\n# a square\n4 2 5\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n";
    EXPECT_EQ(outcomeOf("a.off", text).triangles, 2u);
    EXPECT_FALSE(outcomeOf("a.off", text).says("cut"));
    for (const std::size_t less : {1u, 2u})
        EXPECT_EQ(outcomeOf("a.off", text.substr(0, text.size() - less + 1)).triangles, 2u);
    for (const std::size_t less : {3u, 5u, 8u}) {
        const CutOutcome shown = outcomeOf("a.off", text.substr(0, text.size() - less));
        EXPECT_EQ(shown.triangles, 1u) << less << shown.said;
        EXPECT_WORDS(shown.said) << less;
    }
    const CutOutcome none = outcomeOf("a.off", text.substr(0, text.find("3 0 1 2") + 3));
    EXPECT_TRUE(none.refused) << none.said;
    EXPECT_WORDS(none.said);
    const CutOutcome corners = outcomeOf("a.off", text.substr(0, text.find("1 1 0")));
    EXPECT_TRUE(corners.refused) << corners.said;
    EXPECT_WORDS(corners.said);
    EXPECT_WORDS(outcomeOf("a.off", text + "3 0 3 1\n").said);
}

/// 17346 cut to 1734 is a number, too.
TEST(CutFiles, ALastNumberWithoutALineBreakIsInDoubt) {
    std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\nelement face "
        "1\nproperty list uchar int vertex_indices\nend_header\n";
    std::string off = "OFF\n12 1 0\n";
    for (int i = 0; i < 12; ++i)
        for (std::string* const file : {&ply, &off}) *file += fmt::format("{} {} 0\n", i, i * i);
    for (const auto& [name, head] : {std::pair("a.ply", ply), std::pair("a.off", off)}) {
        const CutOutcome shown = outcomeOf(name, head + "3 0 2 1");
        EXPECT_EQ(shown.triangles, 1u) << shown.said;
        EXPECT_WORDS(shown.said);
        EXPECT_WORDS(outcomeOf(name, head + "3 0 2 1", true).said) << "as bare geometry";
        for (const char* whole : {"3 0 2 1\n", "3 0 2 1\r\n", "3 0 2 1 ", "3 0 2 11\n\n"}) {
            EXPECT_FALSE(outcomeOf(name, head + whole).says("cut off")) << name << whole;
            EXPECT_FALSE(outcomeOf(name, head + whole, true).says("cut off")) << name << whole;
        }
        // Of what is no number, nobody doubts.
        const CutOutcome none = outcomeOf(name, head + "3 0 2 -");
        EXPECT_TRUE(none.refused) << none.said;
        EXPECT_WORDS(none.said);
    }
    for (const char* behind : {"3 0 2 1 255 0 2", "3 0 2 1 # eleven"})
        EXPECT_FALSE(outcomeOf("a.off", off + behind).says("cut off")) << "its corners are whole";
    const std::string cloud =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nelement face "
        "0\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0\n";
    const CutOutcome points = outcomeOf("a.ply", cloud + "1 1 17.3");
    EXPECT_EQ(points.points, 2u) << points.said;
    EXPECT_WORDS(points.said);
    const CutOutcome exponent = outcomeOf("a.ply", cloud + "1 1 17.3e");
    EXPECT_EQ(exponent.points, 1u) << exponent.said;
    EXPECT_WORDS(exponent.said);
}

TEST(CutFiles, ADxfOrSmdWithoutItsEndSaysSo) {
    const std::string dxf =
        "0\nSECTION\n2\nENTITIES\n0\n3DFACE\n8\n0\n10\n0\n20\n0\n30\n0\n11\n1\n21\n0\n31\n0\n12\n0\n22\n1\n32\n0\n13\n0"
        "\n23\n1\n33\n0\n0\nENDSEC\n0\nEOF\n";
    EXPECT_FALSE(outcomeOf("a.dxf", dxf).says("cut off")) << outcomeOf("a.dxf", dxf).said;
    EXPECT_WORDS(outcomeOf("a.dxf", dxf.substr(0, dxf.size() - 6)).said);
    const std::string smd =
        "version 1\nnodes\n0 \"root\" -1\nend\nskeleton\ntime 0\n0 0 0 0 0 0 0\nend\ntriangles\nnone.bmp\n0 0 0 0 0 0 "
        "1 0 0\n0 1 0 0 0 0 1 1 0\n0 0 1 0 0 0 1 0 1\nend\n";
    EXPECT_FALSE(outcomeOf("a.smd", smd).says("cut off"));
    EXPECT_WORDS(outcomeOf("a.smd", smd.substr(0, smd.size() - 4)).said);
}

TEST(FurtherProperties, OfAPlyAreNamedOnce) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float "
        "confidence\nproperty float intensity\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    const std::string rows = "0 0 0 1 2 9 9 9\n1 0 0 1 2 9 9 9\n0 1 0 1 2 9 9 9\n";
    const CutOutcome cloud = outcomeOf("a.ply", head + "end_header\n" + rows);
    EXPECT_EQ(cloud.points, 3u) << cloud.said;
    EXPECT_WORDS(cloud.said);
    EXPECT_EQ(cloud.said.find("confidence"), cloud.said.rfind("confidence")) << "once";
    const CutOutcome mesh =
        outcomeOf("a.ply", head +
                               "element face 1\nproperty list uchar int vertex_indices\nproperty uchar "
                               "quality\nelement camera 1\nproperty float view_px\n"
                               "property float view_py\nelement nothing 0\nproperty int id\nend_header\n" +
                               rows + "3 0 1 2 7\n0 1\n");
    EXPECT_EQ(mesh.triangles, 1u) << mesh.said;
    EXPECT_WORDS(mesh.said);
    EXPECT_FALSE(mesh.says("nothing")) << "there is none of it";
    std::string many =
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n",
                numbers = "0 0 0";
    for (int i = 0; i < 45; ++i) many += fmt::format("property float f_rest_{}\n", i), numbers += " 0";
    EXPECT_WORDS(outcomeOf("a.ply", many + "end_header\n" + numbers + "\n").said);
    const CutOutcome plain = outcomeOf("a.ply",
                                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                                       "y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                                       "end_header\n0 0 0 0 0 1\n");
    EXPECT_FALSE(plain.says("left out")) << plain.said;
}

/// At every byte: it is refused, or said, or nothing is missing but what ends a line.
TEST(CutFiles, AreToldFromWholeOnesAtEveryByte) {
    const auto blankEnd = [](const std::string& text) { return text.size() - (text.find_last_not_of(" \n") + 1); };
    const std::string off = "OFF\n# a square\n4 2 5\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n";
    const std::string stl = "solid of mine\n" + facet(0) + facet(1) + "endsolid of mine\n";
    struct File {
        const char* what;
        std::string bytes;
        Expected<bool> (*mend)(Bytes&, std::vector<std::string>&, std::vector<std::string>*);
        std::size_t from;     ///< what ends before it is no such file yet
        std::size_t missing;  ///< at the end, that nobody misses
    };
    const File files[] = {{"binary STL", binaryStl(3, 3), mendStl, 84, 0},
                          {"STL in text", stl, mendStl, 5, stl.size() - stl.find("endsolid") - 8},
                          {"PLY in text", plyOf("ascii"), mendPly, 1, blankEnd(plyOf("ascii"))},
                          {"PLY, little end first", plyOf("binary_little_endian"), mendPly, 1, 0},
                          {"PLY, big end first", plyOf("binary_big_endian"), mendPly, 1, 0},
                          {"OFF", off, mendOff, off.find("4 2") + 3, blankEnd(off)}};
    for (const File& file : files)
        for (std::size_t end = file.from; end < file.bytes.size() - file.missing; ++end) {
            const ByteSpan part = asBytes(std::string_view(file.bytes).substr(0, end));
            Bytes bytes(part.begin(), part.end());
            std::vector<std::string> notes;
            const Expected<bool> mended = file.mend(bytes, notes, nullptr);
            if (!mended) continue;
            EXPECT_TRUE(*mended && std::ranges::any_of(notes,
                                                       [](const std::string& note) {
                                                           return note.find("it is cut off") != std::string::npos;
                                                       }))
                << file.what << " " << end;
            // What is left is whole: nobody has anything to say of it.
            std::vector<std::string> again;
            const Expected<bool> changed = file.mend(bytes, again, nullptr);
            EXPECT_TRUE(changed && !*changed) << file.what << " " << end;
            EXPECT_TRUE(std::ranges::none_of(
                again, [](const std::string& note) { return note.find("cut off") != std::string::npos; }))
                << file.what << " " << end;
        }
}

/// Whole models, cut at many places: what is shown has fewer triangles only with a word about it, or all of them.
void expectNoneShorterWithoutAWord(const std::string& folder, std::initializer_list<const char*> names) {
    for (const char* name : names) {
        const std::string path = folder + name;
        std::string bytes(std::filesystem::file_size(path), '\0');
        std::ifstream(path, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        const std::string called = path.substr(path.rfind('/') + 1);
        const std::uint64_t all = outcomeOf(called, bytes).triangles;
        for (const std::size_t percent : {3u, 20u, 50u, 77u, 96u}) {
            const CutOutcome cut = outcomeOf(called, bytes.substr(0, bytes.size() * percent / 100));
            EXPECT_TRUE(cut.says("it is cut off") || cut.says("does not end") || cut.says("it ends after"))
                << name << " " << percent << " %: " << cut.said;
            EXPECT_LT(cut.triangles, all) << name;
        }
    }
}

TEST(CutFiles, OfModelsNoneIsShorterWithoutAWord) {
    expectNoneShorterWithoutAWord(TESSERA_SOURCE_DIR "/tests/data/models", {"/rim.stl", "/shell.ply"});
}

TEST(CutFiles, OfRealModelsNoneIsShorterWithoutAWord) {
    if (testData().empty()) GTEST_SKIP() << "no models beside the project";
    expectNoneShorterWithoutAWord(testData(), {"/cad/7_8ths_cube.stl", "/cad/ballA.off", "/cad/cycloidal.ply"});
}

}  // namespace
}  // namespace tessera
