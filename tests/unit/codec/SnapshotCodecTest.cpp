// A scene as a blob: it comes back as it was, and rubbish is refused.
#include "common/codec/SnapshotCodec.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

Blob snapshotOf(std::size_t listBytes, std::size_t blobs) {
    CommittedList whole{
        .sequence = Sequence(7), .stateHash = StateHash(9), .encoded = share(Bytes(listBytes, std::byte{5}))};
    for (std::size_t i = 0; i < blobs; ++i) whole.blobs.push_back({{i, i + 1}, i + 2});
    return encodeSnapshot(whole);
}

TEST(SnapshotCodec, GivesBackWhatItWasGiven) {
    for (const std::size_t count : {0u, 1u, 1000u}) {
        const Blob content = snapshotOf(100 * count, count);
        const Expected<CommittedListPtr> back = decodeSnapshot(content);
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ((*back)->sequence, Sequence(7));
        EXPECT_EQ((*back)->stateHash, StateHash(9));
        EXPECT_EQ((*back)->encoded.size(), 100 * count);
        EXPECT_EQ((*back)->blobs.size(), count);
    }
}

TEST(SnapshotCodec, RefusesWhatIsDamagedOrCutAndCrashesAtNothing) {
    const Blob good = snapshotOf(50, 3);
    std::size_t refused = 0;
    for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
        std::mt19937_64 random(seed);
        Bytes bytes(good.bytes().begin(), good.bytes().end());
        for (std::size_t harm = 1 + random() % 4; harm > 0; --harm)
            bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        if (seed % 2 == 0) bytes.resize(random() % bytes.size());
        if (seed % 16 == 1) bytes.assign(random() % 64, static_cast<std::byte>(random()));
        refused += decodeSnapshot(Blob(std::move(bytes))) ? 0 : 1;
    }
    EXPECT_GT(refused, 10'000u) << "every one that is cut";
    EXPECT_FALSE(decodeSnapshot(Blob()));
}

}  // namespace
}  // namespace tessera
