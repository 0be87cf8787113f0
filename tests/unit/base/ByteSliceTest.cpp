/// Slices share, chains hash like what they would be in one piece.
#include "common/base/ByteSlice.h"

#include <gtest/gtest.h>

#include "common/base/Hash.h"

namespace tessera {
namespace {

Bytes counted(std::size_t size) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 31 + 7);
    return bytes;
}

TEST(ByteSlice, IsAPartOfABufferThatItKeeps) {
    SharedBytes buffer = share(counted(100));
    const std::byte* const at = buffer->data();
    const std::weak_ptr<const Bytes> alive = buffer;
    ByteSlice part = ByteSlice(std::move(buffer)).slice(ByteSpan(at + 10, 20));
    EXPECT_EQ(part.data(), at + 10) << "nothing is copied";
    EXPECT_EQ(part.size(), 20u);
    EXPECT_FALSE(alive.expired());
    part = {};
    EXPECT_TRUE(alive.expired());
    EXPECT_TRUE(part.empty());
}

TEST(ByteSlice, NoBufferIsNoBytes) {
    EXPECT_TRUE(ByteSlice(nullptr).empty());
    EXPECT_TRUE(ByteSlice(SharedBytes()).empty());
    EXPECT_EQ(ByteSlice(), ByteSlice(share(Bytes())));
}

TEST(ByteSlice, IsEqualToTheSameBytesElsewhere) {
    EXPECT_EQ(ByteSlice(counted(50)), counted(50));
    EXPECT_EQ(ByteSlice(counted(50)), ByteSlice(counted(50)));
    EXPECT_FALSE(ByteSlice(counted(50)) == ByteSlice(counted(49)));
}

TEST(ByteSliceDeathTest, APartOfOtherBytesIsOurOwnBug) {
    const ByteSlice slice(counted(10));
    const Bytes other = counted(10);
    EXPECT_DEATH((void)slice.slice(other), "a part of other bytes");
}

TEST(ByteChain, HashesAsIfItWereInOnePiece) {
    const Bytes whole = counted(10'000);
    for (const std::size_t cut : {0u, 1u, 239u, 240u, 241u, 1024u, 9999u, 10'000u}) {
        ByteChain chain;
        chain.append(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut)));
        chain.append(Bytes(whole.begin() + static_cast<std::ptrdiff_t>(cut), whole.end()));
        EXPECT_EQ(chain.size(), whole.size());
        EXPECT_EQ(chain.joined(), whole);
        for (const std::uint64_t seed : {0ull, 99ull}) EXPECT_EQ(chain.hash64(seed), hash64(whole, seed)) << cut;
    }
    EXPECT_EQ(ByteChain().hash64(5), hash64({}, 5));
}

}  // namespace
}  // namespace tessera
