#include "common/cores/ChildList.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tessera {
namespace {

void expectSame(const ChildList& list, const std::vector<ObjectId>& plain) {
    ASSERT_EQ(list.size(), plain.size());
    EXPECT_TRUE(list == plain);
    std::vector<ObjectId> walked;
    for (const ObjectId id : list) walked.push_back(id);
    EXPECT_EQ(walked, plain);
}

/// Made anew, one behind the other.
std::uint64_t hashOf(const std::vector<ObjectId>& plain) {
    ChildList list;
    for (const ObjectId id : plain) list.push_back(id);
    return list.orderHash();
}

class ChildLists : public testing::TestWithParam<std::size_t> {};

/// Random histories around every size at which the list changes its form, beside a plain vector.
TEST_P(ChildLists, AreWhatAVectorWouldBe) {
    const std::size_t size = GetParam();
    std::mt19937_64 random(size);
    const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
    ChildList list;
    std::vector<ObjectId> plain;
    std::uint64_t next = 1;
    const auto insert = [&](std::size_t index) {
        list.insert(index, ObjectId(next));
        plain.insert(plain.begin() + static_cast<std::ptrdiff_t>(index), ObjectId(next++));
    };
    const auto erase = [&](std::size_t index) {
        const ObjectId id = plain[index];
        EXPECT_EQ(list.erase(id), index);
        plain.erase(plain.begin() + static_cast<std::ptrdiff_t>(index));
        EXPECT_FALSE(list.contains(id));
    };
    // Grows in bursts at one place (front, middle, end, anywhere), then stays about as large, then goes, each by its
    // own way.
    for (int burst = 0; plain.size() < size; ++burst)
        for (std::size_t i = 0; i < 1 + size / 5; ++i)
            insert(burst % 4 == 0   ? 0
                   : burst % 4 == 1 ? plain.size() / 2
                   : burst % 4 == 2 ? plain.size()
                                    : below(plain.size() + 1));
    expectSame(list, plain);
    EXPECT_EQ(list.orderHash(), hashOf(plain));
    for (std::size_t i = 0; i < 2 * size; ++i) {
        if (below(2) && !plain.empty())
            erase(below(plain.size()));
        else
            insert(below(plain.size() + 1));
        if (plain.empty()) continue;
        const std::size_t at = below(plain.size());
        EXPECT_EQ(list[at], plain[at]);
        EXPECT_EQ(list.indexOf(plain[at]), at);
        EXPECT_TRUE(list.contains(plain[at]));
        EXPECT_EQ(*list.from(at), plain[at]);
    }
    expectSame(list, plain);
    EXPECT_EQ(list.orderHash(), hashOf(plain));
    std::vector<ObjectId> shuffled = plain;
    if (plain.size() > 2) {
        std::swap(shuffled[0], shuffled[plain.size() - 1]);
        EXPECT_NE(hashOf(shuffled), list.orderHash());
    }
    // One place wears away first.
    while (plain.size() > size / 2) erase(plain.size() / 3);
    expectSame(list, plain);
    while (!plain.empty()) {
        erase(below(3) ? 0 : below(plain.size()));
        if (plain.size() % 97 == 0) expectSame(list, plain);
    }
    EXPECT_EQ(list.orderHash(), 0u);
    EXPECT_EQ(list.memoryBytes(), 0u) << "an empty list holds nothing";
}
INSTANTIATE_TEST_SUITE_P(Sizes, ChildLists,
                         testing::Values(1, 2, 3, 5, ChildList::kFew - 1, ChildList::kFew, ChildList::kFew + 1,
                                         ChildList::kChunk, 2 * ChildList::kChunk + 1, 3000, 20000));

TEST(ChildList, TheOrderCounts) {
    std::mt19937_64 random(1);
    std::vector<ObjectId> plain;
    for (std::uint64_t i = 0; i < 300; ++i) plain.push_back(ObjectId(i + 2));
    const std::uint64_t hash = hashOf(plain);
    for (int i = 0; i < 2000; ++i) {
        std::vector<ObjectId> other = plain;
        const std::size_t a = random() % other.size(), b = random() % other.size();
        if (a == b) continue;
        std::rotate(other.begin() + static_cast<std::ptrdiff_t>(std::min(a, b)),
                    other.begin() + static_cast<std::ptrdiff_t>(std::min(a, b)) + 1,
                    other.begin() + static_cast<std::ptrdiff_t>(std::max(a, b)) + 1);
        EXPECT_NE(hashOf(other), hash);
    }
}

}  // namespace
}  // namespace tessera
