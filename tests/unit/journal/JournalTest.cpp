/// What is in a journal survives its server.
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>

#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/journal/KeptShow.h"

namespace tessera {
namespace {

using test::KeptShow;
using test::Standing;
using namespace std::chrono_literals;

/// A server ends in order and another one goes on, several times; logs become snapshots all the while.
TEST(Journal, GoesOnWithTheStateAndTheHistoryThatWere) {
    forSeeds(12, [](Random& random) {
        const test::TestFolder folder;
        test::ReadableLog words;
        JournalLimits limits;
        limits.compactBytes = 20'000 + below(random, 60'000);
        BlobStore arrays;
        KeptShow kept(random);
        Epoch epoch;
        for (int server = 0; server < 4; ++server) {
            Expected<Journal::Opened> opened =
                test::openJournal(folder / "wall", arrays, words.log, limits, {"/a.tsct"});
            ASSERT_TRUE(opened) << opened.error().message;
            EXPECT_GT(opened->journal->epoch(), epoch);
            epoch = opened->journal->epoch();
            EXPECT_EQ(opened->state.begun, server > 0);
            if (server == 0) {
                kept.load(*opened->journal);
            } else {
                EXPECT_EQ(opened->state.nextFrame, kept.next);
                EXPECT_EQ(opened->state.sequence, kept.show.simulation().sequence());
                kept.show.connectAnew();
                Simulation next;
                next.goOnFrom(test::leftIn(opened->state));
                ASSERT_EQ(test::standingOf(next), test::standingOf(kept.show.simulation()));
                EXPECT_EQ(next.nodeCount(), kept.show.simulation().nodeCount());
                EXPECT_EQ(next.display().ids(), kept.show.simulation().display().ids());
                for (const auto kind : {Edit::Kind::kUndo, Edit::Kind::kRedo}) {
                    const ChangeListPtr here = next.listOf(kind), there = kept.show.simulation().listOf(kind);
                    ASSERT_EQ(here != nullptr, there != nullptr);
                    if (here) {
                        EXPECT_EQ(*here, *there);
                    }
                }
            }
            kept.frames(*opened->journal, 60);
            EXPECT_FALSE(opened->journal->trouble());
            opened->journal->ends(kept.next);
        }
        EXPECT_EQ(words.said(), "");
    });
}

TEST(Journal, IsBoundedBySnapshots) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(7);
    JournalLimits limits;
    limits.compactBytes = 64'000;
    BlobStore arrays;
    KeptShow kept(random);
    std::uint64_t written = 0;
    {
        Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log, limits);
        ASSERT_TRUE(opened) << opened.error().message;
        kept.load(*opened->journal);
        for (int i = 0; i < 40; ++i) {
            kept.frames(*opened->journal, 50);
            ASSERT_TRUE(test::waitUntilWritten(*opened->journal));
        }
        // A snapshot that is being made ends by itself; then there is one, and what is before it has gone.
        ASSERT_TRUE(test::eventually([&] {
            const bool made = std::ranges::any_of(test::filesIn(folder / "wall"),
                                                  [](const std::string& n) { return n.starts_with("snapshot"); });
            if (!made) kept.frames(*opened->journal, 1);
            return made;
        }));
        written = opened->journal->writtenBytes();
    }
    EXPECT_GT(written, 0u);
    Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log, limits);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(opened->state.scene.stateHash(), kept.show.simulation().scene().stateHash());
    EXPECT_EQ(words.said(), "");
}

/// Files as a kill leaves them: any length of the last log.
TEST(Journal, IsGoneOnFromWhereverItIsCutOff) {
    forSeeds(3, [](Random& random) {
        const test::TestFolder folder;
        test::ReadableLog words;
        BlobStore arrays;
        KeptShow kept(random);
        {
            Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
            ASSERT_TRUE(opened) << opened.error().message;
            kept.load(*opened->journal);
            kept.frames(*opened->journal, 40);
        }
        const std::string log = folder / "wall/log-0000000001";
        const std::uint64_t whole = std::filesystem::file_size(log);
        std::uint64_t last = kept.show.simulation().sequence().value;
        for (std::uint64_t bytes = whole;; bytes -= std::min<std::uint64_t>(bytes, 1 + below(random, whole / 12))) {
            const std::string copy = folder / "copy";
            std::filesystem::remove_all(copy);
            std::filesystem::create_directory(copy);
            std::filesystem::copy_file(log, copy + "/log-0000000001");
            std::filesystem::resize_file(copy + "/log-0000000001", bytes);
            test::goOnWith(copy, bytes < 200 ? 0 : 1);
            for (int server = 0; server < 2; ++server) {  // the second finds what the first has mended
                Expected<Journal::Opened> opened = test::openJournal(copy, arrays, words.log);
                ASSERT_TRUE(opened) << bytes << " of " << whole << " bytes: " << opened.error().message;
                const JournalState& state = opened->state;
                if (server == 0) {
                    ASSERT_LE(state.sequence.value, last);
                    last = state.sequence.value;
                } else {
                    ASSERT_GE(state.sequence.value, last);  // it stands behind what the first one may have sent
                }
                if (!state.begun) continue;
                const Standing standing{state.scene.stateHash(), state.history.undoDepth(), state.history.redoDepth()};
                EXPECT_TRUE(std::ranges::count(kept.standings.at(last), standing)) << "list " << last;
            }
            if (bytes == 0) break;
        }
        EXPECT_EQ(last, 0u);
    });
}

