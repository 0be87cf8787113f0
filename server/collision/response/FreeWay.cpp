#include "server/collision/response/FreeWay.h"

#include <algorithm>

namespace tessera {

namespace {

/// How far one obstacle lets the motion go, and the nearest fraction known (or feared) to be blocked.
struct Freedom {
    double reached = 1;
    double blockedAt = 1;
    std::uint64_t undecided = 0;
    Impact contact = {};
};

/// A body stops half the tolerance of way before it touches: no point of it goes farther than its length says. What
/// rests on something stops where it would get deeper.
Freedom untilTouch(const MotionTrial& trial, std::size_t obstacle, double limit) {
    const Impact contact = trial.firstContact(obstacle, limit);
    if (!contact.hit && contact.complete) return Freedom{limit, limit};
    // Known to be free up to there; what comes then is feared.
    if (!contact.hit) return Freedom{contact.t, limit, 1};
    const double length = trial.length(obstacle);
    const double pause = contact.support < 0 && length > 0 ? 0.5 * trial.tolerance(obstacle) / length : 0;
    return Freedom{std::max(0.0, contact.t - pause), std::min(limit, contact.t + pause), 0, contact};
}

/// Two hulls, one of them stuck in the other.
bool stuckHulls(const MotionTrial& trial, std::size_t obstacle) {
    if (!trial.bothHulls(obstacle) || trial.obstacles()[obstacle].touchingAtStart == 0) return false;
    const auto overlap = trial.hullOverlap(obstacle, 0);
    return !overlap || overlap->depth > trial.tolerance(obstacle);
}

/// A depth changes by no more than the two move against each other, so that none that matters is jumped.
Freedom whileHullsNotDeeper(const MotionTrial& trial, std::size_t obstacle, double limit) {
    const auto start = trial.hullOverlap(obstacle, 0);
    if (!start) return {0, limit, 1};
    const double length = trial.length(obstacle), last = std::min(limit, trial.boxesMeet(obstacle).last);
    const double rounding = 1e-10 * trial.size(obstacle), most = start->depth + rounding;
    double good = 0, depth = start->depth;
    constexpr int kMostSteps = 10'000;
    for (int step = 0; length > 0 && good < last; ++step) {
        if (step == kMostSteps) return {good, limit, 1};
        double bad = std::min(last, good + (most + trial.tolerance(obstacle) - depth) / length);
        const auto overlap = trial.hullOverlap(obstacle, bad);
        if (!overlap) return {good, limit, 1};
        depth = overlap->depth;
        if (depth <= most) {
            good = bad;
            continue;
        }
        constexpr int kHalvings = 20;
        for (int k = 0; k < kHalvings; ++k) {
            const double middle = 0.5 * (good + bad);
            const auto there = trial.hullOverlap(obstacle, middle);
            (!there || there->depth > most ? bad : good) = middle;
        }
        return {good, bad};
    }
    return {limit, limit};
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
        const Touch touch = trial.touchingAnew(obstacle, fraction);
        if (touch == Touch::kNo) break;
        undecided += touch == Touch::kUnknown;
        const double further = fraction - step, before = meet.first * (1 - 1e-9);
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
        double freeTo = kNotAsked;  ///< the way there is known to be free
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
            if (stuckHulls(trial, k)) {
                of.freedom = whileHullsNotDeeper(trial, k, way.reached);
                way.undecided += of.freedom.undecided;
                reached = of.freedom.reached;
            } else {
                if (of.freeTo == kNotAsked) {
                    of.freedom = untilTouch(trial, k, way.reached);
                    of.freeTo = of.freedom.reached;
                    way.undecided += of.freedom.undecided;
                }
                reached = backToFree(trial, k, std::min(way.reached, of.freeTo), way.undecided);
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

bool leadsNowhere(const MotionTrial& trial, std::span<const std::size_t> by, const Pose& accepted) {
    return std::ranges::any_of(by, [&](std::size_t k) { return trial.leadsNowhere(k, accepted); });
}

bool mayEndAt(const MotionTrial& trial, double fraction) {
    for (std::size_t k = 0; k < trial.obstacles().size(); ++k) {
        if (!trial.boxesMeet(k).holds(fraction)) continue;
        if (stuckHulls(trial, k) ? whileHullsNotDeeper(trial, k, fraction).reached < fraction
                                 : trial.touchingAnew(k, fraction) != Touch::kNo)
            return false;
    }
    return true;
}

std::vector<Hit> hitsOf(const MotionTrial& trial, const FreeWay& way) {
    std::vector<Hit> hits;
    for (std::size_t k = 0; k < trial.obstacles().size(); ++k) {
        const auto by = std::find(way.by.begin(), way.by.end(), k);
        // Smooth surfaces stop what comes near, though its box does not meet theirs.
        const bool near = by != way.by.end() && trial.smooth(k);
        if (!near && trial.boxesMeet(k).first > way.blockedAt) continue;
        if (near || trial.smooth(k)) {
            if (by == way.by.end()) continue;
            const Impact& contact = way.contacts[static_cast<std::size_t>(by - way.by.begin())];
            if (!contact.hit) continue;
            const auto nearest = trial.nearestPlaces(k, contact.t);
            const MeetingPlace place = nearest ? nearest->place : MeetingPlace{contact.point, contact.normal, {}, {}};
            hits.push_back({k,
                            {nearest ? nearest->faces : contact.faces},
                            trial.worldOfA(k, contact.t),
                            trial.worldOfB(k, contact.t),
                            contact.t,
                            {place}});
            continue;
        }
        double where = way.blockedAt;
        std::vector<FacePair> faces;
        if (apart(trial, k) && !trial.rests(k)) {
            faces = trial.facesTouching(k, where).pairs;
        } else {
            // What it rests on is touched where the motion ends.
            if (by == way.by.end()) continue;
            const Impact& contact = way.contacts[static_cast<std::size_t>(by - way.by.begin())];
            if (!contact.hit || contact.support >= 0) continue;
        }
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
