#include "server/collision/freeform/FreeformQuery.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>

#include "server/collision/freeform/PartBounds.h"
#include "server/collision/freeform/PartChoice.h"

namespace tessera {
namespace {

/// Something of `other` that is within a hull. Where no surfaces meet, a face is inside as a whole or not at all.
std::optional<FreeformPlace> insideHull(const ConvexHull& hull, const Affine3d& hull_T_other,
                                        const FreeformShape& other, FreeformParts& parts, QueryWork& work) {
    if (!hull_T_other.matrix().allFinite() || hull.dimension() < 3) return std::nullopt;
    std::vector<std::uint32_t> open{parts.root()};
    while (!open.empty() && !work.exhausted()) {
        const std::uint32_t p = open.back();
        open.pop_back();
        ++work.boxTests;
        Box box;
        for (const Vec3d& x : parts.hullOf(parts[p])) box.extend(hull_T_other * x);
        if (!box.overlaps(hull.bounds())) continue;
        if (parts[p].hasSample && hull.contains(hull_T_other * parts[p].center))
            return placeOf(parts[p], parts[p].middle, parts[p].center, Vec3d::Zero());
        // Of a face that trimming cuts the sample may be missing: then some of its parts have one.
        if (parts[p].kind != FreeformPart::Kind::kGroup &&
            (parts[p].hasSample || parts[p].radius < 1e-6 * other.bounds().size().norm()))
            continue;
        parts.divide(p);
        for (std::uint32_t c = 0; c < parts[p].children; ++c) open.push_back(parts[p].firstChild + c);
    }
    return std::nullopt;
}

/// In the shared frame, which is A's.
std::optional<FreeformPlace> insideEither(const FreeformShape& a, FreeformParts& partsA, const FreeformShape& b,
                                          FreeformParts& partsB, const Affine3d& a_T_b, QueryWork& work, bool& isOfA) {
    if (a.hull() != nullptr) {
        isOfA = false;
        if (std::optional<FreeformPlace> in = insideHull(*a.hull(), a_T_b, b, partsB, work)) {
            in->point = a_T_b * in->point;
            return in;
        }
    }
    if (b.hull() != nullptr && a_T_b.linear().determinant() != 0) {
        isOfA = true;
        return insideHull(*b.hull(), a_T_b.inverse(), a, partsA, work);
    }
    return std::nullopt;
}

/// Depth first through pairs of parts that no direction parts: the nearest first.
class TouchSearchOfParts {
public:
    TouchSearchOfParts(FreeformParts& a, FreeformParts& b, const PartBounds& bounds, double tolerance, QueryWork& work)
        : a_(a), b_(b), bounds_(bounds), tolerance_(std::max(tolerance, 4 * bounds.slack())), work_(work) {}

    Touch run() {
        consider(a_.root(), b_.root(), std::nullopt, kNever);
        arrange();
        while (!open_.empty()) {
            if (found_) return Touch::kYes;
            if (work_.exhausted()) return Touch::kUnknown;
            const Open pair = open_.back();
            open_.pop_back();
            const bool divideA = dividesA(a_[pair.a], b_[pair.b], bounds_);
            FreeformParts& parts = divideA ? a_ : b_;
            const std::uint32_t which = divideA ? pair.a : pair.b;
            if (bounds_.areRigid()) {
                ++work_.boxTests;
                const std::uint32_t block = parts.blockOf(which), lanes = parts.block(block).count;
                const Vec3d hint = way_.value_or(pair.along);
                if (divideA)
                    bounds_.gapsOfA(parts.block(block), pair.b, hint, gaps_);
                else
                    bounds_.gapsOfB(parts.block(block), pair.a, hint, gaps_);
                for (std::uint32_t lane = 0; lane < lanes && !found_; ++lane) {
                    if (gaps_[lane] > 0) continue;
                    const std::uint32_t child = parts.partOf(block, lane);
                    look(divideA ? child : pair.a, divideA ? pair.b : child, gaps_[lane], pair);
                }
                arrange();
                continue;
            }
            parts.divide(which);
            for (std::uint32_t c = 0; c < parts[which].children && !found_; ++c) {
                const std::uint32_t child = parts[which].firstChild + c;
                consider(divideA ? child : pair.a, divideA ? pair.b : child, pair.along, pair.descended);
            }
            arrange();
        }
        return found_ ? Touch::kYes : Touch::kNo;
    }
    [[nodiscard]] const PlacePair& found() const { return *found_; }

private:
    struct Open {
        std::uint32_t a, b;
        double away;
        Vec3d along;
        double descended;  ///< how far the parts reached from which steps have led nowhere
    };

