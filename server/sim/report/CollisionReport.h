/// What report.json says of collisions: sums over the run, lists of the last frame.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// Bounded: sums, and lists of one frame within the limits of the pipeline and those below.
class CollisionReport {
public:
    static constexpr std::size_t kMaxContacts = 1000;
    static constexpr std::size_t kMaxDistances = 1000;
    static constexpr std::size_t kMaxNotLookedAt = 100;

    void frameDone(const StepResult& step);

    /// `scene`: as of the last frame; objects are named by their paths there, those that are gone by "#id".
    [[nodiscard]] nlohmann::ordered_json toJson(const Aspect& scene) const;

private:
    StepCounters last_;  ///< of the last frame
    LazyList<Contact> contacts_;
    DistanceList distances_;
    std::vector<NotLookedAt> notLookedAt_;
    std::vector<StandIn> standIns_;
    // Over the run.
    std::uint64_t begun_ = 0, pairsTested_ = 0, boxTests_ = 0, triangleTests_ = 0;
    std::uint64_t eventsBegan_ = 0, eventsEnded_ = 0, eventsLeftOut_ = 0, contactsLeftOut_ = 0;
    std::uint64_t unanswered_ = 0, notLookedAtCount_ = 0, mostTests_ = 0;
};

}  // namespace tessera
