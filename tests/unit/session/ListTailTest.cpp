#include "common/session/ListTail.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

message::Changes listOf(std::uint64_t sequence, std::size_t bytes = 1) {
    return {.sequence = sequence, .stateHash = 100 + sequence, .list = share(Bytes(bytes))};
}

TEST(ListTail, CoversEverythingBeforeTheFirstFrame) {
    ListTail tail(10, 1000);
    tail.keep(true);
    EXPECT_TRUE(tail.covers(5));
    tail.append(listOf(6));
    EXPECT_TRUE(tail.covers(5));
    EXPECT_FALSE(tail.covers(4));
}

TEST(ListTail, KeepsListsOnlyWhileTheyAreWanted) {
    ListTail tail(10, 1000);
    tail.startAt(5, 105);
    tail.append(listOf(6));
    EXPECT_TRUE(tail.lists().empty());
    EXPECT_FALSE(tail.covers(5));
    tail.keep(true);
    EXPECT_TRUE(tail.covers(6));
    tail.append(listOf(7));
    EXPECT_EQ(tail.lists().size(), 1u);
    tail.keep(false);
    EXPECT_TRUE(tail.lists().empty());
    EXPECT_FALSE(tail.covers(6));
    EXPECT_TRUE(tail.covers(7));
}

TEST(ListTail, ForgetsTheOldestBeyondItsBounds) {
    ListTail few(2, 1000), small(10, 100);
    for (ListTail* tail : {&few, &small}) {
        tail->startAt(5, 105);
        tail->keep(true);
        for (std::uint64_t sequence = 6; sequence < 9; ++sequence) tail->append(listOf(sequence, 40));
        EXPECT_EQ(tail->lists().size(), 2u);
        EXPECT_FALSE(tail->covers(5));
        EXPECT_TRUE(tail->covers(6));
    }
}

TEST(ListTail, AListAboveTheBoundIsNotKeptAtAll) {
    ListTail tail(10, 100);
    tail.startAt(5, 105);
    tail.keep(true);
    tail.append(listOf(6, 101));
    EXPECT_TRUE(tail.lists().empty());
    EXPECT_FALSE(tail.covers(5));
    EXPECT_TRUE(tail.covers(6));
}

TEST(ListTail, RemembersTheNewestHashes) {
    ListTail tail(10, 1000);
    tail.startAt(5, 105);
    for (std::uint64_t sequence = 6; sequence < 6 + ListTail::kHashes; ++sequence) tail.append(listOf(sequence));
    EXPECT_EQ(tail.hashAt(5), std::nullopt);
    EXPECT_EQ(tail.hashAt(6), 106u);
    EXPECT_EQ(tail.hashAt(tail.last()), 100 + tail.last());
    EXPECT_EQ(tail.hashAt(tail.last() + 1), std::nullopt);
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
