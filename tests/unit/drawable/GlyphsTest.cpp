/// Glyphs: what screens draw is what the fields say, in whatever order; what rays meet is around it; what is refused.
#include "common/drawable/GlyphArrays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/drawable/Drawable.h"
#include "common/geometry/MeshCopies.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

template <typename Number>
Blob glyphBlob(const std::vector<Number>& numbers) {
    return numbers.empty() ? Blob() : Blob::of(std::span<const Number>(numbers));
}

Glyphs someGlyphs(Random& random, std::size_t count) {
    const auto numbers = [&](std::size_t each, double low, double high) {
        std::vector<float> all;
        for (std::size_t i = 0; i < count * each; ++i)
            all.push_back(static_cast<float>(low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53));
        return glyphBlob(all);
    };
    Glyphs g;
    g.positions = numbers(3, -5, 5);
    g.shape = static_cast<std::int64_t>(below(random, 3));
    g.size = 0.5;
    if (!oneIn(random, 3)) g.vectors = numbers(3, -2, 2);
    if (oneIn(random, 3)) g.turns = numbers(4, -3, 3);
    if (!oneIn(random, 3)) g.scalars = numbers(1, -0.2, 3);
    g.lengthBy = static_cast<std::int64_t>(below(random, 3));
    g.widthBy = static_cast<std::int64_t>(below(random, 3));
    g.colorBy = static_cast<std::int64_t>(below(random, 3));
    if (oneIn(random, 2)) g.transfer = glyphBlob<std::uint8_t>({0, 0, 255, 255, 255, 0, 0, 128});
    if (oneIn(random, 2)) {
        std::vector<std::uint8_t> colors;
        for (std::size_t i = 0; i < 4 * count; ++i) colors.push_back(static_cast<std::uint8_t>(random()));
        g.colors = glyphBlob(colors);
    }
    return g;
}

MeshArrays onScreens(const Glyphs& g) {
    return drawableOf(Object::of(g)).at(kGlyphsOnScreens).arrays();
}

/// The formula, of a glyph by itself.
double factorOf(const Glyphs& g, std::int64_t by, std::size_t i) {
    const std::span<const float> v = g.vectors.as<float>(), s = g.scalars.as<float>();
    if (by == Glyphs::kVector && !v.empty()) return Vec3f(v[3 * i], v[3 * i + 1], v[3 * i + 2]).cast<double>().norm();
    if (by == Glyphs::kScalar && !s.empty()) return std::max(0.0, static_cast<double>(s[i]));
    return 1;
}

TEST(Glyphs, AreOnScreensWhatTheirFieldsSay) {
    forSeeds(60, [](Random& random) {
        const std::size_t count = 1 + below(random, 700);
        const Glyphs g = someGlyphs(random, count);
        const MeshArrays arrays = onScreens(g);
        const Expected<void> sound = checkMesh(arrays);
        ASSERT_TRUE(sound) << sound.error().message;
        ASSERT_EQ(copyCount(arrays), count);
        EXPECT_EQ(triangleCount(arrays), count * arrays.indices.sizeBytes() / 12);
        // Which copy is which glyph, by its place: no two are the same.
        const std::span<const float> places = g.positions.as<float>();
        std::set<std::size_t> seen;
        for (std::size_t k = 0; k < count; ++k) {
            const MeshCopy& copy = arrays.copies.as<MeshCopy>()[k];
            std::size_t i = 0;
            while (i < count && !std::equal(copy.place.begin(), copy.place.end(), &places[3 * i])) ++i;
            ASSERT_LT(i, count);
            seen.insert(i);
            const double width = 0.5 * factorOf(g, g.widthBy, i), length = 0.5 * factorOf(g, g.lengthBy, i);
            const bool shown = width > 0 && length > 0;
            EXPECT_FLOAT_EQ(copy.width, shown ? static_cast<float>(width) : 0.0F);
            EXPECT_FLOAT_EQ(copy.length, shown ? static_cast<float>(length) : 0.0F);
            const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
            EXPECT_NEAR(turn.norm(), 1, 1e-6);
            if (const std::span<const float> said = g.turns.as<float>(); !said.empty()) {
                const Quatd own(said[4 * i + 3], said[4 * i], said[4 * i + 1], said[4 * i + 2]);
                EXPECT_LT((turn.coeffs() - own.normalized().coeffs()).norm(), 1e-6);
                continue;
            }
            Vec3d direction = Vec3d::UnitY();
            if (const std::span<const float> v = g.vectors.as<float>(); !v.empty())
                direction = Vec3f(v[3 * i], v[3 * i + 1], v[3 * i + 2]).cast<double>().normalized();
            EXPECT_LT((turn * Vec3d::UnitY() - direction).norm(), 1e-6);
        }
        EXPECT_EQ(seen.size(), count);
    });
}

