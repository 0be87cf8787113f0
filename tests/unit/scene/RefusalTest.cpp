#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/cores/Camera.h"
#include "common/cores/Group.h"
#include "common/cores/Image.h"
#include "common/cores/Interest.h"
#include "common/cores/Switch.h"
#include "tests/support/words/Words.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The message with which the hall refuses a list. A refused list must leave no trace.
Error refusalBy(Aspect aspect, const ChangeList& list) {
    const StateHash before = aspect.stateHash();
    const std::vector<ObjectId> ids = aspect.ids();
    const std::uint64_t nextFreeId = aspect.nextFreeId();
    const Expected<void> done = aspect.apply(list);
    EXPECT_FALSE(done) << "the list was not refused";
    EXPECT_FALSE(aspect.applyWithInverse(list));
    EXPECT_EQ(aspect.stateHash(), before);
    EXPECT_EQ(aspect.ids(), ids);
    EXPECT_EQ(aspect.nextFreeId(), nextFreeId);
    return done ? Error() : done.error();
}
Error refusal(const ChangeList& list) {
    return refusalBy(hall(), list);
}
std::string message(const ChangeList& list) {
    return refusal(list).message;
}

TEST(Refusals, OfCreations) {
    EXPECT_WORDS(message(Edits().core<Group>(0).take()));
    EXPECT_WORDS(message(Edits().core<Group>(1).take()));
    EXPECT_WORDS(message(Edits().core<Group>(5).take()));
    EXPECT_WORDS(message(Edits().core<Group>(50).core<Switch>(50).take()));
    EXPECT_WORDS(message(Edits().core<Group>(kFirstPlaceholder + 3).take()));
    ChangeListBuilder unknown;
    unknown.create(ObjectId(50), ObjectType(77));
    EXPECT_WORDS(message(unknown.take()));
}

TEST(Refusals, OfPlacements) {
    EXPECT_WORDS(message(Edits().under(1, 2).take()));
    EXPECT_WORDS(message(Edits().under(1, 0).take()));
    EXPECT_WORDS(message(Edits().under(99, 1).take()));
    EXPECT_WORDS(message(Edits().under(3, 99).take()));
    EXPECT_WORDS(message(Edits().under(5, 1).take()));
    EXPECT_WORDS(message(Edits().under(3, 5).take()));
    EXPECT_WORDS(message(Edits().under(2, 2).take()));
    EXPECT_WORDS(message(Edits().under(2, 3).take()));
    EXPECT_WORDS(message(Edits().under(3, 4).under(4, 3).take()));
    EXPECT_WORDS(message(Edits().under(3, 1, 2).take()));
    EXPECT_WORDS(message(Edits().under(3, 2, 2).take()));
    EXPECT_WORDS(message(Edits().under(kFirstPlaceholder, 1).take()));
}

TEST(Refusals, OfRanges) {
    Aspect aspect = hall();
    const std::vector<float> corners(9, 1.0f);
    const Blob array = Blob::of(std::span<const float>(corners)), four = Blob{Bytes(4)};
    const FieldId positions = fieldId<&Geometry::positions>;
    mustApply(aspect, Edits().value<Geometry>(6, positions, array).take());
    const auto range = [&](std::uint64_t id, std::uint64_t offset, const Blob& bytes, FieldId field = FieldId{1},
                           ObjectType type = typeOf<Geometry>()) {
        Edits edits;
        edits.setRange(ObjectId(id), type, field, offset, bytes);
        return edits.take();
    };
    const auto refuses = [&](const ChangeList& list) {
        Aspect copy;
        mustApply(copy, snapshot(aspect));
        EXPECT_WORDS(refusalBy(std::move(copy), list).message);
    };
    refuses(range(99, 0, four));
    refuses(range(5, 0, four));
    refuses(range(5, 0, four, FieldId{1}, typeOf<Transform>()));
    refuses(range(6, 0, four, fieldId<&Geometry::material>));
    refuses(range(6, 33, four));
    refuses(range(6, ~std::uint64_t{0}, four));
    refuses(range(6, 0, Blob()));
    refuses(range(6, 0, Blob::absent(four.id(), 4)));
    ChangeList lying = range(6, 0, four);
    lying.ranges[0].result = Blob::absent({1, 2}, 36);
    refuses(lying);
    ChangeList good = range(6, 32, four);
    ASSERT_TRUE(resolveRanges(aspect, good));
    EXPECT_EQ(good.ranges[0].result, *array.withRange(32, four.bytes()));
    // A range of what is not there is the scene's to refuse; the one behind it has its result all the same, and is not
    // blamed.
    ChangeList behind = range(99, 0, four);
    behind.ranges.push_back(range(6, 32, four).ranges[0]);
    ASSERT_TRUE(resolveRanges(aspect, behind));
    EXPECT_EQ(behind.ranges[1].result, good.ranges[0].result);
    refuses(behind);
    // What does not fit is named in elements.
    ChangeList beyond = range(6, 36, four);
    const Expected<void> refused = resolveRanges(aspect, beyond);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    mustApply(aspect, good);
    EXPECT_EQ(aspect.get<Geometry>(ObjectId(6))->positions, good.ranges[0].result);
    // Behind a column of the same list that takes the array away.
    ChangeList both = Edits().value<Geometry>(6, positions, Blob()).take();
    both.ranges = range(6, 0, four).ranges;
    refuses(both);
    // An array that is not here needs a name.
    mustApply(aspect, Edits().value<Geometry>(6, positions, Blob::absent({3, 4}, 36)).take());
    refuses(range(6, 0, four));
    ChangeList unnamed = range(6, 0, four);
    EXPECT_FALSE(resolveRanges(aspect, unnamed));
}

