/// Writes what goes into a simulation, and what comes out of it, to a file as it happens.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <unordered_set>

#include "common/base/LaneThreads.h"
#include "common/base/Log.h"
#include "server/sim/recording/RecordingFormat.h"

namespace tessera {

/// What this program is, with so many threads for collisions.
[[nodiscard]] record::Opening openingOfThisServer(unsigned threads);

/// The frame thread hands over and goes on; a lane of the writer's own writes, a record at a time, so that the file
/// has what happened up to the last moment when the server is killed. A recording is never worth a frame: when the disk
/// is full, or too slow (RecordingLimits::maxQueuedBytes), or the file too long, the recording ends with one line in
/// the log and the wall goes on; what has been written until then can be replayed.
///
/// Calls in this order, from one thread: startScene and started where a scene is loaded, then for each frame
/// frameBegins and frameDone.
class RecordingWriter {
public:
    /// Makes or overwrites the file. kFailed says why that cannot be.
    [[nodiscard]] static Expected<std::unique_ptr<RecordingWriter>> create(const std::string& path,
                                                                           const record::Opening& opening, Log& log,
                                                                           const RecordingLimits& limits = {},
                                                                           MakeLane lane = LaneThreads::make);
    /// Ends the recording in order and waits until it is written.
    ~RecordingWriter();
    RecordingWriter(const RecordingWriter&) = delete;
    RecordingWriter& operator=(const RecordingWriter&) = delete;

    /// Written before it returns: no frame waits yet, and a scene may be larger than what may be queued.
    void startScene(std::span<const ChangeList> lists);
    void started(const CommittedFrame& scene);
    /// What Simulation::step is about to be handed.
    void frameBegins(FrameNumber frame, bool first, std::span<const Edit> edits, std::span<const Reply> replies);
    void frameDone(FrameNumber frame, const FrameResult& result);

    /// False once the recording has ended before its time.
    [[nodiscard]] bool recording() const { return !ended_; }

private:
    RecordingWriter(std::string path, int file, Log& log, const RecordingLimits& limits, MakeLane lane);
    void hand(RecordContent content);
    void handArraysOf(const ChangeList& list);
    void write(const RecordContent& content);
    void end(const std::string& why);

    std::string path_;
    int file_;
    Log& log_;
    RecordingLimits limits_;
    std::unordered_set<BlobId> arrays_;  ///< handed over already
    std::uint64_t frames_ = 0;
    std::uint64_t number_ = 0;        ///< of the next record; the lane's once there is one
    std::uint64_t writtenBytes_ = 0;  ///< as number_
    std::atomic<std::uint64_t> queuedBytes_{0};
    std::atomic<bool> ended_{false};
    MakeLane makeLane_;
    std::unique_ptr<Lane> lane_;  ///< from the first frame on
};

}  // namespace tessera
