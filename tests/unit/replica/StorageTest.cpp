/// Where blobs lie: the shelf in memory, the cache on disk. And the option that injects faults.
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "client/replica/BlobShelf.h"
#include "client/replica/DiskCache.h"
#include "client/replica/Injection.h"
#include "common/image/Picture.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

Blob blobOf(int seed, std::size_t bytes) {
    return Blob(Bytes(bytes, static_cast<std::byte>(seed)));
}

std::set<BlobId> loadedFrom(const std::string& folder, const std::string& host, std::uint64_t maxBytes = 1'000'000) {
    Log log("test");
    DiskCache cache(folder, host, maxBytes, log);
    std::set<BlobId> ids;
    cache.load([&](const Blob& blob) { ids.insert(blob.id()); });
    return ids;
}

TEST(BlobShelf, KeepsWhatOthersHoldAndLetsGoOfTheOldestRest) {
    BlobStore store;
    BlobShelf shelf(store, 250);
    const Blob inUse = store.add(blobOf(1, 100));
    shelf.put(inUse);
    for (int i = 2; i <= 4; ++i) shelf.put(blobOf(i, 100));
    shelf.put(blobOf(4, 100));  // a second time
    EXPECT_EQ(shelf.heldBytes(), 400u);

    std::vector<BlobId> dropped;
    shelf.trim([&](const BlobId& id) { dropped.push_back(id); });
    EXPECT_EQ(dropped, (std::vector<BlobId>{blobOf(2, 100).id(), blobOf(3, 100).id()}));
    EXPECT_EQ(shelf.heldBytes(), 200u);
    EXPECT_FALSE(store.find(inUse.id()).empty());
    EXPECT_TRUE(store.find(blobOf(2, 100).id()).empty());
    EXPECT_FALSE(store.find(blobOf(4, 100).id()).empty());
}

TEST(BlobShelf, LooksAtAFewInTurnHoweverManyAreInUse) {
    BlobStore store;
    BlobShelf shelf(store, 100);
    std::vector<Blob> inUse;
    for (int i = 0; i < 1000; ++i) {
        inUse.push_back(store.add(Blob(Bytes(10 + i))));
        shelf.put(inUse.back());
    }
    shelf.put(blobOf(1, 2000));
    std::vector<BlobId> dropped;
    int trims = 0;
    for (; dropped.empty() && trims < 100; ++trims) shelf.trim([&](const BlobId& id) { dropped.push_back(id); });
    EXPECT_EQ(dropped, std::vector<BlobId>{blobOf(1, 2000).id()});
    EXPECT_GT(trims, 5) << "all were looked at at once";
    EXPECT_LT(trims, 30);
}

TEST(BlobShelf, NamesWhatItHoldsForTheNextConnection) {
    BlobStore store;
    BlobShelf shelf(store, 1000);
    shelf.put(blobOf(1, 10));
    shelf.put(Blob::absent(blobOf(2, 10).id(), 10));
    std::vector<BlobId> held;
    shelf.forEach([&](const Blob& blob) { held.push_back(blob.id()); });
    EXPECT_EQ(held, std::vector<BlobId>{blobOf(1, 10).id()});
}

TEST(DiskCache, BringsBlobsBackAfterARestart) {
    const test::TestFolder folder;
    {
        Log log("test");
        DiskCache cache(folder.path(), "left", 1'000'000, log);
        cache.store(blobOf(1, 1000));
        cache.store(blobOf(2, 0));
        cache.store(blobOf(3, 70'000));
    }
    EXPECT_EQ(loadedFrom(folder.path(), "left"),
              (std::set<BlobId>{blobOf(1, 1000).id(), blobOf(2, 0).id(), blobOf(3, 70'000).id()}));
    EXPECT_TRUE(loadedFrom(folder.path(), "right").empty()) << "hosts of one machine do not meet";
}

TEST(DiskCache, DeletesWhatDoesNotHaveTheHashOfItsName) {
    const test::TestFolder folder;
    const Blob good = blobOf(1, 500), bad = blobOf(2, 500);
    {
        Log log("test");
        DiskCache cache(folder.path(), "left", 1'000'000, log);
        cache.store(good);
        cache.store(bad);
    }
    const std::string damaged = folder / ("left/" + toHex(bad.id()) + ".blob");
    {
        std::fstream file(damaged, std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(123);
        file.put('x');
    }
    EXPECT_EQ(loadedFrom(folder.path(), "left"), std::set<BlobId>{good.id()});
    EXPECT_FALSE(std::filesystem::exists(damaged));
}

TEST(DiskCache, StaysWithinItsBudget) {
    const test::TestFolder folder;
    {
        Log log("test");
        DiskCache cache(folder.path(), "left", 10'000, log);
        for (int i = 0; i < 40; ++i) cache.store(blobOf(i, 1000));
        cache.store(blobOf(99, 20'000));
    }
    std::uintmax_t bytes = 0;
    for (const auto& file : std::filesystem::directory_iterator(folder / "left")) bytes += file.file_size();
    EXPECT_LE(bytes, 12'000u);
    EXPECT_GE(bytes, 8'000u);
}

TEST(DiskCache, GoesOnWithoutADisk) {
    const test::TestFolder folder;
    ASSERT_TRUE(writeFile(folder / "file", asBytes("x")));
    EXPECT_TRUE(loadedFrom(folder / "file", "left").empty());
    Log log("test");
    DiskCache cache(folder / "file", "left", 10'000, log);
    cache.store(blobOf(1, 10));
}

TEST(Injection, IsReadFromItsText) {
    EXPECT_TRUE(parseInjection("draw-hang@20")->at(Injection::Kind::kDrawHang, 20));
    EXPECT_FALSE(parseInjection("draw-hang@20")->at(Injection::Kind::kDrawHang, 21));
    EXPECT_TRUE(parseInjection("corrupt@0")->at(Injection::Kind::kCorrupt, 0));
    EXPECT_TRUE(parseInjection("draw-fail@3")->at(Injection::Kind::kDrawFail, 3));
    EXPECT_EQ(parseInjection("draw-slow@3:250")->pause, std::chrono::milliseconds(250));
    for (const char* wrong : {"", "hang", "draw-hang", "draw-hang@", "draw-hang@x", "draw-hang@-1", "draw-slow@3",
                              "draw-slow@3:", "draw-slow@3:99999999999", "corrupt@1@2"}) {
        const auto injection = parseInjection(wrong);
        ASSERT_FALSE(injection) << wrong;
        EXPECT_EQ(injection.error().code, ErrorCode::kUsage);
    }
}

}  // namespace
}  // namespace tessera
