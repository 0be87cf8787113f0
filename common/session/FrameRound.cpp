#include "common/session/FrameRound.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tessera {

std::optional<TimePoint> FrameRound::startDeadline() const {
    if (!startedAt_ || roster_.barrier.open() || roster_.barrier.nextFrame() != roster_.config.firstFrame) return {};
    return *startedAt_ + roster_.config.sync.startDeadline;
}

bool FrameRound::mayBegin(TimePoint now) const {
    if (!roster_.barrier.mayBegin()) return false;
    if (roster_.barrier.nextFrame() != roster_.config.firstFrame) return true;
    if (std::ranges::all_of(roster_.hosts, [&](const SessionHost& host) { return roster_.mayEnter(host); }))
        return true;
    return startedAt_ && now - *startedAt_ >= roster_.config.sync.startDeadline;
}

void FrameRound::begin(const message::Begin& begin, TimePoint now) {
    const CommittedList& list = *begin.list;
    TESSERA_CHECK(roster_.followers.continues(list),
                  "a frame without a list stands where the last one did: nothing is between two frames");
    roster_.announcements.named(list.blobs);
    catchUp_.sendToSlow(now);
    enterSynced(begin, now);
    const std::vector<std::string> drawing = roster_.barrier.begin(begin.frame, now);
    const MessagePtr toHosts = SessionRoster::shared(begin);
    for (const std::string& name : drawing) {
        SessionHost& host = *roster_.find(name);
        host.state = HostState::kLive;
        host.everBegun = true;
        host.answered = false;
        host.frame = begin.frame;
        host.sequence = list.sequence;
        host.stateHash = list.stateHash;
        roster_.followers.sentWithFrame(host.connection, list.sequence);
        roster_.send(host.connection, toHosts);
    }
    if (list.changed()) catchUp_.send(begin.list, now);
    roster_.followers.record(begin.list);
    settle(now);
}

void FrameRound::enterSynced(const message::Begin& begin, TimePoint now) {
    for (SessionHost& host : roster_.hosts) {
        if (!roster_.mayEnter(host) || !roster_.followers.lacksJust(host.connection, *begin.list)) continue;
        roster_.barrier.enter(host.name);
        host.state = HostState::kLive;
        const Duration away = host.everEntered ? std::max(Duration::zero(), now - host.awaySince) : Duration::zero();
        roster_.out.push_back(server_action::HostEntered{host.name, begin.frame, host.everEntered, away,
                                                         roster_.barrier.framesToProve(host.name)});
        host.everEntered = true;
    }
}

Expected<void> FrameRound::ready(SessionPeer& peer, const message::Ready& message, TimePoint now) {
    SessionHost& host = roster_.hostOf(peer);
    if (!host.everBegun || message.frame > host.frame)
        return fail(ErrorCode::kRefused,
                    fmt::format("is ready with frame {}, which it was not told to draw", message.frame.value));
    if (message.frame < host.frame || host.answered) return {};
    host.answered = true;
    if (!message.stats.empty())
        roster_.out.push_back(server_action::FrameStats{host.name, message.frame, message.stats});
    if (!host.inBarrier()) return {};  // it left the barrier while it drew; its catching up is under way
    if (message.stateHash != host.stateHash) {
        (void)repairs_.differs(peer, host, host.sequence, host.stateHash, message.stateHash, now);
        settle(now);
        return {};
    }
    if (Expected<void> taken = roster_.barrier.ready(host.name, message.frame, now); !taken) return taken;
    if (host.state == HostState::kLate && !roster_.barrier.contains(host.name)) {
        // Dropped, and now done with the old frame: in again once it has applied what was sent meanwhile.
        host.state = HostState::kSyncing;
        host.standing.begin(now);
        host.standing.mustReach(roster_.followers.sentThrough(peer.id));
        host.standing.stands(host.sequence);
    }
    settle(now);
    return {};
}

Expected<void> FrameRound::shown(const SessionPeer& peer, const message::Shown& message, TimePoint now) {
    SessionHost& host = roster_.hostOf(peer);
    if (!host.everSwapped || message.frame > host.lastSwap)
        return fail(ErrorCode::kRefused,
                    fmt::format("shows frame {}, which was not released to it", message.frame.value));
    if (host.everShown && message.frame <= host.lastShown) return {};
    host.everShown = true;
    host.lastShown = message.frame;
    // What a host shows that is out of the barrier is no matter of those who are in it.
    if (host.inBarrier()) roster_.out.push_back(server_action::FrameShown{host.name, message.frame, message.shownAtNs});
    roster_.barrier.shown(host.name, message.frame, now);
    if (host.unshown && message.frame == host.lastSwap) {
        host.unshown = false;
        roster_.resync(host, now);
    }
    return {};
}

void FrameRound::settle(TimePoint now) {
    const FrameNumber frame = roster_.currentFrame();
    SwapBarrier::Outcome outcome = roster_.barrier.poll(now, grace_.known(now));
    if (outcome.released) released(outcome, now);
    for (const std::string& name : outcome.unshown) leaveUnshown(*roster_.find(name), now);
    for (const std::string& name : outcome.stalled) {
        SessionHost& host = *roster_.find(name);
        SessionPeer& peer = roster_.peerOf(host);
        const std::string detail = fmt::format("no picture of frame {} within the frame deadline", host.frame.value);
        roster_.lose(host, FaultKind::kDrawStalled, detail, frame, now);
        roster_.close(peer, detail);
    }
    catchUp_.reportEverywhere();
}

void FrameRound::released(SwapBarrier::Outcome& outcome, TimePoint now) {
    const MessagePtr swap = SessionRoster::shared(message::Swap{outcome.frame});
    for (const std::string& name : outcome.show) {
        SessionHost& host = *roster_.find(name);
        host.everSwapped = true;
        host.lastSwap = outcome.frame;
        roster_.send(host.connection, swap);
    }
    for (const std::string& name : outcome.held) {
        SessionHost& host = *roster_.find(name);
        if (host.state == HostState::kLive) host.awaySince = now;
        host.state = HostState::kLate;
        if (!roster_.barrier.contains(name)) roster_.announcements.notAwaited(name);
    }
    for (std::string& name : repairs_.heldBack()) outcome.held.push_back(std::move(name));
    roster_.out.push_back(server_action::FrameReleased{outcome.frame, std::move(outcome.show), std::move(outcome.held),
                                                       outcome.barrierTime, outcome.frameTime, outcome.lastHost,
                                                       std::move(outcome.wait)});
}

void FrameRound::leaveUnshown(SessionHost& host, TimePoint now) {
    roster_.fault(host, FaultKind::kNotShown,
                  fmt::format("it lives, and has not said in time that it shows frame {}; it is out until it does",
                              host.lastSwap.value),
                  host.lastSwap, now);
    roster_.leaveBarrier(host, now);
    host.state = HostState::kLost;
    host.unshown = true;
    host.standing.over();
    roster_.followers.stop(host.connection);
}

}  // namespace tessera
