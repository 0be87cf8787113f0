#include "common/base/HashStreams.h"

#include <gtest/gtest.h>

#include <malloc.h>

#include <algorithm>
#include <array>
#include <random>
#include <thread>

#include "common/base/BlobMaker.h"

namespace tessera {
namespace {

Bytes bytesOf(std::string_view text) {
    return {asBytes(text).begin(), asBytes(text).end()};
}

TEST(Blob, IsNamedByItsContent) {
    const Blob a(bytesOf("hello")), b(bytesOf("hello")), c(bytesOf("world"));
    EXPECT_EQ(a.id(), b.id());
    EXPECT_EQ(a, b);
    EXPECT_FALSE(a == c);
    EXPECT_EQ(a.sizeBytes(), 5u);
    EXPECT_EQ(asText(a.bytes()), "hello");
}

TEST(Blob, HasTheSameNameWhereItsBytesComeInPieces) {
    std::mt19937_64 random(1);
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{5'000}, kBlobLeafBytes - 1,
                                   kBlobLeafBytes, kBlobLeafBytes + 1, 2 * kBlobLeafBytes, 5 * kBlobLeafBytes + 17})
        for (int run = 0; run < 20; ++run) {
            Bytes bytes(size);
            for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
            BlobIdStream id;
            Hash64Stream hash;
            const std::size_t most = 1 + random() % (run % 2 == 0 ? 100'000 : 3 * kBlobLeafBytes);
            for (ByteSpan rest = bytes; !rest.empty();) {
                const ByteSpan piece = rest.first(std::min<std::size_t>(rest.size(), 1 + random() % most));
                id.add(piece);
                hash.add(piece);
                rest = rest.subspan(piece.size());
            }
            ASSERT_EQ(id.id(), blobIdOf(bytes)) << size;
            ASSERT_EQ(hash.hash(), hash64(bytes)) << size;
        }
}

TEST(Blob, TellsEmptyAbsentAndZeroBytesApart) {
    const Blob none;
    EXPECT_TRUE(none.empty());
    EXPECT_FALSE(none.resident());
    const Blob zero{Bytes()};
    EXPECT_FALSE(zero.empty()) << "a blob of no bytes is a blob";
    EXPECT_TRUE(zero.resident());
    const Blob absent = Blob::absent(zero.id(), 7);
    EXPECT_FALSE(absent.empty());
    EXPECT_FALSE(absent.resident());
    EXPECT_EQ(absent.sizeBytes(), 7u);
    EXPECT_TRUE(absent.bytes().empty());
}

TEST(Blob, GivesItsBytesBackAsValues) {
    const std::array<float, 3> values{1.5f, -2, 3};
    const Blob blob = Blob::of(std::span<const float>(values));
    ASSERT_EQ(blob.as<float>().size(), 3u);
    EXPECT_EQ(blob.as<float>()[1], -2);
    EXPECT_EQ(Blob(Bytes(11)).as<float>().size(), 2u) << "the tail is left off";
    EXPECT_EQ(Blob().as<double>().size(), 0u);
}

TEST(Blob, LiesWhereSomebodyElseHasPutIt) {
    auto memory = std::make_shared<const Bytes>(bytesOf("elsewhere"));
    const std::weak_ptr<const Bytes> watched = memory;
    const Blob own(bytesOf("elsewhere"));
    Blob there(memory, ByteSpan(*memory)), moved = own.movedTo(memory, ByteSpan(*memory));
    EXPECT_EQ(there.id(), own.id());
    EXPECT_EQ(moved.id(), own.id());
    EXPECT_EQ(moved.bytes().data(), memory->data()) << "no copy";
    memory.reset();
    const auto changed = there.withRange(4, bytesOf("_"));
    ASSERT_TRUE(changed);
    EXPECT_EQ(changed->id(), Blob(bytesOf("else_here")).id());
    EXPECT_EQ(there.id(), blobIdOf(there.bytes())) << "what lies there stays as it is";
    there = moved = {};
    EXPECT_TRUE(watched.expired()) << "what nobody holds is let go";
}

TEST(BlobStore, FindsWhatSomebodyHolds) {
    BlobStore store;
    const Blob first = store.add(Blob(bytesOf("mesh")));
    const Blob found = store.find(first.id());
    EXPECT_TRUE(found.resident());
    EXPECT_EQ(found.bytes().data(), first.bytes().data()) << "the same bytes, not a copy";
    const Blob again = store.add(Blob(bytesOf("mesh")));
    EXPECT_EQ(again.bytes().data(), first.bytes().data()) << "equal content is kept once";
}

TEST(BlobStore, FindsWhatIsHeldWhicheverHandleOnTheSameContentThatIs) {
    BlobStore store;
    std::vector<Blob> twins;
    for (int i = 0; i < 3; ++i) twins.emplace_back(bytesOf("text"));
    const BlobId id = twins.front().id();
    for (const Blob& twin : twins) store.add(twin);
    std::vector<Blob> others;
    for (int i = 0; i < 5000; ++i) others.push_back(store.add(Blob(bytesOf(std::to_string(i)))));
    for (const std::size_t gone : {0, 2, 1}) {
        EXPECT_TRUE(store.find(id).resident()) << gone;
        twins[gone] = {};
    }
    EXPECT_TRUE(store.find(id).empty());
    EXPECT_TRUE(store.add(Blob(bytesOf("text"))).resident());
}

TEST(BlobStore, KeepsNothingAliveItself) {
    BlobStore store;
    BlobId id;
    {
        const Blob blob = store.add(Blob(bytesOf("short-lived")));
        id = blob.id();
    }
    EXPECT_TRUE(store.find(id).empty());
    EXPECT_TRUE(store.find(BlobId{1, 2}).empty());
}

TEST(BlobStore, LeavesAbsentBlobsAlone) {
    BlobStore store;
    const Blob resident(bytesOf("x"));
    const Blob absent = store.add(Blob::absent(resident.id(), 1));
    EXPECT_FALSE(absent.resident());
    EXPECT_TRUE(store.find(resident.id()).empty());
}

TEST(BlobStore, ForgetsWhatIsGoneWithoutLosingWhatIsHeld) {
    BlobStore store;
    std::vector<Blob> held;
    for (int i = 0; i < 5000; ++i) {
        Blob blob = store.add(Blob(bytesOf(std::to_string(i))));
        if (i % 10 == 0) held.push_back(blob);
    }
    for (const Blob& blob : held) EXPECT_TRUE(store.find(blob.id()).resident());
}

TEST(BlobStore, IsUsedByManyThreads) {
    BlobStore store;
    std::array<std::vector<Blob>, 4> results;
    {
        std::vector<std::jthread> threads;
        for (std::vector<Blob>& mine : results) {
            threads.emplace_back([&store, &mine] {
                for (int i = 0; i < 500; ++i) mine.push_back(store.add(Blob(bytesOf(std::to_string(i)))));
            });
        }
    }
    for (std::size_t i = 0; i < 500; ++i) {
        for (const std::vector<Blob>& one : results) EXPECT_EQ(one[i].bytes().data(), results[0][i].bytes().data());
    }
}

TEST(Blob, ARangeMakesWhatAllTheBytesWouldMake) {
    std::mt19937_64 random(5);
    for (const std::size_t size :
         {std::size_t{1}, std::size_t{100}, kBlobLeafBytes - 1, kBlobLeafBytes, kBlobLeafBytes + 1, 3 * kBlobLeafBytes,
          5 * kBlobLeafBytes + 17, Blob::kPagedBytes - 1, Blob::kPagedBytes, Blob::kPagedBytes + 4097}) {
        Bytes bytes(size);
        for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
        Blob blob{Bytes(bytes)};
        if (size > Blob::kPagedBytes) blob = blob.paged();
        for (int i = 0; i < 20; ++i) {
            const std::size_t offset = random() % size;
            Bytes part(1 + random() % (size - offset));
            for (std::byte& byte : part) byte = static_cast<std::byte>(random());
            std::copy(part.begin(), part.end(), bytes.begin() + static_cast<std::ptrdiff_t>(offset));
            const Expected<Blob> next = blob.withRange(offset, part);
            ASSERT_TRUE(next) << next.error().message;
            EXPECT_EQ(next->id(), Blob(Bytes(bytes)).id()) << size << " " << offset << " " << part.size();
            EXPECT_TRUE(std::ranges::equal(next->bytes(), bytes));
            EXPECT_EQ(blobIdOf(next->bytes()), next->id());
            blob = *next;
        }
    }
}

TEST(Blob, LiesInPagesWhereItIsLarge) {
    const Bytes bytes(Blob::kPagedBytes + 3, std::byte{7});
    const Blob plain{Bytes(bytes)}, paged = plain.paged();
    EXPECT_EQ(paged.id(), plain.id());
    EXPECT_NE(paged.bytes().data(), plain.bytes().data());
    EXPECT_EQ(paged.paged().bytes().data(), paged.bytes().data()) << "it lies there already";
    EXPECT_TRUE(std::ranges::equal(paged.bytes(), bytes));
    const Blob small(Bytes(Blob::kPagedBytes - 1));
    EXPECT_EQ(small.paged().bytes().data(), small.bytes().data()) << "too small to be worth it";
    EXPECT_TRUE(Blob().paged().empty());
    EXPECT_FALSE(Blob::absent(plain.id(), bytes.size()).paged().resident());
    ByteSlice slice;
    {
        const Blob edited = *paged.withRange(5, bytesOf("abc"));
        slice = edited.slice().slice(edited.bytes().subspan(4, 5));
    }
    EXPECT_EQ(asText(slice),
              "\a"
              "abc"
              "\a")
        << "a slice keeps its array";
}

/// Beside its pages (PagedBytes.AnEditTakesThePagesThatItLiesIn): 8 KiB at most.
TEST(Blob, AnEditOfAHundredMiBTakesNoMoreThan56KiBOfHeap) {
    std::vector<Blob> all{Blob(Bytes(std::size_t{100} << 20)).paged()};
    all.reserve(200);
    const Bytes thousand(1'000, std::byte{7});
    const std::size_t before = ::mallinfo2().uordblks;
    for (std::size_t step = 1; step <= 100; ++step)
        all.push_back(*all.back().withRange(step * 1'000'003 % (all[0].sizeBytes() - 1'000), thousand));
    EXPECT_LE(::mallinfo2().uordblks - before, 100 * (std::size_t{56} << 10));
}

/// A place that has no more room after so many bytes, or cannot be had in one piece at the end.
class PoorPlace : public BlobPlace {
public:
    PoorPlace(std::size_t size, std::size_t room) : bytes_(size), room_(room) {}
    bool write(std::size_t offset, ByteSpan bytes) override {
        if (offset + bytes.size() > room_) return false;
        std::ranges::copy(bytes, bytes_.begin() + static_cast<std::ptrdiff_t>(offset));
        return true;
    }
    void read(std::size_t offset, std::span<std::byte> to) const override {
        std::ranges::copy(ByteSpan(bytes_).subspan(offset, to.size()), to.begin());
    }
    std::shared_ptr<const PagedBytes> finish() override { return nullptr; }

private:
    Bytes bytes_;
    std::size_t room_;
};

TEST(BlobMaker, MakesWhatTheBytesWouldMakeHoweverTheyCome) {
    std::mt19937_64 random(7);
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, kBlobLeafBytes, kBlobLeafBytes + 1,
                                   Blob::kPagedBytes - 1, Blob::kPagedBytes, Blob::kPagedBytes + 70'001})
        for (const int way : {0, 1, 2, 3, 4, 5}) {
            Bytes bytes(size);
            for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
            std::vector<std::pair<std::size_t, std::size_t>> pieces;
            for (std::size_t at = 0; at < size;) {
                const std::size_t most = way % 2 == 0 ? 1 + random() % 300'000 : 4 * kBlobLeafBytes;
                pieces.emplace_back(at, std::min(most, size - at));
                at += pieces.back().second;
            }
            // In their order, in another one, and some of them first with other bytes.
            if (way >= 2) std::ranges::shuffle(pieces, random);
            const std::size_t room = way == 4 ? size / 2 : size;
            BlobMaker maker(size, way >= 4 ? std::make_unique<PoorPlace>(size, room) : nullptr);
            // Wrong bytes in pieces of other places and sizes: leaves that are known are overwritten in part.
            const Bytes wrong(size, std::byte{0x5a});
            if (way >= 2 && size > 0)
                for (int i = 0; i < 8; ++i) {
                    const std::size_t at = random() % size,
                                      count = std::min<std::size_t>(1 + random() % 400'000, size - at);
                    if (way >= 4 || i % 2) maker.write(at, ByteSpan(bytes).subspan(at, count));
                    maker.write(at, ByteSpan(wrong).subspan(at, count));
                }
            for (const auto& [at, count] : pieces) maker.write(at, ByteSpan(bytes).subspan(at, count));
            const Blob made = maker.finish();
            EXPECT_EQ(made.id(), Blob(Bytes(bytes)).id()) << size << ", way " << way;
            EXPECT_TRUE(std::ranges::equal(made.bytes(), bytes)) << size << ", way " << way;
            EXPECT_FALSE(made.empty()) << "a blob of no bytes is a blob";
            if (size > 0) {
                Bytes one(1, std::byte{9});
                Bytes changed = bytes;
                changed[size / 2] = one[0];
                EXPECT_EQ(made.withRange(size / 2, one)->id(), Blob(std::move(changed)).id())
                    << size << ", way " << way;
            }
        }
}

TEST(Blob, RemembersWhichRangesLedToIt) {
    std::mt19937_64 random(6);
    std::vector<Blob> history = {Blob(Bytes(3 * kBlobLeafBytes))};
    EXPECT_TRUE(history[0].origins().empty());
    for (int i = 0; i < 12; ++i) {
        Bytes part(1 + random() % 500);
        for (std::byte& byte : part) byte = static_cast<std::byte>(random());
        history.push_back(*history.back().withRange(random() % (3 * kBlobLeafBytes - 500), part));
        const std::span<const Blob::Origin> origins = history.back().origins();
        ASSERT_EQ(origins.size(), std::min<std::size_t>(history.size() - 1, Blob::kOrigins));
        for (std::size_t back = 0; back < origins.size(); ++back) {
            const Blob& earlier = history[history.size() - 2 - back];
            ASSERT_EQ(origins[back].id, earlier.id());
            for (std::size_t at = 0; at < earlier.sizeBytes(); ++at)
                if (at < origins[back].begin || at >= origins[back].end) {
                    ASSERT_EQ(earlier.bytes()[at], history.back().bytes()[at]);
                }
        }
    }
}

TEST(Blob, ARangeOutsideIsRefused) {
    const Blob blob{Bytes(10)};
    const Bytes four(4);
    EXPECT_TRUE(blob.withRange(6, four));
    EXPECT_FALSE(blob.withRange(7, four));
    EXPECT_FALSE(blob.withRange(~std::uint64_t{0}, four));
    EXPECT_FALSE(blob.withRange(0, {}));
    EXPECT_FALSE(Blob::absent(blob.id(), 10).withRange(0, four));
    EXPECT_FALSE(Blob().withRange(0, four));
}

TEST(Blob, TheNameOfLeavesIsNotTheNameOfTheirHashes) {
    Bytes bytes(2 * kBlobLeafBytes);
    const Blob large{Bytes(bytes)};
    const Hash128 leaf = hash128(ByteSpan(bytes).first(kBlobLeafBytes));
    const std::array<Hash128, 2> leaves{leaf, leaf};
    EXPECT_NE(Blob::of(std::span<const Hash128>(leaves)).id(), large.id());
}

}  // namespace
}  // namespace tessera
