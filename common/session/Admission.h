/// What a Hello is answered: whether its program fits, its name is free, and its epoch is not above ours.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/session/ServerSession.h"

namespace tessera {

/// Judges and refuses in words; whom it lets in, others admit. It holds the epoch, and who claims a name that somebody
/// holds.
///
/// The holder of a name may have died without a word, which is noticed once it has been silent for long enough. Whoever
/// asks again after that, and the holder has spoken meanwhile, is one too many.
///
/// Invariants: the epoch only rises, above what a host has seen, never above `furthestSeen`, and never once a host has
/// entered the barrier. Pure; one owner.
class Admission {
public:
    struct Refusal {
        ErrorCode code{};
        std::string reason;
        bool retry = false;
    };
    using Verdict = std::optional<Refusal>;  ///< none: it may go on

    /// `config` outlives it.
    explicit Admission(const ServerSessionConfig& config) : config_(config), epoch_(config.epoch) {}

    [[nodiscard]] Epoch epoch() const { return epoch_; }

    [[nodiscard]] Verdict program(const message::Hello& hello) const;
    /// Who it is, and as what it comes in: by its key or its word. kRefused, kNetwork (it needs a key): as nothing, and
    /// it does no good to ask again.
    [[nodiscard]] Expected<Entrant> entrantOf(const message::Hello& hello, const PeerOrigin& origin) const;
    /// Whether a bulk connection may be that of a control connection: both are of one key, and the key still holds.
    [[nodiscard]] static bool goTogether(const PeerOrigin& control, const PeerOrigin& bulk);
    /// One more application, beside so many of its own name and of others.
    [[nodiscard]] Verdict application(const Entrant& who, std::size_t own, std::size_t others) const;
    [[nodiscard]] Refusal unknownHost(const std::string& name) const;
    /// `name` is held by that connection, last heard then.
    [[nodiscard]] Refusal taken(const std::string& name, ConnectionId holder, TimePoint lastHeard, TimePoint now);

    struct EpochVerdict {
        Verdict refused = {};
        std::optional<Epoch> raisedFrom = {};  ///< everybody welcomed so far starts over
    };
    /// `entered`: a host has shown our pictures. A server that goes on while another one has taken over must not outbid
    /// it.
    [[nodiscard]] EpochVerdict epochOf(const std::string& host, Epoch seen, bool entered);

private:
    [[nodiscard]] Expected<Entrant> byKey(const message::Hello& hello, const Credential& key) const;
    [[nodiscard]] Expected<Entrant> byWord(const message::Hello& hello) const;

    struct Claim {
        ConnectionId from;  ///< the holder
        TimePoint since{}, last{};
    };
    const ServerSessionConfig& config_;
    Epoch epoch_;
    std::map<std::string, Claim> claims_;  ///< by name
};

}  // namespace tessera
