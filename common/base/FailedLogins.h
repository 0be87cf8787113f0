/// Who has shown a wrong word of late, by address, and how long the next refusal is to wait.
#pragma once

#include <chrono>
#include <cstddef>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "common/base/Clock.h"
#include "common/base/SourceAddress.h"

namespace tessera {

struct FailedLoginLimits {
    std::size_t atOnce = 5;              ///< refusals that wait for nothing
    std::chrono::seconds forgotten{60};  ///< an address that has failed at nothing for so long begins anew
    /// What the next one waits; each waits twice as long. Programs wait for ten seconds, and are to hear why.
    std::chrono::seconds first{1}, longest{8};
    std::size_t maxAddresses = 4096;                   ///< above it the one that has failed least recently is forgotten
    std::size_t maxWaitingOfOne = 4, maxWaiting = 32;  ///< refusals
    std::chrono::seconds tells{10};                    ///< at most one address in so long is told of
};

/// For a door, which refuses. It slows down programs that go on asking with a word that has ended, and whoever waits
/// to be answered. Who does not wait learns as much as before: what guards a word is its 256 bits. Who shows the right
/// word is no concern of this class: it never waits.
///
/// Pure; one owner. Each call takes as long however many addresses are known.
class FailedLogins {
public:
    explicit FailedLogins(FailedLoginLimits limits = {}) : limits_(limits) {}
    FailedLogins(const FailedLogins&) = delete;
    FailedLogins& operator=(const FailedLogins&) = delete;

    /// A refusal that waits, until it is given or its peer has gone. It does not outlive its FailedLogins.
    class Ticket {
    public:
        Ticket(FailedLogins& owner, SourceAddress from) : owner_(&owner), from_(from) {}
        Ticket(Ticket&& other) noexcept : owner_(other.owner_), from_(other.from_) { other.owner_ = nullptr; }
        Ticket& operator=(Ticket&& other) noexcept {
            std::swap(owner_, other.owner_);
            std::swap(from_, other.from_);
            return *this;
        }
        ~Ticket() {
            if (owner_) owner_->ended(from_);
        }

    private:
        FailedLogins* owner_;
        SourceAddress from_;
    };
    struct Verdict {
        std::chrono::seconds wait{};        ///< before the refusal is said; zero: it is said at once
        std::optional<Ticket> ticket = {};  ///< of one that waits
        bool close = false;                 ///< too many wait: the connection is closed at once, and nothing said
        bool begins = false;                ///< the address is slowed down from now on: people may be told
    };
    [[nodiscard]] Verdict failed(SourceAddress from, TimePoint now);

private:
    struct Address {
        std::size_t failures = 0;
        TimePoint last{};
        std::size_t waiting = 0;
        std::list<SourceAddress>::iterator place{};
    };

    Address& addressOf(SourceAddress from);
    void ended(SourceAddress from);

    FailedLoginLimits limits_;
    std::unordered_map<SourceAddress, Address> addresses_;
    std::list<SourceAddress> byTime_;  ///< the least recent failure first
    std::size_t waiting_ = 0;
    std::optional<TimePoint> told_;
};

/// For people.
[[nodiscard]] std::string describeSlowed(SourceAddress from);

}  // namespace tessera
