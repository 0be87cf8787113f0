#include "common/drawable/Drawable.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "common/cores/ParticleEmitter.h"
#include "common/cores/Particles.h"
#include "common/drawable/GlyphArrays.h"
#include "common/drawable/VolumeShapes.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

Aspect sceneWith(const MeshArrays& arrays) {
    Aspect aspect = hall();
    Edits edits;
    setField<&Geometry::positions>(edits, ObjectId(6), arrays.positions);
    setField<&Geometry::normals>(edits, ObjectId(6), arrays.normals);
    setField<&Geometry::indices>(edits, ObjectId(6), arrays.indices);
    mustApply(aspect, edits.take());
    return aspect;
}

TEST(Drawable, IsWhatACoreSaysOfItsSurface) {
    const MeshArrays box = makeBox({2, 4, 6}).toArrays();
    const Aspect aspect = sceneWith(box);
    const Drawable drawable = drawableOf(aspect, *aspect.get<Node>(ObjectId(4)));
    ASSERT_TRUE(drawable);
    EXPECT_EQ(drawable.triangleCount(), 12u);
    EXPECT_EQ(drawable.material(), ObjectId(7));
    EXPECT_EQ(drawable.bounds().lower, Vec3d(-1, -2, -3));
    EXPECT_EQ(drawable.bounds().upper, Vec3d(1, 2, 3));
    EXPECT_TRUE(drawable.resident());
    EXPECT_TRUE(drawable.check());
    EXPECT_EQ(drawable.arrays().positions, box.positions);

    // Equal arrays, equal key, whatever the material; other arrays, another one.
    const Aspect same = sceneWith(makeBox({2, 4, 6}).toArrays()), other = sceneWith(makeBox({2, 4, 7}).toArrays());
    EXPECT_EQ(drawableOf(same, ObjectId(6)).key(), drawable.key());
    EXPECT_NE(drawableOf(other, ObjectId(6)).key(), drawable.key());
}

TEST(Drawable, SaysWhatDoesNotFitOrIsNotHere) {
    MeshArrays box = makeBox({1, 1, 1}).toArrays();
    box.indices = Blob::absent(box.indices.id(), box.indices.sizeBytes());
    const Aspect absent = sceneWith(box);
    EXPECT_FALSE(drawableOf(absent, ObjectId(6)).resident());
    EXPECT_EQ(drawableOf(absent, ObjectId(6)).triangleCount(), 12u) << "its size is known";
    const Aspect empty = hall();
    const std::vector<std::uint32_t> beyond = {0, 1, 99};
    box.indices = Blob::of(std::span<const std::uint32_t>(beyond));
    const Aspect broken = sceneWith(box);
    EXPECT_FALSE(drawableOf(broken, ObjectId(6)).check());
    EXPECT_TRUE(drawableOf(empty, ObjectId(6)).check()) << "nothing at all is fine";
}

TEST(Drawable, KnowsTheMeshesThatRangesLedFrom) {
    MeshArrays first = makeBox({2, 4, 6}).toArrays();
    first.texcoords = {};
    const auto with = [](const Blob& blob, std::uint64_t offset, std::span<const float> numbers) {
        return *blob.withRange(offset, std::as_bytes(numbers));
    };
    MeshArrays second = first;
    const std::vector<float> far = {100, 200};
    second.positions = with(first.positions, 16, far);
    MeshArrays third = second;
    third.normals = with(first.normals, 0, far);
    third.positions = with(second.positions, 40, far);

    const Aspect a = sceneWith(first), b = sceneWith(second), c = sceneWith(third);
    const auto find = [&](const Aspect& scene) -> std::optional<MeshRanges> {
        for (const MeshOrigin& origin : originsOf(third))
            if (origin.key == drawableOf(scene, ObjectId(6)).key()) return origin.changed;
        return std::nullopt;
    };
    ASSERT_TRUE(find(a));
    EXPECT_EQ((*find(a))[0].begin, 16u);
    EXPECT_EQ((*find(a))[0].end, 48u);
    EXPECT_EQ((*find(a))[1].end, 8u);
    ASSERT_TRUE(find(b)) << "only one of the two arrays had been edited then";
    EXPECT_EQ((*find(b))[0].begin, 40u);
    EXPECT_EQ((*find(b))[1].end, 8u);
    EXPECT_TRUE((*find(b))[4].empty());
    EXPECT_FALSE(find(c)) << "itself";
    EXPECT_TRUE(originsOf(first).empty());
}

