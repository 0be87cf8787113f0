#include "common/base/PagedBytes.h"

#include <gtest/gtest.h>

#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <thread>

#include "common/base/Blob.h"

namespace tessera {
namespace {

constexpr std::size_t kPage = PagedBytes::kPageBytes;

/// The first `count` seeds, or the one that TESSERA_SEED names.
template <typename Test>
void forEachSeed(std::uint64_t count, Test&& test) {
    const char* only = std::getenv("TESSERA_SEED");
    const std::uint64_t first = only ? std::strtoull(only, nullptr, 10) : 0;
    for (std::uint64_t seed = first; seed < (only ? first + 1 : count) && !testing::Test::HasFatalFailure(); ++seed) {
        const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_base --gtest_filter=PagedBytes." +
                     info->name());
        test(seed);
    }
}

Bytes randomBytes(std::mt19937_64& random, std::size_t size) {
    Bytes bytes(size);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    return bytes;
}

/// Of all pages of this process, as the machine counts it.
std::uint64_t memoryTaken() {
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        std::error_code error;
        struct stat status {};
        if (std::filesystem::read_symlink(entry.path(), error).string().starts_with("/memfd:tessera-pages") &&
            ::stat(entry.path().c_str(), &status) == 0)
            return static_cast<std::uint64_t>(status.st_blocks) * 512;
    }
    return 0;
}

struct Version {
    std::shared_ptr<const PagedBytes> paged;
    Bytes bytes;
};

void expectSame(const Version& version, std::mt19937_64& random) {
    ASSERT_TRUE(version.paged);
    const std::size_t size = version.bytes.size(), from = random() % size, count = 1 + random() % (size - from);
    Bytes part(count);
    version.paged->read(from, part);
    ASSERT_EQ(std::memcmp(part.data(), version.bytes.data() + from, count), 0) << "[" << from << ", +" << count << ")";
    if (random() % 3 != 0) return;
    const ByteSpan view = version.paged->view();
    ASSERT_EQ(view.size(), size);
    ASSERT_EQ(std::memcmp(view.data(), version.bytes.data(), size), 0);
}

TEST(PagedBytes, EveryVersionKeepsItsBytesWhateverBecomesOfOthers) {
    forEachSeed(60, [](std::uint64_t seed) {
        std::mt19937_64 random(seed);
        const std::size_t size = 1 + random() % (40 * kPage);
        std::vector<Version> versions;
        Bytes first = randomBytes(random, size);
        std::shared_ptr<void> mapping;
        if (seed % 2 == 0) {
            // Somebody else's memory, which cannot be written to.
            void* memory = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
            ASSERT_NE(memory, MAP_FAILED);
            std::copy(first.begin(), first.end(), static_cast<std::byte*>(memory));
            ::mprotect(memory, size, PROT_READ);
            mapping = std::shared_ptr<void>(memory, [size](void* m) { ::munmap(m, size); });
            versions.push_back({PagedBytes::over(mapping, {static_cast<const std::byte*>(memory), size}), first});
        } else {
            versions.push_back({PagedBytes::copyOf(first), first});
        }
        mapping.reset();
        const std::size_t most = 1 + random() % 12;
        for (int step = 0; step < 120; ++step) {
            const Version& from = versions[random() % versions.size()];
            const std::size_t at = random() % size, count = random() % 8 == 0
                                                                ? 1 + random() % (size - at)
                                                                : 1 + random() % std::min<std::size_t>(size - at, 300);
            const Bytes bytes = randomBytes(random, count);
            Version next{from.paged->withRange(at, bytes), from.bytes};
            std::ranges::copy(bytes, next.bytes.begin() + static_cast<std::ptrdiff_t>(at));
            ASSERT_TRUE(next.paged);
            EXPECT_LE(next.paged->pieces(), PagedBytes::kMostPieces);
            versions.push_back(std::move(next));
            while (versions.size() > most)
                versions.erase(versions.begin() + static_cast<std::ptrdiff_t>(random() % versions.size()));
            for (const Version& version : versions) expectSame(version, random);
            if (testing::Test::HasFatalFailure()) return;
        }
    });
    EXPECT_EQ(memoryTaken(), 0u) << "nobody holds anything";
}

