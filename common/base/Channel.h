/// The only way threads talk: a bounded queue of values.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

namespace tessera {

/// Bounded queue between threads. Any number of producers and consumers. Closing wakes everybody; what is queued can
/// still be taken.
template <typename T>
class Channel {
public:
    explicit Channel(std::size_t capacity) : capacity_(capacity) {}

    /// Waits for room. False when the channel is closed: the value is dropped.
    bool push(T value) {
        std::unique_lock lock(mutex_);
        room_.wait(lock, [&] { return closed_ || queue_.size() < capacity_; });
        return put(std::move(value));
    }
    /// False at once when full or closed.
    bool tryPush(T value) {
        const std::scoped_lock lock(mutex_);
        return queue_.size() < capacity_ && put(std::move(value));
    }
    /// Waits for a value. Nothing when closed and empty.
    std::optional<T> pop() {
        std::unique_lock lock(mutex_);
        filled_.wait(lock, [&] { return closed_ || !queue_.empty(); });
        return take();
    }
    /// Nothing when no value came within `timeout`, or closed and empty.
    std::optional<T> popFor(std::chrono::nanoseconds timeout) {
        std::unique_lock lock(mutex_);
        filled_.wait_for(lock, timeout, [&] { return closed_ || !queue_.empty(); });
        return take();
    }
    std::optional<T> tryPop() {
        const std::scoped_lock lock(mutex_);
        return take();
    }
    void close() {
        const std::scoped_lock lock(mutex_);
        closed_ = true;
        room_.notify_all();
        filled_.notify_all();
    }
    [[nodiscard]] bool empty() const {
        const std::scoped_lock lock(mutex_);
        return queue_.empty();
    }
    [[nodiscard]] bool closed() const {
        const std::scoped_lock lock(mutex_);
        return closed_;
    }

private:
    bool put(T value) {
        if (closed_) return false;
        queue_.push_back(std::move(value));
        filled_.notify_one();
        return true;
    }
    std::optional<T> take() {
        if (queue_.empty()) return std::nullopt;
        std::optional<T> value(std::move(queue_.front()));
        queue_.pop_front();
        room_.notify_one();
        return value;
    }

    mutable std::mutex mutex_;
    std::condition_variable room_;
    std::condition_variable filled_;
    std::deque<T> queue_;
    std::size_t capacity_;
    bool closed_ = false;
};

}  // namespace tessera
