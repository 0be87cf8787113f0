/// What a thread asks of the kernel's scheduler.
#pragma once

#include <string>

namespace tessera {

/// Who shows pictures comes before who draws them, and who says that all are to be shown before those whom it wakes
/// with that.
enum class Urgency : int {
    kShowing = 1,  ///< priorities of SCHED_RR
    kReleasing = 2,
};

/// What the system did with what a thread asked for.
struct PriorityAnswer {
    bool realTime = false;
    std::string got;      ///< for a person: "SCHED_RR 1", "nice -10", "a short time slice"; empty: nothing
    std::string refused;  ///< "SCHED_RR 1: Operation not permitted; …"; empty: it got what it asked for first
};

/// For threads that sleep mostly and do little when they are woken. The calling thread asks to run as soon as it is
/// woken, whatever the processors are at: SCHED_RR; else a nice value of -10; else the shortest time slice that Linux
/// gives (6.12 and later), with which it is let in before those that compute. And for every processor that this process
/// may use, wherever the rest of it is bound to. What it starts, threads and processes, is as ordinary as before.
[[nodiscard]] PriorityAnswer askToRunAhead(Urgency urgency);

/// The calling thread is ahead of others as long as this lives, where the system allows it without being asked twice:
/// for a thread that computes much and has something urgent to say now and then. A microsecond each time; where it is
/// refused, nothing.
class AheadForNow {
public:
    AheadForNow();
    ~AheadForNow();
    /// What the system says to that; empty: nothing is refused.
    [[nodiscard]] static std::string refusal();
    AheadForNow(const AheadForNow&) = delete;
    AheadForNow& operator=(const AheadForNow&) = delete;

private:
    int before_ = -1;  ///< policy; none: it is not ahead
};

}  // namespace tessera
