/// The table of formats: as the importer itself tells which files it reads, and as FORMATS.md has it.
#include "server/import/FormatTable.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

namespace tessera {
namespace {

/// As the readers of a program say them, in a process of their own; without the first dot.
std::set<std::string> endingsOf(const std::string& program) {
    std::FILE* const list = ::popen((TESSERA_BIN_DIR "/" + program + " --endings").c_str(), "r");
    if (list == nullptr) return {};
    std::string says;
    std::array<char, 4096> piece{};
    for (std::size_t got = 0; (got = std::fread(piece.data(), 1, piece.size(), list)) > 0;)
        says.append(piece.data(), got);
    EXPECT_EQ(::pclose(list), 0);
    std::set<std::string> endings;
    std::istringstream lines(says);
    for (std::string line; std::getline(lines, line);) endings.insert(line.substr(1));
    return endings;
}

TEST(FormatTable, HasARowForEachEndingThatTheImporterReadsAndForNoOther) {
    std::set<std::string> read;
    for (const char* program : {"tessera-import", "tessera-import-coin"})
        for (const std::string& ending : endingsOf(program)) {
            read.insert(ending);
            EXPECT_TRUE(isModelEnding(ending)) << ending;
            EXPECT_EQ(readingProgram(ending), program) << ending;
        }
    EXPECT_GT(read.size(), 60u);
    const std::vector<std::string_view> told = modelEndings();
    for (const std::string_view ending : told) EXPECT_TRUE(read.contains(std::string(ending))) << ending;
    EXPECT_EQ(std::ranges::adjacent_find(told), told.end()) << "a file has one reader";
    for (const char* none : {"", "nothing", "png", "mtl", "bin", "txt", "GLB", "panel"})
        EXPECT_FALSE(isModelEnding(none)) << none;
}

TEST(FormatTable, SaysOfEachFormatWhatArrivesAndWhatDoesNot) {
    for (const FormatRow& row : formatTable())
        for (const std::string_view cell : {row.name, row.endings, row.reader, row.arrives, row.lost})
            EXPECT_FALSE(cell.empty()) << row.name;
}

/// Whoever changes one of them runs `tessera-check --formats`, and puts what it prints between the fences.
TEST(FormatTable, IsTheSameInItsPageAndAtTheTerminal) {
    std::ifstream page(TESSERA_SOURCE_DIR "/server/import/FORMATS.md");
    const std::string text{std::istreambuf_iterator<char>(page), {}}, fence = "```\n";
    const std::size_t begin = text.find(fence);
    ASSERT_NE(begin, std::string::npos) << "FORMATS.md has no table";
    const std::size_t from = begin + fence.size();
    std::istringstream kept(text.substr(from, text.find(fence, from) - from)), printed(formatsText());
    for (std::string ours, theirs; std::getline(printed, ours);) {
        EXPECT_LE(ours.size(), 80u) << ours;
        ASSERT_TRUE(std::getline(kept, theirs)) << "FORMATS.md lacks: " << ours;
        ASSERT_EQ(ours, theirs);
    }
    std::string more;
    EXPECT_FALSE(std::getline(kept, more)) << "FORMATS.md has besides: " << more;
}

}  // namespace
}  // namespace tessera
