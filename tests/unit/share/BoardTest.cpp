/// Boards of two hosts, and neighbours that are dead, stale, hostile or something else altogether.
#include "client/share/Board.h"
#include "tests/support/words/Words.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <random>
#include <thread>

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr HostIndex kOwner = 0, kHelper = 1;
const Hash128 kDigest{11, 12};
const PixelRect kTile{.x = 128, .y = 64, .width = 8, .height = 4};
const std::vector<PixelRect> kParts = {{.x = 128, .y = 64, .width = 5, .height = 4},
                                       {.x = 133, .y = 64, .width = 3, .height = 4}};

Picture coloured(const PixelRect& rect, std::uint8_t shade) {
    return Picture::filled(rect.width, rect.height, shade, shade, shade);
}

struct TwoHosts {
    Board owner = Board::create().value(), helper = Board::create().value();
    NeighbourBoard seenByHelper = NeighbourBoard::open(owner.place()).value();
    NeighbourBoard seenByOwner = NeighbourBoard::open(helper.place()).value();
};

TEST(Board, APartIsTakenDrawnElsewhereAndCopied) {
    TwoHosts hosts;
    EXPECT_FALSE(hosts.seenByHelper.look()) << "nothing is posted";
    hosts.owner.post(kDigest, 3, kParts);
    const auto posting = hosts.seenByHelper.look();
    ASSERT_TRUE(posting);
    EXPECT_EQ(posting->digest, kDigest);
    EXPECT_EQ(posting->tile, 3u);
    EXPECT_EQ(posting->parts, kParts);
    // The owner from the front, who helps from the back.
    EXPECT_EQ(hosts.seenByHelper.takeLast(*posting, kHelper), 1u);
    EXPECT_FALSE(hosts.owner.take(1));
    EXPECT_TRUE(hosts.owner.take(0));
    EXPECT_FALSE(hosts.owner.take(0)) << "each once";
    EXPECT_FALSE(hosts.owner.take(2)) << "there is none";
    EXPECT_FALSE(hosts.seenByHelper.takeLast(*posting, kHelper));
    EXPECT_FALSE(hosts.owner.doneElsewhere(1));

    const Picture drawn = coloured(kParts[1], 200);
    LightHistogram light;
    light.pixels[7] = 70;
    light.pixels[255] = 3;
    const std::uint8_t slot = hosts.helper.keep(drawn, light, Board::stamp(posting->number, kOwner, 1));
    const std::uint32_t before = hosts.owner.doneCount();
    EXPECT_TRUE(hosts.seenByHelper.done(*posting, 1, kHelper, slot));
    EXPECT_NE(hosts.owner.doneCount(), before);
    const auto done = hosts.owner.doneElsewhere(1);
    ASSERT_TRUE(done);
    EXPECT_EQ(done->by, kHelper);
    Picture whole = coloured(kTile, 0);
    EXPECT_FALSE(hosts.seenByOwner.copy(done->slot, hosts.owner.stampOf(kOwner, 0), kParts[0], kTile, whole))
        << "another part";
    EXPECT_EQ(hosts.seenByOwner.copy(done->slot, hosts.owner.stampOf(kOwner, 1), kParts[1], kTile, whole), light);
    Picture expected = coloured(kTile, 0);
    paste(expected, drawn, 5, 0);
    EXPECT_EQ(whole, expected);
    hosts.owner.withdraw();
    EXPECT_FALSE(hosts.seenByHelper.look());
}

TEST(Board, WhoComesBackTooLateSpoilsNothing) {
    TwoHosts hosts;
    hosts.owner.post(kDigest, 3, kParts);
    const auto old = hosts.seenByHelper.look();
    ASSERT_TRUE(old);
    EXPECT_EQ(hosts.seenByHelper.takeLast(*old, kHelper), 1u);
    const std::uint64_t oldStamp = hosts.owner.stampOf(kOwner, 1);
    hosts.owner.post(kDigest, 3, kParts);  // the next picture
    EXPECT_FALSE(hosts.seenByHelper.done(*old, 1, kHelper, 0));
    hosts.seenByHelper.giveUp(*old, 1, kHelper);
    EXPECT_FALSE(hosts.seenByHelper.takeLast(*old, kHelper)) << "nothing of the old one is free";
    EXPECT_FALSE(hosts.owner.doneElsewhere(1));
    EXPECT_NE(hosts.owner.stampOf(kOwner, 1), oldStamp);
    // Its pixels give way to newer ones, and whoever copies notices.
    const std::uint8_t slot = hosts.helper.keep(coloured(kParts[1], 7), {}, oldStamp);
    Picture whole = coloured(kTile, 0);
    EXPECT_TRUE(hosts.seenByOwner.copy(slot, oldStamp, kParts[1], kTile, whole));
    for (std::size_t i = 0; i < board::kSlots; ++i) (void)hosts.helper.keep(coloured(kParts[1], 9), {}, oldStamp + 2);
    EXPECT_FALSE(hosts.seenByOwner.copy(slot, oldStamp, kParts[1], kTile, whole));
}

