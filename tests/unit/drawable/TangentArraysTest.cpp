/// Arrays with tangents: whose they are, which arrays stay what they were, and the same bytes along whatever edits.
#include "common/drawable/TangentArrays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/drawable/Drawable.h"
#include "common/geometry/TangentSpace.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

Blob floats(const std::vector<float>& values) {
    return Blob::of(std::span<const float>(values));
}

/// A bumpy sheet of side x side vertices; `mirrored`: its image is, in its right half, around a column of vertices.
MeshArrays sheet(std::size_t side, bool mirrored) {
    MeshData mesh;
    const auto last = static_cast<float>(side - 1);
    for (std::size_t y = 0; y < side; ++y)
        for (std::size_t x = 0; x < side; ++x) {
            const float u = static_cast<float>(x) / last, v = static_cast<float>(y) / last;
            mesh.positions.insert(mesh.positions.end(), {u, v, 0.1f * std::sin(5 * u + 3 * v)});
            mesh.normals.insert(mesh.normals.end(), {0, 0, 1});
            mesh.texcoords.insert(mesh.texcoords.end(), {mirrored ? std::abs(u - 0.5f) : u, 1 - v});
            mesh.colors.insert(mesh.colors.end(), {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 0, 255});
        }
    for (std::uint32_t y = 0; y + 1 < side; ++y)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const auto n = static_cast<std::uint32_t>(side), a = y * n + x;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, a + n + 1, a, a + n + 1, a + n});
        }
    return mesh.toArrays();
}

/// Each corner of all arrays, in the triangles' order, without tangents.
std::vector<float> cornersOfAll(const MeshArrays& arrays) {
    std::vector<float> all;
    for (const std::uint32_t i : arrays.indices.as<std::uint32_t>()) {
        for (std::size_t k = 0; k < 3; ++k)
            all.insert(all.end(), {arrays.positions.as<float>()[3 * i + k], arrays.normals.as<float>()[3 * i + k]});
        for (std::size_t k = 0; k < 2; ++k) all.push_back(arrays.texcoords.as<float>()[2 * i + k]);
        for (std::size_t k = 0; k < 4; ++k) all.push_back(arrays.colors.as<std::uint8_t>()[4 * i + k]);
    }
    return all;
}

TEST(TangentArrays, ShareTheArraysWhereNoVertexIsCut) {
    const MeshArrays arrays = sheet(9, false), made = withTangents(arrays, {});
    ASSERT_EQ(made.tangents.sizeBytes(), arrays.positions.sizeBytes() / 3 * 4);
    EXPECT_TRUE(checkMesh(made));
    MeshArrays without = made;
    without.tangents = {};
    EXPECT_EQ(keyOf(without), keyOf(arrays));
    EXPECT_EQ(withTangents(arrays, {}).tangents.bytes().data(), made.tangents.bytes().data()) << "made once";
}

TEST(TangentArrays, CutVerticesWhoseCornersDiffer) {
    const MeshArrays arrays = sheet(9, true), made = withTangents(arrays, {});
    EXPECT_TRUE(checkMesh(made));
    EXPECT_EQ(made.positions.sizeBytes() / 12, 81u + 9u) << "the column where the image turns";
    EXPECT_EQ(made.indices.sizeBytes(), arrays.indices.sizeBytes());
    EXPECT_EQ(cornersOfAll(made), cornersOfAll(arrays)) << "the same triangles in the same order";
    const auto tangents = made.tangents.as<float>();
    const auto indices = made.indices.as<std::uint32_t>();
    const CornerTangents corners = mikkTangents({arrays.positions.as<float>(), arrays.normals.as<float>(),
                                                 arrays.texcoords.as<float>(), arrays.indices.as<std::uint32_t>()});
    for (std::size_t c = 0; c < indices.size(); ++c)
        for (std::size_t k = 0; k < 4; ++k)
            ASSERT_EQ(tangents[4 * indices[c] + k], corners.tangents[corners.ofCorner[c]][k]) << c;
}

