/// Handshakes of a door: one after the other on its thread, with all else that is ready in between.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <utility>

#include "common/net/HandshakeTurns.h"

namespace tessera {

/// Bounded by the door's connections: each has one step at most that waits. The door's thread alone.
class DoorHandshakes {
public:
    explicit DoorHandshakes(boost::asio::io_context& io) : io_(io) {}

    /// `work` takes up to a millisecond.
    void push(SourceAddress from, bool goesOn, HandshakeTurns::Work work) {
        turns_.push(from, goesOn, std::move(work));
        if (!std::exchange(running_, true)) boost::asio::post(io_, [this] { next(); });
    }

private:
    void next() {
        const std::optional<HandshakeTurns::Work> work = turns_.tryPop();
        running_ = work.has_value();
        if (!work) return;
        boost::asio::post(io_, [this] { next(); });  // first: whatever becomes of this one
        (*work)();
    }

    boost::asio::io_context& io_;
    HandshakeTurns turns_;
    bool running_ = false;
};

}  // namespace tessera
