/// Makes the frames of a recording again and compares what comes out.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "server/sim/recording/RecordingReader.h"

namespace tessera {

struct ReplayOptions {
    unsigned threads = 1;  ///< of the collision pipeline; results do not depend on it
    std::uint64_t maxFrames = std::numeric_limits<std::uint64_t>::max();
    /// Called after each frame with the scene as it then is; may be empty.
    std::function<void(FrameNumber frame, const FrameResult&, const Aspect&)> onFrame;
};

struct ReplayResult {
    /// How the replay came to its end.
    enum class End : std::uint8_t {
        kClosed,     ///< the recording's end
        kCutOff,     ///< the file's end, before the recording's: the server was killed, or records still
        kMaxFrames,  ///< ReplayOptions::maxFrames
        kDamaged,    ///< `error`: the file is damaged or not what a server writes
    };
    End end = End::kClosed;
    Error error;
    std::uint64_t frames = 0;           ///< made again and compared
    std::uint64_t differingFrames = 0;  ///< of those
    std::vector<double> frameMs;        ///< of each: the whole step
    /// Set too where the start scene differs.
    struct Difference {
        std::optional<FrameNumber> frame;  ///< none: the start scene
        std::vector<std::string> what;
    };
    std::optional<Difference> firstDifference;
    /// A frame whose inputs are there and whose outcome is not: it was made again, without anything to compare.
    std::optional<FrameNumber> unfinishedFrame;
};

/// Whatever the file says, this returns; it takes as long as its frames take.
[[nodiscard]] ReplayResult replay(RecordingReader& recording, const ReplayOptions& options = {});

}  // namespace tessera
