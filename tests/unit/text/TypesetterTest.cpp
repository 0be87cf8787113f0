// Set in DejaVu, which every machine that was set up has (deploy/set-up).
#include "server/text/Typesetter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "common/drawable/Drawable.h"
#include "server/text/TextRuns.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

Text words(std::string text, std::int64_t alignment = Text::kLeft) {
    Text made;
    made.text = std::move(text);
    made.font = "DejaVu Sans";
    made.alignment = alignment;
    return made;
}

TextOutlines outlinesOf(const Text& text, std::vector<std::string>* notes = nullptr) {
    Typesetter typesetter;
    std::vector<std::string> own;
    const Expected<TextOutlines> made = typesetter.set(text, notes ? *notes : own);
    EXPECT_TRUE(made) << made.error().message;
    return made ? *made : TextOutlines();
}

std::string refusalOf(const Text& text) {
    Typesetter typesetter;
    std::vector<std::string> notes;
    const Expected<TextOutlines> made = typesetter.set(text, notes);
    return made ? "it was set" : made.error().message;
}

std::vector<std::int32_t> placesAlong(const TextOutlines& text) {
    std::vector<std::int32_t> places;
    for (const PlacedLetter& letter : text.letters) places.push_back(letter.at.x);
    return places;
}

/// From left to right as they stand.
std::vector<std::uint32_t> shapesInSight(const TextOutlines& text) {
    std::vector<std::pair<std::int32_t, std::uint32_t>> sorted;
    for (const PlacedLetter& letter : text.letters) sorted.emplace_back(letter.at.x, letter.shape);
    std::ranges::stable_sort(sorted);
    std::vector<std::uint32_t> shapes;
    for (const auto& [x, shape] : sorted) shapes.push_back(shape);
    return shapes;
}

TEST(Typesetter, PlacesLettersAlongLinesAndEachShapeIsThereOnce) {
    const TextOutlines text = outlinesOf(words("noon\nno"));
    EXPECT_EQ(text.shapes.size(), 2u);
    ASSERT_EQ(text.letters.size(), 6u);
    EXPECT_EQ(text.letters[0].at, (OutlinePoint{0, 0}));
    EXPECT_LT(text.letters[0].at.x, text.letters[1].at.x);
    EXPECT_EQ(text.letters[0].shape, text.letters[3].shape);
    EXPECT_EQ(text.letters[4].at, (OutlinePoint{0, -78643})) << "1.2 em below";
    EXPECT_EQ(text, outlinesOf(words("noon\nno"))) << "the same again";
    EXPECT_TRUE(outlinesOf(words("")).letters.empty());
    EXPECT_TRUE(outlinesOf(words(" \n \t ")).letters.empty()) << "blanks are to be seen by nobody";
}

TEST(Typesetter, KernsAndJoins) {
    const auto advance = [](const std::string& pair) {
        const TextOutlines text = outlinesOf(words(pair));
        return text.letters.at(1).at.x;
    };
    EXPECT_LT(advance("AV"), advance("AH")) << "V reaches under A";
    EXPECT_EQ(outlinesOf(words("ﬁ")).letters.size(), 1u);
    EXPECT_EQ(outlinesOf(words("fi")).letters.size(), 1u) << "DejaVu Sans joins f and i";
    EXPECT_EQ(outlinesOf(words("fi")).shapes, outlinesOf(words("ﬁ")).shapes);
    EXPECT_EQ(outlinesOf(words("é")).shapes, outlinesOf(words("e\u0301")).shapes) << "an accent that comes by itself";
}

TEST(Typesetter, LinesStandAsTheyAreAligned) {
    const std::vector<std::int32_t> left = placesAlong(outlinesOf(words("HHH"))),
                                    middle = placesAlong(outlinesOf(words("HHH", Text::kCenter))),
                                    right = placesAlong(outlinesOf(words("HHH", Text::kRight)));
    const std::int32_t width = left[1] * 3;
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(middle[i], left[i] - width / 2, 3);
        EXPECT_NEAR(right[i], left[i] - width, 3);
    }
}

