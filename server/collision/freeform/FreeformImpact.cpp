#include <cmath>
#include <limits>
#include <optional>
#include <queue>

#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/freeform/PartBounds.h"
#include "server/collision/freeform/PartChoice.h"
#include "server/collision/query/BodyWay.h"

namespace tessera {
namespace {

/// At one moment after the other: until when is every pair of parts surely apart? A gap along a direction closes no
/// faster than what both bodies can do along it on the whole way. Pairs whose gap is a fair share of their distance
/// need not be looked at more closely.
class ImpactSearchOfParts {
public:
    ImpactSearchOfParts(FreeformParts& a, FreeformParts& b, const BodyWay& wayA, const BodyWay& wayB, double tolerance,
                        double reach, QueryWork& work)
        : a_(a), b_(b), bounds_(a, b), wayA_(wayA), wayB_(wayB), tolerance_(tolerance), reach_(reach), work_(work) {}

    FreeformImpact run() {
        FreeformImpact out;
        double t = 0;
        for (;;) {
            const Step step = stepFrom(t);
            if (work_.exhausted() && !step.hit) {
                out.t = t;
                out.complete = false;
                return out;
            }
            if (step.hit) {
                const PlacePair& at = *step.hit;
                const Vec3d na = bounds_.normalA(at), nb = bounds_.normalB(at), between = at.onB - at.onA;
                out.hit = true;
                out.t = t;
                out.distance = at.distance;
                out.a = placeOf(a_[at.a], at.inA, at.onA, na);
                out.b = placeOf(b_[at.b], at.inB, at.onB, nb);
                // Apart by more than rounding, the way between them is the normal.
                out.normal =
                    at.distance > 16 * bounds_.slack() ? Vec3d(between / at.distance) : contactNormal(na, nb, between);
                return out;
            }
            t += step.free * (1 - 1e-12);
            if (!(t < 1)) return out;
        }
    }

private:
    struct Step {
        double free = 0;  ///< apart for so long
        std::optional<PlacePair> hit;
    };
    struct Open {
        double free, gap;
        std::uint32_t a, b;
        Vec3d along;
        bool operator<(const Open& other) const { return free > other.free; }
    };

    Step stepFrom(double t) {
        const BodyMoment a = wayA_.at(t), b = wayB_.at(t);
        Affine3d mapA = Affine3d::Identity(), mapB = Affine3d::Identity();
        mapA.linear() = a.linear;
        mapA.translation() = a.translation;
        mapB.linear() = b.linear;
        mapB.translation() = b.translation;
        bounds_.place(mapA, mapB, reach_);
        const double enough = std::max(tolerance_, 8 * bounds_.slack());
        open_ = {};
        left_ = 1 - t;
        consider(a_.root(), b_.root(), hint_);
        while (!open_.empty()) {
            const Open pair = open_.top();
            if (work_.exhausted()) return {};
            open_.pop();
            if (isFace(a_[pair.a]) && isFace(b_[pair.b])) {
                const FreeformPart &pa = a_[pair.a], &pb = b_[pair.b];
                PlacePair at = bounds_.samples(pair.a, pair.b);
                const double around = bounds_.radiusA(pa) + bounds_.radiusB(pb);
                // The samples are at most so far apart where the hulls' gap is what it is: then nothing is gained by
                // looking closer.
                bool known = pa.hasSample && pb.hasSample;
                if (!(pair.gap >= kFairShare * at.distance) && at.distance <= 2 * (around + pair.gap)) {
                    ++work_.triangleTests;
                    at = bounds_.descend(at, 0.5 * enough, kSteps);
                    known = known || bounds_.isThere(at);
                }
                known = known && bounds_.isThere(at);
                if (known && at.distance <= enough) return {0, at};
                if (pair.gap > 0 && ((known && pair.gap >= kFairShare * at.distance) || around <= 0.25 * pair.gap)) {
                    hint_ = pair.along;
                    return {pair.free, std::nullopt};
                }
                // Too small to be halved, or a trimming edge within the tolerance.
                if ((a_.isSmallest(pa) && b_.isSmallest(pb)) || 8 * (around + std::max(pair.gap, 0.0)) <= enough)
                    return {0, at};
            }
            const FreeformPart &pa = a_[pair.a], &pb = b_[pair.b];
            bool divideA = dividesA(pa, pb, bounds_);
            if (divideA && a_.isSmallest(pa)) divideA = false;
            if (!divideA && b_.isSmallest(pb)) divideA = true;
            FreeformParts& parts = divideA ? a_ : b_;
            const std::uint32_t which = divideA ? pair.a : pair.b;
            parts.divide(which);
            for (std::uint32_t c = 0; c < parts[which].children; ++c) {
                const std::uint32_t child = parts[which].firstChild + c;
                consider(divideA ? child : pair.a, divideA ? pair.b : child, pair.along);
            }
        }
        return {1, std::nullopt};
    }

