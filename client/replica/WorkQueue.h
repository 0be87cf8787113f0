/// The draw thread's work, and whether it has any in hand.
#pragma once

#include <atomic>
#include <optional>

#include "client/replica/Work.h"
#include "common/base/Channel.h"

namespace tessera {

/// A channel of work with one taker, who says when a piece is done. While all of it is, the one giver may use what the
/// taker works on: neither then needs to wait for the other, or to wake it.
class WorkQueue {
public:
    explicit WorkQueue(std::size_t capacity) : channel_(capacity) {}

    // The giver's.
    /// False at once when full or closed.
    bool tryPush(Work work) {
        open_.fetch_add(1, std::memory_order_relaxed);
        if (channel_.tryPush(std::move(work))) return true;
        open_.fetch_sub(1, std::memory_order_relaxed);
        return false;
    }
    void close() { channel_.close(); }
    /// All that was given is done, and seen by the caller: the taker waits for more.
    [[nodiscard]] bool idle() const { return open_.load(std::memory_order_acquire) == 0; }

    // The taker's.
    /// Nothing when closed and empty.
    std::optional<Work> pop() { return channel_.pop(); }
    /// Nothing, too, when there is none now.
    std::optional<Work> tryPop() { return channel_.tryPop(); }
    [[nodiscard]] bool closed() const { return channel_.closed(); }
    std::optional<Work> popFor(std::chrono::nanoseconds timeout) { return channel_.popFor(timeout); }
    /// While one is in hand: another one waits.
    [[nodiscard]] bool more() const { return open_.load(std::memory_order_relaxed) > 1; }
    /// What was popped last is done with.
    void done() { open_.fetch_sub(1, std::memory_order_release); }

private:
    Channel<Work> channel_;
    std::atomic<std::size_t> open_{0};
};

}  // namespace tessera
