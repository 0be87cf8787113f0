/// What came out of a frame, in a few hundred bytes: enough to say that a replay differs, and in what.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/sim/frame/Frame.h"

namespace tessera {

/// The parts of a frame's result that are compared one by one, in the order in which they come to be.
enum class DigestPart : std::uint8_t {
    kOutcomes,  ///< of the edits: granted or not, ids given, what was stopped
    kAccepted,
    kVelocities,
    kStopped,
    kContacts,
    kEvents,
    kDistances,
    kQuestions,
    kNotLookedAt,
    kChanges,  ///< the committed list, as it is sent
};
inline constexpr std::size_t kDigestParts = 10;
/// The pipeline's counters and the number of contacts begun.
inline constexpr std::size_t kDigestCounters = 13;

/// Order counts, so do all bits of all numbers. Time measured does not.
struct FrameDigest {
    struct Part {
        std::uint64_t count = 0, hash = 0;
        bool operator==(const Part&) const = default;
    };
    Sequence sequence;
    StateHash stateHash;
    std::array<Part, kDigestParts> parts{};
    std::array<std::uint64_t, kDigestCounters> counters{};
    bool operator==(const FrameDigest&) const = default;
};

[[nodiscard]] FrameDigest digestOf(const FrameResult& frame);

/// What differs, in words, the earliest cause first: "contacts: recorded 14 (0123…), now 13 (4567…)". Empty when equal.
[[nodiscard]] std::vector<std::string> differences(const FrameDigest& recorded, const FrameDigest& now);

/// Over all numbers of the limits that decide about results.
[[nodiscard]] std::uint64_t digestOf(const CollisionLimits& limits);

}  // namespace tessera
