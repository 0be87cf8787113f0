#include "server/collision/rigid_bodies/PathSweep.h"

#include <algorithm>
#include <limits>

#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/rigid_bodies/FaceSweep.h"
#include "server/collision/rigid_bodies/SolidSweep.h"

namespace tessera::rigid {

namespace {

/// Allowed depth, in half thicknesses of the thinner one.
constexpr double kAllowedHalves = 0.4;
/// Of the slop: surfaces that move less are not looked at.
constexpr double kUnseen = 0.1;
constexpr double kRestsDeep = 1.5;
/// Surfaces that are deeper in each other as the frame begins are let go.
constexpr double kInEachOther = 5;

BodyMotion motionOf(const SweptPart& part, const Vec3d& lift) {
    const BodyPath& path = *part.path;
    BodyMotion out;
    out.start.translation = path.centre + lift;
    out.end.translation = path.centre + path.moved + lift;
    out.end.rotation = path.turned;
    out.body_T_mesh = Eigen::Translation3d(-path.centre) * part.part->given->world;
    return out;
}

/// Neither is convex: the first contact of their faces, A held a little off what it touches as the frame begins.
SweepHit sweepSurfaces(const SweptPart& a, const SweptPart& b, const KnownGap& known, QueryWork& work) {
    SweepHit out;
    for (const ContactPoint& p : known.points)
        if (p.gap < -kInEachOther * known.slop) return out;
    double clearance = 0.5 * known.slop;
    for (int attempt = 0; attempt < 3; ++attempt, clearance *= 2) {
        Vec3d lift = Vec3d::Zero();
        for (int pass = 0; pass < 8; ++pass)
            for (const ContactPoint& p : known.points) {
                // What is deeper than things rest is not lifted out: frame by frame it would get through.
                if (p.gap < -kRestsDeep * known.slop) continue;
                const double missing = clearance - p.gap + p.normal.dot(lift);
                if (missing > 0) lift -= missing * p.normal;
            }
        ImpactOptions options;
        options.tolerance = 0.25 * clearance;
        const Impact impact = timeOfImpact(*a.part->given->tree, motionOf(a, lift), *b.part->given->tree,
                                           motionOf(b, Vec3d::Zero()), work, options);
        if (impact.complete && !impact.hit) return out;
        if (impact.complete && impact.t == 0 && attempt < 2) continue;
        out.hit = true;
        out.t = impact.t;
        if (!impact.hit || impact.t == 0) return out;
        const Isometry3d backA = a.path->at(impact.t).inverse(), backB = b.path->at(impact.t).inverse();
        SweepPoint point;
        point.onA = backA * (impact.point - lift);
        point.onB = backB * impact.point;
        point.normal = impact.normal;
        point.gap = point.normal.dot(point.onB - point.onA);
        out.points.push_back(point);
        return out;
    }
    return out;
}

}  // namespace

double farthestOf(const SweptPart& part) {
    const Vec3d& centre = part.path->centre;
    if (part.solid != nullptr) return (part.solid->centre - centre).norm() + part.solid->radius;
    return (part.part->box.center() - centre).norm() + 0.5 * part.part->box.size().norm();
}

double turningOf(const SweptPart& part) {
    return part.path->rate > 0 ? part.path->rate * farthestOf(part) : 0;
}

double allowedDepth(const SweptPart& a, const SweptPart& b) {
    double out = kAllowedSizes * std::min(a.size, b.size);
    for (const SweptPart* part : {&a, &b})
        if (part->solid != nullptr && part->solid->inner > 0) out = std::min(out, kAllowedHalves * part->solid->inner);
    if (!(a.solid != nullptr && a.solid->inner > 0) && !(b.solid != nullptr && b.solid->inner > 0)) return 0;
    return out;
}

SweepHit sweep(const SweptPart& a, const SweptPart& b, const KnownGap& known, SweepScratch& scratch, QueryWork& work,
               bool wantPoints) {
    SweepHit out;
    if (a.path->still() && b.path->still()) return out;
    const double farA = farthestOf(a), farB = farthestOf(b);
    const double way = (a.path->moved - b.path->moved).norm() + a.path->rate * farA + b.path->rate * farB;
    if (a.solid != nullptr && b.solid != nullptr) {
        if (a.solid->sides.empty() || b.solid->sides.empty()) return out;
        const double allowed = allowedDepth(a, b);
        out.room = known.gap - way + allowed;
        if (out.room >= 0) return out;
        // Along the axis that parts them now they come nearer by this at most.
        if (!known.normal.isZero(0)) {
            const double closes = std::max(known.normal.dot(a.path->moved - b.path->moved), 0.0);
            const double room = known.gap - closes - a.path->rate * farA - b.path->rate * farB + allowed;
            if (room >= 0) {
                out.room = room;
                return out;
            }
        }
        SolidSweep sweep(a, *a.solid, farA, b, *b.solid, farB, allowed, scratch, work);
        out.hit = sweep.find(0, 1, out.t, {known.gap, known.normal});
        if (!out.hit) {
            out.t = 1;
            out.room = sweep.room();
            return out;
        }
        if (wantPoints) sweep.holds(out.t, std::numeric_limits<double>::infinity(), out.points);
        return out;
    }
    if (a.solid != nullptr || b.solid != nullptr) {
        const SweptPart &solid = a.solid != nullptr ? a : b, &faces = a.solid != nullptr ? b : a;
        const double allowed = allowedDepth(a, b);
        if (solid.solid->sides.empty()) return out;
        out.room = std::min(known.slack - way, known.nearest - way + allowed);
        if (out.room >= 0) return out;
        return sweepAmongFaces(solid, faces, a.solid != nullptr, known, way, allowed, scratch, work, wantPoints);
    }
    if (way <= kUnseen * known.slop || (known.points.empty() && way <= known.slack)) return out;
    return sweepSurfaces(a, b, known, work);
}

}  // namespace tessera::rigid
