/// Work beside the frames: one piece after the other, on no thread of the caller's.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "common/base/Clock.h"

namespace tessera {

/// Pieces begin in the order in which they were posted. Members may be called from any thread, and from within a piece.
class Lane {
public:
    using Piece = std::function<void()>;

    Lane() = default;
    Lane(const Lane&) = delete;
    Lane& operator=(const Lane&) = delete;
    /// Waits for the pieces under way. Those that wait are not begun.
    virtual ~Lane() = default;

    virtual void post(Piece piece) = 0;
    /// Not before `due`. In the order of their times, where they wait for these alone.
    virtual void postAt(TimePoint due, Piece piece) = 0;
    /// Begins all that was posted and waits for it, but for pieces with a time that has not come: these are dropped.
    /// Nothing is taken any more.
    virtual void finish() = 0;
};

struct LaneOptions {
    int nice = 0;           ///< of its threads (Linux); where that is forbidden they run as others do
    std::size_t width = 1;  ///< so many pieces at once
};
/// On threads of their own (LaneThreads.h), or in a simulated wall.
using MakeLane = std::function<std::unique_ptr<Lane>(const LaneOptions&)>;

}  // namespace tessera
