#include "common/base/Turn.h"

#include <gtest/gtest.h>

#include <vector>

namespace tessera {
namespace {

TEST(Turn, IsOnesAtATimeAndSeesWhatWasDoneBefore) {
    Turn turn;
    int done = 0, missed = 0;
    std::atomic<int> refused{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&] {
            for (int k = 0; k < 5000; ++k) {
                if (k % 2 == 0) {
                    const Turn::Hold hold = turn.take();
                    EXPECT_TRUE(turn.mine());
                    ++done;
                } else if (const Turn::Hold hold = turn.tryTake(); hold) {
                    ++done;
                } else {
                    ++refused;
                    EXPECT_FALSE(turn.mine());
                }
            }
        });
    for (std::thread& thread : threads) thread.join();
    missed = refused;
    EXPECT_EQ(done + missed, 20'000);
    EXPECT_FALSE(turn.mine());
}

TEST(Turn, IsRefusedWhileAnotherHoldsIt) {
    Turn turn;
    const Turn::Hold hold = turn.take();
    std::thread([&] {
        EXPECT_FALSE(turn.tryTake());
        EXPECT_FALSE(turn.mine());
    }).join();
    EXPECT_TRUE(turn.mine());
}

}  // namespace
}  // namespace tessera