TEST(Refusals, OfWordsAndFlags) {
    Edits edits;
    edits.core<Interest>(20);
    ChangeList list = edits.take();
    list.columns.push_back(FieldColumn::ofShape(typeOf<Interest>(), fieldId<&Interest::enabled>, FieldKind::kBool, 1));
    list.columns[0].append(ObjectId(20), true);
    std::get<std::vector<std::uint8_t>>(list.columns[0].values)[0] = 2;
    EXPECT_WORDS(message(list));
    EXPECT_WORDS(
        message(Edits().core<Interest>(20).value<Interest>(20, fieldId<&Interest::mode>, std::int64_t{6}).take()));
}

TEST(Refusals, OfColumns) {
    EXPECT_WORDS(message(Edits().value<Transform>(99, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1))).take()));
    EXPECT_WORDS(message(Edits().value<Transform>(7, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1))).take()));
    EXPECT_WORDS(message(Edits().value<Transform>(5, FieldId(9), toValue(1.0)).take()));
    EXPECT_WORDS(message(Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(1.0)).take()));
    EXPECT_WORDS(message(Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(Vec3f(1, 1, 1))).take()));
    EXPECT_WORDS(message(Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(Vec3d(1, NAN, 1))).take()));
    EXPECT_WORDS(message(Edits().value<Material>(7, fieldId<&Material::roughness>, toValue(float(kInfinity))).take()));
    EXPECT_WORDS(message(Edits().value<Transform>(5, fieldId<&Transform::rotation>, Doubles{{0, 0, 0, 0}, 4}).take()));
    EXPECT_WORDS(
        message(Edits().value<Transform>(5, fieldId<&Transform::rotation>, Doubles{{1e-60, 0, 0, 0}, 4}).take()));
    EXPECT_WORDS(
        message(Edits().value<Transform>(5, fieldId<&Transform::rotation>, Doubles{{1e200, 0, 0, 0}, 4}).take()));
    EXPECT_WORDS(message(Edits().value<Node>(4, fieldId<&Node::name>, std::string(5000, 'x')).take()));
    EXPECT_WORDS(message(Edits().value<Node>(4, fieldId<&Node::name>, std::string("\xC3(")).take()));
    EXPECT_WORDS(message(Edits().core<Image>(20).value<Image>(20, fieldId<&Image::widthPx>, std::int64_t{-1}).take()));
    EXPECT_WORDS(
        message(Edits().core<Camera>(20).value<Camera>(20, fieldId<&Camera::worldUnitsPerMetre>, toValue(0.0)).take()));

    const auto look = [](FieldId field, const FieldValue& value) {
        return Edits().value<Material>(7, field, value).take();
    };
    EXPECT_WORDS(message(look(fieldId<&Material::roughness>, toValue(9.0f))));
    EXPECT_WORDS(message(look(fieldId<&Material::metallic>, toValue(-0.1f))));
    EXPECT_WORDS(message(look(fieldId<&Material::baseColor>, toValue(Vec4f(1, 1, 1.5f, 1)))));
    EXPECT_WORDS(message(look(fieldId<&Material::emissive>, toValue(Vec3f(0, -1, 0)))));

    ChangeList twice = Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1))).take();
    twice.columns[0].append(ObjectId(5), toValue(Vec3d(2, 2, 2)));
    EXPECT_WORDS(message(twice));
    ChangeList createdTwice =
        Edits().core<Transform>(20).value<Transform>(20, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1))).take();
    createdTwice.columns[0].append(ObjectId(20), toValue(Vec3d(2, 2, 2)));
    EXPECT_WORDS(message(createdTwice));
    ChangeList sameColumn = Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1))).take();
    sameColumn.columns.push_back(sameColumn.columns[0]);
    EXPECT_WORDS(message(sameColumn));
    ChangeList ragged = Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1))).take();
    ragged.columns[0].ids.push_back(ObjectId(5));
    EXPECT_WORDS(message(ragged));
}