TEST(Typesetter, WhatRunsFromRightToLeftStandsSo) {
    // Alef, bet, gimel: the first stands farthest right.
    const std::vector<std::uint32_t> hebrew = shapesInSight(outlinesOf(words("אבג"))),
                                     alef = shapesInSight(outlinesOf(words("א")));
    ASSERT_EQ(hebrew.size(), 3u);
    EXPECT_EQ(outlinesOf(words("אבג")).shapes[hebrew[2]], outlinesOf(words("א")).shapes[alef[0]]);
}

/// As they stand: the letters of each run, how it runs, and its script.
std::vector<std::tuple<std::u32string, bool, std::string>> runsFrom(std::u32string_view line) {
    std::vector<std::tuple<std::u32string, bool, std::string>> made;
    for (const TextRun& run : runsOf(line)) {
        std::string script;
        for (int shift = 24; shift >= 0; shift -= 8) script.push_back(static_cast<char>(run.script >> shift));
        made.emplace_back(line.substr(run.begin, run.length), run.rightToLeft, script);
    }
    return made;
}
using RunsOfLine = std::vector<std::tuple<std::u32string, bool, std::string>>;

/// Unicode's annex 9, with the annex's own examples where it has some.
TEST(TextRuns, StandAsTheLineRuns) {
    EXPECT_TRUE(runsFrom(U"").empty());
    EXPECT_EQ(runsFrom(U"12 + 3"), (RunsOfLine{{U"12 + 3", false, "Zyyy"}}));
    EXPECT_EQ(
        runsFrom(U"ab אב cd"),
        (RunsOfLine{{U"ab ", false, "Latn"}, {U"אב", true, "Hebr"}, {U" ", false, "Hebr"}, {U"cd", false, "Latn"}}));
    EXPECT_EQ(runsFrom(U"אב 1.5 גד"),
              (RunsOfLine{{U" גד", true, "Hebr"}, {U"1.5", false, "Hebr"}, {U"אב ", true, "Hebr"}}))
        << "a number is read from left to right";
    EXPECT_EQ(runsFrom(U"אב, גד"), (RunsOfLine{{U"אב, גד", true, "Hebr"}}));
    // A bracket belongs to what is around it, with all that is in it (N0); what is quoted in what is quoted has a level
    // of its own.
    EXPECT_EQ(runsFrom(U"ab (אב) cd"),
              (RunsOfLine{{U"ab (", false, "Latn"}, {U"אב", true, "Hebr"}, {U") cd", false, "Latn"}}));
    EXPECT_EQ(runsFrom(U"אב (cd) גד"),
              (RunsOfLine{{U") גד", true, "Hebr"}, {U"cd", false, "Latn"}, {U"אב (", true, "Hebr"}}));
    // An isolate runs by itself, and what is around it as though it were one sign (X5a).
    EXPECT_EQ(runsFrom(U"he said \u2067אב! cd\u2069."), (RunsOfLine{{U"he said \u2067", false, "Latn"},
                                                                    {U"cd", false, "Latn"},
                                                                    {U"אב! ", true, "Hebr"},
                                                                    {U"\u2069.", false, "Latn"}}));
    // An embedding of the other way (X2).
    EXPECT_EQ(runsFrom(U"ab \u202Bאב cd\u202C ef"), (RunsOfLine{{U"ab \u202B", false, "Latn"},
                                                                {U"cd\u202C", false, "Latn"},
                                                                {U"אב ", true, "Hebr"},
                                                                {U" ef", false, "Latn"}}));
}

/// Unicode's annex 24: signs have the script of what is before them, and a bracket that of the one that opens it.
TEST(TextRuns, EndWhereScriptsDo) {
    EXPECT_EQ(runsFrom(U"שלום سلام"), (RunsOfLine{{U"سلام", true, "Arab"}, {U"שלום ", true, "Hebr"}}));
    EXPECT_EQ(runsFrom(U"سلام שלום"), (RunsOfLine{{U"שלום", true, "Hebr"}, {U"سلام ", true, "Arab"}}));
    EXPECT_EQ(runsFrom(U"(סל) سلام"), (RunsOfLine{{U"سلام", true, "Arab"}, {U"(סל) ", true, "Hebr"}}));
    EXPECT_EQ(runsFrom(U"שלום (سلام)!"),
              (RunsOfLine{{U")!", true, "Hebr"}, {U"سلام", true, "Arab"}, {U"שלום (", true, "Hebr"}}));
    EXPECT_EQ(runsFrom(U"Ab (Ωλ) c"),
              (RunsOfLine{{U"Ab (", false, "Latn"}, {U"Ωλ", false, "Grek"}, {U") c", false, "Latn"}}));
    EXPECT_EQ(runsFrom(U"e\u0301 Ω\u0301"), (RunsOfLine{{U"e\u0301 ", false, "Latn"}, {U"Ω\u0301", false, "Grek"}}))
        << "a mark stays with its letter";
}

