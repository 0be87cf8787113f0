#include <algorithm>
#include <cmath>

#include "server/collision/pipeline/Response.h"

namespace tessera {

namespace {

/// How far one obstacle lets the motion go, and the nearest fraction known (or feared) to be blocked.
struct Freedom {
    double reached = 1;
    double blockedAt = 1;
    std::uint64_t undecided = 0;
};

Freedom untilTouch(const MotionTrial& trial, std::size_t obstacle, double limit) {
    Freedom freedom{limit, limit};
    const auto blocked = [&](double from, double to) {
        const Touch touch = trial.touchingOnTheWay(obstacle, from, to);
        freedom.undecided += touch == Touch::kUnknown;
        return touch != Touch::kNo;
    };
    if (!blocked(0, limit)) return freedom;
    freedom.reached = 0;
    const double tolerance = trial.limits().stopTolerance * trial.size(obstacle);
    constexpr int kMaxHalvings = 60;  // a double has no more to halve
    for (int i = 0; i < kMaxHalvings && trial.length(obstacle) * (freedom.blockedAt - freedom.reached) > tolerance; ++i) {
        const double middle = 0.5 * (freedom.reached + freedom.blockedAt);
        (blocked(freedom.reached, middle) ? freedom.blockedAt : freedom.reached) = middle;
        // Once the work is used up every answer is the same.
        if (freedom.undecided > 0) break;
    }
    return freedom;
}

Freedom whileNotDeeper(const MotionTrial& trial, std::size_t obstacle, double limit) {
    Freedom freedom{limit, limit};
    const std::uint64_t allowed = trial.obstacles()[obstacle].touchingAtStart;
    const auto deeper = [&](double fraction) {
        const FacePairs faces = trial.facesTouching(obstacle, fraction);
        freedom.undecided += !faces.complete;
        return !faces.complete || faces.pairs.size() > allowed;
    };
    const double step = std::max(0.5 * trial.thickness(obstacle), trial.size(obstacle) / 64);
    const double steps = std::ceil(trial.length(obstacle) * limit / step);
    const double maxSteps = trial.limits().maxPieces;
    if (steps > maxSteps) {
        // Too far to look all the way: go on in the next frame.
        freedom.blockedAt = limit * std::min(1.0, (maxSteps + 1) / steps);
        freedom.reached = limit * maxSteps / steps;
        ++freedom.undecided;
    }
    const int n = static_cast<int>(std::clamp(steps, 1.0, maxSteps));
    double good = 0;
    for (int i = 1; i <= n; ++i) {
        double bad = i == n ? freedom.reached : freedom.reached * i / n;
        if (!deeper(bad)) {
            good = bad;
            continue;
        }
        constexpr int kHalvings = 10;
        for (int k = 0; k < kHalvings; ++k) {
            const double middle = 0.5 * (good + bad);
            (deeper(middle) ? bad : good) = middle;
        }
        return {good, bad, freedom.undecided};
    }
    return freedom;
}

}  // namespace

Resolution StopResponse::resolve(const MotionTrial& trial) const {
    Freedom least;
    // An obstacle can shorten the way for those that were asked before it, and a shorter way ends in another pose; so ask
    // until all agree. Fractions only fall; where they will not settle, staying put is always right.
    constexpr int kRounds = 8;
    bool settled = false;
    for (int round = 0; round < kRounds && !settled && least.reached > 0; ++round) {
        settled = true;
        for (std::size_t k = 0; k < trial.obstacles().size() && least.reached > 0; ++k) {
            const bool apart = trial.obstacles()[k].touchingAtStart == 0;
            const Freedom freedom = apart ? untilTouch(trial, k, least.reached) : whileNotDeeper(trial, k, least.reached);
            least.undecided += freedom.undecided;
            if (freedom.reached >= least.reached) continue;
            least.reached = freedom.reached;
            least.blockedAt = freedom.blockedAt;
            settled = false;
        }
    }
    if (!settled) least.reached = 0;

    Resolution resolution;
    resolution.accepted = trial.way().at(least.reached);
    resolution.stopped = least.reached < 1;
    resolution.undecided = least.undecided;
    if (!resolution.stopped) return resolution;
    for (std::size_t k = 0; k < trial.obstacles().size(); ++k) {
        if (trial.obstacles()[k].touchingAtStart != 0) continue;
        FacePairs faces = trial.facesTouching(k, least.blockedAt);
        double where = least.blockedAt;
        if (faces.pairs.empty()) {
            // Met and left again within the last stretch: seen from before.
            faces = trial.facesTouchingOnTheWay(k, least.reached, least.blockedAt);
            where = least.reached;
        }
        if (!faces.pairs.empty())
            resolution.hits.push_back({k, std::move(faces.pairs), trial.worldOfA(k, where), trial.worldOfB(k, where)});
    }
    return resolution;
}

}  // namespace tessera