TEST(Board, APartThatIsGivenBackIsTheOwnersAgain) {
    TwoHosts hosts;
    hosts.owner.post(kDigest, 3, kParts);
    const auto posting = hosts.seenByHelper.look();
    ASSERT_EQ(hosts.seenByHelper.takeLast(*posting, kHelper), 1u);
    EXPECT_FALSE(hosts.owner.take(1));
    hosts.seenByHelper.giveUp(*posting, 1, kHelper);
    EXPECT_TRUE(hosts.owner.take(1));
}

TEST(Board, IsNobodysButItsUsers) {
    const Board board = Board::create().value();
    struct stat status {};
    ASSERT_EQ(::stat(("/proc/" + board.place().substr(0, board.place().find('/')) + "/fd/" +
                      board.place().substr(board.place().find('/') + 1))
                         .c_str(),
                     &status),
              0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST(Board, TellsNeighboursWhatItsHostIsAt) {
    TwoHosts hosts;
    EXPECT_EQ(hosts.seenByOwner.activity(), Activity::kIdle);
    hosts.helper.is(Activity::kDrawing);
    EXPECT_EQ(hosts.seenByOwner.activity(), Activity::kDrawing);
    const TimePoint now = clockNow();
    EXPECT_FALSE(hosts.seenByOwner.readyWith(0));
    hosts.helper.ready(0, now);
    EXPECT_EQ(hosts.seenByOwner.readyWith(0), now);
    EXPECT_FALSE(hosts.seenByOwner.readyWith(1));
}

TEST(Board, ACallEndsTheWait) {
    TwoHosts hosts;
    const std::uint32_t seen = hosts.helper.calls();
    std::thread waiting([&] {
        while (hosts.helper.calls() == seen) hosts.helper.waitForCall(seen, 10s);
    });
    hosts.seenByOwner.call();
    waiting.join();
    EXPECT_NE(hosts.helper.calls(), seen);
}

TEST(Board, OutlivesItsProcessForWhoHasItOpenAndForNobodyElse) {
    int toParent[2], toChild[2];
    ASSERT_EQ(::pipe(toParent), 0);
    ASSERT_EQ(::pipe(toChild), 0);
    const pid_t child = ::fork();
    if (child == 0) {
        Board mine = Board::create().value();
        mine.post(kDigest, 3, kParts);
        char place[64] = {};
        std::strncpy(place, mine.place().c_str(), sizeof place - 1);
        char go = 0;
        const bool told = ::write(toParent[1], place, sizeof place) == sizeof place && ::read(toChild[0], &go, 1) == 1;
        ::_exit(told ? 0 : 1);
    }
    char place[64] = {};
    ASSERT_EQ(::read(toParent[0], place, sizeof place), static_cast<ssize_t>(sizeof place));
    auto open = NeighbourBoard::open(place);
    ASSERT_TRUE(open) << open.error().message;
    ASSERT_EQ(::write(toChild[1], "g", 1), 1);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(open->look()->parts, kParts);
    EXPECT_EQ(NeighbourBoard::open(place).error().code, ErrorCode::kNotFound);
    for (const int end : {toParent[0], toParent[1], toChild[0], toChild[1]}) ::close(end);
}

TEST(Board, NothingElseIsTakenForOne) {
    const auto refused = [](const std::string& place) {
        const auto open = NeighbourBoard::open(place);
        return open ? std::string("opened")
                    : std::to_string(static_cast<int>(open.error().code)) + open.error().message;
    };
    for (const char* place :
         {"", "7", "/etc/passwd", "self/3", "1/../../../etc/passwd", "-1/3", "1/3 ", "99999999999/3"})
        EXPECT_WORDS(refused(place));
    const auto at = [](int file) { return std::to_string(::getpid()) + "/" + std::to_string(file); };
    const int plain = ::open("/proc/self/exe", O_RDONLY);
    EXPECT_NE(refused(at(plain)), "opened");
    ::close(plain);
    EXPECT_WORDS(refused(at(plain)));
    int pipes[2];
    ASSERT_EQ(::pipe(pipes), 0);
    EXPECT_WORDS(refused(at(pipes[0])));
    for (const int end : pipes) ::close(end);
    const std::size_t bytes = board::kHeadBytes + board::kSlots * board::kSlotStride;
    const auto memory = [&](unsigned flags, std::size_t size, int seals) {
        const int file = ::memfd_create("other", flags);
        EXPECT_EQ(::ftruncate(file, static_cast<off_t>(size)), 0);
        if (seals) {
            EXPECT_EQ(::fcntl(file, F_ADD_SEALS, seals), 0);
        }
        const std::string said = refused(at(file));
        ::close(file);
        return said;
    };
    EXPECT_WORDS(memory(MFD_ALLOW_SEALING, bytes, 0));
    EXPECT_WORDS(memory(MFD_ALLOW_SEALING, bytes, F_SEAL_GROW));
    EXPECT_WORDS(memory(MFD_ALLOW_SEALING, bytes - 1, F_SEAL_SHRINK | F_SEAL_GROW));
    EXPECT_NE(memory(MFD_ALLOW_SEALING, bytes, F_SEAL_SHRINK | F_SEAL_GROW).find("of this version"), std::string::npos);
}

/// A neighbour that writes anything anywhere, all the time: nobody crashes, waits, reads beyond, or takes nonsense.
TEST(Board, SurvivesANeighbourThatWritesAnything) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::stoul(given)) : 1;
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_share --gtest_filter=Board.Survives*");
    TwoHosts hosts;
    auto hostile =
        OthersMemory::open(hosts.owner.place(), board::kHeadBytes, board::kSlots * board::kSlotStride).value();
    std::atomic<bool> over = false;
    std::thread scribbling([&] {
        std::mt19937_64 random(seed);
        auto* words = reinterpret_cast<std::atomic<std::uint64_t>*>(hostile.head.data());
        while (!over) {
            // Anything, what the head may hold, and small numbers.
            const std::uint64_t at = random() % (sizeof(board::Head) / 8);
            const std::uint64_t value = random();
            words[at].store(random() % 3 == 0 ? value
                            : random() % 2    ? value % 20
                                              : words[random() % (sizeof(board::Head) / 8)].load());
        }
    });
    Picture whole = coloured(kTile, 0);
    std::size_t looked = 0, done = 0;
    for (int i = 0; i < 20'000; ++i) {
        hosts.owner.post(kDigest, 3, kParts);
        for (int tries = 0; tries < 3; ++tries)
            if (const auto posting = hosts.seenByHelper.look()) {
                ++looked;
                ASSERT_LE(posting->parts.size(), board::kMostParts);
                for (const PixelRect& part : posting->parts) {
                    ASSERT_GT(part.width, 0);
                    ASSERT_GT(part.height, 0);
                    ASSERT_GE(part.x, 0);
                    ASSERT_LE(3ull * static_cast<unsigned>(part.width) * static_cast<unsigned>(part.height),
                              board::kSlotBytes);
                }
                if (const auto part = hosts.seenByHelper.takeLast(*posting, kHelper)) {
                    ASSERT_LT(*part, posting->parts.size());
                }
            }
        for (std::size_t part = 0; part < board::kMostParts; ++part)
            if (hosts.owner.take(part)) {
                ASSERT_LT(part, kParts.size());
                ASSERT_FALSE(hosts.owner.take(part));
            }
        for (std::size_t part = 0; part < kParts.size(); ++part)
            if (const auto by = hosts.owner.doneElsewhere(part)) {
                ++done;
                ASSERT_FALSE(
                    hosts.seenByOwner.copy(by->slot, hosts.owner.stampOf(kOwner, part), kParts[part], kTile, whole))
                    << "nobody has drawn it";
            }
        (void)hosts.seenByHelper.activity();
        (void)hosts.seenByHelper.readyWith(5);
        hosts.owner.withdraw();
    }
    over = true;
    scribbling.join();
    EXPECT_GT(looked, 0u);
    EXPECT_EQ(whole, coloured(kTile, 0));
}

}  // namespace
}  // namespace tessera
