#include "common/drawable/Drawable.h"

#include <gtest/gtest.h>

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