template <typename T>
Blob blobOf(std::initializer_list<T> values) {
    return Blob::of(std::span<const T>(std::data(values), values.size()));
}

TEST(Drawable, ArraysSayTheirKindAndAreOfIt) {
    const auto expectKind = [](const auto& core, MeshKind kind, const Fineness& fineness = {}) {
        const Object object = Object::of(core);
        const MeshArrays arrays = drawableOf(object).at(fineness).arrays();
        const auto number = static_cast<int>(kind);
        EXPECT_FALSE(arrays.positions.empty()) << number;
        EXPECT_EQ(static_cast<int>(arrays.kind), number);
        const Expected<void> sound = checkMesh(arrays);
        EXPECT_TRUE(sound) << number << ": " << sound.error().message;
        // Of another kind it is another mesh, whatever its arrays.
        MeshArrays other = arrays;
        other.kind = kind == MeshKind::kTriangles ? MeshKind::kLines : MeshKind::kTriangles;
        EXPECT_NE(keyOf(other), keyOf(arrays)) << number;
    };
    const Blob places = blobOf<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
    Geometry geometry{.positions = places};
    expectKind(geometry, MeshKind::kTriangles);
    geometry.primitive = Geometry::kPoints;
    expectKind(geometry, MeshKind::kPoints);
    for (const std::int64_t primitive : {Geometry::kLines, Geometry::kLineStrip}) {
        geometry.primitive = primitive;
        expectKind(geometry, MeshKind::kLines);
    }
    Particles particles;
    particles.positions = particles.tails = places;
    expectKind(particles, MeshKind::kDiscs);
    particles.mode = Particles::kLines;
    expectKind(particles, MeshKind::kStreaks);
    particles.mode = Particles::kQuads;
    expectKind(particles, MeshKind::kSprites);
    for (const bool sorted : {true, false}) {
        particles.sorted = sorted;
        EXPECT_EQ(drawableOf(Object::of(particles)).arrays().sorted, sorted);
    }
    expectKind(ParticleEmitter{.time = 3}, MeshKind::kDiscs);
    Volume volume;
    volume.sizeX = volume.sizeY = volume.sizeZ = 2;
    volume.voxels = blobOf<std::uint8_t>({0, 0, 0, 0, 0, 0, 0, 255});
    volume.slices = blobOf<double>({0, 0, 1, 0.5});
    volume.surfaceValue = 100;
    for (const std::int64_t mode : {Volume::kCloud, Volume::kMaximum}) {
        volume.mode = mode;
        expectKind(volume, MeshKind::kMarched, kVolumeOnScreens);
    }
    volume.mode = Volume::kSlices;
    expectKind(volume, MeshKind::kSlices, kVolumeOnScreens);
    expectKind(volume, MeshKind::kTriangles);
    Glyphs glyphs;
    glyphs.positions = places;
    expectKind(glyphs, MeshKind::kGlyphs, kGlyphsOnScreens);
    expectKind(glyphs, MeshKind::kTriangles);
}

Aspect sceneWithPoints(const MeshArrays& points, double radius) {
    Aspect aspect = sceneWith(points);
    Edits edits;
    setField<&Geometry::primitive>(edits, ObjectId(6), Geometry::kPoints);
    setField<&Geometry::pointRadius>(edits, ObjectId(6), radius);
    mustApply(aspect, edits.take());
    return aspect;
}

TEST(Drawable, PointsHaveAnExtentTrianglesAndAKeyOfTheirOwn) {
    const std::vector<float> places = {0, 0, 0, 4, 0, 0, 0, 2, 0};
    const MeshArrays arrays{.positions = Blob::of(std::span<const float>(places))};
    const Aspect bare = sceneWith(arrays), points = sceneWithPoints(arrays, 0.5), larger = sceneWithPoints(arrays, 1);
    const Drawable drawable = drawableOf(points, ObjectId(6));
    EXPECT_TRUE(drawable.check());
    EXPECT_EQ(drawable.triangleCount(), 24u);
    EXPECT_EQ(drawable.bounds().lower, Vec3d(-0.5, -0.5, -0.5));
    EXPECT_EQ(drawable.bounds().upper, Vec3d(4.5, 2.5, 0.5));
    EXPECT_EQ(drawable.arrays().kind, MeshKind::kPoints);
    EXPECT_NE(drawable.key(), drawableOf(bare, ObjectId(6)).key());
    EXPECT_NE(drawable.key(), drawableOf(larger, ObjectId(6)).key());
    EXPECT_EQ(drawable.key(), drawableOf(sceneWithPoints(arrays, 0.5), ObjectId(6)).key());
    EXPECT_EQ(drawableOf(bare, ObjectId(6)).triangleCount(), 1u) << "without indices the vertices as they stand";

    const Aspect indexed = sceneWithPoints(makeBox({1, 1, 1}).toArrays(), 1);
    EXPECT_FALSE(drawableOf(indexed, ObjectId(6)).check()) << "points have no indices";
    EXPECT_FALSE(
        drawableOf(indexed, ObjectId(6)).check(drawableOf(sceneWith(makeBox({1, 1, 1}).toArrays()), ObjectId(6)).key()))
        << "though as triangles it was sound";
}

