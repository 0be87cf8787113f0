/// What takes long, beside the door's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>

#include <utility>

#include "server/door/DoorWire.h"

namespace tessera {

/// One piece of work behind the other, on a thread that stands behind the frames. The door's thread alone calls it.
class Beside {
public:
    explicit Beside(boost::asio::io_context& io) : io_(io) { boost::asio::post(thread_, standBehindFrames); }
    /// Calls `work()` there, and then `then(what it returned)` on the door's thread. Handles that `work` holds may end
    /// there, those of `then` end on the door's.
    template <typename Work, typename Then>
    void run(Work work, Then then) {
        boost::asio::post(thread_, [&io = io_, work = std::move(work), then = std::move(then)]() mutable {
            boost::asio::post(io, [made = work(), then = std::move(then)]() mutable { then(std::move(made)); });
        });
    }
    /// Waits for the piece that is under way, and forgets those behind it. Nothing may come after it.
    void finish() {
        thread_.stop();
        thread_.join();
    }

private:
    boost::asio::io_context& io_;
    boost::asio::thread_pool thread_{1};
};

}  // namespace tessera
