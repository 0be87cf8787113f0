#include "server/sim/recording/RecordingReplay.h"

#include <chrono>

#include <fmt/format.h>

#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

/// One replay under way: the scene so far, and the inputs that wait for their outcome.
class Replay {
public:
    Replay(const record::Opening& opening, const ReplayOptions& options)
        : options_(options), simulation_({.scene = opening.limits, .threads = options.threads}) {}

    void take(record::StartList list) { startLists_.push_back(std::move(list.list)); }

    void take(const record::Started& started) {
        const Expected<CommittedFrame> loaded = load();
        if (!loaded) return differs({}, {loaded.error().message});
        std::vector<std::string> what;
        if (loaded->sent->sequence != started.sequence)
            what.push_back(
                fmt::format("sequence: recorded {}, now {}", started.sequence.value, loaded->sent->sequence.value));
        if (loaded->sent->stateHash != started.stateHash)
            what.push_back(fmt::format("state hash: recorded {}, now {}", toHex(started.stateHash),
                                       toHex(loaded->sent->stateHash)));
        if (!what.empty()) differs({}, std::move(what));
    }

    /// Makes the frame at once: where the recording server ended in it, so may we.
    void take(record::Inputs inputs) {
        using Clock = std::chrono::steady_clock;
        const Clock::time_point begin = Clock::now();
        const FrameResult frame = simulation_.step(inputs.first, std::move(inputs.edits), inputs.replies);
        result.frameMs.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
        digest_ = digestOf(frame);
        result.unfinishedFrame = inputs.frame;
        if (options_.onFrame) options_.onFrame(inputs.frame, frame, simulation_.scene());
    }

    void take(const record::Outcome& outcome) {
        result.unfinishedFrame.reset();
        ++result.frames;
        if (std::vector<std::string> what = differences(outcome.digest, digest_); !what.empty()) {
            ++result.differingFrames;
            differs(outcome.frame, std::move(what));
        }
    }

    /// The recording's end, in order or not: a scene that was never said to be loaded is loaded all the same, for what
    /// that does.
    void take(const record::Closing&) { finish(ReplayResult::End::kClosed); }
    void take(const RecordingReader::CutOff&) { finish(ReplayResult::End::kCutOff); }

    [[nodiscard]] bool done() const { return done_ || result.frames >= options_.maxFrames; }

    ReplayResult result;

private:
    [[nodiscard]] Expected<CommittedFrame> load() { return simulation_.load(std::exchange(startLists_, {})); }

    void finish(ReplayResult::End end) {
        if (!startLists_.empty())
            if (const Expected<CommittedFrame> loaded = load(); loaded && end == ReplayResult::End::kClosed)
                differs({}, {"it was refused when it was recorded, and is taken now"});
        result.end = end;
        done_ = true;
    }

    void differs(std::optional<FrameNumber> frame, std::vector<std::string> what) {
        if (!result.firstDifference) result.firstDifference = {.frame = frame, .what = std::move(what)};
    }

    const ReplayOptions& options_;
    Simulation simulation_;
    std::vector<ChangeList> startLists_;
    FrameDigest digest_;
    bool done_ = false;
};

}  // namespace

ReplayResult replay(RecordingReader& recording, const ReplayOptions& options) {
    Replay replay(recording.opening(), options);
    replay.result.end = ReplayResult::End::kMaxFrames;
    while (!replay.done()) {
        Expected<RecordingReader::Item> item = recording.next();
        if (!item) {
            replay.result.end = ReplayResult::End::kDamaged;
            replay.result.error = item.error();
            break;
        }
        std::visit([&](auto&& what) { replay.take(std::move(what)); }, std::move(*item));
    }
    return std::move(replay.result);
}

}  // namespace tessera
