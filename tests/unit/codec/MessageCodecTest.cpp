#include "common/codec/MessageCodec.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>

#include "tests/unit/AnyMessage.h"
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

/// Numbers small and large, texts and bytes with and without something in them.
struct RandomSource {
    std::mt19937_64 random{7};

    std::uint64_t number() {
        switch (random() % 4) {
            case 0:
                return 0;
            case 1:
                return ~0ull;
            default:
                return random() >> (random() % 64);
        }
    }
    std::uint64_t word(std::uint64_t last) { return random() % (last + 1); }
    std::size_t count() { return random() % 4; }
    std::string text() { return std::string(random() % 20, static_cast<char>(random())); }
    ByteSlice bytes() { return some(random() % 300, static_cast<int>(random() % 256)); }
};

Expected<Message> there(const Message& m) {
    return decodeMessage(wireType(m), encodeMessage(m).joined());
}

TEST(MessageCodec, EveryMessageArrivesAsItWasSent) {
    for (const Message& sent : test::sampleMessages()) {
        const auto back = there(sent);
        ASSERT_TRUE(back) << nameOf(sent) << ": " << back.error().message;
        EXPECT_TRUE(*back == sent) << nameOf(sent);
    }
    RandomSource source;
    test::MessageMaker maker(source);
    for (int round = 0; round < 2000; ++round) {
        Message sent = maker.make(source.random() % std::variant_size_v<Message>);
        if (auto* hello = std::get_if<message::Hello>(&sent)) hello->protocol = kProtocolVersion;
        const auto back = there(sent);
        ASSERT_TRUE(back) << nameOf(sent) << ": " << back.error().message;
        EXPECT_TRUE(*back == sent) << nameOf(sent);
    }
}

TEST(MessageCodec, EqualMessagesAreEqualInEveryField) {
    message::TileImage a{1, 2_frame, "left", false, some(5)};
    message::TileImage b{1, 2_frame, "left", false, some(5)};
    EXPECT_TRUE(a == b) << "bytes are compared, not where they lie";
    b.picture = some(5, 2);
    EXPECT_FALSE(a == b);
    const message::Changes c{listOf(3_seq, 4_hash, 20)};
    EXPECT_TRUE(c == message::Changes{listOf(3_seq, 4_hash, 20)});
    EXPECT_FALSE(c == message::Changes{listOf(3_seq, 5_hash, 20)});
}

TEST(MessageCodec, WhatIsUnknownInAHeadIsPassedOver) {
    Bytes bytes = encodeMessage(message::Swap{7_frame}).joined();
    // Field 9 as a number, 10 as 8 bytes, 11 as a text, 12 as 4 bytes, 1000 as a number.
    for (const int byte : {0x48, 5, 0x51, 1, 2, 3, 4, 5, 6, 7, 8, 0x5a, 2, 0x6e, 0x6f, 0x65, 1, 2, 3, 4, 0xc0, 0x3e, 1})
        bytes.push_back(static_cast<std::byte>(byte));
    bytes[0] = static_cast<std::byte>(bytes.size() - 8);
    const auto back = decodeMessage(wireType(message::Swap{}), share(Bytes(bytes)));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(std::get<message::Swap>(*back).frame, 7_frame);
}

TEST(MessageCodec, ANumberThatDoesNotFitItsFieldIsRefused) {
    message::BlobRequest request{{1, 2}, 3, 4};
    Bytes bytes = encodeMessage(request).joined();
    ASSERT_EQ(bytes.back(), std::byte{4});
    for (const int byte : {0x84, 0x80, 0x80, 0x80, 0x10}) bytes.push_back(static_cast<std::byte>(byte));  // 2^32 + 4
    bytes.erase(bytes.end() - 6);
    bytes[0] = static_cast<std::byte>(bytes.size() - 8);
    const auto back = decodeMessage(wireType(request), share(Bytes(bytes)));
    ASSERT_FALSE(back);
    EXPECT_WORDS(back.error().message);
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
    for (const Message& m : test::sampleMessages()) {
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
    EXPECT_WORDS(why(hello));
    hello.role = PeerRole::kHost;
    hello.name = std::string(1025, 'x');
    EXPECT_WORDS(why(hello));
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
    for (const Message& m : test::sampleMessages()) {
        const Bytes good = encodeMessage(m).joined();
        for (int round = 0; round < 400; ++round) {
            Bytes bytes = good;
            for (unsigned n = 1 + random() % 4; n > 0; --n)
                bytes[random() % std::min<std::size_t>(bytes.size(), 120)] = static_cast<std::byte>(random());
            if (random() % 3 == 0) bytes.resize(random() % (bytes.size() + 1));
            const auto back = decodeMessage(wireType(m), share(std::move(bytes)));
            if (!back) continue;
            ++accepted;
            if (const auto* hello = std::get_if<message::Hello>(&*back);
                hello && (hello->protocol < kOldestAskersProtocol || hello->protocol > kProtocolVersion))
                continue;
            const auto again = there(*back);
            ASSERT_TRUE(again) << again.error().message;
            EXPECT_TRUE(*again == *back);
        }
    }
    EXPECT_GT(accepted, 100u);
}

}  // namespace
}  // namespace tessera
