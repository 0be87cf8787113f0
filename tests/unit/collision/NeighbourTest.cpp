#include "server/collision/pipeline/NeighbourFinder.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

/// Everybody is of interest to everybody.
InteractionTable everybody(std::size_t n) {
    return {std::vector<std::uint32_t>(n, 0), {true}, {true}};
}

Box boxAt(const Vec3d& lower, const Vec3d& size) {
    Box box;
    box.extend(lower);
    box.extend(Vec3d(lower + size));
    return box;
}

std::vector<NeighbourPair> list(std::span<const NeighbourPair> pairs) {
    return {pairs.begin(), pairs.end()};
}

TEST(SweepAndPrune, TouchingBoxesAreNeighboursAndEmptyOnesAreNot) {
    SweepAndPrune finder;
    const std::vector<Box> boxes{boxAt({0, 0, 0}, {1, 1, 1}), boxAt({1, 0, 0}, {1, 1, 1}),
                                 boxAt({1, 1.1, 0}, {1, 1, 1}), Box{}};
    finder.reset(boxes, everybody(4));
    EXPECT_EQ(list(finder.pairs()), (std::vector<NeighbourPair>{{0, 1}}));
    finder.move(2, boxAt({1, 1, 0}, {1, 1, 1}));
    EXPECT_EQ(list(finder.pairs()), (std::vector<NeighbourPair>{{0, 1}, {0, 2}, {1, 2}}));
    finder.move(0, Box{});
    EXPECT_EQ(list(finder.pairs()), (std::vector<NeighbourPair>{{1, 2}}));
}

TEST(SweepAndPrune, FindsWhatAllPairsFindsWhileThingsMove) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-10, 10), size(0, 2), step(-0.3, 0.3);
    for (const std::size_t n : {1u, 2u, 30u, 400u}) {
        // Three kinds: 0 meets everybody, 1 meets only 0, 2 nobody at all.
        InteractionTable table;
        std::uniform_int_distribution<std::uint32_t> group(0, 2);
        for (std::size_t i = 0; i < n; ++i) table.groupOf.push_back(group(random));
        table.active = {true, false, false};
        table.interacts = {true, true, false, true, false, false, false, false, false};
        std::vector<Box> boxes;
        for (std::size_t i = 0; i < n; ++i)
            boxes.push_back(
                boxAt({place(random), place(random), place(random)}, {size(random), size(random), size(random)}));
        SweepAndPrune sweep;
        AllPairs all;
        sweep.reset(boxes, table);
        all.reset(boxes, table);
        ASSERT_EQ(list(sweep.pairs()), list(all.pairs()));
        std::uniform_int_distribution<std::uint32_t> item(0, static_cast<std::uint32_t>(n - 1));
        for (int frame = 0; frame < 150; ++frame) {
            // Mostly small steps, now and then a leap, now and then everybody (the axis changes on the way, too).
            const std::size_t moves = frame % 20 == 0 ? n : n / 20 + 1;
            for (std::size_t k = 0; k < moves; ++k) {
                const std::uint32_t i = item(random);
                Vec3d shift(step(random), step(random), step(random));
                if (frame % 7 == 0) shift *= 30;
                if (frame > 75) shift.x() *= 10;
                boxes[i].lower += shift;
                boxes[i].upper += shift;
                sweep.move(i, boxes[i]);
                all.move(i, boxes[i]);
            }
            ASSERT_EQ(list(sweep.pairs()), list(all.pairs())) << n << ' ' << frame;
        }
    }
}

}  // namespace
}  // namespace tessera
