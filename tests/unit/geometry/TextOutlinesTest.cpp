#include "common/geometry/TextOutlines.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace tessera {
namespace {

OutlineContour lineContour(std::vector<OutlinePoint> points) {
    OutlineContour contour{.start = points.front(), .segments = {}};
    for (std::size_t i = 1; i < points.size(); ++i) contour.segments.push_back({.degree = 1, .points = {points[i]}});
    return contour;
}
OutlineContour squareAround(std::int32_t x, std::int32_t y, std::int32_t half, bool left) {
    std::vector<OutlinePoint> points{
        {x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}};
    if (!left) std::ranges::reverse(points);
    return lineContour(points);
}

double areaOfLetter(const LetterTriangles& letter) {
    double area = 0;
    for (std::size_t i = 0; i < letter.triangles.size(); i += 3) {
        const OutlinePoint &a = letter.vertices[letter.triangles[i]], &b = letter.vertices[letter.triangles[i + 1]],
                           &c = letter.vertices[letter.triangles[i + 2]];
        const double twice = (double(b.x) - a.x) * (double(c.y) - a.y) - (double(b.y) - a.y) * (double(c.x) - a.x);
        EXPECT_GE(twice, 0) << "counter-clockwise";
        area += twice / 2;
    }
    return area;
}

/// The triangles' open sides are the rims, each once: then front, back and sides of a solid close.
void expectRimsAreWhereTrianglesEnd(const LetterTriangles& letter) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (std::size_t i = 0; i < letter.triangles.size(); i += 3)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t from = letter.triangles[i + k], to = letter.triangles[i + (k + 1) % 3];
            from < to ? ++sides[{from, to}] : --sides[{to, from}];
        }
    for (const auto& rim : letter.rims)
        for (std::size_t i = 0; i < rim.size(); ++i) {
            const std::uint32_t from = rim[(i + 1) % rim.size()], to = rim[i];
            from < to ? ++sides[{from, to}] : --sides[{to, from}];
        }
    for (const auto& [side, count] : sides) EXPECT_EQ(count, 0) << side.first << " to " << side.second;
}

LetterTriangles cutOf(const LetterShape& shape) {
    const Expected<LetterTriangles> letter = trianglesOf(shape, 16);
    EXPECT_TRUE(letter) << (letter ? "" : letter.error().message);
    if (!letter) return {};
    expectRimsAreWhereTrianglesEnd(*letter);
    return *letter;
}

TEST(LetterTriangles, ContoursNestByTheirWinding) {
    const double unit = 2000.0 * 2000;
    EXPECT_EQ(areaOfLetter(cutOf({squareAround(0, 0, 1000, true)})), unit);
    EXPECT_EQ(areaOfLetter(cutOf({squareAround(0, 0, 1000, false)})), unit)
        << "TrueType's outer contours go around to the right";
    EXPECT_EQ(areaOfLetter(cutOf({squareAround(0, 0, 1000, false), squareAround(0, 0, 500, true)})), 0.75 * unit)
        << "a hole";
    EXPECT_EQ(areaOfLetter(cutOf({squareAround(0, 0, 1000, true), squareAround(0, 0, 500, true)})), unit)
        << "wound twice is solid";
    EXPECT_EQ(areaOfLetter(cutOf(
                  {squareAround(0, 0, 1000, true), squareAround(0, 0, 500, false), squareAround(0, 0, 250, true)})),
              (0.75 + 0.0625) * unit)
        << "an island";
    EXPECT_EQ(areaOfLetter(cutOf({squareAround(0, 0, 1000, true), squareAround(-400, 0, 200, false),
                                  squareAround(400, 0, 200, false), squareAround(400, 500, 200, false)})),
              (1 - 3 * 0.04) * unit)
        << "holes beside each other";
    EXPECT_EQ(areaOfLetter(cutOf({squareAround(0, 0, 1000, true), squareAround(5000, 0, 1000, false)})), 2 * unit)
        << "dots, wound as they like";
    EXPECT_TRUE(cutOf({lineContour({{0, 0}, {5, 5}, {9, 9}}), lineContour({{3, 3}})}).triangles.empty())
        << "nothing has an area";
}

