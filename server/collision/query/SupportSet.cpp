#include "server/collision/query/SupportSet.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

/// Faces that are apart nearly opposite to a support's normal are on its wrong side.
constexpr double kBehind = -0.7;

double overlapOf(const Vec3d& n, const Triangle& a, const Triangle& b) {
    return -lowest(-n, a) - lowest(n, b);
}

double fastest(const MovingPair& pair) {
    double square = 0;
    for (const Vec3d& va : pair.velocityA)
        for (const Vec3d& vb : pair.velocityB) square = std::max(square, (vb - va).squaredNorm());
    return std::sqrt(square);
}

}  // namespace

double lowest(const Vec3d& n, const Triangle& t) {
    return std::min({n.dot(t[0]), n.dot(t[1]), n.dot(t[2])});
}

double timeUntilZero(double gap, double rate, double bend) {
    if (!(gap > 0)) return 0;
    const double root = std::sqrt(rate * rate + 2 * gap * bend);
    const double t = 2 * gap * (1 - 1e-12) / (root - rate + 1e-13 * std::abs(rate) + 1e-300);
    return t > 0 ? t : 0;
}

double MovingPair::timeApart(const Vec3d& n, double least, double growth, double bend) const {
    double time = std::numeric_limits<double>::infinity();
    double rateA[3], rateB[3];
    for (std::size_t i = 0; i < 3; ++i) {
        rateA[i] = n.dot(velocityA[i]);
        rateB[i] = n.dot(velocityB[i]);
    }
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            time = std::min(time, timeUntilZero(n.dot(b[j] - a[i]) - least, rateB[j] - rateA[i] - growth, bend));
    return time;
}

Extent extentAlong(const TreeStorage& tree, const BodyMoment& moment, kernel::Slot slot, const Vec3d& n) {
    const kernel::TreeView view = tree.view();
    const unsigned rows = rowsOf(tree.options.volume);
    const float* const node =
        view.volumes + std::size_t{slot / kernel::kWidth} * rows * kernel::kWidth + slot % kernel::kWidth;
    const auto row = [&](unsigned r) { return static_cast<double>(node[r * kernel::kWidth]); };
    // Lengths along n of the tree's own coordinates.
    const Vec3d m = moment.linear.transpose() * n / tree.unit;
    double middle = n.dot(moment.place(tree.centre)), half = 0;
    if (tree.options.volume == VolumeKind::kSphere) {
        middle += m.dot(Vec3d(row(0), row(1), row(2)));
        half = m.norm() * row(3);
    } else if (tree.options.volume == VolumeKind::kObb) {
        middle += m.dot(Vec3d(row(0), row(1), row(2)));
        for (unsigned i = 0; i < 3; ++i)
            half += std::abs(m.dot(Vec3d(row(3 + 3 * i), row(4 + 3 * i), row(5 + 3 * i)))) * row(12 + i);
    } else {
        for (unsigned k = 0; k < 3; ++k) {
            const double upper = row(k), lower = -row(k + rows / 2);
            middle += m[k] * 0.5 * (upper + lower);
            half += std::abs(m[k]) * 0.5 * (upper - lower);
        }
    }
    return {middle - half, middle + half};
}

SupportSet::SupportSet(const BodyWay& a, double reachA, const BodyWay& b, double reachB,
                       std::span<const Support> supports, double margin, const Thickness& thickness)
    : a_(a),
      b_(b),
      supports_(supports.begin(), supports.end()),
      margin_(margin),
      thickness_(thickness),
      straight_(a.straight() && b.straight()) {
    for (Support& support : supports_) {
        support.rounding = std::max(support.rounding, 8 * margin);
        const bool turns = support.turns != Support::Turns::kNo;
        if (turns && !(support.turns == Support::Turns::kWithA ? a : b).turnsDirections())
            support.overlap = -std::numeric_limits<double>::infinity();
        if (support.parting || turns) continue;
        const Vec3d& n = support.normal;
        const double sinks =
            std::max(0.0, a.advance(n, reachA) + b.advance(-n, reachB)) + std::max(0.0, thickness.growth());
        if (sinks <= support.rounding) along_.push_back(support);
    }
}

BodyWay::Turned SupportSet::directionAt(const Support& support, double t) const {
    if (support.turns == Support::Turns::kNo) return {support.normal, Vec3d::Zero(), 0};
    return (support.turns == Support::Turns::kWithA ? a_ : b_).turned(support.normal, t);
}

