#include "server/collision/rigid_bodies/SolidSweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::rigid {

namespace {

/// In allowed depths: what one frame may add to a depth that is there, and how near to a limit is on it.
constexpr double kCreep = 0.01, kOnLimit = 4e-3;
constexpr int kMostSteps = 100;
/// How often a span along one axis is shortened until it is clear.
constexpr int kShorter = 4;

}  // namespace

/// A placed solid somewhere else: `to` moves it from where it is as the frame begins.
PlacedSolid movedTo(const PlacedSolid& from, const Isometry3d& to, SweepScratch::Room& room) {
    room.corners.resize(from.corners.size());
    room.sides.resize(from.sides.size());
    room.edges.resize(from.edges.size());
    for (std::size_t i = 0; i < from.corners.size(); ++i) room.corners[i] = to * from.corners[i];
    const Mat3d turn = to.linear();
    for (std::size_t i = 0; i < from.sides.size(); ++i) {
        const PlacedSide& side = from.sides[i];
        const Vec3d normal = turn * side.normal;
        room.sides[i] = {normal, side.offset + normal.dot(to.translation())};
    }
    for (std::size_t i = 0; i < from.edges.size(); ++i) {
        const PlacedEdge& e = from.edges[i];
        room.edges[i] = {to * e.from, turn * e.along, turn * e.first, turn * e.second, turn * e.crossed};
    }
    PlacedSolid out = from;
    out.corners = room.corners;
    out.sides = room.sides;
    out.edges = room.edges;
    out.centre = to * from.centre;
    return out;
}

SolidSweep::SolidSweep(const SweptPart& a, const PlacedSolid& solidA, double farA, const SweptPart& b,
                       const PlacedSolid& solidB, double farB, double allowed, SweepScratch& scratch, QueryWork& work)
    : a_(a),
      b_(b),
      solidA_(solidA),
      solidB_(solidB),
      allowed_(allowed),
      farA_(farA),
      farB_(farB),
      scratch_(scratch),
      work_(work) {
    // Of the second derivative of R(-t) (x(t) - c(t)): turning of the one that looks, both together, of the other. x is
    // never farther from c than where it is as the frame begins and how far both go.
    const BodyPath &pathA = *a.path, &pathB = *b.path;
    const double way = (pathA.moved - pathB.moved).norm();
    const auto bend = [&](const BodyPath& looks, const BodyPath& goes, const PlacedSolid& seen, double far) {
        const double distance = (seen.centre - looks.centre).norm() + seen.radius + way + goes.rate * far;
        return looks.rate * (looks.rate * distance + 2 * (way + goes.rate * far)) + goes.rate * goes.rate * far;
    };
    bend_[0] = bend(pathA, pathB, solidB, farB);
    bend_[1] = bend(pathB, pathA, solidA, farA);
}

Isometry3d SolidSweep::bSeenFromA(double t) const {
    if (a_.path->still()) return b_.path->at(t);
    return a_.path->at(t).inverse() * b_.path->at(t);
}

/// As BodyPath::arc: the speed of turning is not quite the same all the way.
double SolidSweep::arc(Seen seen, double part) const {
    const double turning = (a_.path->rate + b_.path->rate) * part;
    return 0.125 * part * part * bend_[static_cast<int>(seen)] * (1 + turning);
}

SolidSweep::Look SolidSweep::lookAlong(Seen seen, const Vec3d& normalInA, double t) const {
    if (seen == Seen::kFromA) return {seen, normalInA, lowest(solidA_.corners, -normalInA)};
    const Vec3d normal = t > 0 ? Vec3d(bSeenFromA(t).linear().transpose() * normalInA) : normalInA;
    return {seen, normal, lowest(solidB_.corners, normal)};
}

double SolidSweep::gapAt(const Look& look, double t) const {
    const bool fromA = look.seen == Seen::kFromA;
    const Vec3d n = fromA ? look.normal : Vec3d(-look.normal);
    const PlacedSolid& other = fromA ? solidB_ : solidA_;
    if (t == 0) return look.own + lowest(other.corners, n);
    const Isometry3d b = bSeenFromA(t);
    if (fromA) return look.own + lowest(other.corners, b.linear().transpose() * n) + n.dot(b.translation());
    return look.own + lowest(other.corners, b.linear() * n) - (b.linear() * n).dot(b.translation());
}

double SolidSweep::clearFor(const Look& look, double gap, double t, double to, double target) {
    double span = to - t, sure = 0;
    for (int i = 0; i <= kShorter; ++i) {
        const double end = gapAt(look, t + span), bent = arc(look.seen, span), closes = std::max(gap - end, 0.0);
        room_ = gap - closes - bent - target;
        if (room_ >= 0) return span;
        // On a shorter one both are less: by so much surely, and by the other perhaps.
        const double room = std::max(gap - target, 0.0);
        sure = std::max(sure, span * std::min(1.0, room / (closes + 4 * bent)));
        span *= std::min(0.9, room / (closes + bent));
        if (!(span > sure)) break;
    }
    return sure;
}

