#include "common/session/ReplicaRepairs.h"

#include <fmt/format.h>

#include <utility>

namespace tessera {

bool ReplicaRepairs::differs(SessionPeer& peer, SessionHost& host, Sequence at, StateHash expected, StateHash actual,
                             TimePoint now) {
    const FrameNumber frame = host.everBegun ? host.frame : roster_.currentFrame();
    std::string differs = fmt::format("its replica differs at list {}", at.value);
    // Its picture of this frame may be wrong: the others go on, it keeps the image it has.
    if (roster_.barrier.open() && roster_.barrier.contains(host.name) && host.frame == roster_.currentFrame())
        heldBack_.push_back(host.name);
    if (tooOften(host.name, now)) {
        differs += fmt::format(", as {} times within {:.0f} s; it is sent away", times_[host.name].size(),
                               std::chrono::duration<double>(roster_.config.mismatchesWithin).count());
        roster_.lose(host, FaultKind::kStateMismatch, differs, frame, now);
        roster_.close(peer,
                      fmt::format("host '{}': {}. Look at its memory and its installation, then start it again",
                                  host.name, differs),
                      false);
        return true;
    }
    roster_.fault(host, FaultKind::kStateMismatch, differs, frame, now);
    roster_.out.push_back(server_action::StateMismatch{host.name, frame, at, expected, actual});
    roster_.leaveBarrier(host, now);
    host.state = HostState::kSyncing;
    host.mismatched = true;
    host.standing.begin(now);
    roster_.followers.pause(peer.id);
    ++host.queriesOpen;
    roster_.send(peer.id, message::HashQuery{});
    return false;
}

bool ReplicaRepairs::tooOften(const std::string& host, TimePoint now) {
    std::deque<TimePoint>& times = times_[host];
    while (!times.empty() && now - times.front() > roster_.config.mismatchesWithin) times.pop_front();
    times.push_back(now);
    const bool tooOften = times.size() >= roster_.config.maxMismatches;
    if (times.size() > roster_.config.maxMismatches) times.pop_front();
    return tooOften;
}

Expected<void> ReplicaRepairs::answered(const SessionPeer& peer, SessionHost& host,
                                        const message::HashAnswer& message) {
    if (host.queriesOpen == 0) return fail(ErrorCode::kRefused, "answers a hash query that nobody made");
    if (message.sequence > roster_.followers.sentThrough(peer.id))
        return fail(ErrorCode::kRefused,
                    fmt::format("describes itself at list {}, which it was not sent", message.sequence.value));
    --host.queriesOpen;
    if (host.mismatched)
        roster_.out.push_back(
            server_action::HashesReceived{host.name, message.sequence, message.objects, message.entries});
    return {};
}

void ReplicaRepairs::query(const std::string& name, std::uint64_t leaf) {
    SessionHost* host = roster_.find(name);
    if (!host || !host->mismatched) return;
    ++host->queriesOpen;
    roster_.send(host->connection, message::HashQuery{.objects = true, .leaf = leaf});
}

bool ReplicaRepairs::repair(const std::string& name, TimePoint now) {
    SessionHost* host = roster_.find(name);
    if (!host || !host->mismatched || roster_.followers.awaitsSnapshot(host->connection)) return false;
    roster_.resync(*host, now);
    return true;
}

}  // namespace tessera
