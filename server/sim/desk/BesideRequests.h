/// Requests that take longer than a frame has time for: worked out beside the frames, one at a time.
#pragma once

#include <deque>
#include <functional>
#include <map>

#include "server/sim/desk/Answering.h"

namespace tessera {

/// Applications take turns. Of one that asks for much more than it is told the rest is refused. Frame thread only.
class BesideRequests {
public:
    explicit BesideRequests(const Answers& answers) : answers_(answers) {}

    /// Calls `begin` now or later, unless the application has gone by then; whoever has begun calls `done` once.
    /// `bytes`: of memory that the waiting takes.
    [[nodiscard]] ServerActions ask(const Asker& asker, std::size_t bytes, std::function<void()> begin);
    /// What was begun has been worked out.
    void done();
    void applicationLeft(ConnectionId connection) { waiting_.erase(connection); }

    static constexpr std::size_t kMostOfOne = 256, kMostBytesOfOne = std::size_t{4} << 20;

private:
    struct Waiting {
        std::size_t bytes = 0;
        std::function<void()> begin;
    };
    struct Queue {
        std::deque<Waiting> requests;
        std::size_t bytes = 0;
    };
    void goOn();

    const Answers answers_;
    std::map<ConnectionId, Queue> waiting_;  ///< none is empty
    ConnectionId last_;                      ///< who had the last turn
    bool busy_ = false;
};

}  // namespace tessera