TEST(TangentArrays, AMeshsOwnComeFirstAndOthersAreNone) {
    MeshArrays own = sheet(3, true);
    own.tangents = floats(std::vector<float>(36, 0.5f));
    EXPECT_EQ(keyOf(withTangents(own, {})), keyOf(own));
    MeshArrays flat = sheet(3, true);
    flat.normals = {};
    flat.tangents = own.tangents;
    EXPECT_TRUE(withTangents(flat, {}).tangents.empty()) << "they say nothing without normals";
    for (const auto& spoil : std::vector<void (*)(MeshArrays&)>{
             [](MeshArrays& a) { a.texcoords = {}; },
             [](MeshArrays& a) {
                 a.indices = Blob::of(std::span<const std::uint32_t>(std::vector<std::uint32_t>{0, 1, 99}));
             },
             [](MeshArrays& a) { a.positions = Blob::absent(a.positions.id(), a.positions.sizeBytes()); },
             [](MeshArrays& a) { a.colors = Blob(Bytes(3)); }, [](MeshArrays& a) { a.indices = {}; }}) {
        MeshArrays spoiled = sheet(3, true);
        spoil(spoiled);
        EXPECT_EQ(keyOf(withTangents(spoiled, {})), keyOf(spoiled));
    }
}

TEST(TangentArrays, FollowTheImagesOwnTexcoordsAndTurn) {
    MeshArrays arrays = sheet(5, false);
    // Of the second set u goes up.
    std::vector<float> second;
    const auto first = arrays.texcoords.as<float>();
    for (std::size_t i = 0; i < first.size(); i += 2) second.insert(second.end(), {1 - first[i + 1], first[i]});
    arrays.texcoords1 = floats(second);
    const auto along = [&](const Image& image) {
        const auto tangents = withTangents(arrays, image).tangents.as<float>();
        // In the sheet's plane, and the side.
        return Vec3f(std::round(tangents[0] * 1000), std::round(tangents[1] * 1000), tangents[3]);
    };
    EXPECT_EQ(along({}), Vec3f(along({}).x(), 0, 1));
    EXPECT_GT(along({}).x(), 800);
    EXPECT_GT(along({.texcoordSet = 1}).y(), 800);
    EXPECT_EQ(along({.texcoordSet = 1}).z(), 1) << "u goes up, v right";
    EXPECT_EQ(along({.offset = Vec2f(3, 4), .scale = Vec2f(2, 5)}), along({}));
    EXPECT_LT(along({.scale = Vec2f(-1, 1)}).x(), -800);
    EXPECT_EQ(along({.scale = Vec2f(-1, 1)}).z(), -1);
    // glTF: counter-clockwise as the image is looked at, so its u lies along what was downwards.
    const Vec3f turned = along({.rotation = std::numbers::pi_v<float> / 2});
    EXPECT_GT(std::abs(turned.y()), 800);
    EXPECT_EQ(turned.z(), 1);
}

TEST(TangentArrays, TheSameBytesAlongWhateverEditsAndRangesLeadOn) {
    std::size_t parts = 0;
    forSeeds(20, [&](Random& random) {
        const bool cut = oneIn(random, 2);
        MeshArrays arrays = sheet(9, cut);
        std::vector<MeshArrays> kept{withTangents(arrays, {})};
        for (int step = 0; step < 6; ++step) {
            Blob& edited = oneIn(random, 3) ? arrays.normals : arrays.positions;
            const std::size_t at = 3 * below(random, 81);
            const std::vector<float> moved(3, 0.1f * static_cast<float>(below(random, 9)));
            edited = *edited.withRange(4 * at, std::as_bytes(std::span<const float>(moved)));
            const MeshArrays followed = withTangents(arrays, {});
            MeshArrays fresh = arrays;
            for (Blob* blob : {&fresh.positions, &fresh.normals}) *blob = Blob::of(blob->as<float>());
            const CornerTangents right = mikkTangents({fresh.positions.as<float>(), fresh.normals.as<float>(),
                                                       fresh.texcoords.as<float>(), fresh.indices.as<std::uint32_t>()});
            const auto indices = followed.indices.as<std::uint32_t>();
            for (std::size_t c = 0; c < indices.size(); ++c)
                for (std::size_t k = 0; k < 4; ++k)
                    ASSERT_EQ(followed.tangents.as<float>()[4 * indices[c] + k], right.tangents[right.ofCorner[c]][k]);
            ASSERT_EQ(blobIdOf(followed.tangents.bytes()), followed.tangents.id());
            for (const MeshOrigin& origin : originsOf(followed))
                if (origin.key == keyOf(kept.back()))
                    parts += origin.changed[7].end - origin.changed[7].begin < followed.tangents.sizeBytes();
            kept.push_back(followed);
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(parts, 20u) << "an edit leads to a part of the tangents";
}

}  // namespace
}  // namespace tessera