TEST(PagedBytes, ThreadsMakeVersionsOfTheSame) {
    std::mt19937_64 random(1);
    const Bytes bytes = randomBytes(random, 64 * kPage + 7);
    const Version common{PagedBytes::copyOf(bytes), bytes};
    std::vector<std::thread> threads;
    for (std::uint64_t number = 0; number < 4; ++number)
        threads.emplace_back([&, number] {
            std::mt19937_64 own(number);
            Version version = common;
            for (int step = 0; step < 300; ++step) {
                const std::size_t at = own() % (bytes.size() - 100);
                const Bytes part = randomBytes(own, 100);
                version.paged = version.paged->withRange(at, part);
                std::ranges::copy(part, version.bytes.begin() + static_cast<std::ptrdiff_t>(at));
                expectSame(version, own);
                if (step % 50 == 0) version = common;
                if (testing::Test::HasFatalFailure()) return;
            }
        });
    for (std::thread& thread : threads) thread.join();
    expectSame(common, random);
}

/// While the newest few are held, as a wall does, pages come home: whatever has been edited, the newest has few pieces,
/// and what is taken is the array and what those few differ by.
TEST(PagedBytes, HaveFewPiecesAfterAnyNumberOfEdits) {
    forEachSeed(4, [](std::uint64_t seed) {
        std::mt19937_64 random(seed);
        const std::size_t size = 2'000 * kPage, kept = 1 + seed % 4;
        std::vector<std::shared_ptr<const PagedBytes>> held{PagedBytes::copyOf(Bytes(size))};
        const Bytes thousand = randomBytes(random, 1'000);
        const std::uint64_t before = memoryTaken();
        ASSERT_GE(before, size);
        for (int step = 0; step < 3'000; ++step) {
            held.push_back(held.back()->withRange(random() % (size - 1'000), thousand));
            if (held.size() > kept) held.erase(held.begin());
            ASSERT_LE(held.back()->pieces(), 2 * kept + 2) << "after " << step << " edits";
            ASSERT_LE(memoryTaken(), before + 16 * 2 * (kept + 1) * kPage);
        }
    });
}

TEST(PagedBytes, AnEditTakesThePagesThatItLiesIn) {
    const std::size_t size = std::size_t{100} << 20;
    std::vector<std::shared_ptr<const PagedBytes>> all{PagedBytes::copyOf(Bytes(size))};
    const std::uint64_t before = memoryTaken();
    const Bytes thousand(1'000, std::byte{7});
    for (std::size_t step = 1; step <= 100; ++step) {
        all.push_back(all.back()->withRange(step * 1'000'003 % (size - 1'000), thousand));
        ASSERT_LE(memoryTaken() - before, step * 2 * kPage) << "though all versions are kept";
    }
    all.clear();
    EXPECT_EQ(memoryTaken(), 0u);
}

TEST(PagedBytes, CanBeSeenAsAWholeInAnyNumberOfVersions) {
    // More pieces than a process may have mappings.
    std::vector<std::shared_ptr<const PagedBytes>> all{PagedBytes::copyOf(Bytes(600 * kPage))};
    const Bytes one(1, std::byte{1});
    for (std::size_t version = 1; version <= 500; ++version) {
        all.push_back(all.back()->withRange(version * kPage, one));
        const ByteSpan view = all.back()->view();
        ASSERT_EQ(view.size(), 600 * kPage);
        for (std::size_t page = 0; page < 600; ++page)
            ASSERT_EQ(view[page * kPage], static_cast<std::byte>(page >= 1 && page <= version ? 1 : 0));
    }
}

}  // namespace
}  // namespace tessera
