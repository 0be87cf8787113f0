/// Handshakes (TLS) that wait for a processor.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "common/base/FairQueue.h"
#include "common/base/SourceAddress.h"

namespace tessera {

/// Addresses take turns, so that none keeps another one waiting: among those that go on, and among those that begin.
/// These two take turns as well: who has answered does not wait behind all that begin. Bounded by who pushes. Any
/// number of threads push, one pops.
class HandshakeTurns {
public:
    using Work = std::function<void()>;

    void push(SourceAddress from, bool goesOn, Work work) {
        // The highest bit tells no two addresses apart that are anybody's.
        const std::uint64_t source = 2 * from.value + (goesOn ? 1 : 0);
        if (goesOn) queue_.setRank(source, Queue::Rank::kFirst);
        queue_.push(source, std::move(work));
        queue_.forget(source);  // once it is empty
    }
    [[nodiscard]] std::optional<Work> tryPop() {
        goesOn_ = !goesOn_;
        for (const bool goesOn : {goesOn_, !goesOn_})
            if (auto next = queue_.tryPop(goesOn ? Queue::Rank::kFirst : Queue::Rank::kOther))
                return std::move(next->second);
        return std::nullopt;
    }
    /// Returns once something has been pushed since it last returned, or `close` was called.
    void waitForNews() { queue_.waitForNews(std::chrono::hours(1)); }
    /// What is pushed from now on is dropped.
    void close() { queue_.close(); }

private:
    using Queue = FairQueue<Work>;
    Queue queue_;
    bool goesOn_ = false;  ///< whose turn it was; who pops
};

}  // namespace tessera
