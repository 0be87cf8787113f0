#include "common/codec/MessageCodec.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

SharedBytes some(std::size_t size, int seed = 1) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 31 + static_cast<std::size_t>(seed));
    return share(std::move(bytes));
}

const std::vector<BlobInfo> kBlobs = {{BlobId{1, 2}, 3}, {BlobId{~0ull, 5}, 1ull << 40}};

CommittedListPtr listOf(Sequence sequence, StateHash hash, std::size_t size) {
    return share(CommittedList{sequence, hash, some(size), kBlobs});
}

/// One of each, every field different from its default.
std::vector<Message> everyMessage() {
    using namespace message;
    return {
        Heartbeat{-5, 6, 7'000'000'000},
        Hello{kProtocolVersion, 0xfeed, PeerRole::kApplication, ChannelKind::kBulk, "lower-left", 99, 12, false},
        Synced{17_seq, 0xabcdef_hash},
        Ready{18_frame, 0x1234_hash, some(100)},
        Shown{19_frame, -20},
        BlobsHeld{21},
        BlobRequest{BlobId{22, 23}, 24, 25},
        HashAnswer{26_seq, true, {{27, 28}, {29, ~0ull}}},
        TileImage{30, 31_frame, "front-0-1", some(5000)},
        Request{32, some(33)},
        Welcome{34_epoch, 35, std::chrono::milliseconds(36), std::chrono::milliseconds(37), some(38)},
        Refused{ErrorCode::kLimit, "there is no host \"west\"", true},
        Snapshot{listOf(40_seq, 41_hash, 100'000)},
        Changes{listOf(42_seq, 43_hash, 44)},
        Begin{45_frame, some(49), listOf(46_seq, 47_hash, 48)},
        Swap{FrameNumber(~0ull)},
        BlobNotice{50, kBlobs},
        BlobChunk{BlobId{51, 52}, 53, 54, some(262'144)},
        HashQuery{true, 55},
        ImageRequest{56, 57_frame},
        Reply{58, ErrorCode::kNotFound, "no node \"/hall/crna\"", some(59)},
        Notice{some(60)},
        Over{"the last frame was shown"},
    };
}

bool same(const CommittedList& a, const CommittedList& b) {
    return a.sequence == b.sequence && a.stateHash == b.stateHash && a.encoded == b.encoded && a.blobs == b.blobs;
}
template <typename M>
bool same(const M& a, const M& b) requires requires {
    a == b;
}
{ return a == b; }
bool same(const message::Ready& a, const message::Ready& b) {
    return a.frame == b.frame && a.stateHash == b.stateHash && same(a.stats, b.stats);
}
bool same(const message::TileImage& a, const message::TileImage& b) {
    return a.request == b.request && a.frame == b.frame && a.tile == b.tile && same(a.png, b.png);
}
bool same(const message::Request& a, const message::Request& b) {
    return a.id == b.id && same(a.body, b.body);
}
bool same(const message::Welcome& a, const message::Welcome& b) {
    return a.epoch == b.epoch && a.token == b.token && a.heartbeat == b.heartbeat && a.lostAfter == b.lostAfter &&
           same(a.configuration, b.configuration);
}
bool same(const message::Snapshot& a, const message::Snapshot& b) {
    return same(*a.list, *b.list);
}
bool same(const message::Changes& a, const message::Changes& b) {
    return same(*a.list, *b.list);
}
bool same(const message::Begin& a, const message::Begin& b) {
    return a.frame == b.frame && same(a.payload, b.payload) && same(*a.list, *b.list);
}
bool same(const message::BlobChunk& a, const message::BlobChunk& b) {
    return a.id == b.id && a.offset == b.offset && a.totalBytes == b.totalBytes && same(a.bytes, b.bytes);
}
bool same(const message::Reply& a, const message::Reply& b) {
    return a.id == b.id && a.code == b.code && a.error == b.error && same(a.body, b.body);
}
bool same(const message::Notice& a, const message::Notice& b) {
    return same(a.body, b.body);
}

bool sameMessage(const Message& a, const Message& b) {
    return a.index() == b.index() && std::visit([&]<typename M>(const M& m) { return same(m, std::get<M>(b)); }, a);
}

Expected<Message> there(const Message& m) {
    return decodeMessage(wireType(m), encodeMessage(m).joined());
}

TEST(MessageCodec, EveryMessageArrivesAsItWasSent) {
    const auto all = everyMessage();
    ASSERT_EQ(all.size(), std::variant_size_v<Message>);
    for (std::size_t i = 0; i < all.size(); ++i) {
        ASSERT_EQ(all[i].index(), i) << "one of each, in order";
        const auto back = there(all[i]);
        ASSERT_TRUE(back) << i << ": " << back.error().message;
        EXPECT_TRUE(sameMessage(*back, all[i])) << "message " << i;
    }
}

TEST(MessageCodec, WhatIsMissingArrivesEmptyAndNeverNull) {
    const auto begin = there(message::Begin{.frame = 1_frame});
    ASSERT_TRUE(begin);
    EXPECT_TRUE(std::get<message::Begin>(*begin).payload.empty());
    ASSERT_NE(std::get<message::Begin>(*begin).list, nullptr);
    EXPECT_FALSE(std::get<message::Begin>(*begin).list->changed());
}

TEST(MessageCodec, NumbersOnTheWireAreFixedAndBounded) {
    std::set<std::uint16_t> numbers;
    for (const Message& m : everyMessage()) {
        EXPECT_TRUE(numbers.insert(wireType(m)).second);
        EXPECT_GE(maxPayloadBytes(wireType(m)), encodeMessage(m).size());
    }
    EXPECT_EQ(wireType(message::Heartbeat{}), 1);
    EXPECT_EQ(wireType(message::Hello{}), 2) << "a peer of any version must find the Hello";
    EXPECT_EQ(wireType(message::Over{}), 23);
    EXPECT_EQ(maxPayloadBytes(0), 0u);
    EXPECT_EQ(maxPayloadBytes(9999), 0u);
    EXPECT_EQ(maxPayloadBytesFromPeer(wireType(message::Snapshot{})), 0u) << "only servers send snapshots";
    EXPECT_GT(maxPayloadBytesFromPeer(wireType(message::Ready{})), 0u);
}

TEST(MessageCodec, HeartbeatsAndSwapsStaySmall) {
    EXPECT_LE(encodeMessage(message::Heartbeat{1, 2, 3}).size(), 64u);
    EXPECT_LE(encodeMessage(message::Swap{FrameNumber(~0ull)}).size(), 64u);
}

TEST(MessageCodec, AHelloOfAnotherVersionCanStillBeNamed) {
    message::Hello hello;
    hello.protocol = kProtocolVersion + 41;
    hello.role = static_cast<PeerRole>(77);  // a role we do not know
    const auto back = there(hello);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(std::get<message::Hello>(*back).protocol, kProtocolVersion + 41);
}

TEST(MessageCodec, RefusesWhatIsOutOfRange) {
    const auto why = [](const Message& m) {
        const auto back = there(m);
        return back ? std::string("accepted") : back.error().message;
    };
    message::Hello hello;
    hello.role = static_cast<PeerRole>(2);
    EXPECT_NE(why(hello).find("unknown value 2"), std::string::npos);
    hello.role = PeerRole::kHost;
    hello.name = std::string(1025, 'x');
    EXPECT_NE(why(hello).find("1025 bytes; at most 1024"), std::string::npos);
    hello.name = std::string(1 << 20, 'x');
    EXPECT_NE(why(hello), "accepted");

    MessageLimits tight;
    tight.maxEntries = 1;
    const message::BlobNotice notice{1, kBlobs};
    const auto back = decodeMessage(wireType(notice), encodeMessage(notice).joined(), tight);
    ASSERT_FALSE(back);
    EXPECT_EQ(back.error().code, ErrorCode::kLimit);

    EXPECT_FALSE(decodeMessage(0, some(8)));
    EXPECT_FALSE(decodeMessage(4711, some(8)));
    EXPECT_FALSE(decodeMessage(1, nullptr));
    EXPECT_FALSE(decodeMessage(1, some(1000))) << "longer than any heartbeat";
}

TEST(MessageCodec, LongReasonsAreCutBetweenCharacters) {
    std::string reason(1023, 'a');
    reason += "\xc3\xa9 and more";  // é would be cut in half
    const auto back = there(message::Over{reason});
    ASSERT_TRUE(back);
    EXPECT_EQ(std::get<message::Over>(*back).reason, std::string(1023, 'a'));
}

TEST(MessageCodec, ClaimsWithoutBytesBehindThemAreRefused) {
    const Bytes good = encodeMessage(message::Snapshot{listOf(1_seq, 2_hash, 50)}).joined();
    const auto patched = [&](std::size_t at, std::uint64_t value, std::size_t width) {
        Bytes bytes = good;
        std::memcpy(bytes.data() + at, &value, width);
        return decodeMessage(wireType(message::Snapshot{}), share(std::move(bytes)));
    };
    EXPECT_FALSE(patched(0, 0xffffffffu, 4)) << "head length";
    EXPECT_FALSE(patched(4, 0xffffffffu, 4)) << "number of parts";
    EXPECT_FALSE(patched(8, ~0ull, 8)) << "length of the list";
    EXPECT_FALSE(patched(16, 1ull << 62, 8)) << "length of the blobs";
    EXPECT_FALSE(patched(16, 47, 8)) << "an array that ends in the middle of an entry";
}

TEST(MessageCodec, NoBytesCrashItAndWhatItAcceptsItCanRepeat) {
    std::mt19937 random(20);
    std::size_t accepted = 0;
    for (const Message& m : everyMessage()) {
        const Bytes good = encodeMessage(m).joined();
        for (int round = 0; round < 400; ++round) {
            Bytes bytes = good;
            for (unsigned n = 1 + random() % 4; n > 0; --n)
                bytes[random() % std::min<std::size_t>(bytes.size(), 120)] = static_cast<std::byte>(random());
            if (random() % 3 == 0) bytes.resize(random() % (bytes.size() + 1));
            const auto back = decodeMessage(wireType(m), share(std::move(bytes)));
            if (!back) continue;
            ++accepted;
            if (const auto* hello = std::get_if<message::Hello>(&*back); hello && hello->protocol != kProtocolVersion)
                continue;
            const auto again = there(*back);
            ASSERT_TRUE(again) << again.error().message;
            EXPECT_TRUE(sameMessage(*again, *back));
        }
    }
    EXPECT_GT(accepted, 100u);
}

}  // namespace
}  // namespace tessera
