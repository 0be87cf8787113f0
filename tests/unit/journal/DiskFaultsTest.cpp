/// Each call of the file system fails once, or from there on; the power goes at any moment.
#include <atomic>
#include <cerrno>

#include <fmt/format.h>

#include "tests/unit/journal/KeptShow.h"
#include "tests/unit/journal/ModelDisk.h"

namespace tessera {
namespace {

using test::KeptShow;
using test::ModelDisk;
using test::Standing;
using namespace std::chrono_literals;
using Call = ModelDisk::Call;

constexpr int kServers = 3;
constexpr std::uint64_t kFrames = 6;

/// Files are long soon, and everything is synced at once.
JournalLimits quickLimits() {
    JournalLimits limits;
    limits.compactBytes = 6'000;
    limits.syncEvery = 0ms;
    limits.retryEvery = 1ms;
    return limits;
}

/// Ids and lists that others have seen.
struct Seen {
    std::uint64_t nextId = 0;
    Sequence list;
};

/// Servers of one journal, one after the other, until a fault stops one.
class FaultyShow {
public:
    explicit FaultyShow(std::uint64_t seed) : random_(seed), kept(random_) {}

    void run(const std::function<void(const Journal&)>& onOpened = {}, const std::function<void()>& onClosed = {}) {
        for (int server = 0; server < kServers && !stopped; ++server) {
            Expected<Journal::Opened> opened =
                Journal::open({.folder = folder / "wall", .scenes = {}, .limits = quickLimits(), .calls = disk},
                              arrays_, words.log, {});
            if (!opened) {
                refused = opened.error().message;
                return;
            }
            Journal& journal = *opened->journal;
            if (onOpened) onOpened(journal);
            if (server > 0) {
                ASSERT_EQ(opened->state.sequence, kept.show.simulation().sequence());
                kept.show.connectAnew();
            }
            recordsOf.clear();
            if (server == 0) {
                kept.load(journal);
                note(journal);
            }
            for (std::uint64_t frame = 0; frame < kFrames && !stopped; ++frame) {
                kept.frames(journal, 1);
                note(journal);
            }
            // (The snapshot that a start makes may take longer than these frames.)
            for (const auto end = std::chrono::steady_clock::now() + 10s;
                 disk->faults.empty() && !disk->onCall && server + 1 == kServers && disk->count(Call::kRemove) == 0 &&
                 std::chrono::steady_clock::now() < end;)
                std::this_thread::yield();
            journal.ends(kept.next);
            // The journal says so a moment after the sync has failed. A sync may also fail while the journal closes.
            const bool syncFailed = disk->failed() && syncsFail();
            const auto deadline = std::chrono::steady_clock::now() + 2s;
            while (syncFailed && !ended(journal) && std::chrono::steady_clock::now() < deadline)
                std::this_thread::yield();
            if (syncFailed) saidThatItEnded = ended(journal);
            stopped = stopped || journal.trouble();
            opened->journal.reset();
            stopped = stopped || (disk->failed() && syncsFail());
            if (onClosed) onClosed();
        }
    }

    const test::TestFolder folder;
    test::ReadableLog words;
    std::shared_ptr<ModelDisk> disk = std::make_shared<ModelDisk>();
    std::string refused;  ///< by the last server that was started
    bool stopped = false;
    bool saidThatItEnded = true;  ///< of a sync that failed before the journal was closed: `trouble` did
    Seen seen;                    ///< under `recordsMutex`
    Sequence granted;             ///< the newest of which somebody would have been told that it is done
    std::map<std::uint64_t, Sequence>
        recordsOf;  ///< sequence by the number of the last record of its frame; of this server

private:
    [[nodiscard]] bool syncsFail() const {
        return std::ranges::any_of(disk->faults,
                                   [](const auto& f) { return f.call == Call::kSync || f.call == Call::kSyncFolder; });
    }
    [[nodiscard]] static bool ended(const Journal& journal) {
        const std::optional<Error> trouble = journal.trouble();
        return trouble && trouble->message.find("has ended") != std::string::npos;
    }
    /// Waits for what becomes of the frame's record, as who asked for the edit does.
    void note(const Journal& journal) {
        const std::uint64_t record = journal.handed();
        const Sequence sequence = kept.show.simulation().sequence();
        {
            const std::scoped_lock lock(recordsMutex);
            seen = {.nextId = kept.show.simulation().scene().nextFreeId(), .list = sequence};
            recordsOf[record] = sequence;
        }
        const auto deadline = std::chrono::steady_clock::now() + 10s;
        while (journal.written() < record && !journal.trouble()) {
            ASSERT_LT(std::chrono::steady_clock::now(), deadline);
            std::this_thread::yield();
        }
        // (A disk that is full for a moment takes it later.)
        while (journal.written() < record && !stopped) {
            stopped = (!disk->faults.empty() && disk->faults.back().forever) || ended(journal);
            ASSERT_LT(std::chrono::steady_clock::now(), deadline);
        }
        if (journal.written() >= record) granted = sequence;
    }

