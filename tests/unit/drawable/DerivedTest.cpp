#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <random>
#include <thread>

#include "common/drawable/ContentCache.h"
#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/drawable/ControlCube.h"

namespace tessera {
namespace {

using test::controlGrid;
using test::sceneWithSurface;

const ObjectId kSurface(9);

Drawable surfaceIn(const Aspect& aspect) {
    return drawableOf(aspect, kSurface);
}

TEST(DerivedArrays, AreWhatTheControlPointsSayWhoeverAsks) {
    const Aspect aspect = sceneWithSurface(controlGrid(4));
    const Drawable drawable = surfaceIn(aspect);
    ASSERT_TRUE(drawable);
    EXPECT_TRUE(drawable.derived());
    ASSERT_TRUE(drawable.check());
    EXPECT_TRUE(drawable.resident());
    const MeshArrays arrays = drawable.arrays();
    EXPECT_TRUE(checkMesh(arrays));
    EXPECT_EQ(drawable.triangleCount(), 6u * 16 * 2 * 64);
    EXPECT_EQ(arrays.normals.sizeBytes(), arrays.positions.sizeBytes());
    EXPECT_EQ(drawable.material(), ObjectId(7));
    // A smooth shape lies inside its control mesh, and here about its middle.
    const Box bounds = drawable.bounds();
    EXPECT_TRUE((bounds.upper.array() <= 1).all() && (bounds.upper.array() > 0.7).all());
    // Another copy of the scene: the same bytes, not made again.
    const Aspect other = sceneWithSurface(controlGrid(4));
    EXPECT_EQ(surfaceIn(other).key(), drawable.key());
    EXPECT_EQ(surfaceIn(other).arrays().positions.bytes().data(), arrays.positions.bytes().data());
    // What shapes it is in the key, what colours it is not.
    SubdivisionSurface finer = controlGrid(4);
    finer.level = 2;
    EXPECT_NE(surfaceIn(sceneWithSurface(finer)).key(), drawable.key());
}

TEST(DerivedArrays, OfWhatIsNotHereAreEmpty) {
    SubdivisionSurface surface = controlGrid(3);
    surface.points = Blob::absent(surface.points.id(), surface.points.sizeBytes());
    const Aspect aspect = sceneWithSurface(surface);
    EXPECT_FALSE(surfaceIn(aspect).resident());
    EXPECT_EQ(surfaceIn(aspect).triangleCount(), 0u);
    EXPECT_TRUE(surfaceIn(aspect).bounds().empty());
    EXPECT_FALSE(surfaceIn(aspect).check()) << "an edit that brings a name without bytes";
}

TEST(DerivedArrays, RefuseWhatIsNoControlMeshByName) {
    const auto why = [](auto&& spoil) {
        SubdivisionSurface surface = controlGrid(2);
        spoil(surface);
        const Aspect aspect = sceneWithSurface(surface);
        const Expected<void> checked = surfaceIn(aspect).check();
        const bool empty = surfaceIn(aspect).arrays().positions.empty();
        EXPECT_EQ(empty, !checked) << "what is refused has no triangles";
        return checked ? std::string() : checked.error().message;
    };
    const auto numbers = [](std::initializer_list<std::uint32_t> values) {
        return Blob::of(std::span<const std::uint32_t>(values.begin(), values.size()));
    };
    const auto floats = [](std::initializer_list<float> values) {
        return Blob::of(std::span<const float>(values.begin(), values.size()));
    };
    EXPECT_EQ(why([](SubdivisionSurface&) {}), "");
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.faceVertices = numbers({0, 1, 2}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.faceSizes = numbers({2}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.creases = numbers({0, 99}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.creaseSharpness = floats({1, 2}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.creaseSharpness = floats({1}), s.creases = numbers({0}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.corners = numbers({99}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.holes = numbers({99}); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.scheme = SubdivisionSurface::kLoop; }));
    for (const float bad : {NAN, INFINITY, 2e30F})
        EXPECT_WORDS(
            why([&](SubdivisionSurface& s) { s.points = *s.points.withRange(12, std::as_bytes(std::span(&bad, 1))); }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s.points = {}; }));
    EXPECT_WORDS(why([&](SubdivisionSurface& s) { s = controlGrid(60), s.level = 6; }));
}

TEST(DerivedArrays, FollowRangesOfControlPointsToTheSameBytes) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 30;
    std::size_t parts = 0, whole = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message() << "TESSERA_SEED=" << seed << " build/bin/unit_drawable");
        std::mt19937_64 random(seed);
        SubdivisionSurface surface = controlGrid(2 + static_cast<std::uint32_t>(random() % 5));
        surface.level = static_cast<std::int64_t>(random() % 4);
        // Another mesh each time, so that nothing is found that another seed has made.
        const float away = static_cast<float>(seed) / 64;
        surface.points = *surface.points.withRange(0, std::as_bytes(std::span(&away, 1)));
        Aspect before = sceneWithSurface(surface);
        std::vector<std::uint8_t> levels(surface.faceSizes.sizeBytes() / 4);
        for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random() % 3);
        const Fineness fineness = random() % 2 ? Fineness(static_cast<unsigned>(random() % 2))
                                               : Fineness(Blob::of(std::span<const std::uint8_t>(levels)));
        MeshArrays known = surfaceIn(before).at(fineness).arrays();
        for (int step = 0; step < 6; ++step) {
            const std::size_t count = surface.points.sizeBytes() / 4, at = random() % count;
            std::vector<float> moved(1 + random() % std::min<std::size_t>(9, count - at));
            for (float& x : moved) x = static_cast<float>(static_cast<double>(random() % 2000) / 1000 - 1);
            surface.points = *surface.points.withRange(4 * at, std::as_bytes(std::span<const float>(moved)));
            // One knows how it came about; the other has the bytes alone, and another process would make it so.
            const Aspect after = sceneWithSurface(surface);
            const MeshArrays arrays = surfaceIn(after).at(fineness).arrays();
            const EarlierMesh* const nothing = nullptr;
            const DerivedMesh fresh =
                kSubdivisionDerivation.derive(after.get<SubdivisionSurface>(kSurface), fineness, nothing);
            ASSERT_EQ(arrays.positions.id(), fresh.arrays.positions.id()) << step;
            ASSERT_EQ(arrays.normals.id(), fresh.arrays.normals.id()) << step;
            ASSERT_EQ(arrays.indices.id(), known.indices.id());
            ASSERT_EQ(blobIdOf(arrays.positions.bytes()), arrays.positions.id());
            // Whoever kept something of the mesh before finds its way from there, and where it differs.
            bool found = false;
            for (const MeshOrigin& origin : originsOf(arrays)) {
                if (origin.key != keyOf(known)) continue;
                found = true;
                EXPECT_TRUE(soundWithin(arrays, origin.changed));
                const ByteRange& changed = origin.changed[0];
                (changed.end - changed.begin < arrays.positions.sizeBytes() ? parts : whole) += 1;
                const ByteSpan now = arrays.positions.bytes(), then = known.positions.bytes();
                for (std::size_t i = 0; i < now.size(); ++i) {
                    if (i < changed.begin || i >= changed.end) {
                        ASSERT_EQ(now[i], then[i]);
                    }
                }
            }
            EXPECT_TRUE(found || keyOf(arrays) == keyOf(known));
            known = arrays;
        }
    }
    if (!one) {
        EXPECT_GT(parts, whole / 2) << "ranges are said, not the whole";
    }
}