/// Along the normal n(t) every corner of B is above every corner of A by n · (b - a), but for the overlap. Where n
/// turns, |n''| <= turn², and the product rule bounds how fast that can fall.
double SupportSet::heldFor(const MovingPair& pair, double t, const Support& support, double overlap) const {
    if (support.parting) {
        const double apart =
            lowest(support.normal, pair.velocityB) + lowest(-support.normal, pair.velocityA) - thickness_.growth();
        const double speed = fastest(pair);
        return straight_ && speed > 0 && apart >= 0.5 * speed ? 2 : 0;
    }
    const BodyWay::Turned d = directionAt(support, t);
    double bend = a_.accelerationAlong(d.direction, pair.reachA) + b_.accelerationAlong(d.direction, pair.reachB);
    if (d.turn > 0) {
        const double left = 1 - t, acceleration = a_.acceleration(pair.reachA) + b_.acceleration(pair.reachB);
        const double speed = fastest(pair) + left * acceleration;
        double away = 0;
        for (const Vec3d& a : pair.a)
            for (const Vec3d& b : pair.b) away = std::max(away, (b - a).norm());
        bend = acceleration + 2 * d.turn * speed + d.turn * d.turn * (away + left * speed);
    }
    double held = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const Vec3d away = pair.b[j] - pair.a[i];
            const double gap = d.direction.dot(away) + overlap - 2 * margin_ - thickness_.at(t);
            const double rate = d.direction.dot(pair.velocityB[j] - pair.velocityA[i]) + d.rate.dot(away) -
                                2 * margin_ - thickness_.growth();
            held = std::min(held, timeUntilZero(gap, rate, bend));
        }
    return held;
}

double SupportSet::heldFor(const MovingPair& pair, double t, std::uint32_t ticket) const {
    const Ticket& of = tickets_[ticket - 1];
    return heldFor(pair, t, supports_[of.support], of.overlap);
}

bool SupportSet::stays(const MovingPair& pair, double t, std::uint32_t ticket) const {
    return t + heldFor(pair, t, ticket) > t;
}

bool SupportSet::behind(const Vec3d& apart, double t, std::uint32_t ticket) const {
    return directionAt(supports_[tickets_[ticket - 1].support], t).direction.dot(apart) < kBehind;
}

std::uint32_t SupportSet::choose(const MovingPair& pair, double t, const Vec3d& apart, std::uint32_t before,
                                 const Start& start) {
    const bool meet = apart.isZero(0);
    const Vec3d was = before ? directionAt(supports_[tickets_[before - 1].support], t).direction : Vec3d(Vec3d::Zero());
    const auto flush = [&](const Support& support, const Vec3d& n, double overlap) {
        if (overlap > support.overlap || was.dot(n) < kBehind) return false;
        // Faces that meet have no side that could be told any more, but at the start, or where they lie in a plane.
        if ((before || (meet && t > 0)) && overlap > support.rounding) return false;
        if (meet || apart.dot(n) >= kBehind) return true;
        // Behind it: only what had been sunk in so far at the start.
        if (before) return false;
        const auto [a0, b0] = start();
        const NearestPoints near = nearestPoints(a0, b0);
        return near.distance <= thickness_.at(0) ||
               (overlapOf(support.normal, a0, b0) + thickness_.at(0) <= support.overlap &&
                support.normal.dot(near.onB - near.onA) < kBehind * near.distance);
    };
    double least = std::numeric_limits<double>::infinity();
    std::vector<double> overlaps(supports_.size(), least);
    for (std::size_t i = 0; i < supports_.size(); ++i) {
        const Vec3d n = directionAt(supports_[i], t).direction;
        const double overlap = overlapOf(n, pair.a, pair.b) + thickness_.at(t);
        if (!flush(supports_[i], n, overlap)) continue;
        overlaps[i] = overlap;
        least = std::min(least, overlap);
    }
    Ticket best{supports_.size(), 0, t};
    double longest = 0;
    for (std::size_t i = 0; i < supports_.size(); ++i) {
        // Infinite: it does not lie flush with this one.
        if (!std::isfinite(overlaps[i]) || overlaps[i] > std::max(least, supports_[i].rounding)) continue;
        const double allowed = std::max(overlaps[i], 0.0) + supports_[i].rounding;
        const double held = heldFor(pair, t, supports_[i], allowed);
        if (!(t + held > t) || held <= longest) continue;
        longest = held;
        best = {i, allowed, t};
    }
    if (best.support == supports_.size()) return 0;
    tickets_.push_back(best);
    return static_cast<std::uint32_t>(tickets_.size());
}

}  // namespace tessera
