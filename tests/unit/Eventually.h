/// Waiting for what another process, thread or file does.
#pragma once

#include <algorithm>
#include <chrono>
#include <random>
#include <thread>

namespace tessera::test {

/// Asks `holds()` again and again until it says yes, and for `patience` at most. Returns whether it said yes.
///
/// Asks once even without patience. Pauses for as long as an answer took, so that a costly question leaves the machine
/// to the one it asks about.
template <typename Holds>
[[nodiscard]] bool eventually(Holds&& holds, std::chrono::nanoseconds patience = std::chrono::seconds(60)) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begun = Clock::now();
    for (Clock::time_point asked = begun; !holds(); asked = Clock::now()) {
        const Clock::time_point answered = Clock::now();
        if (answered - begun >= patience) return false;
        // Other processes, threads and files tell nobody when they have got there.
        std::this_thread::sleep_for(std::max<Clock::duration>(std::chrono::milliseconds(5), answered - asked));
    }
    return true;
}

/// Lets a drawn time pass, `most` at most, so that threads and processes meet at other instants each time.
template <typename Random>
void aMoment(Random& random, std::chrono::nanoseconds most) {
    std::uniform_int_distribution<std::chrono::nanoseconds::rep> upTo(0, most.count());
    // A hunt for races has no event to wait for: the instant is what it draws.
    std::this_thread::sleep_for(std::chrono::nanoseconds(upTo(random)));
}

}  // namespace tessera::test
