/// How a wall does: the figures of `top`, from what a server tells within some time.
#pragma once

#include <map>
#include <string>

#include "client/ctl/Answer.h"
#include "common/base/Clock.h"
#include "common/request/StatusRequests.h"

namespace tessera {

/// Counts from one `take` to the next. Times are the caller's.
class WallFigures {
public:
    explicit WallFigures(TimePoint now) : since_(now) {}

    /// As each frame is told.
    void frame(const notice::Frame& frame, TimePoint now);
    /// What has come since, beside how the wall is now: for people and for programs.
    [[nodiscard]] Answer take(const answer::Status& status, TimePoint now);

private:
    struct Shown {
        std::uint64_t shown = 0, held = 0;  ///< frames
        std::uint64_t drawn = 0;            ///< of which the server told what they took
        double drawMs = 0, longestMs = 0;   ///< to choose and to draw, all tiles
    };
    TimePoint since_;
    std::optional<TimePoint> lastFrame_;
    std::uint64_t frames_ = 0;
    Duration longest_{};  ///< between two frames
    std::map<std::string, Shown> hosts_;
};

}  // namespace tessera
