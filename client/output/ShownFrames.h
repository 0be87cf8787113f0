/// The pictures of one output's tiles, all of one frame: never a left eye of frame n beside a right one of n - 1.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "common/image/SharedFrame.h"

namespace tessera {

/// Follows one `shown.frame`, or two, each written by whoever and whenever. One thread.
class ShownFrames {
public:
    /// Errors as of SharedFrameReader::open: of the first file that cannot be opened.
    [[nodiscard]] static Expected<ShownFrames> open(const std::vector<std::string>& paths);

    /// Waits for pictures of another frame than those given last (of one file: for another picture), all of one frame;
    /// nothing when there are none within the time. They are good until the next call.
    [[nodiscard]] const std::vector<SharedFrameReader::Frame>* next(std::chrono::milliseconds atMost);
    /// Those shown now, whether they were given before or not; nothing while files show different frames.
    [[nodiscard]] const std::vector<SharedFrameReader::Frame>* again();
    /// Another writer's file has one of the names now: all are to be opened anew.
    [[nodiscard]] bool replaced() const;

private:
    ShownFrames() = default;
    [[nodiscard]] bool readAll();

    std::vector<SharedFrameReader> readers_;
    std::vector<SharedFrameReader::Frame> frames_;
    std::uint64_t lastTimes_ = 0;              ///< of one file
    std::optional<std::uint64_t> lastNumber_;  ///< of two
};

}  // namespace tessera
