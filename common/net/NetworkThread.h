/// Whose turn it is to be the network thread of a TcpTransport. For its own files alone.
#pragma once

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <thread>

#include "common/base/Clock.h"
#include "common/base/Turn.h"
#include "common/net/AbsenceTimer.h"

namespace tessera {

/// A thread inside, and a caller who does its work while it waits for it (`attend`). Whoever holds the turn is the
/// network thread: all handlers of `io` run on it.
class NetworkThread {
public:
    NetworkThread() : work_(io_.get_executor()) {}

    [[nodiscard]] boost::asio::io_context& io() { return io_; }
    /// `first` is called on the thread inside before anything else. May be empty.
    void start(std::function<void()> first);
    /// Once `io` is stopped, which is to follow by itself. Nobody attends.
    void join();
    [[nodiscard]] bool joinable() const { return thread_.joinable(); }

    /// See Transport.
    [[nodiscard]] bool attend(TimePoint until);
    void wake();
    /// An event has been given to the caller: it need not attend any longer.
    void delivered() { delivered_ = true; }

    /// What does `f` on the network thread, after all that was posted before. From any thread.
    template <typename F>
    void post(F f) {
        ++posted_;
        boost::asio::post(io_, [this, f = std::move(f)]() mutable {
            f();
            --posted_;
        });
    }
    /// Does `f` here when it is nobody's turn, so that nobody needs to be woken for it; false: nothing was done. Not
    /// past what was posted before. From any thread.
    template <typename F>
    [[nodiscard]] bool tryHere(F f) {
        if (turn_.mine()) return false;
        const Turn::Hold hold = turn_.tryTake();
        if (!hold || posted_ != 0) return false;
        f();
        return true;
    }

    /// Much is received: work for a thread of its own. Whether that was so already.
    bool seeLarge() { return isRecent(lastLarge_.exchange(now().time_since_epoch())); }
    /// Much is to be sent: the thread inside does it, and is woken for the first of many.
    void sendLarge() {
        if (!seeLarge()) absence_.left(kAtOnce);
    }

private:
    static constexpr Duration kAtOnce = std::chrono::nanoseconds(1);

    static TimePoint now() { return std::chrono::steady_clock::now(); }
    static bool isRecent(Duration large);
    [[nodiscard]] bool busy() const { return isRecent(lastLarge_); }
    void runInside();
    void runHere(TimePoint until);
    void glance();
    void wakeAt(TimePoint until);

    boost::asio::io_context io_{1};
    boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
    Turn turn_;
    std::atomic<bool> wanted_{false};  ///< somebody wants to attend
    std::atomic<bool> closing_{false};
    std::atomic<bool> delivered_{false}, woken_{false};
    std::atomic<std::size_t> posted_{0};                 ///< and not yet done
    std::atomic<Duration> lastLarge_{Duration::zero()};  ///< on the clock; zero: never
    TimePoint attendantLeft_{};                          ///< with the turn
    AbsenceTimer absence_;
    boost::asio::steady_timer alarm_{io_};
    TimePoint alarmAt_ = TimePoint::max();  ///< with the turn
    std::thread thread_;
};

}  // namespace tessera
