#include <gtest/gtest.h>

#include "common/change/ChangeList.h"

namespace tessera {
namespace {

constexpr ObjectType kTransform{3}, kMaterial{5};
constexpr FieldId kFirst{1}, kSecond{2};

FieldValue triple(double x, double y, double z) {
    return Doubles{{x, y, z}, 3};
}

TEST(ChangeListBuilder, GroupsValuesByTypeAndFieldInTheOrderOfTheirFirstSetting) {
    ChangeListBuilder builder;
    builder.set(ObjectId(9), kMaterial, kFirst, Floats{{0.5f}, 1});
    builder.set(ObjectId(7), kTransform, kSecond, triple(7, 0, 0));
    builder.set(ObjectId(5), kTransform, kSecond, triple(5, 0, 0));
    builder.set(ObjectId(5), kTransform, kFirst, triple(1, 2, 3));

    const ChangeList list = builder.take();

    ASSERT_EQ(list.columns.size(), 3u);
    EXPECT_EQ(list.columns[0].type, kTransform);
    EXPECT_EQ(list.columns[0].field, kFirst);
    EXPECT_EQ(list.columns[1].field, kSecond);
    EXPECT_EQ(list.columns[1].ids, (std::vector{ObjectId(7), ObjectId(5)}));
    EXPECT_EQ(std::get<std::vector<double>>(list.columns[1].values), (std::vector<double>{7, 0, 0, 5, 0, 0}));
    EXPECT_EQ(list.columns[2].type, kMaterial);
}

TEST(ChangeListBuilder, KeepsTheLastValueOfAFieldInItsFirstRowWhateverTheOrderOfIds) {
    for (const bool ascending : {true, false}) {
        ChangeListBuilder builder;
        for (std::uint64_t i = 1; i <= 100; ++i)
            builder.set(ObjectId(ascending ? i : 101 - i), kTransform, kFirst, triple(double(i), 0, 0));
        builder.set(ObjectId(40), kTransform, kFirst, triple(-1, -2, -3));

        const ChangeList list = builder.take();

        ASSERT_EQ(list.columns.size(), 1u);
        ASSERT_EQ(list.columns[0].ids.size(), 100u);
        EXPECT_EQ(list.columns[0].value(ascending ? 39 : 60), triple(-1, -2, -3));
        EXPECT_EQ(list.columns[0].ids[ascending ? 39 : 60], ObjectId(40));
    }
}

TEST(ChangeListBuilder, IsEmptyAfterTheListIsTaken) {
    ChangeListBuilder builder;
    builder.create(ObjectId(2), kTransform);
    builder.set(ObjectId(2), kTransform, kFirst, triple(1, 2, 3));
    EXPECT_FALSE(builder.empty());
    EXPECT_EQ(builder.take().changeCount(), 2u);
    EXPECT_TRUE(builder.empty());
    EXPECT_TRUE(builder.take().empty());
}

TEST(ChangeListBuilder, KeepsPlacementsInTheOrderTheyWereMade) {
    ChangeListBuilder builder;
    builder.place(ObjectId(3), ObjectId(2), 0);
    builder.place(ObjectId(2), kRootNode);
    builder.detach(ObjectId(3));
    const ChangeList list = builder.take();
    EXPECT_EQ(list.placements, (std::vector<Placement>{{ObjectId(3), ObjectId(2), 0},
                                                       {ObjectId(2), kRootNode, Placement::kLast},
                                                       {ObjectId(3), ObjectId(), Placement::kLast}}));
}

TEST(FieldColumn, GivesBackEachKindOfValueThatItWasGiven) {
    const std::vector<FieldValue> values = {Floats{{1, 2, 3, 4}, 4}, Doubles{{1, 2}, 2},
                                            std::int64_t{-5},        ObjectId(17),
                                            std::string("crane"),    Blob::of(std::span<const int>())};
    for (const FieldValue& value : values) {
        FieldColumn column = FieldColumn::ofShape(kTransform, kFirst, kindOf(value), widthOf(value));
        column.append(ObjectId(1), value);
        column.append(ObjectId(2), value);
        EXPECT_EQ(column.kind(), kindOf(value));
        EXPECT_EQ(column.value(1), value);
        EXPECT_EQ(column.scalarCount(), 2u * widthOf(value));
    }
}

TEST(FieldColumnDeathTest, ChecksThatAValueHasTheColumnsShape) {
    FieldColumn column = FieldColumn::ofShape(kTransform, kFirst, FieldKind::kDouble, 3);
    EXPECT_DEATH(column.append(ObjectId(1), Doubles{{1}, 1}), "another kind or width");
    EXPECT_DEATH(column.append(ObjectId(1), Floats{{1, 2, 3}, 3}), "another kind or width");
}

TEST(ReplaceIds, ReachesEveryPlaceAnIdCanStand) {
    ChangeListBuilder builder;
    builder.create(ObjectId(1), kTransform);
    builder.place(ObjectId(2), ObjectId(3));
    builder.set(ObjectId(4), kMaterial, kFirst, ObjectId(5));
    builder.destroy(ObjectId(6));
    ChangeList list = builder.take();

    replaceIds(list, [](ObjectId id) { return ObjectId(id.value + 100); });

    EXPECT_EQ(list.creations[0].id, ObjectId(101));
    EXPECT_EQ(list.placements[0].node, ObjectId(102));
    EXPECT_EQ(list.placements[0].parent, ObjectId(103));
    EXPECT_EQ(list.columns[0].ids[0], ObjectId(104));
    EXPECT_EQ(list.columns[0].value(0), FieldValue(ObjectId(105)));
    EXPECT_EQ(list.destructions[0], ObjectId(106));
}

}  // namespace
}  // namespace tessera