    void arrange() {
        std::sort(fresh_.begin(), fresh_.end(), [](const Open& x, const Open& y) { return x.away > y.away; });
        open_.insert(open_.end(), fresh_.begin(), fresh_.end());
        fresh_.clear();
    }

    /// At a pair whose boxes are not apart. Of hulls that are hardly less than their boxes no more is asked.
    void look(std::uint32_t a, std::uint32_t b, double boxes, const Open& from) {
        ++work_.boxTests;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        Open next{a, b, boxes, from.along, from.descended};
        PartBounds::Gap gap;
        if (hasParameters(pa) && hasParameters(pb)) {
            gap = bounds_.gap(pa, pb, 0, way_ ? way_ : from.along);
            if (gap.length > 0) return;
            next.along = gap.along;
        }
        inspect(next, gap);
    }

    void consider(std::uint32_t a, std::uint32_t b, const std::optional<Vec3d>& hint, double descended) {
        ++work_.boxTests;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        const PartBounds::Gap gap = bounds_.gap(pa, pb, 0, hint);
        if (gap.length > 0) return;
        inspect({a, b, gap.apart - bounds_.radiusA(pa) - bounds_.radiusB(pb), gap.along, descended}, gap);
    }

    void inspect(Open next, const PartBounds::Gap& gap) {
        const std::uint32_t a = next.a, b = next.b;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        const double descended = next.descended;
        if (isFace(pa) && isFace(pb)) {
            const double reach = bounds_.radiusA(pa) + bounds_.radiusB(pb);
            PlacePair at = bounds_.samples(a, b);
            // Boxes that meet may still have spheres that do not. Where these do, no point of one is farther from one
            // of the other than this.
            if (at.distance - reach - bounds_.slack() > 0) return;
            const bool small =
                (pa.crossed || pb.crossed ? 8 : 2) * reach <= tolerance_ || (a_.isSmallest(pa) && b_.isSmallest(pb));
            if (small || (at.distance <= tolerance_ && pa.hasSample && pb.hasSample)) {
                found_ = at;
                return;
            }
            if (hasParameters(pa) && hasParameters(pb) && at.distance <= kNearEnough * reach &&
                reach <= kMuchSmaller * descended) {
                ++work_.triangleTests;
                next.descended = reach;
                at = bounds_.descend(at, tolerance_, kSteps, kSlow);
                if (at.distance <= tolerance_ && bounds_.isThere(at)) {
                    found_ = at;
                    return;
                }
                // The way between their nearest points parts bodies that are near each other best.
                if (at.distance > 0) {
                    const Vec3d along = (at.onB - at.onA) / at.distance;
                    way_ = along;
                    PartBounds::Gap better = gap;
                    bounds_.offerAlong(pa, pb, along, better);
                    if (better.length > 0) return;
                    next.along = better.along;
                }
            }
        }
        fresh_.push_back(next);
    }

    static constexpr double kNearEnough = 0.3;
    /// Steps from parts of parts lead to where they led before, until these are so much smaller.
    static constexpr double kMuchSmaller = 0.2;
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    static constexpr int kSteps = 6;
    /// To places that meet steps lead ever faster; where they do not, the way between is known well enough.
    static constexpr double kSlow = 0.9;

    FreeformParts &a_, &b_;
    const PartBounds& bounds_;
    double tolerance_;
    QueryWork& work_;
    std::vector<Open> open_, fresh_;
    PartBounds::Gaps gaps_;
    std::optional<PlacePair> found_;
    std::optional<Vec3d>
        way_;  ///< between the last nearest points: bodies that are near each other lie beside it almost everywhere
};

/// Best first by the lower bound.
class DistanceSearchOfParts {
public:
    DistanceSearchOfParts(FreeformParts& a, FreeformParts& b, const PartBounds& bounds,
                          const FreeformDistanceOptions& options, QueryWork& work)
        : a_(a), b_(b), bounds_(bounds), options_(options), work_(work) {
        best_.distance = options.upperBound;
    }

