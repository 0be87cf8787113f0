#include "common/base/LaneThreads.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "common/base/StartThread.h"

namespace tessera {

LaneThreads::LaneThreads(const LaneOptions& options) {
    const auto serve = [this, nice = options.nice] {
        if (nice != 0) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
        run();
    };
    threads_.emplace_back(serve);
    // Where the machine has no room for all of them those that there are do the work.
    for (std::size_t i = 1; i < options.width; ++i) {
        std::thread another = startThread(serve);
        if (!another.joinable()) return;
        threads_.push_back(std::move(another));
    }
}

LaneThreads::~LaneThreads() {
    end(Ending::kNow);
}

void LaneThreads::finish() {
    end(Ending::kWhenDone);
}

void LaneThreads::post(Piece piece) {
    const std::scoped_lock lock(mutex_);
    if (ending_ != Ending::kNot) return;
    pieces_.push_back(std::move(piece));
    news_.notify_one();
}

void LaneThreads::postAt(TimePoint due, Piece piece) {
    const std::scoped_lock lock(mutex_);
    if (ending_ != Ending::kNot) return;
    later_.emplace(due, std::move(piece));
    news_.notify_one();
}

void LaneThreads::end(Ending how) {
    {
        const std::scoped_lock lock(mutex_);
        ending_ = std::max(ending_, how);
        news_.notify_all();
    }
    for (std::thread& thread : threads_)
        if (thread.joinable()) thread.join();
    // Pieces that go may post others, which comes to nothing.
    std::deque<Piece> pieces;
    std::multimap<TimePoint, Piece> later;
    const std::scoped_lock lock(mutex_);
    pieces.swap(pieces_);
    later.swap(later_);
}

LaneThreads::Piece LaneThreads::take(TimePoint& waitUntil) {
    const TimePoint now = clockNow();
    while (!later_.empty() && later_.begin()->first <= now)
        pieces_.push_back(std::move(later_.extract(later_.begin()).mapped()));
    waitUntil = later_.empty() ? TimePoint::max() : later_.begin()->first;
    if (pieces_.empty() || ending_ == Ending::kNow) return {};
    Piece piece = std::move(pieces_.front());
    pieces_.pop_front();
    return piece;
}

void LaneThreads::run() {
    std::unique_lock lock(mutex_);
    for (;;) {
        TimePoint until;
        if (Piece piece = take(until)) {
            lock.unlock();
            piece();
            piece = nullptr;  // what it holds is let go of here
            lock.lock();
        } else if (ending_ != Ending::kNot) {
            return;
        } else if (until == TimePoint::max()) {
            news_.wait(lock);
        } else {
            news_.wait_until(lock, until);
        }
    }
}

}  // namespace tessera
