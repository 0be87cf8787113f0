/// Those who want to see what the wall shows: one question to all hosts, one answer of all tiles.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/wall/Wall.h"
#include "server/sim/desk/Answering.h"

namespace tessera {

/// A host that is not there, or does not send its tiles by the deadline, is named in the answer as missing. The
/// deadline counts from when no host is at work on the frame any more: frames may take seconds. Nobody is kept for
/// longer than kLongest. Frame thread only.
class ImageRequests {
public:
    static constexpr std::chrono::milliseconds kLongest{60'000}, kLook{200};  ///< whether hosts are at work: so often

    ImageRequests(const Wall& wall, ServerSession& session, std::chrono::milliseconds deadline)
        : wall_(wall), session_(session), deadline_(deadline) {}

    /// Asks for the next frame to begin: on each host's control connection the question comes before that frame's
    /// Begin.
    [[nodiscard]] ServerActions ask(const Asker& asker, TimePoint now);
    [[nodiscard]] ServerActions imageReceived(const server_action::ImageReceived& image);
    [[nodiscard]] ServerActions advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    void applicationLeft(ConnectionId connection);
    /// Of one application.
    [[nodiscard]] std::size_t openCount(ConnectionId connection) const;

private:
    struct Open {
        Asker asker;
        TimePoint deadline, latest;
        FrameNumber frame;  ///< that was asked for
        struct Awaited {
            std::string tile, host;
        };
        std::vector<Awaited> awaited;
        answer::Images answer;
    };
    using Opens = std::map<std::uint64_t, Open>;  ///< by the number that hosts are asked with

    [[nodiscard]] ServerActions finish(Opens::iterator open);
    /// Whether a host that has not shown the frame yet draws it, or one before it.
    [[nodiscard]] bool isAtWork(const Open& open) const;

    const Wall& wall_;
    ServerSession& session_;
    std::chrono::milliseconds deadline_;
    std::uint64_t next_ = 1;
    Opens open_;
};

}  // namespace tessera
