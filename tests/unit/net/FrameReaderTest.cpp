#include "common/net/FrameReader.h"
#include "tests/support/words/Words.h"

#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <memory>
#include <random>

#include "Peers.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

using test::frameBytes;
using test::pattern;

std::size_t generous(std::uint16_t type) {
    return type < 100 ? std::size_t{256} << 20 : 0;
}

/// Hands bytes to the reader in pieces of at most `piece`.
Expected<void> feed(FrameReader& reader, ByteSpan bytes, std::size_t piece, std::vector<ReceivedFrame>& frames) {
    while (!bytes.empty()) {
        const std::span<std::byte> room = reader.room();
        const std::size_t n = std::min({room.size(), bytes.size(), piece});
        std::memcpy(room.data(), bytes.data(), n);
        bytes = bytes.subspan(n);
        if (auto good = reader.filled(n, frames); !good) return good;
    }
    return {};
}

std::string refusal(ByteSpan bytes) {
    FrameReader reader(generous);
    std::vector<ReceivedFrame> frames;
    const auto good = feed(reader, bytes, 1 << 20, frames);
    return good ? "accepted" : good.error().message;
}

TEST(FrameHeader, SaysTheSameAfterTheWire) {
    const Bytes payload = pattern(1000);
    const auto header = decodeHeader(encodeHeader(7, 0x123456789abcdef0_epoch, ByteSlice(share(payload))));
    ASSERT_TRUE(header);
    EXPECT_EQ(header->type, 7);
    EXPECT_EQ(header->payloadBytes, 1000u);
    EXPECT_EQ(header->epoch, 0x123456789abcdef0_epoch);
    EXPECT_TRUE(checkPayload(*header, payload));
}

/// What any peer of any version reads first.
TEST(FrameHeader, HasTheBytesThatItAlwaysHad) {
    const std::string kept = "5453524101000700e803000000000000f0debc9a78563412ab33cf4166e0d1e4";
    const auto header = encodeHeader(7, 0x123456789abcdef0_epoch, ByteSlice(share(pattern(1000))));
    std::string now;
    for (const std::byte b : header) now += fmt::format("{:02x}", static_cast<unsigned>(b));
    EXPECT_EQ(now, kept);
}

TEST(FrameHeader, EveryFlippedBitIsFound) {
    const Bytes payload = pattern(40);
    const Bytes whole = frameBytes(3, payload, 5_epoch);
    for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
        Bytes damaged = whole;
        damaged[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
        FrameReader reader(generous);
        std::vector<ReceivedFrame> frames;
        const auto good = feed(reader, damaged, damaged.size(), frames);
        // A length that grew leaves the frame unfinished; everything else is refused.
        EXPECT_TRUE(frames.empty()) << "bit " << bit;
        EXPECT_TRUE(!good || reader.midFrame()) << "bit " << bit;
    }
}

TEST(FrameReader, FindsTheFramesHoweverTheBytesAreCut) {
    Bytes stream;
    std::vector<Bytes> sent;
    for (const std::size_t size : {0u, 1u, 31u, 32u, 33u, 16352u, 16384u, 200000u, 5u, 0u, 70000u}) {
        sent.push_back(pattern(size, static_cast<unsigned>(sent.size())));
        const Bytes frame = frameBytes(static_cast<std::uint16_t>(sent.size()), sent.back(), 9_epoch);
        stream.insert(stream.end(), frame.begin(), frame.end());
    }
    for (const std::size_t piece : {1u, 7u, 32u, 33u, 4096u, 1000000u}) {
        FrameReader reader(generous);
        std::vector<ReceivedFrame> frames;
        ASSERT_TRUE(feed(reader, stream, piece, frames));
        ASSERT_EQ(frames.size(), sent.size()) << "pieces of " << piece;
        for (std::size_t i = 0; i < sent.size(); ++i) {
            EXPECT_EQ(frames[i].type, i + 1);
            EXPECT_EQ(frames[i].epoch, 9_epoch);
            EXPECT_EQ(frames[i].payload, sent[i]);
        }
        EXPECT_FALSE(reader.midFrame());
    }
}

TEST(FrameReader, AClaimOfManyMegabytesTakesNoMemoryUntilTheyCome) {
    FrameReader reader(generous);
    std::vector<ReceivedFrame> frames;
    Bytes header = frameBytes(1, {});
    const std::uint32_t claimed = 200u << 20;
    std::memcpy(header.data() + 8, &claimed, 4);
    ASSERT_TRUE(feed(reader, header, header.size(), frames));
    EXPECT_TRUE(reader.midFrame());
    EXPECT_LE(reader.room().size(), 64u * 1024);
    const Bytes some = pattern(1 << 20);
    ASSERT_TRUE(feed(reader, some, 1 << 20, frames));
    EXPECT_LE(reader.room().size(), some.size() + 64 * 1024) << "the buffer is at most twice what has come";
    const Bytes more = pattern(20 << 20);
    ASSERT_TRUE(feed(reader, more, 1 << 20, frames));
    EXPECT_LE(reader.room().size(), 1u << 20) << "and never far ahead of it";
}

TEST(FrameReader, SaysWhatIsWrong) {
    EXPECT_WORDS(refusal(asBytes("GET / HTTP/1.1\r\n")));

    Bytes future = frameBytes(1, {});
    future[4] = std::byte{2};
    EXPECT_WORDS(refusal(future));

    EXPECT_WORDS(refusal(frameBytes(100, {})));

    Bytes endless = frameBytes(1, {});
    std::memset(endless.data() + 8, 0xff, 4);
    EXPECT_WORDS(refusal(endless));

    Bytes damaged = frameBytes(1, pattern(50));
    damaged.back() ^= std::byte{1};
    EXPECT_WORDS(refusal(damaged));
}

TEST(FrameReader, NoBytesCrashIt) {
    std::mt19937 random(4711);
    const Bytes good = frameBytes(5, pattern(300), 2_epoch);
    for (int round = 0; round < 3000; ++round) {
        Bytes bytes = good;
        bytes.insert(bytes.end(), good.begin(), good.end());
        for (unsigned n = random() % 8; n > 0; --n) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        bytes.resize(random() % bytes.size());
        FrameReader reader(generous);
        std::vector<ReceivedFrame> frames;
        (void)feed(reader, bytes, 1 + random() % 400, frames);
        for (const ReceivedFrame& frame : frames) EXPECT_EQ(frame.payload, pattern(300));
    }
}

/// MiB of this process that are in memory.
double residentMiB() {
    std::ifstream file("/proc/self/statm");
    std::size_t all = 0, resident = 0;
    file >> all >> resident;
    return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// Whatever else has been made in between, and lives on.
TEST(FrameReader, LargeMessagesGiveTheirMemoryBack) {
    FrameReader reader(generous);
    const Bytes message = frameBytes(7, pattern(960 << 10));
    std::vector<std::unique_ptr<int>> pins;
    const double before = residentMiB();
    for (int round = 0; round < 2; ++round) {  // (the heap learns from what it frees)
        std::vector<ReceivedFrame> frames;
        for (int i = 0; i < 200; ++i) {
            ASSERT_TRUE(feed(reader, message, 1 << 20, frames));
            pins.push_back(std::make_unique<int>(i));
        }
        EXPECT_GT(residentMiB(), before + 150);
    }
    EXPECT_LT(residentMiB(), before + 80);  // (a sanitizer keeps some of its own)
}

}  // namespace
}  // namespace tessera
