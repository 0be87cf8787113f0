#include "client/draw/store/RangeAllocator.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tessera {
namespace {

TEST(RangeAllocator, HasNothingUntilItGrows) {
    RangeAllocator ranges;
    EXPECT_EQ(ranges.allocate(1), std::nullopt);
    ranges.grow(10);
    EXPECT_EQ(ranges.allocate(11), std::nullopt);
    EXPECT_EQ(ranges.allocate(10), 0u);
    EXPECT_EQ(ranges.allocate(1), std::nullopt);
}

TEST(RangeAllocator, JoinsNeighboursWhenTheyAreReleased) {
    RangeAllocator ranges;
    ranges.grow(30);
    ASSERT_EQ(ranges.allocate(10), 0u);
    ASSERT_EQ(ranges.allocate(10), 10u);
    ASSERT_EQ(ranges.allocate(10), 20u);
    ranges.release(0, 10);
    ranges.release(20, 10);
    EXPECT_EQ(ranges.allocate(20), std::nullopt);
    ranges.release(10, 10);
    EXPECT_EQ(ranges.allocate(30), 0u);
}

TEST(RangeAllocator, GrowthJoinsTheGapAtTheEnd) {
    RangeAllocator ranges;
    ranges.grow(10);
    ASSERT_EQ(ranges.allocate(6), 0u);
    ranges.grow(20);
    EXPECT_EQ(ranges.used(), 6u);
    EXPECT_EQ(ranges.allocate(14), 6u);
}

TEST(RangeAllocator, NeverHandsOutAnElementTwice) {
    RangeAllocator ranges;
    ranges.grow(1000);
    std::vector<int> owner(1000, 0);
    struct Range {
        std::uint64_t start, count;
    };
    std::vector<Range> taken;
    std::mt19937 random(7);
    for (int step = 0; step < 5000; ++step) {
        if (taken.empty() || random() % 2) {
            const std::uint64_t count = 1 + random() % 40;
            const auto start = ranges.allocate(count);
            if (!start) continue;
            for (std::uint64_t i = 0; i < count; ++i) ASSERT_EQ(owner.at(*start + i)++, 0);
            taken.push_back({*start, count});
        } else {
            const std::size_t which = random() % taken.size();
            for (std::uint64_t i = 0; i < taken[which].count; ++i) --owner[taken[which].start + i];
            ranges.release(taken[which].start, taken[which].count);
            taken.erase(taken.begin() + static_cast<std::ptrdiff_t>(which));
        }
    }
    for (const Range& range : taken) ranges.release(range.start, range.count);
    EXPECT_EQ(ranges.used(), 0u);
    EXPECT_EQ(ranges.allocate(1000), 0u);
}

}  // namespace
}  // namespace tessera
