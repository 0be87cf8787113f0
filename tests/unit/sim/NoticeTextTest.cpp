/// The words of notices: bounded, and harmless whatever a program says.
#include "server/programs/NoticeText.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

/// Whole UTF-8, no control characters but ends of lines, nothing that turns the direction of what follows.
bool harmless(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
        const auto byte = [&](std::size_t k) {
            return static_cast<unsigned char>(i + k < text.size() ? text[i + k] : 0);
        };
        if (byte(0) < 0x80) {
            if ((byte(0) < 0x20 && text[i] != '\n') || byte(0) == 0x7f) return false;
            ++i;
            continue;
        }
        const std::size_t size = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
        if (byte(0) < 0xc2 || byte(0) > 0xf4) return false;
        for (std::size_t k = 1; k < size; ++k)
            if ((byte(k) & 0xc0) != 0x80) return false;
        const std::string_view letter = text.substr(i, size);
        for (const std::string_view bad :
             {"\xc2\x85", "\xe2\x80\xae", "\xe2\x80\xaa", "\xe2\x81\xa6", "\xe2\x80\xa8", "\xef\xbb\xbf"})
            if (letter == bad) return false;
        i += size;
    }
    return true;
}

TEST(NoticeText, SaysWhereAndWhatAndHowMuchIsLeftOut) {
    const NoticeText brief = noticeText("/hall/pump", ObjectId(12), "surface, line 3: 'colour' undeclared");
    EXPECT_EQ(brief.text, "/hall/pump: SurfaceProgram #12\nsurface, line 3: 'colour' undeclared");
    EXPECT_EQ(brief.lines, 2u);
    EXPECT_EQ(brief.columns, 36u);
    EXPECT_WORDS(noticeText("/" + std::string(500, 'a') + "/pump", ObjectId(3), "x").text);
    std::string words;
    for (int i = 0; i < 500; ++i) words += "word ";
    const NoticeText cut = noticeText("/a", ObjectId(7), words);
    EXPECT_EQ(cut.lines, NoticeText::kMostLines);
    EXPECT_EQ(cut.text.find("wo\n"), std::string::npos) << "between words";
    EXPECT_WORDS(cut.text);
    // What is said and what is left out are all of it.
    const std::size_t begin = cut.text.find('\n') + 1, end = cut.text.rfind("… and ");
    const std::string said = cut.text.substr(begin, end - begin);
    EXPECT_EQ(said.size() + std::stoul(cut.text.substr(end + 8)), words.size() - 1);
    EXPECT_EQ(noticeText("/a", ObjectId(7), "").lines, 2u);
    // One letter too many for a line, and none that a line could end at.
    const NoticeText solid = noticeText("/a", ObjectId(7), std::string(NoticeText::kColumns + 1, 'x'));
    EXPECT_EQ(solid.lines, 3u);
}

TEST(NoticeText, WhateverAProgramSaysIsHarmless) {
    EXPECT_EQ(noticeText("/a", ObjectId(1), "one\x1b[31m two\r\nthree\x07").text,
              "/a: SurfaceProgram #1\none [31m two three");
    EXPECT_EQ(noticeText("/a", ObjectId(1), "\xff\xfe a \xc3").text, "/a: SurfaceProgram #1\n?? a ?");
    EXPECT_EQ(noticeText("/a", ObjectId(1),
                         "\xe2\x80\xae"
                         "abc")
                  .text,
              "/a: SurfaceProgram #1\nabc")
        << "not from right to left";
    forSeeds(100, [](Random& random) {
        for (int round = 0; round < 200; ++round) {
            std::string problem(below(random, 600), '\0'), path(below(random, 80), '\0');
            const auto any = [&] {
                return static_cast<char>(oneIn(random, 2) ? random()
                                                          : "ab \xe2\x80\xae\xf0\x9f\x98\x80"[below(random, 11)]);
            };
            std::ranges::generate(problem, any);
            std::ranges::generate(path, any);
            const NoticeText notice = noticeText(path, ObjectId(random()), problem);
            ASSERT_TRUE(harmless(notice.text));
            ASSERT_LE(notice.lines, NoticeText::kMostLines);
            ASSERT_EQ(static_cast<std::size_t>(std::ranges::count(notice.text, '\n')) + 1, notice.lines);
            ASSERT_LE(notice.columns, NoticeText::kColumns + 20);
        }
    });
}

}  // namespace
}  // namespace tessera