std::vector<LetterShape> lettersInSight(const std::string& line) {
    const TextOutlines text = outlinesOf(words(line));
    std::vector<LetterShape> letters;
    for (const std::uint32_t shape : shapesInSight(text)) letters.push_back(text.shapes[shape]);
    return letters;
}

bool hasLetters(const std::string& line, const std::vector<LetterShape>& word) {
    const std::vector<LetterShape> letters = lettersInSight(line);
    return std::search(letters.begin(), letters.end(), word.begin(), word.end()) != letters.end();
}

/// Arabic letters have other forms at the beginning, in the middle and at the end of a word.
TEST(Typesetter, JoinsArabicWhateverStandsBesideIt) {
    const std::vector<LetterShape> joined = lettersInSight("سلام");
    const std::vector<LetterShape> apart = lettersInSight("س ل ا م");
    ASSERT_FALSE(joined.empty());
    EXPECT_FALSE(hasLetters("م ا ل س", joined)) << "they are joined";
    EXPECT_NE(joined, apart);
    for (const char* line : {"שלום سلام", "سلام שלום", "שלום (سلام) שלום", "abc שלום سلام 12", "12 שלום سلام abc",
                             "سلام abc שלום", "Жя سلام", "שלום, سلام!"})
        EXPECT_TRUE(hasLetters(line, joined)) << line;
    // And each letter of a long word by itself.
    const std::vector<LetterShape> word = lettersInSight("بسملة");
    EXPECT_TRUE(hasLetters("אב بسملة גד", word));
}

TEST(Typesetter, BracketsOpenTowardsWhatTheyHold) {
    const LetterShape opens = lettersInSight("(a").at(0), closes = lettersInSight("a)").at(1);
    ASSERT_NE(opens, closes);
    // In each of these lines the letter that stands first from the left is the bracket of what was closed last.
    const std::vector<LetterShape> quoted = lettersInSight("אב (גד)");
    EXPECT_EQ(quoted.front(), opens);
    EXPECT_EQ(quoted.at(3), closes);
    const std::vector<LetterShape> mixed = lettersInSight("שלום (سلام)");
    EXPECT_EQ(mixed.front(), opens);
}

TEST(Typesetter, SaysWhatIsMissing) {
    std::vector<std::string> notes;
    Text text = words("Hello");
    text.font = "No Such Family";
    EXPECT_EQ(outlinesOf(text, &notes).letters.size(), 5u);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_WORDS(notes[0]);
    notes.clear();
    const TextOutlines boxes = outlinesOf(words("a\U00013000b"), &notes);
    EXPECT_EQ(boxes.letters.size(), 3u);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_WORDS(notes[0]);
    notes.clear();
    text.font = "sans:bold";
    outlinesOf(text, &notes);
    EXPECT_TRUE(notes.empty()) << "what is generic is always there";
    Text file = words("a");
    file.font = "sans:file=/etc/passwd";
    EXPECT_EQ(outlinesOf(file).letters.size(), 1u) << "a name leads to no file";
}

