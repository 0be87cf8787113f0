#include "tests/drill/Judgement.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

namespace tessera::drill {
namespace {

TEST(Judgement, KeepsAPromiseWithinTheMachinesOwnNoise) {
    EXPECT_TRUE(judge({.missed = 3}, {.missed = {2, 3, 40}}).empty());
    EXPECT_TRUE(judge({.missed = 3}, {.missed = {5}, .usualMissed = 2}).empty());
    EXPECT_TRUE(judge({.noticedMs = 1000}, {.noticedMs = {1010}, .usualGapMs = 17}).empty());
}

TEST(Judgement, NamesWhatWasNotKept) {
    const auto broken = judge({.missed = 3, .backMs = 100}, {.missed = {2, 9, 9}, .backMs = {90}});
    ASSERT_EQ(broken.size(), 1u);
    EXPECT_WORDS(broken[0]);
}

TEST(Judgement, WhatWasPromisedAndNotMeasuredIsNotKept) {
    EXPECT_EQ(judge({.noticedMs = 1000}, {}).size(), 1u);
}

TEST(Judgement, WhatARowFoundWrongIsPassedOn) {
    EXPECT_EQ(judge({}, {.broken = {"the state hashes differ"}}).size(), 1u);
}

}  // namespace
}  // namespace tessera::drill
