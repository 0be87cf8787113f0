// Which chunks of which blobs a client asks for, and what it makes of them.
#include "tests/unit/session/ClientFixture.h"

namespace tessera {
namespace {

TEST(BlobFetcher, TakesChunksInAnyOrderAndResumesAtTheFirstGap) {
    BlobFetcher fetcher({.chunkBytes = 10, .chunksInFlight = 4});
    const Blob blob(content(45, 1));
    ASSERT_TRUE(fetcher.want({infoOf(blob)}));
    const auto chunk = [&](const message::BlobRequest& request) {
        const ByteSpan part = blob.bytes().subspan(request.offset, request.length);
        return fetcher.chunk({blob.id(), request.offset, 45, share(Bytes(part.begin(), part.end()))});
    };
    const auto first = fetcher.requests();
    ASSERT_EQ(first.size(), 4u);
    ASSERT_TRUE(chunk(first[2]));
    ASSERT_TRUE(chunk(first[0]));
    fetcher.interrupted();
    std::optional<Blob> whole;
    for (auto requests = fetcher.requests(); !requests.empty(); requests = fetcher.requests()) {
        EXPECT_GE(requests.front().offset, 10u);
        for (const auto& request : requests) {
            auto result = chunk(request);
            ASSERT_TRUE(result);
            if (*result) whole = **result;
        }
    }
    ASSERT_TRUE(whole);
    EXPECT_EQ(whole->id(), blob.id());
}

TEST(BlobFetcher, AnEmptyBlobNeedsNoFetch) {
    BlobFetcher fetcher({});
    const Blob empty{Bytes{}};
    const Expected<std::vector<Blob>> complete = fetcher.want({infoOf(empty)});
    ASSERT_TRUE(complete);
    EXPECT_EQ(*complete, std::vector{empty});  // to be stored like any other
    EXPECT_TRUE(fetcher.holds(empty.id()));
    EXPECT_TRUE(fetcher.requests().empty());
    EXPECT_FALSE(fetcher.want({{blobOf("x").id, 0}}));
}

TEST(BlobFetcher, AsksForNothingThatIsFoundElsewhere) {
    const Blob early(content(45, 1)), late(content(45, 2)), never(content(45, 3));
    std::vector<Blob> there = {early};
    BlobFetcher fetcher({.chunkBytes = 100, .chunksInFlight = 1, .elsewhere = [&](const BlobInfo& wanted) {
                             for (const Blob& blob : there)
                                 if (blob.id() == wanted.id) return blob;
                             return Blob();
                         }});
    EXPECT_EQ(*fetcher.want({infoOf(never), infoOf(early), infoOf(late)}), std::vector{early});
    const auto first = fetcher.requests();
    ASSERT_EQ(first.size(), 1u);
    EXPECT_EQ(first[0].id, never.id());
    EXPECT_TRUE(fetcher.takeFound().empty());
    there.push_back(late);  // somebody has it before its turn comes
    ASSERT_TRUE(fetcher.chunk({never.id(), 0, 45, never.slice()}));
    EXPECT_TRUE(fetcher.requests().empty());
    EXPECT_EQ(fetcher.takeFound(), std::vector{late});
    EXPECT_TRUE(fetcher.holds(late.id()) && fetcher.holds(early.id()));
}

/// To prove that it is the blob takes as long as to hash it, on the thread that says what is shown.
TEST(BlobFetcher, OnceTheSceneIsKnownLargeOnesAreFetchedAtOnce) {
    const Blob small(content(45, 1)), large(content(46, 2)), first(content(46, 3));
    std::vector<BlobId> asked;
    BlobFetcher fetcher({.chunkBytes = 100,
                         .elsewhere =
                             [&](const BlobInfo& wanted) {
                                 asked.push_back(wanted.id);
                                 return Blob();
                             },
                         .maxLateElsewhereBytes = 45});
    ASSERT_TRUE(fetcher.want({infoOf(first)}));
    fetcher.sceneIsKnown();
    ASSERT_TRUE(fetcher.want({infoOf(small), infoOf(large)}));
    EXPECT_EQ(fetcher.requests().size(), 3u);
    EXPECT_EQ(asked, (std::vector{first.id(), small.id(), first.id(), small.id()}));
}

TEST(BlobFetcher, ThoseWhoFindEachOthersBlobsBeginAtDifferentPlaces) {
    std::vector<BlobInfo> wanted;
    for (int i = 0; i < 8; ++i) wanted.push_back(infoOf(Blob(content(45, static_cast<unsigned>(i)))));
    for (const double share : {0.0, 0.25, 0.5, 0.99, 1.0, -3.0, 7.0}) {
        BlobFetcher fetcher(
            {.chunksInFlight = 100, .elsewhere = [](const BlobInfo&) { return Blob(); }, .firstShare = share});
        ASSERT_TRUE(fetcher.want(wanted));
        const auto asked = fetcher.requests();
        ASSERT_EQ(asked.size(), wanted.size()) << share;
        const std::size_t first = share == 0.25 ? 2 : share == 0.5 ? 4 : share == 0.99 ? 7 : 0;
        for (std::size_t i = 0; i < asked.size(); ++i) EXPECT_EQ(asked[i].id, wanted[(first + i) % 8].id) << share;
    }
}

TEST(BlobFetcher, FetchesAgainWhatWasLetGo) {
    BlobFetcher fetcher({});
    const Blob blob(content(45, 1));
    fetcher.hold(blob.id());
    ASSERT_TRUE(fetcher.want({infoOf(blob)}));
    EXPECT_TRUE(fetcher.requests().empty());
    fetcher.drop(blob.id());
    ASSERT_TRUE(fetcher.want({infoOf(blob)}));
    EXPECT_EQ(fetcher.requests().size(), 1u);
}

}  // namespace
}  // namespace tessera
