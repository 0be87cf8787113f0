// DXF files that lie, are cut off, multiply or go in circles: a clear message, or the sound part of it.

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <sstream>

#include "common/cores/Geometry.h"
#include "server/import/reader/DxfReader.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Damage.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

const std::string kDxfFolder = TESSERA_SOURCE_DIR "/tests/data/dxf/";

/// The reader itself, without the child: as often as wanted.
Expected<PlainScene> readDxf(const std::string& bytes) {
    ReadLimits limits;
    limits.maxNodes = 100'000;
    Expected<DxfDocument> document = DxfDocument::open(bytes);
    if (!document) return tl::unexpected(document.error());
    return DxfReader(std::move(*document), bytes.size(), limits).read();
}

/// What it says where it refuses, else its notes.
std::string readDxfAlone(const std::string& bytes) {
    const Expected<PlainScene> scene = readDxf(bytes);
    if (!scene) return scene.error().message;
    std::string notes;
    for (const std::string& note : scene->notes) notes += note + "\n";
    return notes;
}

/// Groups, one a line: "0 LINE".
std::string groupsOf(const std::string& text) {
    std::istringstream lines(text);
    std::string out;
    for (std::string line; std::getline(lines, line);) {
        const std::size_t space = line.find(' ');
        out += line.substr(0, space) + "\n" + (space == line.npos ? "" : line.substr(space + 1)) + "\n";
    }
    return out;
}

std::string blocksAndEntities(const std::string& blocks, const std::string& entities) {
    return groupsOf("0 SECTION\n2 BLOCKS\n" + blocks + "0 ENDSEC\n0 SECTION\n2 ENTITIES\n" + entities +
                    "0 ENDSEC\n0 EOF\n");
}

bool dxfSays(const std::string& said, std::string_view part) {
    return said.find(part) != std::string::npos;
}

TEST(DxfHostile, FilesCutAnywhereSayWhere) {
    for (const char* name : {"kinds-r12.dxf", "kinds-r12-binary.dxf"}) {
        const std::string whole = contentOf(kDxfFolder + name);
        const std::string place = std::string(name).find("binary") == std::string::npos ? "line " : "byte ";
        for (std::size_t size = 30; size + 20 < whole.size(); size += 41) {
            const std::string said = readDxfAlone(whole.substr(0, size));
            EXPECT_TRUE(dxfSays(said, place) || dxfSays(said, "it is no DXF"))
                << name << " of " << size << ": " << said;
        }
    }
}

class DxfDamage : public testing::TestWithParam<const char*> {};

TEST_P(DxfDamage, LeadsToASceneOrWords) {
    const std::string whole = contentOf(kDxfFolder + GetParam());
    const Seeds seeds(2'500);
    std::size_t read = 0;
    for (unsigned seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=*DxfDamage*", seed));
        std::mt19937 random(seed);
        std::string bytes = whole;
        for (std::uint32_t changes = 1 + seed % 4; changes > 0; --changes) {
            const std::size_t at = random() % bytes.size();
            // Digits become others more often than anything: numbers lie, and the file is still one.
            if (bytes[at] >= '0' && bytes[at] <= '9' && random() % 4 != 0)
                bytes[at] = static_cast<char>('0' + random() % 10);
            else
                bytes[at] = static_cast<char>(random() % 256);
        }
        const Expected<PlainScene> scene = readDxf(bytes);
        read += scene ? 1 : 0;
        if (scene)
            expectSoundMeshes(*scene);
        else
            EXPECT_FALSE(scene.error().message.empty());
        if (testing::Test::HasFailure()) return;
    }
    expectSomeRead(read, seeds);
}

INSTANTIATE_TEST_SUITE_P(Of, DxfDamage,
                         testing::Values("kinds.dxf", "kinds-binary.dxf", "kinds-r12.dxf", "kinds-r12-binary.dxf"),
                         [](const auto& test) {
                             std::string name = test.param;
                             std::ranges::replace_if(
                                 name, [](char c) { return c == '-' || c == '.'; }, '_');
                             return name;
                         });

TEST(DxfHostile, WhatIsNoGroupIsNamedWithItsLine) {
    EXPECT_WORDS(readDxfAlone("hello\nworld\n"));
    EXPECT_WORDS(readDxfAlone(""));
    EXPECT_WORDS(readDxfAlone("5\nx\n"));
    EXPECT_WORDS(readDxfAlone("0\nSECTION\n2\nENTITIES\n0\nLINE\nten\n1\n"));
    EXPECT_WORDS(readDxfAlone(std::string("AutoCAD Binary DXF\r\n\x1a\0\0\0SECTION\0\x50\0\1", 36)));
}

/// A file within the child: within 2 s of its own time.
Expected<ImportedScene> importDxfWithin2s(const std::string& bytes) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    if (!kSanitized) options.maxCpuTime = std::chrono::seconds(2);
    return importScene(scratch.write("hostile.dxf", bytes), kRootNode, options);
}