TEST(Glyphs, RunsOfThemLieTogetherAndInTheirBoxes) {
    Random random(5);
    Glyphs g = someGlyphs(random, 5000);
    g.shape = Glyphs::kArrow;
    const MeshArrays arrays = onScreens(g);
    const std::span<const float> corners = arrays.positions.as<float>();
    double volumes = 0;
    for (std::size_t first = 0; first < 5000; first += 256) {
        const std::size_t end = std::min<std::size_t>(first + 256, 5000);
        const Box box = boundsOfCopies(arrays, first, end);
        volumes += box.size().prod();
        for (const MeshCopy& copy : arrays.copies.as<MeshCopy>().subspan(first, end - first)) {
            const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
            for (std::size_t c = 0; c + 2 < corners.size(); c += 3) {
                const Vec3d at =
                    Vec3d(copy.place[0], copy.place[1], copy.place[2]) +
                    turn * Vec3d(copy.width * corners[c], copy.length * corners[c + 1], copy.width * corners[c + 2]);
                ASSERT_TRUE(((at - box.lower).array() >= 0).all() && ((box.upper - at).array() >= 0).all());
            }
        }
    }
    // In any order each would be around nearly all: 20 times the whole.
    EXPECT_LT(volumes, 8 * shownBounds(arrays).size().prod());
}

TEST(Glyphs, ColoursFollowTheTransferFunctionAndTheirOwn) {
    Glyphs g;
    g.positions = glyphBlob<float>({0, 0, 0, 0, 0, 0, 0, 0, 0});
    g.scalars = glyphBlob<float>({-5, 1.5, 9});
    g.transfer = glyphBlob<std::uint8_t>({0, 0, 0, 255, 200, 100, 50, 255});
    g.low = 1;
    g.high = 2;
    const auto colors = [&] {
        const MeshArrays arrays = onScreens(g);
        const std::span<const std::uint8_t> bytes = arrays.colors.as<std::uint8_t>();
        return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
    };
    EXPECT_EQ(colors(), (std::vector<std::uint8_t>{0, 0, 0, 255, 100, 50, 25, 255, 200, 100, 50, 255}));
    g.colors = glyphBlob<std::uint8_t>({255, 255, 255, 255, 255, 0, 255, 51, 0, 255, 255, 255});
    EXPECT_EQ(colors(), (std::vector<std::uint8_t>{0, 0, 0, 255, 100, 0, 25, 51, 0, 100, 50, 255}));
    g.colorBy = Glyphs::kNothing;
    EXPECT_EQ(colors(), (std::vector<std::uint8_t>{255, 255, 255, 255, 255, 0, 255, 51, 0, 255, 255, 255}));
    g.colors = {};
    EXPECT_TRUE(onScreens(g).colors.empty());
}

