// Triangles of outlines, judged by an argument that knows nothing of ears. Where the sides of the triangles cancel to
// the outline itself, the triangles that cover a point, counted by the way they go around, are as many as the outline's
// winding number there: for an outline that does not cross itself 1 inside and 0 outside. Where besides none goes
// around the other way, each place inside is in one triangle and none is outside. Both are checked in whole numbers.
#include "common/geometry/EarClipping.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace tessera {
namespace {

using Outline = std::vector<GridPoint>;
using Random = std::mt19937_64;

std::vector<std::uint64_t> clippingSeeds(std::uint64_t usual) {
    if (const char* one = std::getenv("TESSERA_SEED")) return {std::strtoull(one, nullptr, 10)};
    std::vector<std::uint64_t> seeds(usual);
    for (std::uint64_t i = 0; i < usual; ++i) seeds[i] = i + 1;
    return seeds;
}
std::string repeatedBy(std::uint64_t seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_geometry --gtest_filter=EarClipping.*";
}

std::int64_t doubleArea(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

std::uint64_t someOf(Random& random, std::uint64_t below) {
    return random() % below;
}

/// Whether the triangles' sides cancel to the outline's, by corner numbers.
bool cancelToTheOutline(std::size_t corners, const std::vector<std::uint32_t>& triangles) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    const auto count = [&](std::uint32_t from, std::uint32_t to) {
        from < to ? ++sides[{from, to}] : --sides[{to, from}];
    };
    for (std::size_t i = 0; i < triangles.size(); i += 3)
        for (std::size_t k = 0; k < 3; ++k) count(triangles[i + k], triangles[i + (k + 1) % 3]);
    for (std::uint32_t i = 0; i < corners; ++i) count((i + 1) % static_cast<std::uint32_t>(corners), i);
    return std::all_of(sides.begin(), sides.end(), [](const auto& side) { return side.second == 0; });
}

std::uint64_t stepsTaken(const Outline& outline, const std::string& what, bool crossesItself = false) {
    std::uint64_t steps = std::uint64_t{1} << 40;
    const auto triangles = clipEars(outline, steps);
    EXPECT_TRUE(triangles) << what;
    if (!triangles) return 0;
    EXPECT_EQ(triangles->size(), 3 * (outline.size() - 2)) << what;
    EXPECT_TRUE(std::all_of(triangles->begin(), triangles->end(), [&](std::uint32_t corner) {
        return corner < outline.size();
    })) << what;
    EXPECT_TRUE(cancelToTheOutline(outline.size(), *triangles)) << what;
    bool left = false, right = false;
    for (std::size_t i = 0; i < triangles->size(); i += 3) {
        const std::int64_t area =
            doubleArea(outline[(*triangles)[i]], outline[(*triangles)[i + 1]], outline[(*triangles)[i + 2]]);
        left = left || area > 0;
        right = right || area < 0;
    }
    EXPECT_FALSE(left && right && !crossesItself) << what << ": some triangles are outside";
    return (std::uint64_t{1} << 40) - steps;
}

Outline starShaped(Random& random, std::size_t corners, double ragged) {
    Outline outline;
    for (std::size_t i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners);
        const double radius = 5e8 * (1 - ragged * static_cast<double>(someOf(random, 1000)) / 1000);
        outline.push_back(
            {(1 << 29) + std::llround(radius * std::cos(angle)), (1 << 29) + std::llround(radius * std::sin(angle))});
    }
    return outline;
}

Outline spiral(std::size_t corners, double turns) {
    Outline outline;
    const std::size_t half = corners / 2;
    const auto at = [&](std::size_t i, double width) -> GridPoint {
        const double t = static_cast<double>(i) / static_cast<double>(half), angle = 2 * std::numbers::pi * turns * t,
                     radius = 5e8 * (0.1 + 0.9 * t) - width;
        return {(1 << 29) + std::llround(radius * std::cos(angle)), (1 << 29) + std::llround(radius * std::sin(angle))};
    };
    for (std::size_t i = 0; i <= half; ++i) outline.push_back(at(i, 0));
    for (std::size_t i = half + 1; i-- > 0;) outline.push_back(at(i, 0.4 * 5e8 * 0.9 / turns));
    return outline;
}