TEST(Drawable, ARadiusThatTrianglesHaveIsNoPartOfTheirKey) {
    const MeshArrays box = makeBox({1, 1, 1}).toArrays();
    Aspect other = sceneWith(box);
    Edits edits;
    setField<&Geometry::pointRadius>(edits, ObjectId(6), 3.0);
    mustApply(other, edits.take());
    EXPECT_EQ(drawableOf(other, ObjectId(6)).key(), drawableOf(sceneWith(box), ObjectId(6)).key());
    EXPECT_EQ(drawableOf(other, ObjectId(6)).bounds().upper, Vec3d(0.5, 0.5, 0.5));
}

TEST(Drawable, PointsRememberWhatRangesLedFrom) {
    const std::vector<float> places = {0, 0, 0, 4, 0, 0}, moved = {7};
    MeshArrays arrays{.positions = Blob::of(std::span<const float>(places))};
    const MeshKey before = drawableOf(sceneWithPoints(arrays, 0.5), ObjectId(6)).key();
    arrays.positions = *arrays.positions.withRange(12, std::as_bytes(std::span(moved)));
    const Aspect scene = sceneWithPoints(arrays, 0.5);
    const std::vector<MeshOrigin> origins = originsOf(drawableOf(scene, ObjectId(6)).arrays());
    ASSERT_EQ(origins.size(), 1u);
    EXPECT_EQ(origins[0].key, before);
}

// The check of a part and the check of all say the same, whatever the part holds.
TEST(Drawable, APartIsCheckedAsTheWhole) {
    std::mt19937 random(2);
    const MeshArrays sound = makeSphere(1, 12).toArrays();
    const MeshKey key = drawableOf(sceneWith(sound), ObjectId(6)).key();
    const std::size_t vertices = sound.positions.sizeBytes() / 12;
    int refused = 0;
    for (int turn = 0; turn < 300; ++turn) {
        MeshArrays arrays = sound;
        for (int several = 0; several < 2; ++several) {
            Blob& blob = random() % 3 == 0 ? arrays.indices : random() % 2 == 0 ? arrays.positions : arrays.normals;
            Bytes part(1 + random() % 9);  // not whole numbers either
            const std::uint64_t offset = random() % (blob.sizeBytes() - part.size());
            const ByteSpan old = blob.bytes().subspan(offset, part.size());
            std::ranges::copy(old, part.begin());
            if (&blob == &arrays.indices)
                part[0] = static_cast<std::byte>(random() % 8 == 0 ? 0xff : random() % vertices);
            else
                part[0] = static_cast<std::byte>(random());
            if (random() % 6 == 0)
                for (std::byte& byte : part) byte = std::byte{0xff};
            blob = *blob.withRange(offset, part);
        }
        const Aspect scene = sceneWith(arrays);
        const bool whole = drawableOf(scene, ObjectId(6)).check().has_value();
        EXPECT_EQ(drawableOf(scene, ObjectId(6)).check(key).has_value(), whole) << turn;
        refused += whole ? 0 : 1;
    }
    EXPECT_GT(refused, 30);
    EXPECT_LT(refused, 270);
}

TEST(Drawable, OnlySomeTypesAre) {
    const Aspect aspect = hall();
    EXPECT_FALSE(drawableOf(aspect, ObjectId(5))) << "a Transform";
    EXPECT_FALSE(drawableOf(aspect, ObjectId(99)));
    EXPECT_FALSE(drawableOf(aspect, ObjectId()));
    for (const TypeInfo& type : allTypes())
        if (isDrawable(type.type)) {
            EXPECT_TRUE(type.isCore) << type.name;
            EXPECT_TRUE(type.effects & Effect::kShape) << type.name << ": who follows shapes would not hear of it";
            EXPECT_NE(type.copy, nullptr) << type.name;
            EXPECT_TRUE(drawableOf(type.freshObject()).check()) << type.name;
        }
}

}  // namespace
}  // namespace tessera