// A face that a pick names, divided by 12, is the glyph's number.
TEST(Glyphs, ForRaysEachIsTheBoxAroundItsShape) {
    forSeeds(40, [](Random& random) {
        const std::size_t count = 1 + below(random, 50);
        const Glyphs g = someGlyphs(random, count);
        const Drawable drawable = drawableOf(Object::of(g));
        EXPECT_TRUE(drawable.meetsNobody());
        EXPECT_EQ(drawable.triangleCount(), triangleCount(onScreens(g))) << "without making any";
        EXPECT_EQ(drawable.bounds().lower, shownBounds(drawable.arrays()).lower);
        EXPECT_EQ(drawable.bounds().upper, shownBounds(drawable.arrays()).upper);
        const MeshArrays boxes = drawable.arrays();
        ASSERT_TRUE(checkMesh(boxes));
        ASSERT_EQ(triangleCount(boxes), 12 * count);
        const Box all = shownBounds(onScreens(g));
        EXPECT_TRUE(drawable.bounds().lower.isApprox(all.lower, 1e-4));
        EXPECT_TRUE(drawable.bounds().upper.isApprox(all.upper, 1e-4));
        const MeshArrays shape = onScreens(g);
        const Box around = boundsOf(shape.positions.as<float>());
        for (std::uint32_t i = 0; i < count; ++i) {
            // Closed and outwards: six times its volume, of tetrahedra over its triangles.
            double volume = 0;
            for (std::uint32_t face = 12 * i; face < 12 * i + 12; ++face) {
                const auto corners = cornersOf(boxes, face, 0);
                ASSERT_TRUE(corners);
                const auto at = [&](std::size_t k) { return (*corners)[k].cast<double>().eval(); };
                const std::span<const float> p = g.positions.as<float>();
                const Vec3d place(p[3 * i], p[3 * i + 1], p[3 * i + 2]);
                volume += (at(0) - place).dot((at(1) - place).cross(at(2) - place)) / 6;
            }
            const double width = 0.5 * factorOf(g, g.widthBy, i), length = 0.5 * factorOf(g, g.lengthBy, i);
            EXPECT_NEAR(volume, width * width * length * around.size().prod(), 1e-4);
        }
    });
}

TEST(Glyphs, AShapeOfOnesOwnIsItsMesh) {
    Glyphs g;
    g.positions = glyphBlob<float>({1, 2, 3});
    g.shape = Glyphs::kMesh;
    const auto problem = [&] {
        const Expected<void> good = drawableOf(Object::of(g)).check();
        return good ? std::string() : good.error().message;
    };
    EXPECT_EQ(problem(), "shape mesh needs shapePositions and shapeIndices");
    g.shapePositions = glyphBlob<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
    g.shapeIndices = glyphBlob<std::uint32_t>({0, 1, 2});
    EXPECT_EQ(problem(), "");
    EXPECT_EQ(onScreens(g).positions, g.shapePositions);
    g.shapeIndices = glyphBlob<std::uint32_t>({0, 1, 3});
    EXPECT_EQ(problem(), "the shape: triangle 0 names vertex 3, but there are 3 vertices");
    g.shapePositions = glyphBlob(std::vector<float>(3 * 1025));
    EXPECT_EQ(problem(), "the shape: 1025 vertices, at most 1024 are allowed");
}

TEST(Glyphs, WhatDoesNotFitIsRefusedInWords) {
    const auto problem = [](auto&& change) {
        Glyphs g;
        g.positions = glyphBlob<float>({0, 0, 0, 1, 1, 1});
        change(g);
        const Expected<void> good = drawableOf(Object::of(g)).check();
        return good ? std::string() : good.error().message;
    };
    EXPECT_EQ(problem([](Glyphs&) {}), "");
    EXPECT_EQ(problem([](Glyphs& g) { g.positions = {}; }), "");
    EXPECT_EQ(problem([](Glyphs& g) { g.scalars = glyphBlob<float>({1}); }),
              "scalars has 4 bytes: 2 glyphs have 8 of 4 each, or none at all");
    EXPECT_EQ(problem([](Glyphs& g) {
                  g.vectors = glyphBlob<float>({1, 2, 3, 4, NAN, 6});
              }),
              "the vector of glyph 1 is nan: it has to be from -1e30 to 1e30");
    EXPECT_EQ(problem([](Glyphs& g) {
                  g.turns = glyphBlob<float>({0, 0, 0, 1});
              }),
              "turns has 16 bytes: 2 glyphs have 32 of 16 each, or none at all");
    EXPECT_EQ(problem([](Glyphs& g) {
                  g.turns = glyphBlob<float>({0, 0, 0, 1, 0, 0, 0, 0});
              }),
              "the turn of glyph 1 is 0, 0, 0, 0, which is no turn");
    EXPECT_EQ(problem([](Glyphs& g) { g.low = 2; }), "low is 2 and high 1: colours need low below high");
    EXPECT_EQ(problem([](Glyphs& g) { g.positions = glyphBlob(std::vector<float>(3 * 1'000'001)); }),
              "1000001 glyphs, at most 1000000 are allowed");
    EXPECT_EQ(problem([](Glyphs& g) {
                  g.positions = glyphBlob(std::vector<float>(3 * 900'000));
                  g.shape = Glyphs::kBall;
              }),
              "900000 glyphs of 120 triangles, at most 64000000 triangles are allowed");
}

}  // namespace
}  // namespace tessera
