#include "server/collision/response/FreeWay.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// How far one obstacle lets the motion go, and the nearest fraction known (or feared) to be blocked.
struct Freedom {
    double reached = 1;
    double blockedAt = 1;
    std::uint64_t undecided = 0;
    Impact contact = {};
};

/// A body that is apart stops half the tolerance of way before it touches: no point of it goes farther than its length
/// says.
Freedom untilTouch(const MotionTrial& trial, std::size_t obstacle, double limit) {
    const Impact contact = trial.firstContact(obstacle, limit);
    if (!contact.hit && contact.complete) return {limit, limit};
    // Known to be free up to there; what comes then is feared.
    if (!contact.hit) return {contact.t, limit, 1};
    const double length = trial.length(obstacle);
    const double pause = length > 0 ? 0.5 * trial.tolerance(obstacle) / length : 0;
    return {std::max(0.0, contact.t - pause), std::min(limit, contact.t + pause), 0, contact};
}

/// What rests on something or is stuck in it: at a fraction, has it got deeper than it was?
class Touched {
public:
    Touched(const MotionTrial& trial, std::size_t obstacle)
        : trial_(trial), obstacle_(obstacle), start_(trial.facesTouching(obstacle, 0)) {
        // What a slide may add by rounding; a million frames of it stay below the stop tolerance.
        const double rounding = 1e-10 * trial.size(obstacle);
        known_ = start_.complete;
        if (trial.bothHulls(obstacle)) {
            const auto overlap = trial.hullOverlap(obstacle, 0);
            known_ = known_ && overlap;
            deepest_ = (overlap ? overlap->depth : 0) + rounding;
            return;
        }
        facing_ = trial.facing(obstacle, start_.pairs);
        const double depth = trial.depth(obstacle, start_.pairs, 0);
        resting_ = depth <= trial.tolerance(obstacle);
        deepest_ = depth + rounding;
    }

    [[nodiscard]] bool known() const { return known_; }
    /// kUnknown where the work is used up.
    [[nodiscard]] Touch deeper(double fraction) const {
        const auto yes = [](bool answer) { return answer ? Touch::kYes : Touch::kNo; };
        if (trial_.bothHulls(obstacle_)) {
            const auto overlap = trial_.hullOverlap(obstacle_, fraction);
            return overlap ? yes(overlap->depth > deepest_) : Touch::kUnknown;
        }
        const FacePairs faces = trial_.facesTouching(obstacle_, fraction);
        if (!faces.complete) return Touch::kUnknown;
        if (!resting_) return yes(faces.pairs.size() > start_.pairs.size());
        return yes(trial_.depth(obstacle_, faces.pairs, fraction) > deepest_ ||
                   trial_.overlap(obstacle_, facing_, fraction) > deepest_);
    }

private:
    const MotionTrial& trial_;
    std::size_t obstacle_;
    FacePairs start_;
    std::vector<FacePair> facing_;
    double deepest_ = 0;
    bool resting_ = true, known_ = true;
};