bool SolidSweep::keptApartByB(const Vec3d& fromAToB, double from, double to) {
    const Look look{Seen::kFromB, fromAToB, lowest(solidB_.corners, fromAToB)};
    const double gap = gapAt(look, from);
    return gap >= -allowed_ && clearFor(look, gap, from, to, -allowed_) >= to - from;
}

bool SolidSweep::find(double from, double to, double& t, const SolidGap& known) {
    t = from;
    double target = -allowed_;
    // Wider gaps than the whole way are as good as any.
    const double way = (a_.path->moved - b_.path->moved).norm() + a_.path->rate * farA_ + b_.path->rate * farB_;
    SolidAxis axis;
    if (from == 0 && known.gap >= (kCreep - 1) * allowed_ && !known.normal.isZero(0)) {
        for (const Seen seen : {Seen::kFromA, Seen::kFromB}) {
            const Look look = lookAlong(seen, known.normal, 0);
            if (const double gap = gapAt(look, 0); gap >= target) t = std::max(t, clearFor(look, gap, 0, to, target));
            if (t >= to) return false;
        }
        axis = axisAt(t, way);
    } else {
        axis = axisAt(0, way);
        if (axis.gap < -2 * allowed_) {
            room_ = std::numeric_limits<double>::infinity();
            return false;
        }
        target = std::min(target, axis.gap - kCreep * allowed_);
        if (from > 0) axis = axisAt(from, way);
    }
    for (int step = 0;; ++step) {
        work_.boxTests += 4;
        if (axis.gap <= target + kOnLimit * allowed_ || step == kMostSteps || work_.exhausted()) return true;
        // Seen from whom it holds longer: what rolls on a plane turns under its normal, what lies on a tray turns with
        // it.
        const Seen first = axis.kind == SolidAxis::Kind::kSideOfA ? Seen::kFromA : Seen::kFromB;
        double span = 0;
        for (const Seen seen : {first, first == Seen::kFromA ? Seen::kFromB : Seen::kFromA})
            if (span < to - t)
                span = std::max(span, clearFor(lookAlong(seen, axis.normal, t), axis.gap, t, to, target));
        if (span >= to - t) {
            // Of one look that was for the whole way.
            if (t > from) room_ = 0;
            return false;
        }
        t += span;
        axis = axisAt(t, way);
    }
}

void SolidSweep::holds(double t, double deep, std::vector<SweepPoint>& out) {
    const SolidAxis axis = axisAt(t, std::numeric_limits<double>::infinity());
    if (axis.kind == SolidAxis::Kind::kNone || axis.gap > deep) return;
    const Isometry3d toB = bSeenFromA(t), backB = toB.inverse();
    const PlacedSolid atB = movedTo(solidB_, toB, scratch_.moved);
    scratch_.points.clear();
    SolidQuery query;
    query.margin = std::max(allowed_, 0.0);
    contactManifold(solidA_, atB, axis, query, scratch_.clip, scratch_.points);
    if (scratch_.points.empty())
        scratch_.points.push_back({0.5 * (solidA_.centre + atB.centre), axis.normal, axis.gap});
    reduceContacts(scratch_.points, 0, kAllowedSizes * std::min(a_.size, b_.size));
    const Mat3d turn = a_.path->at(t).linear();
    for (const ContactPoint& p : scratch_.points) {
        SweepPoint& point = out.emplace_back();
        point.onA = p.position - 0.5 * p.gap * p.normal;
        point.onB = backB * (p.position + 0.5 * p.gap * p.normal);
        point.normal = turn * p.normal;
        point.gap = point.normal.dot(point.onB - point.onA);
    }
}

/// In A's place as the frame begins.
SolidAxis SolidSweep::axisAt(double t, double margin) {
    ++work_.triangleTests;
    if (manyAxes(solidA_, solidB_) && a_.part->given->hull != nullptr && b_.part->given->hull != nullptr &&
        b_.solid != nullptr)
        return deepestAt(t);
    if (t == 0) return widestGap(solidA_, solidB_, margin, 0, SolidMemory{}, scratch_.clip);
    return widestGap(solidA_, movedTo(solidB_, bSeenFromA(t), scratch_.moved), margin, 0, SolidMemory{}, scratch_.clip);
}

/// Of large hulls.
SolidAxis SolidSweep::deepestAt(double t) {
    SolidAxis out;
    const Affine3d &worldA = a_.part->given->world, worldB = bSeenFromA(t) * b_.part->given->world;
    ConvexWork supports;
    const HullDepth depth =
        hullDepth(*a_.part->given->hull, *b_.part->given->hull, worldA.inverse() * worldB, supports, &cache_);
    out.gap = -std::numeric_limits<double>::infinity();
    if (!std::isfinite(depth.depth)) return out;
    Vec3d normal = worldA.linear().inverse().transpose() * depth.normal;
    if (!(normal.norm() > 0)) return out;
    normal.normalize();
    out.normal = normal;
    out.gap = normal.dot(worldA * depth.onB - worldA * depth.onA);
    out.kind = SolidAxis::Kind::kSideOfA;
    out.a = sideAlong(solidA_, normal);
    return out;
}

}  // namespace tessera::rigid