TEST(Refusals, OfRefs) {
    EXPECT_WORDS(message(Edits().coreOfNode(4, 99).take()));
    EXPECT_WORDS(message(Edits().coreOfNode(4, 3).take()));
    EXPECT_WORDS(message(Edits().coreOfNode(4, 7).take()));
    EXPECT_WORDS(message(Edits().value<Geometry>(6, fieldId<&Geometry::material>, ObjectId(5)).take()));
    EXPECT_WORDS(message(Edits().coreOfNode(4, kFirstPlaceholder + 1).take()));
}

TEST(Refusals, OfDestructions) {
    EXPECT_WORDS(message(Edits().gone(1).take()));
    EXPECT_WORDS(message(Edits().gone(99).take()));
    EXPECT_WORDS(message(Edits().gone(2).take()));
    EXPECT_WORDS(message(Edits().gone(3).take()));
    EXPECT_WORDS(message(Edits().gone(6).take()));
    EXPECT_WORDS(message(Edits().gone(7).take()));
    EXPECT_WORDS(message(Edits().under(4, 0).gone(4).gone(4).take()));
    EXPECT_WORDS(message(Edits().core<Group>(20).coreOfNode(3, 20).gone(20).take()));
    // Two let go of it, one takes hold of it.
    EXPECT_WORDS(message(Edits().coreOfNode(4, 0).coreOfNode(3, 6).gone(6).take()));
}

/// Whoever wants something gone is told who holds it, as the list leaves it.
TEST(Refusals, OfDestructionsNameWhoRefersToIt) {
    EXPECT_WORDS(message(Edits().gone(6).take()));
    EXPECT_WORDS(message(Edits().gone(7).take()));
    EXPECT_WORDS(message(Edits().coreOfNode(4, 0).coreOfNode(3, 6).gone(6).take()));
    Aspect many = hall();
    Edits more;
    for (const std::uint64_t id : {20, 21, 22, 23, 24})
        more.core<Geometry>(id).value<Geometry>(id, fieldId<&Geometry::material>, ObjectId(7));
    ASSERT_TRUE(many.apply(more.take()));
    EXPECT_WORDS(refusalBy(std::move(many), Edits().gone(7).take()).message);
    EXPECT_WORDS(message(
        Edits().core<Geometry>(20).value<Geometry>(20, fieldId<&Geometry::material>, ObjectId(7)).gone(7).take()));
}

TEST(Refusals, OfTooMuch) {
    EXPECT_WORDS(refusalBy(hall({.maxObjects = 8}), Edits().core<Group>(20).core<Group>(21).take()).message);
    EXPECT_EQ(refusalBy(hall({.maxChildren = 2}), Edits().node(20, "x", 2).take()).code, ErrorCode::kLimit);
    // root, hall, crane, 20: one too deep.
    EXPECT_EQ(refusalBy(hall({.maxDepth = 3}), Edits().node(20, "x", 3).take()).code, ErrorCode::kLimit);
    ChangeList free;
    free.nextFreeId = ~std::uint64_t{0};
    EXPECT_EQ(refusal(free).code, ErrorCode::kBadInput);
}

TEST(Refusals, OfATreeThatGrowsTooDeepFromBelow) {
    // A chain built from its lower end, each placement shallow by itself.
    Edits e;
    for (std::uint64_t i = 20; i < 24; ++i) e.node(i, "link", 0);
    for (std::uint64_t i = 20; i < 23; ++i) e.under(i, i + 1);
    e.under(23, 3);
    EXPECT_EQ(refusalBy(hall({.maxDepth = 6}), e.take()).code, ErrorCode::kLimit);
}

TEST(Refusals, OfMovingADeepSubtreeTooDeep) {
    Aspect aspect = hall({.maxDepth = 5});
    mustApply(aspect, Edits().node(20, "a", 0).node(21, "b", 20).node(22, "c", 21).take());
    mustApply(aspect, Edits().under(20, 2).take());  // root hall a b c
    EXPECT_EQ(refusalBy(std::move(aspect), Edits().under(20, 3).take()).code, ErrorCode::kLimit);
}

TEST(Refusals, ALimitCountsWhatIsLeftInTheEnd) {
    Aspect aspect = hall({.maxObjects = 7});
    mustApply(aspect, Edits().core<Group>(20).coreOfNode(4, 20).gone(6).take());
    EXPECT_EQ(aspect.objectCount(), 7u);
}

}  // namespace
}  // namespace tessera
