/// Wakes a thread when another one has stayed away for too long.
#pragma once

#include <chrono>

namespace tessera {

/// One waits, the other says when it goes and when it is back. That costs a system call each and wakes nobody, unless
/// the time is over.
class AbsenceTimer {
public:
    /// Throws std::system_error where there is no descriptor left.
    AbsenceTimer();
    ~AbsenceTimer();
    AbsenceTimer(const AbsenceTimer&) = delete;
    AbsenceTimer& operator=(const AbsenceTimer&) = delete;

    /// `wait` returns when `allowed` is over.
    void left(std::chrono::nanoseconds allowed) { set(allowed); }
    void back() { set(std::chrono::nanoseconds(0)); }
    /// May return early: whoever waited looks whether the other is away.
    void wait();

private:
    void set(std::chrono::nanoseconds after);

    int fd_;
};

}  // namespace tessera