TEST(Journal, DamageIsNamedAndItsEndIsLeftOutOnceAPersonSaysSo) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(3);
    BlobStore arrays;
    KeptShow kept(random);
    {
        Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
        ASSERT_TRUE(opened) << opened.error().message;
        kept.load(*opened->journal);
        kept.frames(*opened->journal, 60);
    }
    const std::string log = folder / "wall/log-0000000001";
    const auto flip = [&](std::uint64_t at) {
        std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
        file.seekg(static_cast<std::streamoff>(at));
        const char was = static_cast<char>(file.get());
        file.seekp(static_cast<std::streamoff>(at));
        file.put(static_cast<char>(was ^ 4));
    };
    const std::uint64_t bytes = std::filesystem::file_size(log);
    for (int i = 0; i < 20; ++i) {
        const std::uint64_t at = kJournalMark.size() + below(random, bytes / 2);
        flip(at);
        const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
        ASSERT_FALSE(opened) << "byte " << at;
        EXPECT_EQ(opened.error().code, ErrorCode::kBadInput);
        EXPECT_NE(opened.error().message.find(log), std::string::npos) << opened.error().message;
        EXPECT_WORDS(opened.error().message);
        flip(at);
    }
    // So is damage to the last record, which was granted.
    flip(bytes - 1);
    const Expected<Journal::Opened> refused = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kBadInput);
    EXPECT_WORDS(refused.error().message);
    EXPECT_EQ(words.said(), "");
    test::goOnWith(folder / "wall", 1);
    const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_WORDS(words.said());
    EXPECT_GE(opened->state.sequence.value + 1, kept.show.simulation().sequence().value);
}

TEST(Journal, AMissingFileIsNamed) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    for (int server = 0; server < 3; ++server) ASSERT_TRUE(test::openJournal(folder / "wall", arrays, words.log));
    ASSERT_EQ(test::filesIn(folder / "wall").size(), 3u);
    std::filesystem::remove(folder / "wall/log-0000000002");
    const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_FALSE(opened);
    EXPECT_WORDS(opened.error().message);
}

/// Nothing else would tell: a shorter journal is whole too.
TEST(Journal, NewestFilesThatAreMissingAreNamed) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(2);
    BlobStore arrays;
    KeptShow kept(random);
    const auto start = [&](const std::string& name) { return test::openJournal(folder / name, arrays, words.log); };
    for (int server = 0; server < 3; ++server) {
        Expected<Journal::Opened> opened = start("wall");
        ASSERT_TRUE(opened) << opened.error().message;
        if (server == 0) kept.load(*opened->journal);
        kept.frames(*opened->journal, 10);
        opened->journal->ends(kept.next);
    }
    for (const auto& gone :
         std::vector<std::vector<std::string>>{{"log-0000000003"},
                                               {"log-0000000002", "log-0000000003"},
                                               {"log-0000000001", "log-0000000002", "log-0000000003"}}) {
        std::filesystem::remove_all(folder / "copy");
        std::filesystem::copy(folder / "wall", folder / "copy");
        for (const std::string& name : gone) std::filesystem::remove(folder / "copy/" + name);
        for (int again = 0; again < 2; ++again) {
            const Expected<Journal::Opened> opened = start("copy");
            ASSERT_FALSE(opened) << gone.size() << " files are missing, and list " << opened->state.sequence.value
                                 << " is gone on from";
            EXPECT_EQ(opened.error().code, ErrorCode::kBadInput);
            EXPECT_WORDS(opened.error().message);
        }
        // Who wants to go on without them says so.
        test::goOnWith(folder / "copy", 3 - gone.size());
        const Expected<Journal::Opened> opened = start("copy");
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_EQ(opened->state.begun, gone.size() < 3);
    }
    // Emptied, or cut within what it opens with, is gone as well.
    for (const std::uint64_t left : {0, 7, 60, 120}) {
        std::filesystem::remove_all(folder / "copy");
        std::filesystem::copy(folder / "wall", folder / "copy");
        std::filesystem::resize_file(folder / "copy/log-0000000003", left);
        const Expected<Journal::Opened> refused = start("copy");
        ASSERT_FALSE(refused) << left << " bytes: list " << refused->state.sequence.value << " is gone on from";
        EXPECT_EQ(refused.error().code, ErrorCode::kBadInput);
        EXPECT_WORDS(refused.error().message);
        std::filesystem::remove(folder / "copy/last");
        EXPECT_FALSE(start("copy")) << "nor is it one that a kill has left, without `last`";
        test::goOnWith(folder / "copy", 2);
        EXPECT_TRUE(start("copy"));
        EXPECT_WORDS(words.said());
    }
    // A file without a number; and no file, which else tells how far the journal goes.
    std::ofstream(folder / "wall/last") << "four\n";
    for (int again = 0; again < 2; ++again) {
        const Expected<Journal::Opened> opened = start("wall");
        ASSERT_FALSE(opened);
        EXPECT_EQ(opened.error().code, ErrorCode::kBadInput);
        EXPECT_WORDS(opened.error().message);
        std::filesystem::remove(folder / "wall/last");
    }
    test::goOnWith(folder / "wall", 3);
    EXPECT_TRUE(start("wall"));
}