TEST(DxfHostile, BlocksThatHoldThemselvesOrMultiplyAreLeftOut) {
    const Expected<ImportedScene> circle = importDxfWithin2s(blocksAndEntities(
        "0 BLOCK\n2 A\n0 LINE\n11 1\n0 INSERT\n2 B\n0 ENDBLK\n0 BLOCK\n2 B\n0 INSERT\n2 A\n0 ENDBLK\n",
        "0 INSERT\n2 A\n"));
    ASSERT_TRUE(circle) << messageOf(circle);
    EXPECT_WORDS(notesIn(*circle));
    EXPECT_EQ(circle->geometries, 1u);
    // Each of 30 holds the one before ten times.
    std::string blocks = "0 BLOCK\n2 B0\n0 LINE\n11 1\n0 LINE\n62 3\n12 1\n0 ENDBLK\n";
    for (int i = 1; i < 30; ++i) {
        blocks += fmt::format("0 BLOCK\n2 B{}\n", i);
        for (int k = 0; k < 10; ++k) blocks += fmt::format("0 INSERT\n2 B{}\n10 {}\n", i - 1, k);
        blocks += "0 ENDBLK\n";
    }
    EXPECT_WORDS(messageOf(importDxfWithin2s(blocksAndEntities(blocks, "0 INSERT\n2 B29\n"))));
    const Expected<ImportedScene> rows = importDxfWithin2s(blocksAndEntities(
        "0 BLOCK\n2 A\n0 LINE\n11 1\n0 ENDBLK\n", "0 INSERT\n2 A\n70 32767\n71 32767\n0 LINE\n11 1\n"));
    ASSERT_TRUE(rows) << messageOf(rows);
    EXPECT_WORDS(notesIn(*rows));
    EXPECT_EQ(rows->geometries, 1u);
    // As many looks as there are colours, of a block that takes long to read.
    std::string large = "0 BLOCK\n2 A\n", inserts;
    for (int i = 0; i < 20'000; ++i) large += "0 LINE\n62 0\n11 1\n";
    for (int i = 0; i < 20'000; ++i) inserts += fmt::format("0 INSERT\n2 A\n420 {}\n", i);
    const Expected<ImportedScene> looks = importDxfWithin2s(blocksAndEntities(large + "0 ENDBLK\n", inserts));
    ASSERT_TRUE(looks) << messageOf(looks);
    EXPECT_WORDS(notesIn(*looks));
}

TEST(DxfHostile, MoreCurvesThanTheirBytesBearAreLeftOut) {
    std::string circles;
    for (int i = 0; i < 700'000; ++i) circles += "0\nCIRCLE\n40\n1\n";
    for (int i = 0; i < 10; ++i) circles += "0\nLWPOLYLINE\n10\n0\n20\n0\n42\n1\n10\n1\n20\n1\n";
    const Expected<ImportedScene> scene =
        importDxfWithin2s("0\nSECTION\n2\nENTITIES\n" + circles + "0\nLINE\n11\n1\n0\nENDSEC\n0\nEOF\n");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_WORDS(notesIn(*scene));
}

TEST(DxfHostile, VeryManyCirclesAreRoughRatherThanLeftOut) {
    std::string circles;
    for (int i = 0; i < 400'000; ++i)
        circles += fmt::format("0\nCIRCLE\n8\n0\n10\n{}.5\n20\n{}.5\n40\n0.25\n", i % 1000, i / 1000);
    const Expected<ImportedScene> scene =
        importDxfWithin2s("0\nSECTION\n2\nENTITIES\n" + circles + "0\nENDSEC\n0\nEOF\n");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_FALSE(hasNote(*scene, "left out")) << scene->notes.front();
    EXPECT_WORDS(notesIn(*scene));
    // As programs write them they have room.
    circles.clear();
    for (int i = 0; i < 150'000; ++i)
        circles += fmt::format(
            "0\nCIRCLE\n5\n{:X}\n330\n1F\n100\nAcDbEntity\n8\n0\n100\nAcDbCircle\n10\n{}.523456\n20\n"
            "{}.5\n30\n0.0\n40\n0.25\n",
            i, i % 1000, i / 1000);
    const std::string said = readDxfAlone("0\nSECTION\n2\nENTITIES\n" + circles + "0\nENDSEC\n0\nEOF\n");
    EXPECT_FALSE(dxfSays(said, "chords")) << said;
}

TEST(DxfHostile, CirclesOfVeryFewBytesAllHaveRoomWhereTheyMay) {
    std::string circles;
    for (int i = 0; i < 450'000; ++i) circles += "0\nCIRCLE\n40\n1\n";
    const std::string said = readDxfAlone("0\nSECTION\n2\nENTITIES\n" + circles + "0\nENDSEC\n0\nEOF\n");
    EXPECT_FALSE(dxfSays(said, "left out")) << said;
    EXPECT_WORDS(said);
}

TEST(DxfHostile, OnePolylineOfVeryManyArcsIsRough) {
    std::string arcs = "0\nLWPOLYLINE\n";
    for (int i = 0; i < 600'000; ++i) arcs += fmt::format("10\n{}\n20\n{}\n42\n1\n", i % 1000, i / 1000);
    const Expected<ImportedScene> scene = importDxfWithin2s("0\nSECTION\n2\nENTITIES\n" + arcs + "0\nENDSEC\n0\nEOF\n");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_FALSE(hasNote(*scene, "left out")) << scene->notes.front();
    EXPECT_EQ(scene->geometries, 1u);
}

/// Of a block that came out empty, as there was no room, others of other colours have none either.
TEST(DxfHostile, CurvesThatHaveNoRoomAreCountedWhereverTheirBlockStands) {
    std::string circles, inserts;
    for (int i = 0; i < 1000; ++i) circles += "0 CIRCLE\n62 0\n40 1\n";
    for (int i = 0; i < 1500; ++i) inserts += fmt::format("0 INSERT\n2 A\n420 {}\n", i);
    const std::string said = readDxfAlone(blocksAndEntities("0 BLOCK\n2 A\n" + circles + "0 ENDBLK\n", inserts));
    const std::size_t at = said.find("(save the drawing in parts): ");
    ASSERT_NE(at, std::string::npos) << said;
    EXPECT_GT(std::stoul(said.substr(at + 29)), 1'000'000u) << said;
}

TEST(DxfHostile, LettersCountWhereverTheirBlockStands) {
    const std::string block = "0 BLOCK\n2 A\n0 TEXT\n40 1\n1 " + std::string(960, 'x') + "\n0 ENDBLK\n";
    const Expected<ImportedScene> many =
        importDxfWithin2s(blocksAndEntities(block, "0 INSERT\n2 A\n70 300\n71 300\n0 INSERT\n2 A\n"));
    ASSERT_TRUE(many) << messageOf(many);
    EXPECT_WORDS(notesIn(*many));
    EXPECT_EQ(many->geometries, 1u);
    // What is placed once counts once, however deep it is nested.
    std::string nested = "0 BLOCK\n2 B0\n";
    for (int i = 0; i < 55; ++i) nested += fmt::format("0 TEXT\n20 {}\n40 1\n1 {}\n", i, std::string(960, 'x'));
    for (int i = 1; i < 5; ++i) nested += fmt::format("0 ENDBLK\n0 BLOCK\n2 B{}\n0 INSERT\n2 B{}\n", i, i - 1);
    const Expected<ImportedScene> once =
        importDxfWithin2s(blocksAndEntities(nested + "0 ENDBLK\n", "0 INSERT\n2 B4\n"));
    ASSERT_TRUE(once) << messageOf(once);
    EXPECT_FALSE(hasNote(*once, "left out"));
    std::string texts;
    for (int i = 0; i < 4'000; ++i) texts += "0 TEXT\n40 1\n1 Комната\xc2\xb0\xc2\xb0\n";
    const std::string said = readDxfAlone(groupsOf(
        "0 SECTION\n2 HEADER\n9 $ACADVER\n1 AC1032\n0 ENDSEC\n0 SECTION\n2 ENTITIES\n" + texts + "0 ENDSEC\n0 EOF\n"));
    EXPECT_FALSE(dxfSays(said, "letters")) << said;
}

TEST(DxfHostile, CountsThatLieAndNumbersThatAreNoneLeaveTheRest) {
    const Expected<PlainScene> lying = readDxf(blocksAndEntities(
        "",
        "0 LWPOLYLINE\n90 2000000000\n10 0\n20 0\n10 1\n20 0\n0 CIRCLE\n40 1e300\n0 ARC\n40 nan\n"
        "0 SPLINE\n71 99\n72 2000000000\n40 1\n10 1\n0 MESH\n92 -5\n10 1\n93 2000000000\n90 4\n90 7\n90 8\n90 9\n"
        "0 POLYLINE\n70 16\n71 32767\n72 32767\n0 VERTEX\n10 1\n0 SEQEND\n"
        "0 POLYLINE\n70 64\n0 VERTEX\n70 192\n0 VERTEX\n70 128\n71 1\n72 2\n73 -99\n0 SEQEND\n"
        "0 HATCH\n70 1\n91 2000000000\n92 2\n93 -1\n10 0\n20 0\n10 1\n20 0\n10 1\n20 1\n92 1\n72 4\n94 99\n"
        "0 INSERT\n2 NONE\n70 -5\n0 TEXT\n40 -1\n1 x\n0 ELLIPSE\n11 inf\n0 3DFACE\n10 1\n11 2\n"));
    ASSERT_TRUE(lying) << lying.error().message;
    for (const std::string& note : lying->notes) EXPECT_WORDS(note);
    const Expected<ImportedScene> line =
        importDxfWithin2s(groupsOf("0 SECTION\n2 ENTITIES\n0 TEXT\n40 1\n1 " + std::string(50'000'000, 'x') +
                                   "\n0 LINE\n8 " + std::string(1'000'000, '"') + "\n11 1\n0 ENDSEC\n0 EOF\n"));
    ASSERT_TRUE(line) << messageOf(line);
    EXPECT_EQ(line->geometries, 2u) << "the line, and as many letters as a line may have";
}

TEST(DxfHostile, LettersFollowTheFilesBytes) {
    // As programs write them.
    std::string texts;
    for (int i = 0; i < 10'000; ++i)
        texts += fmt::format(
            "0 TEXT\n5 {:X}\n100 AcDbEntity\n8 LABELS\n100 AcDbText\n10 {}.0\n20 0.0\n30 0.0\n40 0.5\n1 Room{:05}\n",
            256 + i, i, i);
    const std::string said = readDxfAlone(groupsOf("0 SECTION\n2 ENTITIES\n" + texts + "0 ENDSEC\n0 EOF\n"));
    EXPECT_FALSE(dxfSays(said, "letters")) << said;
    texts.clear();
    for (int i = 0; i < 3'000; ++i) texts += fmt::format("0 MTEXT\n10 {}\n40 1\n1 {}\n", i, std::string(200, 'x'));
    EXPECT_WORDS(readDxfAlone(groupsOf("0 SECTION\n2 ENTITIES\n" + texts + "0 ENDSEC\n0 EOF\n")));
}

/// One of more than 4,096 bytes refused the whole drawing, and the end of a long line was lost without a word.
TEST(DxfHostile, LongTextsAreCutWithANote) {
    const auto drawing = [](const std::string& text) {
        return groupsOf("0 SECTION\n2 ENTITIES\n" + text + "0 CIRCLE\n40 1\n0 ENDSEC\n0 EOF\n");
    };
    std::string paragraphs = "0 MTEXT\n40 1\n";
    for (int i = 0; i < 20; ++i) paragraphs += "3 " + std::string(240, 'x') + "\\P\n";
    for (const std::string& text : {paragraphs, "0 TEXT\n40 1\n1 " + std::string(1'001, 'x') + "\n",
                                    "0 TEXT\n40 1\n1 " + std::string(100'000, 'x') + "\n"}) {
        const Expected<ImportedScene> scene = importDxfWithin2s(drawing(text));
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_WORDS(notesIn(*scene));
    }
    const Expected<ImportedScene> whole =
        importDxfWithin2s(drawing("0 TEXT\n40 1\n1 " + std::string(1'000, 'x') + "\n"));
    ASSERT_TRUE(whole) << messageOf(whole);
    EXPECT_FALSE(dxfSays(fmt::format("{}", fmt::join(whole->notes, "\n")), "ends of texts"));
}

}  // namespace
}  // namespace tessera