/// Sampled: nothing that is jumped would be new, for the two touch already.
Freedom whileNotDeeper(const MotionTrial& trial, std::size_t obstacle, double limit) {
    Freedom freedom{limit, limit};
    const Touched touched(trial, obstacle);
    if (!touched.known()) return {0, limit, 1};
    const auto deeper = [&](double fraction) {
        const Touch touch = touched.deeper(fraction);
        freedom.undecided += touch == Touch::kUnknown;
        return touch != Touch::kNo;
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

bool apart(const MotionTrial& trial, std::size_t obstacle) {
    return trial.obstacles()[obstacle].touchingAtStart == 0;
}

/// The pose at a fraction up to which the way is free need not be free itself to the last digit: rounding makes it
/// another than the query's. So back a little, then more. Where the work is used up: to where the boxes are apart.
double backToFree(const MotionTrial& trial, std::size_t obstacle, double fraction, std::uint64_t& undecided) {
    const double length = trial.length(obstacle);
    const MotionTrial::Span meet = trial.boxesMeet(obstacle);
    double step = length > 0 ? 1e-3 * trial.tolerance(obstacle) / length : 1;
    while (fraction > 0 && meet.holds(fraction)) {
        const Touch touch = trial.touching(obstacle, fraction);
        if (touch == Touch::kNo) break;
        undecided += touch == Touch::kUnknown;
        const double further = fraction - step, before = meet.first - 1e-9;
        fraction = std::max(0.0, touch == Touch::kUnknown ? std::min(further, before) : further);
        step *= 2;
    }
    return fraction;
}

}  // namespace

FreeWay freeWay(const MotionTrial& trial, double limit) {
    FreeWay way{limit, limit, 0, {}, {}};
    const std::size_t n = trial.obstacles().size();
    constexpr double kNotAsked = -1;
    struct Known {
        double freeTo = kNotAsked;  ///< of what was apart: the way there is known to be free
        double settledAt = kNotAsked;
        Freedom freedom;
    };
    std::vector<Known> known(n);
    // An obstacle can shorten the way for those that were asked before it, and a shorter way ends in another pose; so
    // ask until all agree.
    constexpr int kRounds = 16;
    bool settled = false;
    for (int round = 0; round < kRounds && !settled && way.reached > 0; ++round) {
        settled = true;
        for (std::size_t k = 0; k < n && way.reached > 0; ++k) {
            Known& of = known[k];
            if (of.settledAt == way.reached || trial.boxesMeet(k).first > way.reached) continue;
            double reached = way.reached;
            if (apart(trial, k)) {
                if (of.freeTo == kNotAsked) {
                    of.freedom = untilTouch(trial, k, way.reached);
                    of.freeTo = of.freedom.reached;
                    way.undecided += of.freedom.undecided;
                }
                reached = backToFree(trial, k, std::min(way.reached, of.freeTo), way.undecided);
            } else {
                of.freedom = whileNotDeeper(trial, k, way.reached);
                way.undecided += of.freedom.undecided;
                reached = of.freedom.reached;
            }
            of.settledAt = reached;
            if (reached >= way.reached) continue;
            way.blockedAt = std::max(reached, std::min(way.blockedAt, of.freedom.blockedAt));
            way.reached = reached;
            settled = false;
        }
    }
    // Where they will not settle, staying put is always right.
    if (!settled) way.reached = 0;
    if (way.reached >= limit) return way;
    for (std::size_t k = 0; k < n; ++k) {
        const Freedom& freedom = known[k].freedom;
        const bool blocks = freedom.contact.hit ? freedom.contact.t <= way.blockedAt
                                                : freedom.reached < freedom.blockedAt && freedom.reached <= way.reached;
        if (!blocks) continue;
        way.by.push_back(k);
        way.contacts.push_back(freedom.contact);
    }
    return way;
}

bool mayEndAt(const MotionTrial& trial, double fraction) {
    for (std::size_t k = 0; k < trial.obstacles().size(); ++k) {
        if (!trial.boxesMeet(k).holds(fraction)) continue;
        if (apart(trial, k) ? trial.touching(k, fraction) != Touch::kNo
                            : whileNotDeeper(trial, k, fraction).reached < fraction)
            return false;
    }
    return true;
}

std::vector<Hit> hitsOf(const MotionTrial& trial, const FreeWay& way) {
    std::vector<Hit> hits;
    for (std::size_t k = 0; k < trial.obstacles().size(); ++k) {
        if (!apart(trial, k) || trial.boxesMeet(k).first > way.blockedAt) continue;
        double where = way.blockedAt;
        std::vector<FacePair> faces = trial.facesTouching(k, where).pairs;
        const auto by = std::find(way.by.begin(), way.by.end(), k);
        if (faces.empty() && by != way.by.end()) {
            // Met and left again within the last stretch.
            const Impact& contact = way.contacts[static_cast<std::size_t>(by - way.by.begin())];
            if (!contact.hit) continue;
            where = contact.t;
            faces = {contact.faces};
        }
        if (!faces.empty())
            hits.push_back({k, std::move(faces), trial.worldOfA(k, where), trial.worldOfB(k, where), where});
    }
    return hits;
}

}  // namespace tessera
