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
    const MotionTrial::Span meet = trial.boxesMeet(obstacle);
    if (meet.first > limit || !blocked(meet.first, std::min(meet.last, limit))) return freedom;
    freedom.reached = meet.first;
    freedom.blockedAt = std::min(meet.last, limit);
    const double tolerance = trial.limits().stopTolerance * trial.size(obstacle);
    constexpr int kMaxHalvings = 60;  // a double has no more to halve
    for (int i = 0; i < kMaxHalvings && trial.length(obstacle) * (freedom.blockedAt - freedom.reached) > tolerance;
         ++i) {
        const double middle = 0.5 * (freedom.reached + freedom.blockedAt);
        (blocked(freedom.reached, middle) ? freedom.blockedAt : freedom.reached) = middle;
        // Once the work is used up every answer is the same.
        if (freedom.undecided > 0) break;
    }
    return freedom;
}

Freedom whileNotDeeper(const MotionTrial& trial, std::size_t obstacle, double limit) {
    Freedom freedom{limit, limit};
    const FacePairs start = trial.facesTouching(obstacle, 0);
    const std::vector<FacePair> facing = trial.facing(obstacle, start.pairs);
    const double depth = trial.depth(obstacle, start.pairs, 0);
    const double size = trial.size(obstacle);
    const bool resting = depth <= trial.limits().stopTolerance * size;
    // What a slide may add by rounding; a million frames of it stay below the stop tolerance.
    const double deepest = depth + 1e-10 * size;
    const auto deeper = [&](double fraction) {
        const FacePairs faces = trial.facesTouching(obstacle, fraction);
        freedom.undecided += !faces.complete;
        if (!faces.complete) return true;
        if (!resting) return faces.pairs.size() > start.pairs.size();
        return trial.depth(obstacle, faces.pairs, fraction) > deepest ||
               trial.overlap(obstacle, facing, fraction) > deepest;
    };
    const double step = std::max(0.5 * trial.thickness(obstacle), size / 64);
    const double steps = std::ceil(trial.length(obstacle) * limit / step);
    const double maxSteps = trial.limits().maxPieces;
    if (!start.complete) return {0, limit, 1};
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
    const std::size_t n = trial.obstacles().size();
    // How far each obstacle has said that the way is free of it. An obstacle can shorten the way for those that were
    // asked before it, and a shorter way ends in another pose; so ask until all agree.
    std::vector<double> freeTo(n, 2);
    constexpr int kRounds = 8;
    bool settled = false;
    for (int round = 0; round < kRounds && !settled && least.reached > 0; ++round) {
        settled = true;
        for (std::size_t k = 0; k < n && least.reached > 0; ++k) {
            if (freeTo[k] == least.reached) continue;
            const bool apart = trial.obstacles()[k].touchingAtStart == 0;
            // The way there is known to be free; the pose at its new end is not.
            const MotionTrial::Span meet = trial.boxesMeet(k);
            const bool clear = least.reached < meet.first || least.reached > meet.last;
            const bool known = apart && freeTo[k] <= 1 && (clear || trial.touching(k, least.reached) == Touch::kNo);
            const Freedom freedom =
                known ? Freedom{least.reached, least.reached}
                      : (apart ? untilTouch(trial, k, least.reached) : whileNotDeeper(trial, k, least.reached));
            freeTo[k] = freedom.reached;
            least.undecided += freedom.undecided;
            if (freedom.reached >= least.reached) continue;
            least.reached = freedom.reached;
            least.blockedAt = freedom.blockedAt;
            settled = false;
        }
    }
    // Where they will not settle, staying put is always right.
    if (!settled) least.reached = 0;

    Resolution resolution;
    resolution.accepted = trial.way().at(least.reached);
    resolution.stopped = least.reached < 1;
    resolution.undecided = least.undecided;
    if (!resolution.stopped) return resolution;
    for (std::size_t k = 0; k < trial.obstacles().size(); ++k) {
        if (trial.obstacles()[k].touchingAtStart != 0 || trial.boxesMeet(k).first > least.blockedAt) continue;
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
