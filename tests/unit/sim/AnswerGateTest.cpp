/// Who is told that something is done is told once the journal has it.
#include "server/sim/peers/AnswerGate.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

ServerAction replyTo(std::uint64_t request, const std::string& error = {}) {
    return server_action::Send{
        ConnectionId(1), std::make_shared<const Message>(
                             message::Reply{.id = request, .code = ErrorCode::kRefused, .error = error, .body = {}})};
}
ServerAction notice() {
    return server_action::Send{ConnectionId(1), std::make_shared<const Message>(message::Notice{})};
}
const message::Reply* replyIn(const ServerAction& action) {
    return std::get_if<message::Reply>(std::get<server_action::Send>(action).message.get());
}

TEST(AnswerGate, KeepsWhatGrantsAndNothingElse) {
    AnswerGate gate;
    EXPECT_FALSE(gate.awaited());
    const ServerActions passed = gate.pass({replyTo(1), notice(), replyTo(2, "no")}, 7);
    ASSERT_EQ(passed.size(), 2u);
    EXPECT_FALSE(replyIn(passed[0]));
    EXPECT_EQ(replyIn(passed[1])->id, 2u);
    EXPECT_EQ(gate.awaited(), 7u);
}

TEST(AnswerGate, OpensInOrderAsTheJournalIsWritten) {
    AnswerGate gate;
    EXPECT_TRUE(gate.pass({replyTo(1)}, 3).empty());
    EXPECT_TRUE(gate.pass({replyTo(2)}, 5).empty());
    EXPECT_TRUE(gate.open(2, {}).empty());
    const ServerActions first = gate.open(4, {});
    ASSERT_EQ(first.size(), 1u);
    EXPECT_EQ(replyIn(first[0])->id, 1u);
    EXPECT_TRUE(replyIn(first[0])->error.empty());
    EXPECT_EQ(gate.awaited(), 5u);
    EXPECT_EQ(gate.open(5, {}).size(), 1u);
    EXPECT_FALSE(gate.awaited());
}

/// An edit that changes nothing, before anything else has been handed to the journal of a server that goes on.
TEST(AnswerGate, WhatNothingHasToBeWrittenForIsAwaitedToo) {
    AnswerGate gate;
    EXPECT_TRUE(gate.pass({replyTo(1)}, 0).empty());
    EXPECT_EQ(gate.awaited(), 0u);
    EXPECT_TRUE(gate.awaited()) << "who asks whether anybody waits is told so";
    EXPECT_EQ(gate.open(0, {}).size(), 1u);
    EXPECT_FALSE(gate.awaited());
}

TEST(AnswerGate, InTroubleNobodyWaitsAndNobodyIsToldMoreThanIsTrue) {
    AnswerGate gate;
    EXPECT_TRUE(gate.pass({replyTo(1)}, 3).empty());
    EXPECT_TRUE(gate.pass({replyTo(2)}, 5).empty());
    const ServerActions told = gate.open(4, Error{ErrorCode::kFailed, "the disk is full"});
    ASSERT_EQ(told.size(), 2u);
    EXPECT_TRUE(replyIn(told[0])->error.empty()) << "that one is written";
    EXPECT_EQ(replyIn(told[1])->code, ErrorCode::kFailed);
    EXPECT_EQ(replyIn(told[1])->error,
              "it is done, but the disk is full; a server that is started again may not know of it");
}

}  // namespace
}  // namespace tessera
