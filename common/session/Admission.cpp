#include "common/session/Admission.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/Hash.h"
#include "common/session/Grace.h"

namespace tessera {

Admission::Verdict Admission::program(const message::Hello& hello) const {
    const bool holdsReplica = hello.role == PeerRole::kHost || hello.follows;
    if (hello.protocol > kProtocolVersion || hello.protocol < (holdsReplica ? kProtocolVersion : kOldestAskersProtocol))
        return Refusal{
            ErrorCode::kNetwork,
            fmt::format("this server speaks protocol version {}, the peer version {}; install the same Tessera on both",
                        kProtocolVersion, hello.protocol),
            false};
    // Who holds no replica asks and is answered by numbers that keep their meaning (proto/README.md).
    if (holdsReplica && hello.schema != config_.schema)
        return Refusal{ErrorCode::kNetwork,
                       "this server's scene has schema " + toHex(config_.schema) + ", the peer's " +
                           toHex(hello.schema) + "; install the same Tessera on both",
                       false};
    return {};
}

Expected<Entrant> Admission::entrantOf(const message::Hello& hello, const PeerOrigin& origin) const {
    if (origin.key) return byKey(hello, *origin.key);
    if (std::optional<Entrant> who = origin.near ? config_.access.byDoor(hello.access) : std::nullopt)
        return *std::move(who);
    const Entrant anybody{.role = Role::kOperator};
    if (config_.access.empty()) return anybody;
    const bool host = hello.role == PeerRole::kHost;
    if (!origin.sealed && !origin.near) {
        if (config_.insecure) return hello.access.empty() ? anybody : byWord(hello);
        return fail(
            ErrorCode::kNetwork,
            fmt::format("from another machine nobody comes in without a key: `tessera-keys {}`, on the server's "
                        "machine, makes one, and --keys DIR names where it is",
                        host ? "host " + hello.name : "person NAME --role ROLE"));
    }
    if (origin.sealed && host)
        return fail(
            ErrorCode::kNetwork,
            fmt::format("a render host needs a key of its own: `tessera-keys host {}`, on the server's machine, "
                        "makes it",
                        hello.name));
    if (!hello.access.empty()) return byWord(hello);
    if (origin.sealed)
        return fail(ErrorCode::kNetwork,
                    "nobody comes in without a key or a token: `tessera-keys person NAME --role ROLE`, on the server's "
                    "machine, makes a key");
    return fail(ErrorCode::kRefused,
                fmt::format("on this machine the server takes programs of its own user ({}) alone: run this one as "
                            "that user, or name a file with the server's token (--token-file FILE)",
                            config_.owner));
}

/// The names in it are the authority's word: what a program says of itself counts for nothing beside it.
Expected<Entrant> Admission::byKey(const message::Hello& hello, const Credential& key) const {
    if (!key.fault.empty()) return fail(ErrorCode::kNetwork, key.fault);
    const Identity& who = key.identity;
    const bool host = hello.role == PeerRole::kHost;
    if (who.kind == Identity::Kind::kPerson && !host) return Entrant{who.role, Entrant::By::kKey, who.name};
    if (who.kind == Identity::Kind::kHost && host && hello.name == who.name)
        return Entrant{Role::kOperator, Entrant::By::kKey, who.name};
    if (who.kind == Identity::Kind::kHost && host)
        return fail(ErrorCode::kNetwork,
                    fmt::format("the key is of the host '{}', and not of '{}'", who.name, hello.name));
    return fail(ErrorCode::kNetwork, fmt::format("the key is of {}, and lets in no {}", describe(who),
                                                 host ? "render host" : "application"));
}

Expected<Entrant> Admission::byWord(const message::Hello& hello) const {
    std::optional<Entrant> who;
    if (const std::optional<Role> role = config_.access.roleOf(hello.access))
        who = {*role, Entrant::By::kWord, config_.owner};
    else if (const auto pass = config_.passOf ? config_.passOf(hello.access) : std::nullopt)
        who = {pass->role, Entrant::By::kPass, pass->name, {}, pass->panel};
    if (!who)
        return fail(
            ErrorCode::kRefused,
            fmt::format("the token is not this server's, or has ended: take it from where the server's user ({}) "
                        "finds it, or have another one made (tessera-keys token)",
                        config_.owner));
    if (hello.role == PeerRole::kHost && who->role != Role::kOperator)
        return fail(ErrorCode::kRefused,
                    fmt::format("a render host needs the token of an operator, and this one is a token for the role {}",
                                nameOf(who->role)));
    return *who;
}

bool Admission::goTogether(const PeerOrigin& control, const PeerOrigin& bulk) {
    if (control.sealed != bulk.sealed || control.key.has_value() != bulk.key.has_value()) return false;
    return !bulk.key || (bulk.key->fault.empty() && bulk.key->serial == control.key->serial);
}

Admission::Verdict Admission::application(const Entrant& who, std::size_t own, std::size_t others) const {
    if (hasShare(who.by, own, others, config_.maxApplications)) return {};
    if (own + others < config_.maxApplications)
        return Refusal{ErrorCode::kRefused,
                       fmt::format("already {} applications of '{}' are connected: of {} places one name has at most "
                                   "half of those that others leave",
                                   own, who.name, config_.maxApplications),
                       true};
    return Refusal{ErrorCode::kRefused,
                   fmt::format("already {} applications are connected, the most there may be", own + others), true};
}

Admission::Refusal Admission::unknownHost(const std::string& name) const {
    return {ErrorCode::kNotFound,
            fmt::format("unknown host '{}'; the wall has: {}", name, fmt::join(config_.hosts, ", ")), false};
}

Admission::Refusal Admission::taken(const std::string& name, ConnectionId holder, TimePoint lastHeard, TimePoint now) {
    constexpr Duration kForgotten = std::chrono::seconds(10);  // more than a host waits between two tries
    Claim& claim = claims_[name];
    if (claim.from != holder || now - claim.last > kForgotten) {
        claim.from = holder;
        claim.since = now;
    }
    claim.last = now;
    const Duration noticed = config_.sync.lostAfter + Grace::kInARow * config_.sync.heartbeat;
    const bool speaks = now - claim.since >= noticed && lastHeard > claim.since;
    if (speaks) claim.from = {};  // the next one who claims the name begins anew
    const std::string taken = "host '" + name + "' is connected already";
    return {
        ErrorCode::kRefused,
        speaks ? taken + ", and goes on speaking; end that process, or give this one the name of another host" : taken,
        !speaks};
}

Admission::EpochVerdict Admission::epochOf(const std::string& host, Epoch seen, bool entered) {
    if (seen <= epoch_) return {};
    if (seen > config_.furthestSeen)
        return {.refused = Refusal{ErrorCode::kRefused,
                                   fmt::format("host '{}' says that it has seen epoch {}, which no server of this wall "
                                               "can have had; start it again",
                                               host, seen.value),
                                   false}};
    if (entered || !seen.next())
        return {.refused =
                    Refusal{ErrorCode::kRefused,
                            fmt::format("this server is at epoch {}, and host '{}' has seen epoch {} of this wall: "
                                        "a server that started later has taken over, or the clock went back; end "
                                        "one of the two, or start this one again",
                                        epoch_.value, host, seen.value),
                            true}};
    return {.raisedFrom = std::exchange(epoch_, seen.next())};
}

}  // namespace tessera
