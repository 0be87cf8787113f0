/// Simulated time and chance. One seed, one history.
#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/Clock.h"

namespace tessera::simulation {

using namespace std::chrono_literals;

/// Something that must never happen, happened.
struct Violation : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// SplitMix64 (Steele, Lea, Flood 2014).
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
        return z ^ (z >> 31);
    }
    /// In [0, n); n > 0.
    std::uint64_t below(std::uint64_t n) { return next() % n; }
    bool chance(double probability) { return static_cast<double>(next() >> 11) * 0x1p-53 < probability; }
    Duration between(Duration low, Duration high) {
        return low + Duration(below(static_cast<std::uint64_t>((high - low).count()) + 1));
    }
    /// A generator of its own for a part of the simulation, so that one part's draws do not shift another's.
    Random fork() { return Random(next()); }

private:
    std::uint64_t state_;
};

/// Events in the order of their time; of those at one time, in the order they were planned.
class Timeline {
public:
    [[nodiscard]] TimePoint now() const { return now_; }
    void at(TimePoint when, std::function<void()> what) {
        events_.push({std::max(when, now_), ++planned_, std::move(what)});
    }
    void after(Duration delay, std::function<void()> what) { at(now_ + delay, std::move(what)); }
    /// Lets everything happen up to and including `end`.
    void runUntil(TimePoint end) {
        while (runNext(end)) {
        }
    }
    /// Lets the next thing happen. False: there is none before `end`, which it is now.
    bool runNext(TimePoint end) {
        if (events_.empty() || events_.top().when > end) {
            now_ = std::max(now_, end);
            return false;
        }
        eventsNow_ = events_.top().when == now_ ? eventsNow_ + 1 : 0;
        if (eventsNow_ > kMostAtOnce) throw Violation("time stands still: somebody asks for the clock again and again");
        now_ = events_.top().when;
        const std::function<void()> what = std::move(const_cast<Event&>(events_.top()).what);
        events_.pop();
        what();
        return true;
    }

private:
    static constexpr std::uint64_t kMostAtOnce = 20'000;

    struct Event {
        TimePoint when;
        std::uint64_t order = 0;
        std::function<void()> what;
        bool operator<(const Event& other) const {
            return when != other.when ? when > other.when : order > other.order;
        }
    };
    std::priority_queue<Event> events_;
    TimePoint now_{1'000s};
    std::uint64_t planned_ = 0, eventsNow_ = 0;
};

}  // namespace tessera::simulation
