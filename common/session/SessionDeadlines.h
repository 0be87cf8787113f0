/// What happens because something else did not: silence, hosts that do not come into step, blobs that are not fetched.
#pragma once

#include "common/session/FrameRound.h"
#include "common/session/Grace.h"
#include "common/session/SessionRoster.h"

namespace tessera {

/// Heartbeats go out when they are due. All else waits while grace lasts (Grace): then who is silent is closed, a host
/// that is not in step in time starts over on a new connection, one that does not fetch announced blobs leaves the
/// barrier, and the frame round is asked.
///
/// Invariants: nothing is judged before its deadline, nor while grace lasts; `next` names the first. Pure; one owner.
class SessionDeadlines {
public:
    /// All outlive it.
    SessionDeadlines(SessionRoster& roster, Grace& grace, FrameRound& frames)
        : roster_(roster), grace_(grace), frames_(frames) {}

    void advance(TimePoint now);
    /// TimePoint{}: there is something to be said, or no time has come in yet.
    [[nodiscard]] TimePoint next() const;

private:
    void excuse(Duration standstill);
    void sendHeartbeats(TimePoint now);
    void closeEnded(TimePoint now);
    void closeSilent(TimePoint now);
    void closeUnsynced(TimePoint now);
    void leaveBlobsLate(TimePoint now);

    SessionRoster& roster_;
    Grace& grace_;
    FrameRound& frames_;
};

}  // namespace tessera