struct Counted {
    std::size_t size = 0;
    const std::atomic<bool>* used = nullptr;
    [[nodiscard]] std::size_t bytes() const { return size; }
    [[nodiscard]] bool inUse() const { return used && *used; }
};

TEST(ContentCache, MakesEachContentOnceHoweverManyThreadsAsk) {
    ContentCache<Counted> cache(1'000'000);
    std::atomic<int> made{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 8; ++t)
        threads.emplace_back([&] {
            for (std::uint64_t key = 1; key <= 200; ++key) {
                const auto value = cache.get({key, 0}, [&] {
                    ++made;
                    std::this_thread::yield();
                    return Counted{key};
                });
                EXPECT_EQ(value->size, key);
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(made, 200);
}

TEST(ContentCache, KeepsWhatIsUsedAndOfTheRestALittle) {
    ContentCache<Counted> cache(1000);
    const std::atomic<bool> used{true};
    const auto kept = cache.get({1, 1}, [] { return Counted{400}; });
    (void)cache.get({2, 2}, [&] { return Counted{400, &used}; });
    for (std::uint64_t key = 1; key <= 1000; ++key) (void)cache.get({key, 0}, [] { return Counted{100}; });
    EXPECT_EQ(cache.find({1, 1}), kept);
    EXPECT_NE(cache.find({2, 2}), nullptr);
    EXPECT_NE(cache.find({1000, 0}), nullptr);
    EXPECT_EQ(cache.find({1, 0}), nullptr);
    EXPECT_LE(cache.size(), 2 + 10 + 3u) << "what has come since the last look";
}

}  // namespace
}  // namespace tessera