/// Teeth that reach between those of the other side.
Outline combs(std::size_t corners) {
    Outline outline;
    const auto teeth = static_cast<std::int64_t>(corners / 4), step = GridPoint::kMost / (teeth + 1);
    for (std::int64_t i = 0; i < teeth; ++i)
        outline.insert(outline.end(), {{i * step, 0}, {i * step + step / 2, GridPoint::kMost - 5 * step}});
    outline.push_back({teeth * step, 0});
    for (std::int64_t i = teeth; i-- > 0;)
        outline.insert(outline.end(), {{i * step + step / 2, GridPoint::kMost}, {i * step, 5 * step}});
    return outline;
}

/// Around the cells of a tree on a raster, grown by chance: many sides in line, many corners inwards.
Outline aroundATree(Random& random, int size, int cells) {
    std::vector<std::vector<char>> in(static_cast<std::size_t>(size),
                                      std::vector<char>(static_cast<std::size_t>(size), 0));
    const auto filled = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < size && y < size &&
               in[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)] != 0;
    };
    std::vector<std::pair<int, int>> tree{{size / 2, size / 2}};
    in[static_cast<std::size_t>(size / 2)][static_cast<std::size_t>(size / 2)] = 1;
    for (int tries = 0; tries < 20 * cells && static_cast<int>(tree.size()) < cells; ++tries) {
        const auto [x, y] = tree[someOf(random, tree.size())];
        const auto way = static_cast<int>(someOf(random, 4));
        const int nx = x + (way == 0) - (way == 1), ny = y + (way == 2) - (way == 3);
        if (nx < 1 || ny < 1 || nx >= size - 1 || ny >= size - 1 || filled(nx, ny)) continue;
        // It touches nothing but the cell that it grows from, and what is beside that one.
        int touched = 0;
        for (int dx = -1; dx <= 1; ++dx)
            for (int dy = -1; dy <= 1; ++dy)
                if (dx * (nx - x) + dy * (ny - y) >= 0 && (dx != 0 || dy != 0) && filled(nx + dx, ny + dy)) ++touched;
        if (touched > 0) continue;
        in[static_cast<std::size_t>(nx)][static_cast<std::size_t>(ny)] = 1;
        tree.emplace_back(nx, ny);
    }
    // Sides with the tree on their left, one after the other.
    std::map<std::pair<int, int>, std::pair<int, int>> next;
    for (const auto& [x, y] : tree) {
        if (!filled(x, y - 1)) next[{x, y}] = {x + 1, y};
        if (!filled(x + 1, y)) next[{x + 1, y}] = {x + 1, y + 1};
        if (!filled(x, y + 1)) next[{x + 1, y + 1}] = {x, y + 1};
        if (!filled(x - 1, y)) next[{x, y + 1}] = {x, y};
    }
    Outline outline;
    const auto start = next.begin()->first;
    auto at = start;
    do {
        outline.push_back({at.first * (GridPoint::kMost / size), at.second * (GridPoint::kMost / size)});
        at = next.at(at);
    } while (at != start);
    return outline;
}

/// Corners named twice, corners within a side, and spikes that lead out and back: none changes what is inside.
Outline withIdleCorners(Random& random, const Outline& outline, bool spikes) {
    Outline made;
    for (std::size_t i = 0; i < outline.size(); ++i) {
        const GridPoint &a = outline[i], &b = outline[(i + 1) % outline.size()];
        made.push_back(a);
        for (std::uint64_t again = someOf(random, 4); again > 2; --again) made.push_back(a);
        const GridPoint middle{(a.x + b.x) / 2, (a.y + b.y) / 2};
        if (doubleArea(a, middle, b) == 0 && someOf(random, 3) == 0) made.push_back(middle);
        if (spikes && doubleArea(a, middle, b) == 0 && someOf(random, 6) == 0)
            made.insert(made.end(), {middle, a, middle});
    }
    return made;
}