TEST(LetterTriangles, CurvesAreAsNearAsIsAsked) {
    // A circle of four cubic Béziers, which is within 2.8e-4 of its radius.
    constexpr double kRadius = 30000, kHandle = 0.5522847498;
    const auto at = [&](double x, double y) {
        return OutlinePoint{static_cast<std::int32_t>(std::lround(kRadius * x)),
                            static_cast<std::int32_t>(std::lround(kRadius * y))};
    };
    const OutlineContour circle{.start = at(1, 0),
                                .segments = {{.degree = 3, .points = {at(1, kHandle), at(kHandle, 1), at(0, 1)}},
                                             {.degree = 3, .points = {at(-kHandle, 1), at(-1, kHandle), at(-1, 0)}},
                                             {.degree = 3, .points = {at(-1, -kHandle), at(-kHandle, -1), at(0, -1)}},
                                             {.degree = 3, .points = {at(kHandle, -1), at(1, -kHandle), at(1, 0)}}}};
    std::size_t before = 0;
    for (const double tolerance : {1000.0, 100.0, 10.0}) {
        const Expected<LetterTriangles> letter = trianglesOf({circle}, tolerance);
        ASSERT_TRUE(letter);
        const auto& rim = letter->rims.at(0);
        for (std::size_t i = 0; i < rim.size(); ++i) {
            const OutlinePoint &a = letter->vertices[rim[i]], &b = letter->vertices[rim[(i + 1) % rim.size()]];
            const double middle = std::hypot(0.5 * (double(a.x) + b.x), 0.5 * (double(a.y) + b.y));
            EXPECT_LE(kRadius - middle, tolerance + 0.75 + 2.8e-4 * kRadius);
        }
        EXPECT_GT(rim.size(), before) << "and no finer than that needs";
        before = rim.size();
        EXPECT_LT(rim.size(), 4 * (2 + std::sqrt(kRadius / tolerance)));
    }
}

TEST(TextOutlines, ComeBackFromTheirWordsAndAreRefusedWhenTheyAreWrong) {
    const TextOutlines text{
        .shapes = {{squareAround(0, 0, 1000, true), squareAround(0, 0, 500, false)},
                   {{.start = {1, 2}, .segments = {{.degree = 3, .points = {OutlinePoint{3, 4}, {5, 6}, {7, -8}}}}}}},
        .letters = {{.shape = 1, .at = {-5, 6}}, {.shape = 0, .at = {70000, 0}}}};
    const Blob blob = text.toBlob();
    const Expected<TextOutlines> back = TextOutlines::of(blob);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, text);
    EXPECT_TRUE(TextOutlines().toBlob().empty());

    const auto words = blob.as<std::uint32_t>();
    const auto refusal = [](std::vector<std::uint32_t> changed) {
        const Expected<TextOutlines> read = TextOutlines::of(Blob::of(std::span<const std::uint32_t>(changed)));
        return read ? std::string("it is sound") : read.error().message;
    };
    for (std::size_t length = 1; length < words.size(); ++length)
        EXPECT_NE(refusal({words.begin(), words.begin() + static_cast<std::ptrdiff_t>(length)}), "it is sound")
            << length;
    std::vector<std::uint32_t> more(words.begin(), words.end());
    more.push_back(0);
    EXPECT_EQ(refusal(more), "the outlines have 1 words too many");
    more = {words.begin(), words.end()};
    more[more.size() - 3] = 9;
    EXPECT_EQ(refusal(more), "letter 1 has shape 9, but there are 2");
    more = {words.begin(), words.end()};
    more.back() = 1u << 29;
    EXPECT_WORDS(refusal(more));

    // Any words at all are read or refused, and what is read can be cut.
    const char* one = std::getenv("TESSERA_SEED");
    for (std::uint64_t seed = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? seed : 400; seed <= last;
         ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_geometry --gtest_filter=TextOutlines.*");
        std::mt19937_64 random(seed);
        std::vector<std::uint32_t> changed(words.begin(), words.end());
        for (std::uint64_t changes = 1 + random() % 3; changes > 0; --changes)
            changed[random() % changed.size()] = static_cast<std::uint32_t>(random() >> (random() % 64));
        const Expected<TextOutlines> read = TextOutlines::of(Blob::of(std::span<const std::uint32_t>(changed)));
        if (!read) continue;
        for (const LetterShape& shape : read->shapes) (void)trianglesOf(shape, 128);
    }
}

}  // namespace
}  // namespace tessera