    Random random_;
    BlobStore arrays_;

public:
    KeptShow kept;
    std::mutex recordsMutex;
};

/// What a server that is started on these files goes on from: never older than `atLeast`, a state that there was, and
/// behind all that others have seen.
void expectGoesOn(const ModelDisk::Files& files, Sequence atLeast, const Seen& seen, FaultyShow& show,
                  const std::string& folder, bool powerCut) {
    ModelDisk::write(files, folder);
    BlobStore arrays;
    test::ReadableLog words;
    Expected<Journal::Opened> opened = test::openJournal(folder, arrays, words.log, quickLimits(), {}, powerCut);
    ASSERT_TRUE(opened) << opened.error().message;
    const JournalState& state = opened->state;
    ASSERT_GE(state.sequence, atLeast);
    EXPECT_GE(opened->nextId, seen.nextId);
    EXPECT_GE(opened->behind, seen.list);
    if (!state.begun) return;
    // Behind a server that has sent nothing the number stands higher than that of any list.
    const Standing standing{state.scene.stateHash(), state.history.undoDepth(), state.history.redoDepth()};
    const bool skipped = state.sequence > show.kept.show.simulation().sequence();
    EXPECT_TRUE(std::ranges::any_of(show.kept.standings,
                                    [&](const auto& known) {
                                        return (skipped ? known.first >= atLeast.value
                                                        : known.first == state.sequence.value) &&
                                               std::ranges::count(known.second, standing);
                                    }))
        << "list " << state.sequence.value;
}

/// The server is killed, so that what it had no time to sync is in the kernel's memory alone; another one goes on from
/// that, and the power goes.
void expectGoesOnAfterBoth(const ModelDisk::Files& killed, const ModelDisk::Files& contents,
                           const ModelDisk::Files& names, Sequence atLeast, const Seen& seen, FaultyShow& show) {
    ModelDisk::write(killed, show.folder / "copy");
    const auto disk = std::make_shared<ModelDisk>();
    disk->adopt(show.folder / "copy", &contents, &names);
    ModelDisk::Files left;
    {
        BlobStore arrays;
        test::ReadableLog words;
        const Expected<Journal::Opened> opened =
            Journal::open({.folder = show.folder / "copy", .scenes = {}, .limits = quickLimits(), .calls = disk},
                          arrays, words.log, {});
        ASSERT_TRUE(opened) << opened.error().message;
        if (opened->state.sequence <= show.kept.show.simulation().sequence())
            atLeast = std::max(atLeast, opened->state.sequence);
        left = disk->afterPowerCut(nullptr);
    }
    expectGoesOn(left, atLeast, seen, show, show.folder / "copy", true);
}

void runWithFaults(const std::vector<ModelDisk::Fault>& faults, bool& reached) {
    std::string text;
    for (const ModelDisk::Fault& f : faults)
        text += fmt::format("call {} no. {}{}; ", static_cast<int>(f.call), f.number,
                            f.forever ? " and all later ones" : "");
    SCOPED_TRACE(text);
    FaultyShow show(9);
    show.disk->faults = faults;
    ASSERT_NO_FATAL_FAILURE(show.run());
    reached = show.disk->failed();
    if (!reached) return;
    ASSERT_NO_FATAL_FAILURE(
        expectGoesOn(show.disk->afterKill(), show.granted, show.seen, show, show.folder / "copy", false));
    // What the kernel tells once is told on, and never tried again.
    if (const Call call = faults.front().call; call == Call::kSync || call == Call::kSyncFolder) {
        const bool said =
            !show.refused.empty() || show.words.said().find("the journal ends here: ") != std::string::npos;
        EXPECT_TRUE(said) << show.words.said();
        EXPECT_TRUE(!show.refused.empty() || show.saidThatItEnded) << "edits are still granted";
        EXPECT_FALSE(show.disk->syncedAgain());
    }
    // A server that is started again, once all is well, goes on in the same folder.
    BlobStore arrays;
    test::ReadableLog words;
    const Expected<Journal::Opened> again = test::openJournal(show.folder / "wall", arrays, words.log, quickLimits());
    ASSERT_TRUE(again) << again.error().message;
    ASSERT_GE(again->state.sequence, show.granted);
}

TEST(JournalDisk, WhateverFailsNothingGrantedIsLostOrItHasSaidThatItEnds) {
    std::array<std::uint64_t, ModelDisk::kCalls> counts{};
    {
        FaultyShow show(9);
        ASSERT_NO_FATAL_FAILURE(show.run());
        for (std::size_t call = 0; call < counts.size(); ++call)
            counts[call] = show.disk->count(static_cast<Call>(call));
        EXPECT_EQ(show.refused, "");
        EXPECT_EQ(show.words.said(), "");
        ASSERT_NO_FATAL_FAILURE(expectGoesOn(show.disk->afterPowerCut(nullptr), show.kept.show.simulation().sequence(),
                                             show.seen, show, show.folder / "copy", true));
        EXPECT_GT(counts[static_cast<std::size_t>(Call::kRemove)], 0u) << "no snapshot was made";
    }
    int runs = 0, reached = 0;
    for (const Call call : {Call::kSync, Call::kSyncFolder, Call::kRename, Call::kCreate, Call::kOpen, Call::kTruncate,
                            Call::kRemove, Call::kOverwrite, Call::kAppend}) {
        const int error = call == Call::kAppend || call == Call::kOverwrite || call == Call::kCreate ? ENOSPC : EIO;
        for (std::uint64_t number = 1; number <= counts[static_cast<std::size_t>(call)]; ++number) {
            std::vector<std::vector<ModelDisk::Fault>> ways{{{.call = call, .number = number, .error = error}}};
            // Who waits for a full disk is given a second at the end: some of them do.
            if ((call != Call::kAppend && call != Call::kOverwrite) || number % 32 == 0)
                ways.push_back({{.call = call, .number = number, .error = error, .forever = true}});
            if (call == Call::kAppend)
                ways.push_back({ways[0][0], {.call = Call::kTruncate, .number = 1, .error = EIO}});
            for (const auto& faults : ways) {
                bool there = false;
                ASSERT_NO_FATAL_FAILURE(runWithFaults(faults, there));
                if (testing::Test::HasFailure()) return;
                ++runs;
                reached += there ? 1 : 0;
            }
        }
    }
    // How many calls there are depends on which thread is quicker.
    EXPECT_GT(reached, runs / 2);
}

/// Files as a kill and as a power cut leave them, at calls picked at random: before the call, and so after the one
/// before it.
TEST(JournalDisk, APowerCutCostsNoMoreThanWhatIsNotSyncedAndNeverTheJournal) {
    forSeeds(3, [](Random& random) {
        FaultyShow show(random());
        struct Cut {
            ModelDisk::Files killed, contents, strict, mixed;
            Sequence written, synced;
            Seen seen;
        };
        std::vector<Cut> cuts;
        std::atomic<const Journal*> journal{nullptr};
        Sequence before;  // of servers that have ended
        const std::uint64_t every = 11 + below(random, 20);
        std::uint64_t calls = 0;
        show.disk->onCall = [&] {
            if (++calls % every != 0) return;
            const std::scoped_lock lock(show.recordsMutex);
            Cut cut{.killed = {},
                    .contents = {},
                    .strict = {},
                    .mixed = {},
                    .written = before,
                    .synced = before,
                    .seen = show.seen};
            if (const Journal* open = journal) {
                const std::uint64_t written = open->written();
                for (const auto& [record, sequence] : show.recordsOf) {
                    if (record <= written) cut.written = std::max(cut.written, sequence);
                    if (record < written) cut.synced = std::max(cut.synced, sequence);  // the newest may be about to be
                }
            }
            cut.killed = show.disk->afterKill();
            cut.contents = show.disk->afterKill(true);
            cut.strict = show.disk->afterPowerCut(nullptr);
            cut.mixed = show.disk->afterPowerCut(&random);
            cuts.push_back(std::move(cut));
        };
        // (A server that is started has granted nothing yet; what those before it have, has been synced.)
        ASSERT_NO_FATAL_FAILURE(show.run([&](const Journal& opened) { journal = &opened; },
                                         [&] {
                                             journal = nullptr;
                                             before = show.kept.show.simulation().sequence();
                                         }));
        show.disk->onCall = {};
        ASSERT_GT(cuts.size(), 3u);
        for (const Cut& cut : cuts) {
            if (&cut != &cuts.front() && oneIn(random, 3)) {
                ASSERT_NO_FATAL_FAILURE(
                    expectGoesOnAfterBoth(cut.killed, cut.contents, cut.strict, cut.written, cut.seen, show));
            }
            ASSERT_NO_FATAL_FAILURE(expectGoesOn(cut.killed, cut.written, cut.seen, show, show.folder / "copy", false));
            ASSERT_NO_FATAL_FAILURE(expectGoesOn(cut.strict, cut.synced, cut.seen, show, show.folder / "copy", true));
            ASSERT_NO_FATAL_FAILURE(expectGoesOn(cut.mixed, cut.synced, cut.seen, show, show.folder / "copy", true));
        }
    });
}

}  // namespace
}  // namespace tessera
