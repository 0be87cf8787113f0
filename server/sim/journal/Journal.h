/// A server's journal: what is in it survives the server.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/LaneThreads.h"
#include "common/base/Log.h"
#include "common/base/TimeSource.h"
#include "server/sim/journal/JournalFolder.h"
#include "server/sim/journal/JournalState.h"

namespace tessera {

class ContactDisplay;

struct JournalOptions {
    std::string folder;
    std::vector<std::string> scenes;  ///< what --scene says
    std::string placing;              ///< options that say how they stand ("--up z"); empty: none
    JournalLimits limits;
    std::shared_ptr<FileSystem> calls = std::make_shared<FileSystem>();
    MakeLane lane = LaneThreads::make;
    const TimeSource* time = &machineTime();
};

/// The frame thread hands over and never waits; a lane of the journal's own writes a record at a time, so that what is
/// written survives a killed server, and sees to it that the disk has it every JournalLimits::syncEvery. Once the logs
/// are long enough, another lane reads them and makes a snapshot of them; the frame thread's scene is not asked.
///
/// **What fails.** Where a record cannot be written (a full disk), it is tried again until it can; meanwhile records
/// wait in memory. `trouble` says so. Where too much waits, or a sync fails, whatever was to be synced, the journal has
/// *ended*: nothing more is written, and what is written until then can be gone on from.
///
/// All members are for the frame thread, but for the callback.
class Journal {
public:
    struct Opened {
        std::unique_ptr<Journal> journal;
        JournalState state;  ///< to go on from; `begun` is false where there is none
        /// New objects have ids from here on, and the next list follows this one: nobody has seen those that come.
        std::uint64_t nextId = 0;
        Sequence behind;
    };
    /// Reads what the folder has, cuts off what a killed server has not finished (it is kept in a file beside), and
    /// begins a new log. Arrays are in
    /// `arrays` for as long as somebody holds them. `onProgress`: called on the journal's lane once what `tellWhen`
    /// asks for is so. Refused: another server has it; another --scene; damage.
    [[nodiscard]] static Expected<Opened> open(JournalOptions options, BlobStore& arrays, Log& log,
                                               std::function<void()> onProgress);
    /// Writes what is left, for at most about a second where the disk does not take it.
    ~Journal();
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// To begin with: higher than that of every server that had the folder before, whatever the clock says.
    [[nodiscard]] Epoch epoch() const { return epoch_; }
    [[nodiscard]] const std::string& folder() const { return folder_.path(); }

    /// The scene before the first frame.
    void started(const CommittedFrame& scene);
    /// Each frame once, in order, before it is shown.
    void frameDone(FrameNumber frame, const FrameResult& result, const ContactDisplay& display);
    /// Whether there was anything to hand over.
    bool viewIs(const ViewSource& view);
    /// This server's epoch is this one from now on.
    void epochRaised(Epoch epoch);
    /// The last frame has been made: the next server goes on with this one.
    void ends(FrameNumber next);

    /// Records handed over and written, counted from 1.
    [[nodiscard]] std::uint64_t handed() const { return handed_; }
    [[nodiscard]] std::uint64_t written() const { return written_; }
    /// Asks to be told once so much is written, or cannot be; it may be so already.
    void tellWhen(std::uint64_t written);
    /// Why nothing is written at present, for a person; nothing where all is well.
    [[nodiscard]] std::optional<Error> trouble() const;
    [[nodiscard]] std::uint64_t writtenBytes() const { return writtenBytes_; }

private:
    struct Item {
        std::variant<journal::Frame, journal::View, journal::Frames, journal::Numbers, journal::Raised> what;
        std::uint64_t bytes = 0;  ///< that it keeps in memory
    };

    Journal(JournalOptions options, JournalFolder folder, Log& log, std::function<void()> onProgress);
    void hand(Item item);
    /// Takes more numbers, long before those that are taken have been given.
    void takeNumbers(const CommittedFrame& frame);

    // The writing lane's.
    void take(std::shared_ptr<const Item> item);
    void writeLeft();
    /// False: it cannot be now, and is tried again.
    [[nodiscard]] bool write(const Item& item);
    /// An errno; 0 once all of it is in the file; -1: an array is not here.
    [[nodiscard]] int append(const Item& item);
    void syncIfDue();
    void sync();
    void endWhereASyncFailed();
    void failed(int error);
    void end(const std::string& why, std::string_view whatIsLeft = "what is written can be gone on from");
    void endWhereItWasTakenAway();
    void lookAround();
    void writeAtTheEnd();
    void tell();
    [[nodiscard]] journal::Opening openingOf(std::uint64_t number, const journal::LogBefore& before) const;
    void rotateIfLong();
    void compact();

    JournalLimits limits_;
    std::vector<std::string> scenes_;
    JournalFolder folder_;
    Log& log_;
    std::function<void()> onProgress_;
    Epoch epoch_;

    // The frame thread's.
    std::uint64_t handed_ = 0;
    FrameNumber framesTaken_;  ///< those before it are taken already
    journal::Numbers taken_;
    std::uint64_t displayVersion_ = 0, viewVersion_ = 0;

    // Between the two.
    std::atomic<std::uint64_t> queued_{0}, queuedBytes_{0}, written_{0}, writtenBytes_{0};
    std::atomic<std::uint64_t> tellAt_{0};  ///< 0: nobody asked
    std::atomic<int> error_{0};             ///< errno of the write that is tried again
    std::atomic<bool> ended_{false};
    std::atomic<bool> whyIsKnown_{false};
    std::string whyEnded_;  ///< written once, by who ended it, before `whyIsKnown_`
    std::atomic<bool> closing_{false};

    // The writing lane's.
    std::deque<std::shared_ptr<const Item>> left_;  ///< to be written
    bool appended_ = false;                         ///< the first of them is in the log, and not in `last`
    bool retries_ = false;                          ///< at a time that has not come
    JournalFile file_;
    JournalArrays arrays_;
    Epoch writtenEpoch_;  ///< the newest in the log
    std::uint64_t logNumber_ = 0, logsSinceSnapshot_ = 0;
    std::uint64_t syncedBytes_ = 0;   ///< of the open log
    std::uint64_t earlierBytes_ = 0;  ///< of the logs since the snapshot, but the open one
    Sequence sequence_;
    StateHash stateHash_;
    bool unsynced_ = false, saidThatItGrows_ = false;
    TimePoint unsyncedSince_{}, rotateAgainAt_{};

    // The snapshots' lane's.
    std::atomic<bool> compacting_{false};
    std::atomic<std::uint64_t> snapshotBytes_{0};

    const TimeSource& time_;
    std::unique_ptr<Lane> compactor_, lane_;  ///< last: they work with what stands above
};

}  // namespace tessera