TEST(Journal, AFullDiskIsSaidAndWhatWaitsIsWrittenOnceThereIsRoom) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(5);
    BlobStore arrays;
    KeptShow kept(random);
    JournalLimits limits;
    limits.retryEvery = 20ms;
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log, limits);
    ASSERT_TRUE(opened) << opened.error().message;
    Journal& journal = *opened->journal;
    kept.load(journal);
    kept.frames(journal, 10);
    ASSERT_TRUE(test::waitUntilWritten(journal));
    EXPECT_FALSE(journal.trouble());

    // Room for a part of a record.
    const rlimit little{.rlim_cur = journal.writtenBytes() + 100, .rlim_max = before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
    kept.frames(journal, 20);
    ASSERT_TRUE(test::eventually([&] { return journal.trouble().has_value(); }));
    EXPECT_WORDS(journal.trouble()->message);
    EXPECT_LT(journal.written(), journal.handed());
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    ASSERT_TRUE(test::waitUntilWritten(journal));
    EXPECT_FALSE(journal.trouble());
    EXPECT_WORDS(words.said());
    opened->journal.reset();

    opened = test::openJournal(folder / "wall", arrays, words.log, limits);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(opened->state.scene.stateHash(), kept.show.simulation().scene().stateHash());
}

TEST(Journal, TooMuchThatWaitsEndsItAndWhatIsWrittenStays) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(6);
    BlobStore arrays;
    KeptShow kept(random);
    JournalLimits limits;
    limits.maxQueuedBytes = 2'000;
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    std::uint64_t reached = 0;
    {
        Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log, limits);
        ASSERT_TRUE(opened) << opened.error().message;
        Journal& journal = *opened->journal;
        kept.load(journal);
        ASSERT_TRUE(test::waitUntilWritten(journal));
        const rlimit little{.rlim_cur = journal.writtenBytes() + 100, .rlim_max = before.rlim_max};
        ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
        kept.frames(journal, 100);
        reached = kept.show.simulation().sequence().value;
        ASSERT_TRUE(journal.trouble());
        EXPECT_WORDS(journal.trouble()->message);
    }
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_LT(opened->state.sequence.value, reached);
    EXPECT_EQ(opened->state.scene.stateHash(), kept.standings.at(opened->state.sequence.value).front().stateHash);
}

// What a wall shows is not for everybody who has an account on its server.
TEST(Journal, ItsFilesAreItsOwnersAlone) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(3);
    BlobStore arrays;
    KeptShow kept(random);
    Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_TRUE(opened);
    kept.load(*opened->journal);
    kept.frames(*opened->journal, 3);
    ASSERT_TRUE(test::waitUntilWritten(*opened->journal));
    int files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "wall")) {
        if (!entry.is_regular_file()) continue;
        ++files;
        EXPECT_EQ(entry.status().permissions(),
                  std::filesystem::perms::owner_read | std::filesystem::perms::owner_write)
            << entry.path();
    }
    EXPECT_GE(files, 2);
}

TEST(Journal, HasOneServer) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    const Expected<Journal::Opened> first = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_TRUE(first);
    const Expected<Journal::Opened> second = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kRefused);
    EXPECT_NE(second.error().message.find("in use by tessera-server, pid " + std::to_string(::getpid())),
              std::string::npos)
        << second.error().message;
}

// Not below the folder in which the tests run: the sentences name them whole.
const std::string kHall = "/scenes/hall.tsct", kYard = "/scenes/yard.tsct";

