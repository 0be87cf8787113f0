/// From a connection to a welcomed peer, or to a refusal in words.
#pragma once

#include <string>

#include "common/session/Admission.h"
#include "common/session/SessionRoster.h"

namespace tessera {

/// Carries out what `Admission` says of a Hello: a host takes its place in the wall, an application or a bulk
/// connection its own. Of hosts whose pixels differ from those of the first one that said anything of them it tells.
///
/// Invariants: a refused connection is closed and leaves nothing; where the epoch rises, everybody welcomed before
/// starts over. Pure; one owner.
class SessionEntrance {
public:
    /// `roster` outlives it.
    explicit SessionEntrance(SessionRoster& roster) : roster_(roster), admission_(roster.config) {}

    [[nodiscard]] Epoch epoch() const { return admission_.epoch(); }
    /// A connection that has not said anything. Of too many the one that has waited longest goes.
    void opened(ConnectionId connection, TimePoint now, const PeerOrigin& origin);
    /// The first word on a connection. `peer` may be gone afterwards.
    void hello(SessionPeer& peer, const message::Hello& hello, TimePoint now);

private:
    void bulk(SessionPeer& peer, const message::Hello& hello);
    void application(SessionPeer& peer, const message::Hello& hello, Entrant who, TimePoint now);
    void host(SessionPeer& peer, const message::Hello& hello, TimePoint now);
    void admit(SessionPeer& peer, SessionHost& host, const message::Hello& hello, TimePoint now);
    void welcome(SessionPeer& peer, TimePoint now);
    void refuse(SessionPeer& peer, Admission::Refusal refusal);
    void refuseLogin(SessionPeer& peer, Error why, TimePoint now);
    void allStartOver(Epoch from, const std::string& because, TimePoint now);
    void comparePixels(const std::string& host, std::uint64_t probe);

    SessionRoster& roster_;
    Admission admission_;
    struct {
        std::string host;  ///< the first with one
        std::uint64_t value = 0;
    } probe_;
};

}  // namespace tessera
