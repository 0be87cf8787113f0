/// The way of a list, from the commit to whoever applies it: encoded once, never copied on the sending side, received
/// where it stays. Bytes are counted by where they lie.
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "common/codec/ChangeCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/cores/Transform.h"
#include "common/net/FrameReader.h"
#include "common/net/SendQueue.h"
#include "common/scene/FieldTable.h"
#include "common/session/ClientSession.h"
#include "common/session/ServerSession.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMoved = 100'000;

ChangeList moves() {
    ChangeListBuilder builder;
    for (std::uint64_t i = 0; i < kMoved; ++i)
        builder.set(ObjectId(2 + i), typeOf<Transform>(), fieldId<&Transform::translation>,
                    toValue(Vec3d(double(i), 1, 2)));
    return builder.take();
}

bool within(const std::byte* at, ByteSpan whole) {
    return at >= whole.data() && at < whole.data() + whole.size();
}

/// A wall of four hosts that are all in the barrier, and an application that follows: what is sent when a frame begins.
std::vector<server_action::Send> sentFor(const CommittedListPtr& list) {
    const TimePoint now(10s);
    ServerSessionConfig config;
    config.hosts = {"a", "b", "c", "d"};
    ServerSession session(config);
    std::uint64_t connections = 0;
    for (const std::string name : {"a", "b", "c", "d", "viewer"}) {
        const bool host = name != "viewer";
        const ConnectionId connection(++connections);
        (void)session.connectionOpened(connection, now);
        (void)session.received(
            connection, {}, message::Hello{.role = host ? PeerRole::kHost : PeerRole::kApplication, .name = name}, now);
        (void)session.snapshotReady(connection, {share(CommittedList{0_seq, 5_hash, {}, {}})}, now);
        if (host) (void)session.received(connection, session.epoch(), message::Synced{0_seq, 5_hash}, now);
    }
    (void)session.beginFrame({.frame = 0_frame, .list = share(CommittedList{0_seq, 5_hash, {}, {}})}, now);
    for (std::uint64_t c = 1; c <= 4; ++c)
        (void)session.received(ConnectionId(c), session.epoch(), message::Ready{0_frame, 5_hash, nullptr}, now);
    std::vector<server_action::Send> sent;
    for (ServerAction& action :
         session.beginFrame({.frame = 1_frame, .payload = Bytes(200, std::byte{1}), .list = list}, now))
        if (auto* send = std::get_if<server_action::Send>(&action)) sent.push_back(std::move(*send));
    return sent;
}

class ListWay : public testing::Test {
protected:
    const ChangeList list_ = moves();
    const CommittedListPtr committed_ =
        share(CommittedList{1_seq, 6_hash, encodeChangeList(list_), {{BlobId{1, 2}, 3}, {BlobId{4, 5}, 6}}});
};

TEST_F(ListWay, FromTheCommitToTheSocketsNothingOfItIsCopied) {
    const std::vector<server_action::Send> sent = sentFor(committed_);
    ASSERT_EQ(sent.size(), 5u) << "four hosts and who follows";
    std::set<const Message*> messages;
    std::size_t made = 0, handedOut = 0;
    SendQueue sockets;
    SharedChain encoded;
    const Message* last = nullptr;
    for (const server_action::Send& send : sent) {
        const auto* begin = std::get_if<message::Begin>(send.message.get());
        const auto* changes = std::get_if<message::Changes>(send.message.get());
        ASSERT_TRUE(begin || changes);
        EXPECT_EQ(begin ? begin->list : changes->list, committed_) << "the envelope of the commit, not one like it";
        messages.insert(send.message.get());
        if (send.message.get() != last) encoded = share(encodeMessage(*send.message));  // as Peers does
        last = send.message.get();
        sockets.push({encodeHeader(wireType(*send.message), {}, *encoded), encoded});
    }
    EXPECT_EQ(messages.size(), 2u) << "one Begin for all hosts, one Changes";
    std::set<const std::byte*> seen;
    for (const ByteSpan piece : sockets.next()) {
        handedOut += piece.size();
        const bool ofTheCommit = within(piece.data(), committed_->encoded) ||
                                 within(piece.data(), std::as_bytes(std::span(committed_->blobs)));
        if (!ofTheCommit && seen.insert(piece.data()).second) made += piece.size();
    }
    EXPECT_GT(handedOut, 5 * committed_->encoded.size());
    EXPECT_LT(made, 1024u) << "headers, heads and the view: not a byte of list or blobs";
}

