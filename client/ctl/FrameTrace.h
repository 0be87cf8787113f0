/// Frames of a wall as trace events, as Perfetto and chrome://tracing open them ("Trace Event Format").
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/ctl/Answer.h"
#include "common/base/Clock.h"
#include "common/request/StatusRequests.h"

namespace tessera {

/// Joins what a server tells of frames by their numbers. Times are the caller's: when the news came.
class FrameTrace {
public:
    /// `begin`: time 0 of the trace.
    FrameTrace(std::string wall, TimePoint begin) : wall_(std::move(wall)), begin_(begin) {}

    /// A frame has been made (notice::Poses).
    void made(FrameNumber frame, TimePoint now);
    /// It has been shown by those, and not by others. One that was made before the trace began does not count.
    void shown(const notice::Frame& frame, TimePoint now);
    void status(const answer::Status& status, TimePoint now);
    void states(const notice::States& states, TimePoint now);

    [[nodiscard]] std::size_t frames() const { return frames_; }
    [[nodiscard]] std::size_t hosts() const { return hosts_.size(); }
    [[nodiscard]] double seconds() const;
    /// The whole file.
    [[nodiscard]] std::string text() const;

private:
    using Json = nlohmann::ordered_json;
    [[nodiscard]] double microseconds(TimePoint time) const;
    [[nodiscard]] int trackOf(const std::string& host);
    void slice(int process, const std::string& name, TimePoint from, TimePoint to, Json arguments);

    std::string wall_;
    TimePoint begin_, end_{};
    std::map<std::uint64_t, TimePoint> open_;  ///< made, and not shown yet
    std::map<std::string, int> hosts_;         ///< their processes
    std::map<std::string, std::string> states_;
    std::size_t frames_ = 0;
    std::vector<std::string> events_;  ///< each a line
};

}  // namespace tessera