TEST(Typesetter, RefusesWhatIsNoTextInWords) {
    EXPECT_EQ(refusalOf(words("ab\xFF")), "the text is no UTF-8: its byte 2 begins no character");
    for (const char* bad : {"\x80", "\xC0\xAF", "\xE2\x82", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xE0\x80\x80"})
        EXPECT_WORDS(refusalOf(words(bad)));
    EXPECT_EQ(refusalOf(words(std::string(1 << 20, 'x'))), "the text has 1048576 bytes, at most 16384 are allowed");
    EXPECT_EQ(refusalOf(words(std::string(16384, 'W'))), "line 1 of the text is longer than 2048 em");
    Text far = words(std::string(200, '\n') + "x");
    far.lineSpacing = 1e3;
    EXPECT_EQ(refusalOf(far), "the lines of the text are farther apart than 2048 em");
    Text font = words("a");
    font.font = std::string(1000, 'f');
    EXPECT_WORDS(refusalOf(font));
    EXPECT_EQ(outlinesOf(words("a\x01\x1B\x7F\r\u202Eb")), outlinesOf(words("ab")))
        << "control characters are left out, and what says a direction is seen by nobody";

    const char* one = std::getenv("TESSERA_SEED");
    Typesetter typesetter;
    for (std::uint64_t seed = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? seed : 300; seed <= last;
         ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_text --gtest_filter=Typesetter.*");
        std::mt19937_64 random(seed);
        std::string text;
        for (std::uint64_t i = random() % 60; i > 0; --i) {
            const char32_t c = static_cast<char32_t>(random() % (random() % 2 == 0 ? 0x700 : 0x110000));
            if (random() % 40 == 0 || (c >= 0xD800 && c < 0xE000)) {
                text.push_back(static_cast<char>(random()));
                continue;
            }
            const int more = c < 0x80 ? 0 : c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
            constexpr unsigned kLead[] = {0, 0xC0, 0xE0, 0xF0};
            text.push_back(static_cast<char>(kLead[more] | c >> (6 * more)));
            for (int byte = more - 1; byte >= 0; --byte)
                text.push_back(static_cast<char>(0x80 | ((c >> (6 * byte)) & 0x3F)));
        }
        std::vector<std::string> notes;
        const Expected<TextOutlines> made = typesetter.set(words(text), notes);
        if (!made) {
            EXPECT_WORDS(made.error().message);
            continue;
        }
        const Expected<TextOutlines> back = TextOutlines::of(made->toBlob());
        ASSERT_TRUE(back) << back.error().message;
        for (const LetterShape& shape : back->shapes) EXPECT_TRUE(trianglesOf(shape, 128));
    }
}

/// By Green's formula on the curves themselves: 1/2 the integral of x dy - y dx, which Simpson's rule has exactly for
/// polynomials of degree 3, and two halves of Boole's for 5.
double areaOfCurves(const LetterShape& shape) {
    double area = 0;
    const auto cross = [](double ax, double ay, double bx, double by) { return ax * by - ay * bx; };
    for (const OutlineContour& contour : shape) {
        OutlinePoint from = contour.start;
        for (const OutlineSegment& s : contour.segments) {
            const OutlinePoint &p = s.points[0], &q = s.points[1], &r = s.points[2];
            if (s.degree == 1) area += cross(from.x, from.y, p.x, p.y) / 2;
            if (s.degree == 2)
                area += (2 * cross(from.x, from.y, p.x, p.y) + 2 * cross(p.x, p.y, q.x, q.y) +
                         cross(from.x, from.y, q.x, q.y)) /
                        6;
            if (s.degree == 3)
                area += (6 * cross(from.x, from.y, p.x, p.y) + 3 * cross(from.x, from.y, q.x, q.y) +
                         cross(from.x, from.y, r.x, r.y) + 3 * cross(p.x, p.y, q.x, q.y) +
                         3 * cross(p.x, p.y, r.x, r.y) + 6 * cross(q.x, q.y, r.x, r.y)) /
                        20;
            from = s.points[s.degree - 1];
        }
        area += cross(from.x, from.y, contour.start.x, contour.start.y) / 2;
    }
    return std::abs(area);
}

TEST(Letters, HaveTheAreaThatTheirCurvesAreAround) {
    std::string all;
    for (char c = '!'; c <= '~'; ++c) all += std::string(1, c) + ' ';  // blanks, so that nothing is joined
    for (const char* more : {"Ä", "ö", "ß", "é", "Å", "ø", "@", "&", "§", "%", "8", "Ж", "Ω", "א", "ش"})
        all += std::string(more) + " ";
    const TextOutlines text = outlinesOf(words(all));
    EXPECT_GT(text.shapes.size(), 100u);
    for (const LetterShape& shape : text.shapes) {
        const Expected<LetterTriangles> letter = trianglesOf(shape, 16);
        ASSERT_TRUE(letter);
        double area = 0, rim = 0;
        for (std::size_t i = 0; i < letter->triangles.size(); i += 3) {
            const OutlinePoint &a = letter->vertices[letter->triangles[i]],
                               &b = letter->vertices[letter->triangles[i + 1]],
                               &c = letter->vertices[letter->triangles[i + 2]];
            area += ((double(b.x) - a.x) * (double(c.y) - a.y) - (double(b.y) - a.y) * (double(c.x) - a.x)) / 2;
        }
        for (const auto& around : letter->rims)
            for (std::size_t i = 0; i < around.size(); ++i) {
                const OutlinePoint &a = letter->vertices[around[i]],
                                   &b = letter->vertices[around[(i + 1) % around.size()]];
                rim += std::hypot(double(a.x) - b.x, double(a.y) - b.y);
            }
        EXPECT_NEAR(area, areaOfCurves(shape), rim * (16 + 0.75)) << "chords are that near to the curves";
    }
}

/// Each side of a triangle, by the places of its ends, lies beside another that leads back; the volume by the
/// divergence theorem.
double volumeOfSolid(const MeshArrays& mesh) {
    using Place = std::array<float, 3>;
    const auto positions = mesh.positions.as<float>();
    const auto indices = mesh.indices.as<std::uint32_t>();
    std::map<std::pair<Place, Place>, int> sides;
    double volume = 0;
    for (std::size_t i = 0; i < indices.size(); i += 3) {
        std::array<Place, 3> p;
        std::array<Vec3d, 3> v;
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = {positions[3 * indices[i + k]], positions[3 * indices[i + k] + 1],
                    positions[3 * indices[i + k] + 2]};
            v[k] = Vec3d(p[k][0], p[k][1], p[k][2]);
        }
        for (std::size_t k = 0; k < 3; ++k)
            p[k] < p[(k + 1) % 3] ? ++sides[{p[k], p[(k + 1) % 3]}] : --sides[{p[(k + 1) % 3], p[k]}];
        volume += v[0].dot(v[1].cross(v[2])) / 6;
    }
    EXPECT_TRUE(std::ranges::all_of(sides, [](const auto& side) { return side.second == 0; })) << "it is not closed";
    return volume;
}

TEST(SolidText, IsClosedAndAsLargeAsItsFrontTimesItsDepth) {
    for (const char* what : {"Tessera", "fi & 8%", "אבג", "Äöé\nzwei Zeilen"}) {
        Text text = words(what, Text::kCenter);
        text.outlines = outlinesOf(text).toBlob();
        text.size = 3;
        text.depth = 0.5;
        const Drawable solid = drawableOf(Object::of(text));
        ASSERT_TRUE(solid.check());
        double front = 0;
        const TextOutlines read = *TextOutlines::of(text.outlines);
        for (const PlacedLetter& letter : read.letters)
            front += areaOfCurves(read.shapes[letter.shape]) * 9 / (65536.0 * 65536);
        EXPECT_NEAR(volumeOfSolid(solid.arrays()), front * 0.5, 0.01 * front);
        Text flat = text;
        flat.depth = 0;
        EXPECT_NEAR(volumeOfSolid(drawableOf(Object::of(flat)).arrays()), 0, 1e-5) << "a front and a back";
        EXPECT_LT(drawableOf(Object::of(flat)).triangleCount(), solid.triangleCount());
        const Drawable finer = solid.at(Fineness(2));
        EXPECT_GT(finer.triangleCount(), solid.triangleCount());
        EXPECT_NEAR(volumeOfSolid(finer.arrays()), front * 0.5, 0.001 * front);
        EXPECT_LT(finer.deviation(), solid.deviation());
    }
}

TEST(SolidText, SaysWhatIsWrongWithItsOutlines) {
    Text text = words("a");
    EXPECT_TRUE(drawableOf(Object::of(text)).check()) << "nothing is set yet";
    EXPECT_EQ(drawableOf(Object::of(text)).triangleCount(), 0u);
    const std::vector<std::uint32_t> wrong{1, 1};
    text.outlines = Blob::of(std::span<const std::uint32_t>(wrong));
    const Expected<void> refused = drawableOf(Object::of(text)).check();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "the outlines end too early");
    EXPECT_TRUE(drawableOf(Object::of(text)).arrays().indices.empty());
}

}  // namespace
}  // namespace tessera