TEST_F(ListWay, WhatIsReceivedStaysWhereItCame) {
    const Message begin = message::Begin{.frame = 1_frame, .payload = Bytes(200, std::byte{1}), .list = committed_};
    const ByteChain sent = encodeMessage(begin);
    Bytes wire;
    const auto header = encodeHeader(wireType(begin), 3_epoch, sent);
    wire.insert(wire.end(), header.begin(), header.end());
    for (const ByteSlice& slice : sent.slices()) wire.insert(wire.end(), slice.begin(), slice.end());

    FrameReader reader(maxPayloadBytes);
    std::vector<ReceivedFrame> frames;
    std::vector<ByteSpan> places;  // of what came, as it came
    for (ByteSpan rest = wire; !rest.empty();) {
        const std::span<std::byte> room = reader.room();
        const std::size_t n = std::min(room.size(), rest.size());
        std::memcpy(room.data(), rest.data(), n);
        places.emplace_back(room.data(), n);
        rest = rest.subspan(n);
        ASSERT_TRUE(reader.filled(n, frames));
    }
    ASSERT_EQ(frames.size(), 1u);
    const ByteSlice& payload = frames[0].payload;
    std::size_t inPlace = 0;
    for (const ByteSpan place : places) inPlace += within(place.data(), payload) ? place.size() : 0;
    // The first read, and the first MiB where the C library could not move its pages; it never claims room before.
    EXPECT_LE(payload.size() - inPlace, (1u << 20) + (16u << 10));
    EXPECT_GT(inPlace, payload.size() / 2);

    const Expected<Message> heard = decodeMessage(frames[0].type, payload);
    ASSERT_TRUE(heard) << heard.error().message;
    const auto& message = std::get<message::Begin>(*heard);
    EXPECT_EQ(message.list->encoded, committed_->encoded);
    EXPECT_TRUE(within(message.list->encoded.data(), payload)) << "a part of what was received";
    EXPECT_TRUE(within(message.payload.data(), payload));

    ClientSession session({.name = "a"});
    (void)session.channelOpened(ChannelKind::kControl, TimePoint(1s));
    (void)session.received(ChannelKind::kControl, {}, message::Welcome{}, TimePoint(1s));
    for (const BlobInfo& blob : committed_->blobs) session.holdBlob(blob.id);
    const ClientActions actions = session.received(ChannelKind::kControl, {}, *heard, TimePoint(1s));
    ASSERT_EQ(actions.size(), 1u);
    const auto& draw = std::get<client_action::Draw>(actions[0]);
    EXPECT_EQ(draw.begin.list, message.list) << "the envelope that was received, not one like it";
    const Expected<ChangeList> decoded = decodeChangeList(draw.begin.list->encoded, BlobStore());
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(*decoded, list_);
}

/// A hostile claim costs what it brings: addresses for a large message are not taken before its first MiB is there.
TEST_F(ListWay, AClaimAloneBringsNoRoom) {
    FrameReader reader(maxPayloadBytes);
    std::vector<ReceivedFrame> frames;
    const Message snapshot = message::Snapshot{committed_};
    auto header = encodeHeader(wireType(snapshot), {}, ByteChain());
    const std::uint32_t claimed = 200u << 20;
    std::memcpy(header.data() + 8, &claimed, sizeof claimed);
    std::memcpy(reader.room().data(), header.data(), header.size());
    ASSERT_TRUE(reader.filled(header.size(), frames));
    std::size_t arrived = 0;
    while (arrived < (1u << 20)) {
        const std::size_t room = reader.room().size();
        ASSERT_LE(room, std::max<std::size_t>(arrived, 64u << 10)) << "after " << arrived;
        ASSERT_TRUE(reader.filled(room, frames));
        arrived += room;
    }
}

}  // namespace
}  // namespace tessera
