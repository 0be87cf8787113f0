/// Frames of a wall as trace events, as Perfetto and chrome://tracing open them ("Trace Event Format").
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/ctl/Answer.h"
#include "common/base/Clock.h"
#include "common/request/StatusRequests.h"

namespace tessera {

/// Joins what a server tells of frames: all stands on the server's clock, with the first frame where its news came. A
/// host's work lies before the instant at which the server heard that it had drawn: what the network took afterwards
/// looks as if it had begun so much later. Its parts stand in the order in which hosts do them.
class FrameTrace {
public:
    /// `begin`: time 0 of the trace.
    FrameTrace(std::string wall, TimePoint begin) : wall_(std::move(wall)), begin_(begin) {}

    /// One that began before the trace did does not count.
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
    void work(const notice::HostWork& work, FrameNumber frame, TimePoint from, TimePoint to);

    std::string wall_;
    TimePoint begin_, end_{};
    std::optional<TimePoint> serversZero_;
    std::map<std::string, int> hosts_;  ///< their processes
    std::map<std::string, std::string> states_;
    std::size_t frames_ = 0;
    std::vector<std::string> events_;  ///< each a line
};

}  // namespace tessera