    void consider(std::uint32_t a, std::uint32_t b, const std::optional<Vec3d>& hint) {
        ++work_.boxTests;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        const PartBounds::Gap gap = bounds_.gap(pa, pb, std::numeric_limits<double>::infinity(), hint);
        double free = 0;
        if (gap.length > 0) {
            const double speed = wayA_.advance(gap.along, wayA_.reachAround(pa.center, pa.radius)) +
                                 wayB_.advance(-gap.along, wayB_.reachAround(pb.center, pb.radius));
            free = speed > 0 ? gap.length / speed : std::numeric_limits<double>::infinity();
            if (std::isnan(free)) free = 0;
        }
        if (free >= left_) return;
        open_.push({free, gap.length, a, b, gap.along});
    }

    static constexpr double kFairShare = 0.5;
    static constexpr int kSteps = 8;

    FreeformParts &a_, &b_;
    PartBounds bounds_;
    const BodyWay &wayA_, &wayB_;
    double tolerance_, reach_, left_ = 1;
    QueryWork& work_;
    std::priority_queue<Open> open_;
    std::optional<Vec3d> hint_;
};

/// No coordinate of a body is larger on its way.
double reachOnWay(const FreeformShape& shape, const BodyWay& way) {
    const Box box = shape.bounds();
    return way.extent(box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()).norm());
}

}  // namespace

FreeformImpact FreeformPair::firstContact(const BodyMotion& motionA, const BodyMotion& motionB, double tolerance,
                                          QueryWork& work) {
    const BodyWay wayA(motionA), wayB(motionB);
    const double reach = wayA.valid() && wayB.valid() ? reachOnWay(a_, wayA) + reachOnWay(b_, wayB)
                                                      : std::numeric_limits<double>::infinity();
    FreeformImpact out;
    if (!std::isfinite(reach) || !std::isfinite(tolerance)) {
        out.t = 0;
        out.complete = false;
        return out;
    }
    // What begins inside a hull touches at the start; nothing gets there later without meeting its faces.
    if (a_.hull() != nullptr || b_.hull() != nullptr) {
        const Affine3d start = wayA.at(0).linear.determinant() != 0
                                   ? Affine3d(motionA.placeAt(0).inverse() * motionB.placeAt(0))
                                   : Affine3d::Identity();
        if (const FreeformTouch at = touch(start, tolerance, work); at.touch == Touch::kYes && at.inside) {
            out.hit = true;
            out.t = 0;
            out.a = at.a;
            out.b = at.b;
            out.normal = Vec3d::UnitX();
            for (FreeformPlace* place : {&out.a, &out.b}) place->point = motionA.placeAt(0) * place->point;
            return out;
        }
    }
    return ImpactSearchOfParts(partsA_, partsB_, wayA, wayB, tolerance, reach, work).run();
}

}  // namespace tessera
