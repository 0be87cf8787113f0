// Strips, fans, quads and polygons as drawables: what everybody who draws, picks or collides is told of them.
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

Blob numbersOf(const std::vector<std::uint32_t>& numbers) {
    return Blob::of(std::span<const std::uint32_t>(numbers));
}
Blob placesOf(const std::vector<float>& places) {
    return Blob::of(std::span<const float>(places));
}

Drawable drawableOf(const Geometry& geometry) {
    return drawableOf(Object::of(geometry));
}
std::string refusalOf(const Geometry& geometry) {
    const Expected<void> sound = drawableOf(geometry).check();
    return sound ? "it is sound" : sound.error().message;
}
std::vector<std::uint32_t> indicesOf(const Geometry& geometry) {
    const Blob blob = drawableOf(geometry).arrays().indices;
    const auto all = blob.as<std::uint32_t>();
    return {all.begin(), all.end()};
}

/// Two polygons beside each other: a triangle, and an arrow whose second corner is concave once it moves.
Geometry twoPolygons() {
    Geometry g;
    g.primitive = Geometry::kPolygons;
    g.positions = placesOf({0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 4, -1, 0, 6, 0, 0, 4, 4, 0});
    g.lengths = numbersOf({3, 4});
    return g;
}

TEST(PrimitiveDrawable, VerticesStayAsTheyStandAndTrianglesAreMade) {
    Geometry g = twoPolygons();
    g.colors = numbersOf(std::vector<std::uint32_t>(7, 0xFF00FF00));
    const Drawable drawable = drawableOf(g);
    ASSERT_TRUE(drawable.check());
    EXPECT_FALSE(drawable.derived()) << "ranges of its vertices are ranges of its arrays";
    EXPECT_EQ(drawable.arrays().positions, g.positions);
    EXPECT_EQ(drawable.arrays().colors, g.colors);
    EXPECT_EQ(drawable.triangleCount(), 3u);
    EXPECT_EQ(indicesOf(g), (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 3, 5, 6}));
}

TEST(PrimitiveDrawable, LinesAreLines) {
    Geometry g = twoPolygons();
    g.primitive = Geometry::kLineLoop;
    g.lineWidth = 3;
    const MeshArrays arrays = drawableOf(g).arrays();
    EXPECT_EQ(arrays.kind, MeshKind::kLines);
    EXPECT_EQ(arrays.lineWidth, 3);
    EXPECT_TRUE(arrays.indices.empty());
    EXPECT_EQ(arrays.lines.sizeBytes(), 7u * 8) << "three of the one and four of the other";
    EXPECT_EQ(drawableOf(g).triangleCount(), 0u);
}

TEST(PrimitiveDrawable, TrianglesAndLinesWithoutIndicesTakeTheVerticesAsTheyStand) {
    Geometry g;
    g.positions = placesOf({0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 4, -1, 0, 6, 0, 0, 4, 4, 0});
    EXPECT_TRUE(drawableOf(g).check()) << "what is left over makes none";
    EXPECT_EQ(indicesOf(g), (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}));
    g.primitive = Geometry::kLines;
    EXPECT_EQ(drawableOf(g).arrays().lines.sizeBytes(), 6u * sizeof(std::uint32_t));
    g.primitive = Geometry::kPoints;
    EXPECT_TRUE(drawableOf(g).arrays().indices.empty());
    g.primitive = Geometry::kTriangles;
    g.positions = placesOf({0, 0, 0, 1, 0, 0});
    EXPECT_EQ(drawableOf(g).triangleCount(), 0u);
}

TEST(PrimitiveDrawable, SaysWhatIsWrong) {
    Geometry g = twoPolygons();
    g.lengths = numbersOf({3, 2, 2});
    EXPECT_EQ(refusalOf(g), "polygon 1 has 2 corners: it takes at least 3");
    EXPECT_TRUE(drawableOf(g).arrays().indices.empty()) << "and nothing is made of it";
    g.lengths = Blob(Bytes(7));
    EXPECT_EQ(refusalOf(g), "the lengths have 7 bytes, not a whole number of elements of 4 bytes");
    g.primitive = Geometry::kTriangles;
    EXPECT_EQ(refusalOf(g), "the lengths have 7 bytes, not a whole number of elements of 4 bytes");
    g = twoPolygons();
    g.positions = placesOf(
        {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 4, -1, 0, 6, 0, 0, 4, std::numeric_limits<float>::quiet_NaN(), 0});
    EXPECT_EQ(refusalOf(g), "the positions of vertex 6 are not finite");
    g.primitive = Geometry::kTriangleStrip;
    EXPECT_EQ(refusalOf(g), "the positions of vertex 6 are not finite")
        << "of strips too, though their order does not ask";
    g = twoPolygons();
    g.colors = numbersOf({1, 2});
    EXPECT_WORDS(refusalOf(g));
    EXPECT_TRUE(drawableOf(Geometry{.primitive = Geometry::kQuads}).check()) << "nothing at all is fine";
}

TEST(PrimitiveDrawable, WhatIsNotHereIsCountedButNotMade) {
    Geometry g = twoPolygons();
    for (Blob* blob : {&g.positions, &g.lengths}) *blob = Blob::absent(blob->id(), blob->sizeBytes());
    EXPECT_FALSE(drawableOf(g).resident());
    EXPECT_EQ(drawableOf(g).triangleCount(), 3u);
    EXPECT_WORDS(refusalOf(g));
    EXPECT_TRUE(drawableOf(twoPolygons()).resident());
    g.primitive = Geometry::kTriangleFan;
    EXPECT_EQ(drawableOf(g).triangleCount(), 3u);
}

TEST(PrimitiveDrawable, RangesOfPlacesLeadOnAndCutWhatMovedAnew) {
    Geometry before = twoPolygons();
    const MeshArrays first = drawableOf(before).arrays();
    Geometry after = before;
    const std::vector<float> inwards{4, 1, 0};
    after.positions = *before.positions.withRange(4 * 12, std::as_bytes(std::span<const float>(inwards)));
    const MeshArrays second = drawableOf(after).arrays();
    EXPECT_EQ(indicesOf(after), (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 6, 4, 5, 6}))
        << "the diagonal is the other one";
    bool found = false;
    for (const MeshOrigin& origin : originsOf(second))
        if (origin.key == keyOf(first)) {
            found = true;
            EXPECT_GE(origin.changed[4].begin, 3u * 4) << "the triangle stays";
        }
    EXPECT_TRUE(found) << "who keeps something of the first follows ranges";
    // The same made at once.
    Geometry anew = after;
    const auto places = after.positions.as<float>();
    anew.positions = Blob::of(places);
    EXPECT_EQ(drawableOf(anew).key(), drawableOf(after).key());
    EXPECT_TRUE(drawableOf(after).check(keyOf(first)));

    // A fan does not ask where its corners are.
    before.primitive = after.primitive = Geometry::kTriangleFan;
    EXPECT_EQ(drawableOf(before).arrays().indices.id(), drawableOf(after).arrays().indices.id());
}

}  // namespace
}  // namespace tessera