    void run() {
        consider(a_.root(), b_.root(), 0, std::nullopt);
        arrange();
        while (!open_.empty()) {
            const Open pair = open_.top();
            if (pair.least >= cutoff()) break;
            if (work_.exhausted()) {
                complete_ = false;
                break;
            }
            open_.pop();
            const FreeformPart &pa = a_[pair.a], &pb = b_[pair.b];
            if (isFace(pa) && isFace(pb) && a_.isSmallest(pa) && b_.isSmallest(pb)) {
                least_ = std::min(least_, pair.least);
                continue;
            }
            const bool divideA =
                dividesA(pa, pb, bounds_) ? !(isFace(pa) && a_.isSmallest(pa)) : isFace(pb) && b_.isSmallest(pb);
            FreeformParts& parts = divideA ? a_ : b_;
            const std::uint32_t which = divideA ? pair.a : pair.b;
            if (bounds_.areRigid()) {
                ++work_.boxTests;
                const std::uint32_t block = parts.blockOf(which), lanes = parts.block(block).count;
                const Vec3d hint = way().value_or(pair.along);
                if (divideA)
                    bounds_.gapsOfA(parts.block(block), pair.b, hint, gaps_);
                else
                    bounds_.gapsOfB(parts.block(block), pair.a, hint, gaps_);
                for (std::uint32_t lane = 0; lane < lanes; ++lane) {
                    const double least = std::max(pair.least, gaps_[lane]);
                    if (least >= cutoff()) {
                        least_ = std::min(least_, least);
                        continue;
                    }
                    const std::uint32_t child = parts.partOf(block, lane);
                    look(divideA ? child : pair.a, divideA ? pair.b : child, least, pair.along);
                }
                arrange();
                continue;
            }
            parts.divide(which);
            for (std::uint32_t c = 0; c < parts[which].children; ++c) {
                const std::uint32_t child = parts[which].firstChild + c;
                consider(divideA ? child : pair.a, divideA ? pair.b : child, pair.least, pair.along);
            }
            arrange();
        }
        if (!open_.empty()) least_ = std::min(least_, open_.top().least);
    }

    [[nodiscard]] bool found() const { return found_; }
    [[nodiscard]] const PlacePair& best() const { return best_; }
    [[nodiscard]] double least() const { return std::clamp(least_, 0.0, std::max(best_.distance, 0.0)); }
    [[nodiscard]] bool complete() const { return complete_; }

private:
    struct Open {
        double least;
        double away;          ///< the spheres, below 0 where they overlap
        std::uint64_t order;  ///< of those that may meet the latest first, which are the smallest: a place where they
                              ///< do ends the search
        std::uint32_t a, b;
        Vec3d along;
        bool operator<(const Open& other) const {
            return least != other.least ? least > other.least : order < other.order;
        }
    };

    [[nodiscard]] double cutoff() const {
        if (!std::isfinite(best_.distance)) return best_.distance;
        // Rounding alone parts bounds from below and above by some slack.
        return best_.distance - std::max({options_.tolerance, options_.relative * best_.distance, 4 * bounds_.slack()});
    }

    void arrange() {
        std::sort(fresh_.begin(), fresh_.end(), [](const Open& x, const Open& y) { return x.away > y.away; });
        for (Open& next : fresh_) {
            next.order = ++pushed_;
            open_.push(next);
        }
        fresh_.clear();
    }

    void offer(const PlacePair& at) {
        if (at.distance < best_.distance && bounds_.isThere(at)) {
            best_ = at;
            found_ = true;
        }
    }

    /// Between the nearest points so far.
    [[nodiscard]] std::optional<Vec3d> way() const {
        if (!found_ || !(best_.distance > 0)) return std::nullopt;
        return (best_.onB - best_.onA) / best_.distance;
    }

    /// At a pair whose boxes are that far apart. Of hulls that are hardly less than their boxes no more is asked.
    void look(std::uint32_t a, std::uint32_t b, double atLeast, const Vec3d& along) {
        if (hasParameters(a_[a]) && hasParameters(b_[b])) {
            consider(a, b, atLeast, along);
            return;
        }
        ++work_.boxTests;
        const double away =
            (bounds_.centerB(b_[b]) - bounds_.centerA(a_[a])).norm() - bounds_.radiusA(a_[a]) - bounds_.radiusB(b_[b]);
        inspect({std::max({atLeast, away - bounds_.slack(), 0.0}), away, 0, a, b, along});
    }

