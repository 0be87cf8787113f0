/// Ids and lists that others have seen never stand for something else, though the server was killed before it wrote
/// them.
#include <cerrno>

#include "tests/unit/journal/KeptShow.h"
#include "tests/unit/journal/ModelDisk.h"

namespace tessera {
namespace {

using test::KeptShow;
using test::ModelDisk;
using namespace std::chrono_literals;

/// What everybody who follows the scene has been sent.
struct Sent {
    std::map<ObjectId, int> makers;  ///< which server made it
    Sequence list;
    int server = 0;

    /// New objects of a list, but for those that an undo or a redo brings back.
    void take(const CommittedFrame& frame, const std::set<ObjectId>& old) {
        if (!frame.list) return;
        for (const Creation& creation : frame.list->creations) {
            const auto [known, fresh] = makers.emplace(creation.id, server);
            ASSERT_TRUE(fresh || known->second == server || old.contains(creation.id))
                << "#" << creation.id.value << " was another object's, of server " << known->second << "; this one is "
                << server;
        }
        ASSERT_GT(frame.sent->sequence, list) << "another list had this number";
        list = frame.sent->sequence;
    }
};

/// A disk that takes some of what a server writes and then nothing more, while the server goes on sending; then it is
/// killed.
TEST(JournalNumbers, WhatOthersHaveSeenIsNeverGivenAgain) {
    forSeeds(4, [](Random& random) {
        const test::TestFolder folder;
        Sent sent;
        JournalLimits limits;
        limits.retryEvery = 1ms;
        limits.compactBytes = oneIn(random, 2) ? limits.compactBytes : 6'000;
        for (; sent.server < 5; ++sent.server) {
            BlobStore arrays;
            test::ReadableLog words;
            const auto disk = std::make_shared<ModelDisk>();
            if (sent.server > 0) disk->adopt(folder / "wall");
            // (Those that a start needs are let through.)
            if (!oneIn(random, 4))
                disk->faults = {{.call = ModelDisk::Call::kAppend,
                                 .number = 7 + below(random, 60),
                                 .error = ENOSPC,
                                 .forever = true}};
            Expected<Journal::Opened> opened = Journal::open(
                {.folder = folder / "wall", .scenes = {}, .limits = limits, .calls = disk}, arrays, words.log, {});
            ASSERT_TRUE(opened) << opened.error().message;
            Journal& journal = *opened->journal;
            std::set<ObjectId> old;
            for (const ObjectId id : opened->state.scene.ids()) old.insert(id);
            const bool begun = opened->state.begun;
            for (const EditHistory::Kept& step : opened->state.history.kept())
                for (const ChangeListPtr& list : step.lists)
                    for (const Creation& creation : list->creations) old.insert(creation.id);
            KeptShow kept(random);
            Simulation& simulation = kept.show.simulation();
            test::goOn(simulation, *opened);
            if (!begun) {
                const Expected<CommittedFrame> loaded = kept.show.load();
                ASSERT_TRUE(loaded);
                journal.started(*loaded);
                ASSERT_NO_FATAL_FAILURE(sent.take(*loaded, old));
            }
            for (std::uint64_t frame = 0; frame < 5 + below(random, 40); ++frame) {
                const FrameResult result = kept.show.frame(FrameNumber(opened->state.nextFrame.value + frame + 1));
                journal.frameDone(FrameNumber(opened->state.nextFrame.value + frame + 1), result, simulation.display());
                ASSERT_NO_FATAL_FAILURE(sent.take(result.commit, old));
                if (oneIn(random, 8)) std::this_thread::yield();
            }
            // The kill: a copy of what is there, of which nobody else knows.
            const ModelDisk::Files files = disk->afterKill();
            opened->journal.reset();
            ModelDisk::write(files, folder / "wall");
        }
    });
}

TEST(JournalNumbers, AreTakenAnewBeforeTheyAreUsedUp) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(4);
    BlobStore arrays;
    KeptShow kept(random);
    JournalLimits limits;
    limits.idsAhead = 300;
    limits.listsAhead = 20;
    const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log, limits);
    ASSERT_TRUE(opened) << opened.error().message;
    kept.load(*opened->journal);
    const std::uint64_t ids = kept.show.simulation().scene().nextFreeId();
    for (int frame = 0; frame < 120; ++frame) {
        kept.frames(*opened->journal, 1);
        ASSERT_TRUE(test::waitUntilWritten(*opened->journal));
        if (frame % 20 != 19) continue;
        std::filesystem::remove_all(folder / "copy");
        std::filesystem::copy(folder / "wall", folder / "copy");
        const Expected<Journal::Opened> copy = test::openJournal(folder / "copy", arrays, words.log, limits);
        ASSERT_TRUE(copy) << copy.error().message;
        EXPECT_GE(copy->nextId, kept.show.simulation().scene().nextFreeId());
        EXPECT_GE(copy->behind, kept.show.simulation().sequence());
    }
    EXPECT_GT(kept.show.simulation().scene().nextFreeId() - ids, limits.idsAhead) << "or none had to be taken";
}

TEST(JournalNumbers, AreSkippedWhereAnOlderJournalDoesNotSayHowManyWereTaken) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(5);
    KeptShow kept(random);
    const Expected<CommittedFrame> loaded = kept.show.load();
    ASSERT_TRUE(loaded);
    {
        const Expected<JournalFolder> held =
            JournalFolder::hold(folder / "wall", std::make_shared<test::UnsyncedDisk>());
        ASSERT_TRUE(held);
        Expected<JournalFile> log = held->beginLog({.schema = schemaHash(),
                                                    .program = "unit_journal",
                                                    .number = 1,
                                                    .epoch = Epoch(1),
                                                    .scenes = {},
                                                    .sequence = {},
                                                    .stateHash = Aspect().stateHash()});
        ASSERT_TRUE(log);
        ASSERT_EQ(JournalArrays().append(*log, *loaded->list), 0);
        ASSERT_EQ(log->append(encodeJournal(journal::Frame{.start = true,
                                                           .sequence = loaded->sent->sequence,
                                                           .stateHash = loaded->sent->stateHash,
                                                           .list = loaded->list})),
                  0);
    }
    BlobStore arrays;
    const Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(opened->state.scene.stateHash(), loaded->sent->stateHash);
    EXPECT_EQ(opened->nextId, opened->state.scene.nextFreeId() + JournalLimits().idsAhead);
    EXPECT_EQ(opened->behind.value, loaded->sent->sequence.value + JournalLimits().listsAhead);
}

/// After an end in order nothing is skipped.
TEST(JournalNumbers, GoOnExactlyAfterAnEndInOrder) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(3);
    BlobStore arrays;
    KeptShow kept(random);
    for (int server = 0; server < 3; ++server) {
        Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
        ASSERT_TRUE(opened) << opened.error().message;
        if (server == 0) kept.load(*opened->journal);
        Simulation next;
        if (server > 0) {
            test::goOn(next, *opened);
            EXPECT_EQ(next.sequence(), kept.show.simulation().sequence());
            EXPECT_EQ(opened->nextId, kept.show.simulation().scene().nextFreeId());
        }
        kept.frames(*opened->journal, 10);
        opened->journal->ends(kept.next);
    }
}

}  // namespace
}  // namespace tessera
