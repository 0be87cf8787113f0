#include "common/base/FairQueue.h"

#include <gtest/gtest.h>

#include <thread>

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Queue = FairQueue<int>;
using enum Queue::Rank;

std::vector<int> takeAll(Queue& queue, Queue::Rank rank) {
    std::vector<int> all;
    while (auto next = queue.tryPop(rank)) all.push_back(next->second);
    return all;
}

TEST(FairQueue, SourcesTakeTurns) {
    Queue queue;
    for (int i = 0; i < 4; ++i) queue.push(7, 70 + i);
    queue.push(8, 80);
    queue.push(9, 90);
    queue.push(9, 91);
    EXPECT_EQ(takeAll(queue, kOther), (std::vector<int>{70, 80, 90, 71, 91, 72, 73}));
    EXPECT_FALSE(queue.tryPop(kOther));
}

TEST(FairQueue, RanksAreServedApartAndASourceKeepsItsOrderWhenItsRankChanges) {
    Queue queue;
    queue.push(1, 10);
    queue.push(2, 20);
    queue.push(2, 21);
    queue.setRank(2, kFirst);
    queue.push(2, 22);
    EXPECT_EQ(takeAll(queue, kFirst), (std::vector<int>{20, 21, 22}));
    EXPECT_EQ(takeAll(queue, kOther), (std::vector<int>{10}));
    queue.push(2, 23);
    EXPECT_TRUE(queue.any(kFirst));
    EXPECT_FALSE(queue.any(kOther));
}

TEST(FairQueue, WhoMayNotBeServedKeepsItsValuesAndNobodyElseWaits) {
    Queue queue;
    queue.push(1, 10);
    queue.push(2, 20);
    const auto notOne = [](Queue::Source source) { return source != 1; };
    EXPECT_EQ(queue.tryPop(kOther, notOne)->second, 20);
    EXPECT_FALSE(queue.tryPop(kOther, notOne));
    EXPECT_FALSE(queue.any(kOther, notOne));
    EXPECT_EQ(queue.waiting(kOther), (std::vector<Queue::Source>{1}));
    EXPECT_EQ(queue.tryPop(kOther)->second, 10);
}

TEST(FairQueue, AForgottenSourceIsServedToItsEndAndStartsAnew) {
    Queue queue;
    queue.setRank(1, kFirst);
    queue.push(1, 10);
    queue.forget(1);
    EXPECT_EQ(queue.tryPop(kFirst)->second, 10);
    queue.push(1, 11);  // of the other rank, as any new source
    EXPECT_FALSE(queue.any(kFirst));
    EXPECT_EQ(queue.tryPop(kOther)->second, 11);
}

TEST(FairQueue, NewsWakesWhoWaitsAndClosingDoes) {
    Queue queue;
    queue.push(1, 1);
    queue.waitForNews(10min);
    std::thread later([&] { queue.push(2, 2); });
    queue.waitForNews(10min);
    later.join();
    queue.waitForNews(1ms);  // nothing new, though values are there
    queue.close();
    queue.waitForNews(10min);
    EXPECT_FALSE(queue.push(3, 3));
    EXPECT_EQ(takeAll(queue, kOther), (std::vector<int>{1, 2}));
}

}  // namespace
}  // namespace tessera