    void consider(std::uint32_t a, std::uint32_t b, double atLeast, const std::optional<Vec3d>& hint) {
        ++work_.boxTests;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        PartBounds::Gap gap = bounds_.gap(pa, pb, cutoff(), hint);
        if (const std::optional<Vec3d> best = way(); best && gap.length < cutoff())
            bounds_.offerAlong(pa, pb, *best, gap);
        inspect({std::max({gap.length, atLeast, 0.0}), gap.apart - bounds_.radiusA(pa) - bounds_.radiusB(pb), 0, a, b,
                 gap.length > 0 ? gap.along : hint.value_or(gap.along)});
    }

    void inspect(const Open& next) {
        const std::uint32_t a = next.a, b = next.b;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        if (next.least >= cutoff()) {
            least_ = std::min(least_, next.least);
            return;
        }
        if (isFace(pa) && isFace(pb)) {
            PlacePair at = bounds_.samples(a, b);
            if (at.distance < best_.distance) {
                ++work_.triangleTests;
                offer(at);
                offer(bounds_.descend(at, options_.tolerance, kSteps));
            }
        }
        fresh_.push_back(next);
    }

    static constexpr int kSteps = 20;

    FreeformParts &a_, &b_;
    const PartBounds& bounds_;
    const FreeformDistanceOptions& options_;
    QueryWork& work_;
    std::priority_queue<Open> open_;
    std::vector<Open> fresh_;
    std::uint64_t pushed_ = 0;
    PartBounds::Gaps gaps_;
    PlacePair best_;
    bool found_ = false, complete_ = true;
    double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace

FreeformTouch FreeformPair::touch(const Affine3d& a_T_b, double tolerance, QueryWork& work) {
    const double reach = reachOf(a_, Affine3d::Identity()) + reachOf(b_, a_T_b);
    if (!std::isfinite(reach) || !std::isfinite(tolerance)) return {.touch = Touch::kUnknown, .a = {}, .b = {}};
    PartBounds bounds(partsA_, partsB_);
    bounds.place(Affine3d::Identity(), a_T_b, reach);
    TouchSearchOfParts search(partsA_, partsB_, bounds, tolerance, work);
    FreeformTouch out;
    out.touch = search.run();
    if (out.touch == Touch::kYes) {
        const PlacePair& at = search.found();
        out.a = placeOf(partsA_[at.a], at.inA, at.onA, bounds.normalA(at));
        out.b = placeOf(partsB_[at.b], at.inB, at.onB, bounds.normalB(at));
        return out;
    }
    bool isOfA = false;
    if (const std::optional<FreeformPlace> in = insideEither(a_, partsA_, b_, partsB_, a_T_b, work, isOfA)) {
        out = {.touch = Touch::kYes, .a = *in, .b = *in, .inside = true};
        (isOfA ? out.b : out.a).face = kNoIndex;
    }
    return out;
}

FreeformDistance FreeformPair::distance(const Affine3d& a_T_b, QueryWork& work,
                                        const FreeformDistanceOptions& options) {
    FreeformDistance out;
    const double reach = reachOf(a_, Affine3d::Identity()) + reachOf(b_, a_T_b);
    if (!std::isfinite(reach) || std::isnan(options.tolerance) || std::isnan(options.upperBound)) {
        out.distance = 0;
        out.complete = false;
        return out;
    }
    PartBounds bounds(partsA_, partsB_);
    bounds.place(Affine3d::Identity(), a_T_b, reach);
    DistanceSearchOfParts search(partsA_, partsB_, bounds, options, work);
    search.run();
    out.complete = search.complete();
    out.least = search.least();
    out.distance = search.best().distance;
    out.farther = !search.found();
    if (search.found()) {
        const PlacePair& at = search.best();
        out.a = placeOf(partsA_[at.a], at.inA, at.onA, bounds.normalA(at));
        out.b = placeOf(partsB_[at.b], at.inB, at.onB, bounds.normalB(at));
    }
    bool isOfA = false;
    if (out.least > 0) {
        if (const std::optional<FreeformPlace> in = insideEither(a_, partsA_, b_, partsB_, a_T_b, work, isOfA)) {
            out = {.distance = 0, .least = 0, .a = *in, .b = *in, .farther = false, .complete = true};
            (isOfA ? out.b : out.a).face = kNoIndex;
        }
    }
    return out;
}

}  // namespace tessera
