/// Frames from Begin to Shown: who enters, who draws, when all may show it.
#pragma once

#include <optional>

#include "common/session/CatchUp.h"
#include "common/session/Grace.h"
#include "common/session/ReplicaRepairs.h"
#include "common/session/SessionRoster.h"

namespace tessera {

/// Hosts that are in step enter where a frame's list is just what their replica lacks; those in the barrier draw it,
/// all others who follow get its list. Then the barrier is asked, after each event, and what it says is carried out.
///
/// Invariants: frames come in order, each once (SwapBarrier); a host that lives and does not show what it was told to
/// is out until it does, and keeps its connection, for on a new one it would be let in, and hold the others up, again.
/// Pure; one owner.
class FrameRound {
public:
    /// All outlive it.
    FrameRound(SessionRoster& roster, CatchUp& catchUp, ReplicaRepairs& repairs, const Grace& grace)
        : roster_(roster), catchUp_(catchUp), repairs_(repairs), grace_(grace) {}

    /// The session has begun, once: hosts are waited for from then on.
    void started(TimePoint now) { startedAt_ = startedAt_.value_or(now); }
    [[nodiscard]] bool hasStarted() const { return startedAt_.has_value(); }
    /// Until when the first frame waits for hosts; none: it does not, or not yet.
    [[nodiscard]] std::optional<TimePoint> startDeadline() const;

    [[nodiscard]] bool mayBegin(TimePoint now) const;
    void begin(const message::Begin& begin, TimePoint now);
    /// Fails where it was not told to draw this one.
    [[nodiscard]] Expected<void> ready(SessionPeer& peer, const message::Ready& message, TimePoint now);
    /// Fails where this one was not released to it.
    [[nodiscard]] Expected<void> shown(const SessionPeer& peer, const message::Shown& message, TimePoint now);

    /// Polls the barrier and carries out what it says. Deadlines are judged by what is known (Grace), not by `now`
    /// alone: the Ready of a host may lie unread in the caller's queue.
    void settle(TimePoint now);

private:
    void enterSynced(const message::Begin& begin, TimePoint now);
    void released(SwapBarrier::Outcome& outcome, TimePoint now);
    void leaveUnshown(SessionHost& host, TimePoint now);

    SessionRoster& roster_;
    CatchUp& catchUp_;
    ReplicaRepairs& repairs_;
    const Grace& grace_;
    std::optional<TimePoint> startedAt_;
};

}  // namespace tessera