TEST(Journal, AnotherSceneIsRefusedAndNoneIsTheSame) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    Random random(1);
    KeptShow kept(random);
    {
        Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log, {}, {kHall});
        ASSERT_TRUE(opened);
        kept.load(*opened->journal);
    }
    const Expected<Journal::Opened> other = test::openJournal(folder / "wall", arrays, words.log, {}, {kYard});
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(other.error().message);
    EXPECT_TRUE(test::openJournal(folder / "wall", arrays, words.log));
    EXPECT_TRUE(test::openJournal(folder / "wall", arrays, words.log, {}, {kHall})) << "it still knows";
}

TEST(Journal, ScenesThatStandAnotherWayAreRefusedWithoutTheirNamesToo) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(1);
    KeptShow kept(random);
    const auto open = [&](const std::vector<std::string>& scenes, const std::string& placing,
                          KeptShow* show = nullptr) -> Expected<void> {
        BlobStore arrays;
        Expected<Journal::Opened> opened =
            Journal::open({.folder = folder / "wall", .scenes = scenes, .placing = placing}, arrays, words.log, [] {});
        if (!opened) return tl::unexpected(opened.error());
        if (show) show->load(*opened->journal);
        return {};
    };
    ASSERT_TRUE(open({kHall}, "--fit 3", &kept));
    EXPECT_TRUE(open({}, ""));
    EXPECT_TRUE(open({}, "--fit 3"));
    EXPECT_TRUE(open({kHall}, "--fit 3"));
    for (const auto& [scenes, placing] :
         {std::pair(std::vector<std::string>{}, "--fit 4"), std::pair(std::vector<std::string>{kHall}, "--fit 4"),
          std::pair(std::vector<std::string>{kHall}, "")}) {
        const Expected<void> other = open(scenes, placing);
        ASSERT_FALSE(other) << placing;
        EXPECT_EQ(other.error().code, ErrorCode::kUsage);
        EXPECT_WORDS(other.error().message);
    }
}

/// A link, or anything but a file, is no lock, and stays as it is.
TEST(Journal, ALockThatIsALinkOrNoFileIsRefused) {
    const test::TestFolder folder;
    const std::string other = folder.write("other", "kept"), lock = folder / "wall/lock";
    const auto refused = [&] {
        const Expected<JournalFolder> held = JournalFolder::hold(folder / "wall");
        EXPECT_FALSE(held);
        if (!held) EXPECT_EQ(held.error().code, ErrorCode::kBadInput);
        if (!held) EXPECT_NE(held.error().message.find(lock), std::string::npos) << held.error().message;
    };
    std::filesystem::create_directory(folder / "wall");
    std::filesystem::create_symlink(other, lock);
    refused();
    std::filesystem::remove(lock);
    std::filesystem::create_hard_link(other, lock);
    refused();
    std::filesystem::remove(lock);
    std::filesystem::create_directory(lock);
    refused();
    std::filesystem::remove(lock);
    ASSERT_EQ(::mkfifo(lock.c_str(), 0600), 0);
    refused();
    EXPECT_EQ(std::filesystem::file_size(other), 4u);
}

TEST(Journal, TheEpochGrowsThoughTheClockHasGoneBack) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    const Epoch later(std::uint64_t{1} << 62);  // the year 2116
    {
        const Expected<JournalFolder> held = JournalFolder::hold(folder / "wall");
        ASSERT_TRUE(held);
        ASSERT_TRUE(held->beginLog({.schema = schemaHash(),
                                    .program = "unit_journal",
                                    .number = 1,
                                    .epoch = later,
                                    .scenes = {},
                                    .sequence = {},
                                    .stateHash = Aspect().stateHash()}));
    }
    for (int server = 1; server < 4; ++server) {
        const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
        ASSERT_TRUE(opened) << opened.error().message;
        EXPECT_EQ(opened->journal->epoch().value, later.value + static_cast<std::uint64_t>(server));
    }
}

TEST(Journal, AnEpochThatWasRaisedIsRemembered) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    const Epoch seen(std::uint64_t{1} << 62);
    {
        const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
        ASSERT_TRUE(opened);
        EXPECT_LT(opened->journal->epoch(), seen);
        opened->journal->epochRaised(seen);
    }
    const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_GT(opened->journal->epoch(), seen);
}

TEST(Journal, WhoeverWaitsForARecordIsTold) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    Random random(4);
    KeptShow kept(random);
    std::atomic<int> told{0};
    Expected<Journal::Opened> opened =
        Journal::open({.folder = folder / "wall", .scenes = {}, .limits = {}}, arrays, words.log, [&] { ++told; });
    ASSERT_TRUE(opened);
    kept.load(*opened->journal);
    for (int i = 1; i <= 50; ++i) {
        kept.frames(*opened->journal, 1);
        opened->journal->tellWhen(opened->journal->handed());
        const auto deadline = std::chrono::steady_clock::now() + 10s;
        while (told < i && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
        ASSERT_EQ(told, i);
        EXPECT_EQ(opened->journal->written(), opened->journal->handed());
    }
}

}  // namespace
}  // namespace tessera
