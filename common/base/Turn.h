/// Work that several threads may do, one at a time.
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

namespace tessera {

/// Whoever holds the turn owns what goes with it, and sees all that was done with it before. Not for waiting: a thread
/// that holds it for long must hear that another one wants it.
class Turn {
public:
    /// To the end of its life, if it is true.
    class Hold {
    public:
        explicit Hold(Turn& turn) : turn_(turn), lock_(turn.mutex_) { turn_.holder_ = std::this_thread::get_id(); }
        Hold(Turn& turn, std::try_to_lock_t now) : turn_(turn), lock_(turn.mutex_, now) {
            if (lock_) turn_.holder_ = std::this_thread::get_id();
        }
        ~Hold() {
            if (lock_) turn_.holder_ = std::thread::id();
        }
        Hold(const Hold&) = delete;
        Hold& operator=(const Hold&) = delete;
        explicit operator bool() const { return lock_.owns_lock(); }

    private:
        Turn& turn_;
        std::unique_lock<std::mutex> lock_;
    };

    /// Waits for it.
    [[nodiscard]] Hold take() { return Hold(*this); }
    /// Never waits: false when another one holds it. Not for who holds it already.
    [[nodiscard]] Hold tryTake() { return Hold(*this, std::try_to_lock); }
    [[nodiscard]] bool mine() const { return holder_.load() == std::this_thread::get_id(); }

private:
    std::mutex mutex_;
    std::atomic<std::thread::id> holder_;
};

}  // namespace tessera
