#include "common/base/Channel.h"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <thread>
#include <vector>

namespace tessera {
namespace {

using namespace std::chrono_literals;

TEST(Channel, HandsValuesOnInOrder) {
    Channel<int> channel(3);
    EXPECT_TRUE(channel.push(1));
    EXPECT_TRUE(channel.tryPush(2));
    EXPECT_EQ(channel.pop(), 1);
    EXPECT_EQ(channel.tryPop(), 2);
    EXPECT_EQ(channel.tryPop(), std::nullopt);
}

TEST(Channel, RefusesMoreThanItsCapacity) {
    Channel<int> channel(2);
    EXPECT_TRUE(channel.tryPush(1));
    EXPECT_TRUE(channel.tryPush(2));
    EXPECT_FALSE(channel.tryPush(3));
    EXPECT_EQ(channel.pop(), 1);
    EXPECT_TRUE(channel.tryPush(3));
}

TEST(Channel, GivesUpAfterItsTimeout) {
    Channel<int> channel(1);
    EXPECT_EQ(channel.popFor(1ms), std::nullopt);
    channel.push(5);
    EXPECT_EQ(channel.popFor(0ms), 5);
}

TEST(Channel, ClosingKeepsWhatIsQueuedAndRefusesMore) {
    Channel<int> channel(4);
    channel.push(1);
    channel.push(2);
    channel.close();
    EXPECT_TRUE(channel.closed());
    EXPECT_FALSE(channel.push(3));
    EXPECT_FALSE(channel.tryPush(3));
    EXPECT_EQ(channel.pop(), 1);
    EXPECT_EQ(channel.pop(), 2);
    EXPECT_EQ(channel.pop(), std::nullopt);
}

TEST(Channel, ClosingWakesThoseWhoWait) {
    Channel<int> empty(1), full(1);
    full.push(1);
    std::optional<int> popped = 7;
    bool pushed = true;
    {
        std::jthread consumer([&] { popped = empty.pop(); });
        std::jthread producer([&] { pushed = full.push(2); });
        empty.close();
        full.close();
    }
    EXPECT_EQ(popped, std::nullopt);
    EXPECT_FALSE(pushed);
}

TEST(Channel, CarriesValuesThatCanOnlyBeMoved) {
    Channel<std::unique_ptr<int>> channel(1);
    channel.push(std::make_unique<int>(9));
    EXPECT_EQ(**channel.pop(), 9);
}

TEST(Channel, LosesAndInventsNothingBetweenManyThreads) {
    Channel<int> channel(8);
    constexpr int kProducers = 3, kEach = 2000;
    std::vector<std::vector<int>> taken(2);
    {
        std::vector<std::jthread> consumers;
        for (std::vector<int>& mine : taken) {
            consumers.emplace_back([&] {
                while (std::optional<int> value = channel.pop()) mine.push_back(*value);
            });
        }
        {
            std::vector<std::jthread> producers;
            for (int p = 0; p < kProducers; ++p) {
                producers.emplace_back([&channel, p] {
                    for (int i = 0; i < kEach; ++i) channel.push(p * kEach + i);
                });
            }
        }
        channel.close();
    }
    std::vector<int> all;
    for (const std::vector<int>& mine : taken) {
        // One producer's values come in the order it sent them, to each consumer.
        std::vector<int> last(kProducers, -1);
        for (const int value : mine) {
            EXPECT_GT(value % kEach, last[static_cast<std::size_t>(value / kEach)]);
            last[static_cast<std::size_t>(value / kEach)] = value % kEach;
        }
        all.insert(all.end(), mine.begin(), mine.end());
    }
    std::sort(all.begin(), all.end());
    std::vector<int> expected(kProducers * kEach);
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(all, expected);
}

}  // namespace
}  // namespace tessera
