/// How far is the way of a trial free?
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/response/Response.h"

namespace tessera {

/// As far as every obstacle lets the motion go: what was apart stays apart, what rests on something gets no deeper,
/// what is stuck in something touches no more faces than at the start.
struct FreeWay {
    double reached = 1;           ///< the pose there makes no new contact, by the predicate, and the way there neither
    double blockedAt = 1;         ///< the nearest fraction known, or feared, to be blocked
    std::uint64_t undecided = 0;  ///< questions that a limit left open; taken as blocked
    std::vector<std::size_t> by;  ///< obstacles that block up to there, ascending
    std::vector<Impact>
        contacts;  ///< of each of these: where it was met first; no hit where it was touched from the start
};

/// Up to `limit` at most.
[[nodiscard]] FreeWay freeWay(const MotionTrial& trial, double limit);
/// Whether a motion that was stopped by some obstacles has come away from where it began by nothing that counts,
/// against one of them.
[[nodiscard]] bool leadsNowhere(const MotionTrial& trial, std::span<const std::size_t> by, const Pose& accepted);
/// May the motion end at a fraction of a way that is free up to some later one?
[[nodiscard]] bool mayEndAt(const MotionTrial& trial, double fraction);
/// What is in the way where it is blocked, as far as it is not touched where the motion ends.
[[nodiscard]] std::vector<Hit> hitsOf(const MotionTrial& trial, const FreeWay& way);

}  // namespace tessera
