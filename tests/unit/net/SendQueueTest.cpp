/// What is handed to a socket is what was handed to the queue: the same bytes at the same places.
#include "common/net/SendQueue.h"

#include <gtest/gtest.h>

#include "Peers.h"

namespace tessera {
namespace {

OutgoingFrame frameOf(SharedChain payload) {
    return {encodeHeader(1, {}, payload ? *payload : ByteChain()), payload};
}

TEST(SendQueue, HandsOutTheVeryBytesOfAPayloadInSeveralPlaces) {
    const SharedBytes list = share(test::pattern(5 << 20));
    ByteChain chain;
    chain.append(test::pattern(30));
    chain.append(list);
    const SharedChain payload = share(std::move(chain));
    SendQueue queue;
    for (int link = 0; link < 2; ++link) queue.push(frameOf(payload));  // as two links would
    const std::vector<ByteSpan> pieces = queue.next();
    ASSERT_EQ(pieces.size(), 6u);
    for (const std::size_t at : {2u, 5u}) {
        EXPECT_EQ(pieces[at].data(), list->data()) << "no copy of the list";
        EXPECT_EQ(pieces[at].size(), list->size());
    }
    EXPECT_EQ(pieces[1].data(), pieces[4].data()) << "one head for all";
}

TEST(SendQueue, KeepsWhatIsBeingWrittenUntilItIsWritten) {
    SharedChain payload = share(ByteChain(test::pattern(1000)));
    const std::weak_ptr<const ByteChain> alive = payload;
    SendQueue queue;
    EXPECT_TRUE(queue.empty());
    queue.push(frameOf(std::move(payload)));
    EXPECT_EQ(queue.next().size(), 2u);
    queue.push(frameOf(nullptr));
    EXPECT_TRUE(queue.writing());
    EXPECT_FALSE(alive.expired());
    EXPECT_EQ(queue.bytes(), 1000 + 2 * FrameHeader::kBytes);
    EXPECT_EQ(queue.written(), 1000 + FrameHeader::kBytes);
    EXPECT_TRUE(alive.expired());
    EXPECT_FALSE(queue.writing());
    EXPECT_EQ(queue.next().size(), 1u) << "a header alone";
    EXPECT_EQ(queue.written(), FrameHeader::kBytes);
    EXPECT_TRUE(queue.empty());
}

TEST(SendQueue, WritesManySmallFramesTogetherButNotAllOfThem) {
    SendQueue queue;
    for (int i = 0; i < 100; ++i) queue.push(frameOf(nullptr));
    std::size_t sum = 0;
    for (int write = 0; write < 4; ++write) {
        EXPECT_LE(queue.next().size(), 32u);
        sum += queue.written();
    }
    EXPECT_EQ(sum, 100 * FrameHeader::kBytes);
}

}  // namespace
}  // namespace tessera
