#include <gtest/gtest.h>

#include <functional>

#include "common/change/ChangeList.h"

namespace tessera {
namespace {

constexpr ObjectType kNodeType{1}, kMaterialType{5};
constexpr FieldId kRoughness{3};

ChangeListPtr listOf(const std::function<void(ChangeListBuilder&)>& edit) {
    ChangeListBuilder builder;
    edit(builder);
    return std::make_shared<const ChangeList>(builder.take());
}

FieldValue number(float v) {
    return Floats{{v}, 1};
}

TEST(Compaction, KeepsOnlyTheLastValueOfAField) {
    std::vector<ChangeListPtr> lists;
    for (int frame = 0; frame < 60; ++frame)
        lists.push_back(listOf([&](auto& b) { b.set(ObjectId(2), kMaterialType, kRoughness, number(float(frame))); }));

    const std::vector<ChangeList> compacted = compact(lists);

    ASSERT_EQ(compacted.size(), 1u);
    ASSERT_EQ(compacted[0].changeCount(), 1u);
    EXPECT_EQ(compacted[0].columns[0].value(0), number(59));
}

TEST(Compaction, KeepsAllPlacementsInOrderBecauseTheyShiftEachOther) {
    const std::vector lists = {listOf([](auto& b) { b.place(ObjectId(2), kRootNode, 0); }),
                               listOf([](auto& b) { b.place(ObjectId(3), kRootNode, 0); }),
                               listOf([](auto& b) { b.place(ObjectId(2), kRootNode, 0); })};
    const std::vector<ChangeList> compacted = compact(lists);
    ASSERT_EQ(compacted.size(), 1u);
    EXPECT_EQ(compacted[0].placements.size(), 3u);
    EXPECT_EQ(compacted[0].placements[1].node, ObjectId(3));
}

TEST(Compaction, StartsANewListWhereADestroyedIdComesBack) {
    const std::vector lists = {listOf([](auto& b) { b.destroy(ObjectId(2)); }),
                               listOf([](auto& b) { b.set(ObjectId(3), kMaterialType, kRoughness, number(1)); }),
                               listOf([](auto& b) { b.create(ObjectId(2), kNodeType); })};
    const std::vector<ChangeList> compacted = compact(lists);
    ASSERT_EQ(compacted.size(), 2u);
    EXPECT_EQ(compacted[0].destructions.size(), 1u);
    EXPECT_EQ(compacted[0].columns.size(), 1u);
    EXPECT_EQ(compacted[1].creations.size(), 1u);
}

TEST(Compaction, ForgetsValuesOfWhatIsDestroyedAndObjectsThatCameAndWent) {
    const std::vector lists = {listOf([](auto& b) {
                                   b.create(ObjectId(8), kMaterialType);
                                   b.set(ObjectId(8), kMaterialType, kRoughness, number(1));
                                   b.set(ObjectId(5), kMaterialType, kRoughness, number(1));
                               }),
                               listOf([](auto& b) {
                                   b.destroy(ObjectId(8));
                                   b.destroy(ObjectId(5));
                               })};
    const std::vector<ChangeList> compacted = compact(lists);
    ASSERT_EQ(compacted.size(), 1u);
    EXPECT_TRUE(compacted[0].creations.empty());
    EXPECT_TRUE(compacted[0].columns.empty());
    EXPECT_EQ(compacted[0].destructions, std::vector{ObjectId(5)});
    EXPECT_EQ(compacted[0].nextFreeId, 9u) << "id 8 has been given and must not be given again";
}

TEST(Compaction, OfNothingIsNothing) {
    EXPECT_TRUE(compact({}).empty());
}

}  // namespace
}  // namespace tessera
