#include "common/session/ListTail.h"

#include <gtest/gtest.h>

#include "common/session/Messages.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

CommittedListPtr listOf(std::uint64_t sequence, std::size_t bytes = 1) {
    return share(CommittedList{Sequence(sequence), StateHash(100 + sequence), share(Bytes(bytes)), {}});
}

TEST(ListTail, CoversEverythingBeforeTheFirstFrame) {
    ListTail tail(10, 1000);
    tail.keep(true);
    EXPECT_TRUE(tail.covers(5_seq));
    tail.append(listOf(6));
    EXPECT_TRUE(tail.covers(5_seq));
    EXPECT_FALSE(tail.covers(4_seq));
}

TEST(ListTail, KeepsListsOnlyWhileTheyAreWanted) {
    ListTail tail(10, 1000);
    tail.startAt(5_seq, 105_hash);
    tail.append(listOf(6));
    EXPECT_TRUE(tail.lists().empty());
    EXPECT_FALSE(tail.covers(5_seq));
    tail.keep(true);
    EXPECT_TRUE(tail.covers(6_seq));
    tail.append(listOf(7));
    EXPECT_EQ(tail.lists().size(), 1u);
    tail.keep(false);
    EXPECT_TRUE(tail.lists().empty());
    EXPECT_FALSE(tail.covers(6_seq));
    EXPECT_TRUE(tail.covers(7_seq));
}

TEST(ListTail, ForgetsTheOldestBeyondItsBounds) {
    ListTail few(2, 1000), small(10, 100);
    for (ListTail* tail : {&few, &small}) {
        tail->startAt(5_seq, 105_hash);
        tail->keep(true);
        for (std::uint64_t sequence = 6; sequence < 9; ++sequence) tail->append(listOf(sequence, 40));
        EXPECT_EQ(tail->lists().size(), 2u);
        EXPECT_FALSE(tail->covers(5_seq));
        EXPECT_TRUE(tail->covers(6_seq));
    }
}

TEST(ListTail, KeepsNoMoreThanIsWanted) {
    ListTail tail(10, 1000);
    tail.startAt(5_seq, 105_hash);
    tail.keep(true, 100);
    for (std::uint64_t sequence = 6; sequence < 10; ++sequence) tail.append(listOf(sequence, 40));
    EXPECT_EQ(tail.lists().size(), 2u);
    tail.keep(true);
    for (std::uint64_t sequence = 10; sequence < 14; ++sequence) tail.append(listOf(sequence, 40));
    EXPECT_EQ(tail.lists().size(), 6u);
    tail.keep(true, 50);
    EXPECT_EQ(tail.lists().size(), 1u);
    EXPECT_TRUE(tail.covers(12_seq));
    EXPECT_FALSE(tail.covers(11_seq));
}

TEST(ListTail, AListAboveTheBoundIsNotKeptAtAll) {
    ListTail tail(10, 100);
    tail.startAt(5_seq, 105_hash);
    tail.keep(true);
    tail.append(listOf(6, 101));
    EXPECT_TRUE(tail.lists().empty());
    EXPECT_FALSE(tail.covers(5_seq));
    EXPECT_TRUE(tail.covers(6_seq));
}

TEST(ListTail, RemembersTheNewestHashes) {
    ListTail tail(10, 1000);
    tail.startAt(5_seq, 105_hash);
    for (std::uint64_t sequence = 6; sequence < 6 + ListTail::kHashes; ++sequence) tail.append(listOf(sequence));
    EXPECT_EQ(tail.hashAt(5_seq), std::nullopt);
    EXPECT_EQ(tail.hashAt(6_seq), 106_hash);
    EXPECT_EQ(tail.hashAt(tail.last()), StateHash(100 + tail.last().value));
    EXPECT_EQ(tail.hashAt(tail.last().next()), std::nullopt);
}

TEST(Messages, HaveTheNamesOfTheirTypes) {
    EXPECT_EQ(nameOf(message::Heartbeat{}), "Heartbeat");
    EXPECT_EQ(nameOf(message::BlobRequest{}), "BlobRequest");
    EXPECT_EQ(nameOf(message::Request{}), "Request");
    EXPECT_EQ(nameOf(message::Snapshot{}), "Snapshot");
    EXPECT_EQ(nameOf(message::HashQuery{}), "HashQuery");
    EXPECT_EQ(nameOf(message::Over{}), "Over");
}

}  // namespace
}  // namespace tessera