TEST(EarClipping, CoversAnOutlineOnceAndNothingElse) {
    for (const std::uint64_t seed : clippingSeeds(60)) {
        SCOPED_TRACE(repeatedBy(seed));
        Random random(seed);
        for (Outline outline :
             {starShaped(random, 3 + someOf(random, 200), 0.9), starShaped(random, 3 + someOf(random, 40), 0),
              spiral(8 + someOf(random, 300), 3.5), combs(8 + someOf(random, 200)),
              aroundATree(random, 30, 1 + static_cast<int>(someOf(random, 200)))}) {
            if (someOf(random, 2) == 0) std::reverse(outline.begin(), outline.end());
            std::rotate(outline.begin(), outline.begin() + static_cast<std::ptrdiff_t>(someOf(random, outline.size())),
                        outline.end());
            stepsTaken(outline, "as it is");
            stepsTaken(withIdleCorners(random, outline, false), "with corners that turn nowhere");
            stepsTaken(withIdleCorners(random, outline, true), "with spikes");
        }
    }
}

TEST(EarClipping, LeavesOutAHoleThatACutLeadsTo) {
    // The cut's two ends are corners twice.
    const Outline frame{{0, 0}, {90, 0}, {90, 90}, {0, 90}, {0, 0}, {30, 30}, {30, 60}, {60, 60}, {60, 30}, {30, 30}};
    stepsTaken(frame, "a square in a square");
    for (const std::uint64_t seed : clippingSeeds(60)) {
        SCOPED_TRACE(repeatedBy(seed));
        Random random(seed);
        Outline outer = starShaped(random, 4 + someOf(random, 60), 0.3);
        const std::size_t from = someOf(random, outer.size());
        Outline cut(outer.begin(), outer.begin() + static_cast<std::ptrdiff_t>(from) + 1);
        // The hole is a smaller copy around the same middle, so the cut between corners of the same number crosses
        // nothing.
        const auto inner = [&](std::size_t i) -> GridPoint {
            return {(1 << 29) + (outer[i].x - (1 << 29)) / 2, (1 << 29) + (outer[i].y - (1 << 29)) / 2};
        };
        for (std::size_t i = 0; i <= outer.size(); ++i) cut.push_back(inner((from + outer.size() - i) % outer.size()));
        cut.insert(cut.end(), outer.begin() + static_cast<std::ptrdiff_t>(from), outer.end());
        stepsTaken(cut, "a ragged ring");
    }
}

TEST(EarClipping, GivesSomeTrianglesOfWhatCrossesItselfOrIsFlat) {
    stepsTaken({{0, 0}, {10, 10}, {10, 0}, {0, 10}}, "a bow tie", true);
    stepsTaken(Outline(50, GridPoint{5, 5}), "one place");
    stepsTaken({{0, 0}, {9, 0}, {4, 0}, {7, 0}, {1, 0}}, "a line", true);
    for (const std::uint64_t seed : clippingSeeds(100)) {
        SCOPED_TRACE(repeatedBy(seed));
        Random random(seed);
        for (const std::int64_t size : {std::int64_t{2}, std::int64_t{7}, GridPoint::kMost + 1}) {
            Outline outline(3 + someOf(random, 120));
            for (GridPoint& p : outline)
                p = {static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(size)),
                     static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(size))};
            stepsTaken(outline, "anywhere", true);
        }
    }
}

TEST(EarClipping, AHundredThousandCornersTakeFewStepsEach) {
    Random random(1);
    const std::size_t many = 100'000;
    const std::vector<std::pair<std::string, Outline>> outlines{{"a circle", starShaped(random, many, 0)},
                                                                {"a star", starShaped(random, many, 0.9)},
                                                                {"a spiral", spiral(many, 60)},
                                                                {"combs", combs(many)},
                                                                {"around a tree", aroundATree(random, 400, 40'000)}};
    for (const auto& [name, outline] : outlines) {
        const std::uint64_t steps = stepsTaken(outline, name);
        EXPECT_LT(steps, 512 * outline.size()) << name;
        if (std::getenv("TESSERA_SAY"))
            std::printf("%s: %zu corners, %.1f steps each\n", name.c_str(), outline.size(),
                        static_cast<double>(steps) / static_cast<double>(outline.size()));
    }
    std::uint64_t few = 1000;
    const auto refused = clipEars(outlines[1].second, few);
    ASSERT_FALSE(refused) << "what costs more than it may is refused";
    EXPECT_WORDS(refused.error().message);
}

}  // namespace
}  // namespace tessera
