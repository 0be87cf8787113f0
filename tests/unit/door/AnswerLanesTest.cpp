/// Large answers of a name wait for each other, and each is asked once.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "server/door/AnswerLanes.h"

namespace tessera {
namespace {

using Ticket = std::shared_ptr<const AnswerLanes::Ticket>;

class Lanes : public testing::Test {
protected:
    /// Asks for one; its ticket stays until it is answered.
    void enter(const std::string& name, const void* who = nullptr) {
        lanes.enter(who, name, [this, name, number = entered++](const Ticket& ticket) {
            asked.push_back(number);
            open.emplace(number, ticket);
        });
    }
    void answer(int number, std::size_t bytes) {
        open.at(number)->answered(bytes);
        open.erase(number);
        io.restart();
        io.poll();
    }

    boost::asio::io_context io;
    AnswerLanes lanes{io};
    std::map<int, Ticket> open;
    std::vector<int> asked;
    int entered = 0;
};

constexpr std::size_t kLarge = 2 * AnswerLanes::kLarge;

TEST_F(Lanes, UntilAnAnswerHasComeAndWhereItIsLargeTwoAreOpen) {
    for (int i = 0; i < 6; ++i) enter("GetTree");
    EXPECT_EQ(asked, (std::vector{0, 1}));
    answer(0, kLarge);
    EXPECT_EQ(asked, (std::vector{0, 1, 2}));
    answer(2, kLarge);
    answer(1, kLarge);
    answer(3, kLarge);
    EXPECT_EQ(asked, (std::vector{0, 1, 2, 3, 4, 5})) << "in the order in which they came";
}

TEST_F(Lanes, SmallAnswersWaitForNothing) {
    for (int i = 0; i < 100; ++i) enter("GetStatus");
    answer(0, 1000);
    EXPECT_EQ(open.size(), 99u);
    enter("GetStatus");
    EXPECT_EQ(open.size(), 100u);
}

TEST_F(Lanes, NamesDoNotWaitForEachOther) {
    for (int i = 0; i < 4; ++i) enter("GetTree");
    for (int i = 0; i < 4; ++i) enter("GetObjects");
    EXPECT_EQ(asked, (std::vector{0, 1, 4, 5}));
}

TEST_F(Lanes, AfterSmallAnswersALaneIsWideAgain) {
    enter("GetTree");
    answer(0, 8 * kLarge);
    int next = 1;
    for (; next < 100; ++next) {
        enter("GetTree");
        answer(next, 10);
    }
    for (int i = 0; i < 10; ++i) enter("GetTree");
    EXPECT_EQ(open.size(), 10u);
}

TEST_F(Lanes, WhatEndsWithoutAnAnswerLetsTheNextIn) {
    for (int i = 0; i < 5; ++i) enter("GetTree");
    for (int i = 0; i < 5; ++i) {
        open.erase(i);
        io.restart();
        io.poll();
    }
    EXPECT_EQ(asked.size(), 5u);
    EXPECT_TRUE(open.empty());
}

TEST_F(Lanes, EachIsAskedOnceWhateverTheOrder) {
    std::mt19937 random(7);
    const std::vector<std::string> names{"a", "b", "c"};
    const int all = 3000;
    while (entered < all || !open.empty()) {
        if (entered < all && random() % 2 == 0) enter(names[random() % names.size()]);
        if (open.empty()) continue;
        const auto one = std::next(open.begin(), static_cast<std::ptrdiff_t>(random() % open.size()));
        if (random() % 4 == 0)
            open.erase(one);
        else
            answer(one->first, random() % 3 == 0 ? kLarge : 100);
        io.restart();
        io.poll();
    }
    std::ranges::sort(asked);
    ASSERT_EQ(asked.size(), static_cast<std::size_t>(all));
    for (int i = 0; i < all; ++i) EXPECT_EQ(asked[static_cast<std::size_t>(i)], i);
}

TEST_F(Lanes, WhoHasHadTheLeastGoesNext) {
    const int greedy[3] = {}, modest = 0;
    for (int round = 0; round < 4; ++round)
        for (const int& one : greedy) enter("GetTree", &one);
    for (int i = 0; i < 4; ++i) answer(asked[static_cast<std::size_t>(i)], kLarge);
    const std::size_t before = asked.size();
    enter("GetTree", &modest);
    const int mine = entered - 1;
    answer(open.begin()->first, kLarge);
    ASSERT_GT(asked.size(), before);
    EXPECT_EQ(asked.back(), mine) << "after one answer, and not after eight";
    answer(mine, 100);
    // Who has had much long ago waits for nobody to catch up.
    const int fresh = 0;
    for (int i = 0; i < 6; ++i) enter("GetTree", &fresh);
    while (!open.empty()) answer(open.begin()->first, kLarge);
    EXPECT_EQ(asked.size(), static_cast<std::size_t>(entered));
}

/// Many who always want more than one answer's room, and one who comes anew each time, in any phase of the round.
TEST_F(Lanes, WhoAsksForLittleWaitsForOneAnswerAndStarvesNobody) {
    const std::array<int, 44> greedy{};
    std::map<int, std::size_t> of;  // by number: whose
    const auto want = [&](std::size_t i) {
        of[entered] = i;
        enter("GetTree", &greedy[i]);
    };
    for (std::size_t i = 0; i < greedy.size(); ++i) want(i);
    std::array<int, greedy.size()> had{};
    std::vector<int> newcomers(300);
    int longest = 0, old = 0;
    const auto answerOldest = [&] {
        const int number = open.begin()->first;
        const auto who = of.find(number);
        answer(number, who == of.end() ? 100 : 3 * kLarge);
        if (who == of.end()) return;
        ++had[who->second];
        want(who->second);
    };
    for (std::size_t i = 0; i < greedy.size(); ++i) answerOldest();  // nothing is known of them before
    for (std::size_t i = 0; i < newcomers.size(); ++i) {
        // Every other one is one that has asked before.
        enter("GetTree", i % 2 ? &old : &newcomers[i]);
        const int mine = entered - 1;
        int waited = 0;
        for (; !std::ranges::count(asked, mine); ++waited) answerOldest();
        longest = std::max(longest, waited);
        answer(mine, 100);
        for (std::size_t more = 0; more < i % 5; ++more) answerOldest();
    }
    EXPECT_LE(longest, 2);
    const auto [least, most] = std::ranges::minmax(had);
    EXPECT_GE(least, most - 2) << "the others share alike";
    // A flood of those who come once and ask for little: the others go on.
    const std::array<int, greedy.size()> before = had;
    std::vector<int> flood(20'000);
    std::size_t came = 0;
    while (came < flood.size()) {
        for (int i = 0; i < 4 && came < flood.size(); ++i) enter("GetTree", &flood[came++]);
        answerOldest();
    }
    EXPECT_GT(had[0], before[0]);
}

TEST_F(Lanes, WhoLeavesIsNotCalled) {
    const int leaves = 0, stays = 0;
    for (int i = 0; i < 3; ++i) enter("GetTree", &leaves);
    enter("GetTree", &stays);
    lanes.leave(&leaves);
    answer(0, kLarge);
    answer(1, kLarge);
    EXPECT_EQ(asked, (std::vector{0, 1, 3}));
}

TEST_F(Lanes, OnceClosedNobodyIsCalled) {
    for (int i = 0; i < 5; ++i) enter("GetTree");
    lanes.close();
    answer(0, 10);
    EXPECT_EQ(asked.size(), 2u);
}

}  // namespace
}  // namespace tessera
