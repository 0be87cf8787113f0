#include "server/collision/rigid_bodies/PathSweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/collision/query/FacesNear.h"
#include "server/collision/query/TimeOfImpact.h"

namespace tessera::rigid {

namespace {

/// Allowed depth, in sizes of the smaller body and in half thicknesses of the thinner.
constexpr double kAllowedSizes = 0.01, kAllowedHalves = 0.4;
/// In allowed depths: what one frame may add to a depth that is there, and how near to a limit is on it.
constexpr double kCreep = 0.01, kOnLimit = 4e-3, kSameHit = 0.3;
constexpr int kMostSteps = 100;
/// Of the slop: surfaces that move less are not looked at.
constexpr double kUnseen = 0.1;
constexpr double kRestsDeep = 1.5;
/// Surfaces that are deeper in each other as the frame begins are let go.
constexpr double kInEachOther = 5;
/// A way is looked at in pieces of so many sizes: the boxes around them hold few faces.
constexpr double kPieceSizes = 3;
constexpr double kMostPieces = 64;

/// How fast a part gets along: per whole way, its middle and beyond that any point of it.
struct Pace {
    Vec3d moved;
    double turning = 0;
};

double farthestFrom(const Vec3d& centre, const SweptPart& part) {
    if (part.solid != nullptr) return (part.solid->centre - centre).norm() + part.solid->radius;
    return (part.part->box.center() - centre).norm() + 0.5 * part.part->box.size().norm();
}

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

double lowest(const PlacedSolid& solid, const Vec3d& n) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3d& c : solid.corners) least = std::min(least, n.dot(c));
    return least;
}

/// The lowest corner along n, of a solid that has gone its way up to t.
double lowestAt(const PlacedSolid& solid, const BodyPath& path, double t, const Vec3d& n) {
    if (path.still() || t == 0) return lowest(solid, n);
    const Isometry3d to = path.at(t);
    return lowest(solid, to.linear().transpose() * n) + n.dot(to.translation());
}

double gapAlong(const PlacedSolid& a, const BodyPath& pathA, const PlacedSolid& b, const BodyPath& pathB, double t,
                const Vec3d& n) {
    return lowestAt(b, pathB, t, n) + lowestAt(a, pathA, t, -n);
}

/// Two convex solids on their ways.
class SolidSweep {
public:
    SolidSweep(const SweptPart& a, const PlacedSolid& solidA, const SweptPart& b, const PlacedSolid& solidB,
               double farA, double farB, double allowed, SweepScratch::Room& roomB, SweepScratch& scratch,
               QueryWork& work)
        : a_(a),
          b_(b),
          solidA_(solidA),
          solidB_(solidB),
          allowed_(allowed),
          roomB_(roomB),
          scratch_(scratch),
          work_(work),
          farA_(farA),
          farB_(farB) {}

    /// Along an axis that is known: is there enough room from start to end?
    [[nodiscard]] bool clears(const Vec3d& axis, double from, double to, double atFrom, double target) const {
        const double part = to - from;
        const double arcs = a_.path->arc(farA_, part) + b_.path->arc(farB_, part);
        return std::min(atFrom, gapAlong(solidA_, *a_.path, solidB_, *b_.path, to, axis)) - arcs >= target;
    }

    /// Whether they get deeper than they may between two times; then `t` is before that.
    bool find(double from, double to, double& t) {
        // Wider gaps than the whole way are as good as any.
        const double way = (a_.path->moved - b_.path->moved).norm() + a_.path->rate * farA_ + b_.path->rate * farB_;
        const SolidAxis start = axisAt(0, way);
        if (start.gap < -2 * allowed_) return false;
        target_ = std::min(-allowed_, start.gap - kCreep * allowed_);
        t = from;
        axis_ = from == 0 ? start : axisAt(from, way);
        for (int step = 0;; ++step) {
            work_.boxTests += 4;
            if (axis_.gap <= target_ + kOnLimit * allowed_ || step == kMostSteps || work_.exhausted()) return true;
            if (clears(axis_.normal, t, to, axis_.gap, target_)) return false;
            const double rate = std::max(0.0, axis_.normal.dot(a_.path->moved - b_.path->moved)) +
                                a_.path->rate * farA_ + b_.path->rate * farB_;
            if (rate * (to - t) <= axis_.gap - target_) return false;
            t += (axis_.gap - target_) / rate;
            axis_ = axisAt(t, way);
        }
    }

    /// What holds them at t; `near`: only what is as deep as that.
    void holds(double t, double gapAtMost, std::vector<SweepPoint>& out) {
        const SolidAxis axis = axisAt(t);
        if (axis.kind == SolidAxis::Kind::kNone || axis.gap > gapAtMost) return;
        const Isometry3d toA = a_.path->at(t), toB = b_.path->at(t);
        const PlacedSolid atA = movedTo(solidA_, toA, scratch_.a), atB = movedTo(solidB_, toB, roomB_);
        scratch_.points.clear();
        SolidQuery query;
        query.margin = std::max(allowed_, 0.0);
        contactManifold(atA, atB, axis, query, scratch_.clip, scratch_.points);
        if (scratch_.points.empty())
            scratch_.points.push_back({0.5 * (atA.centre + atB.centre), axis.normal, axis.gap});
        reduceContacts(scratch_.points, 0, kAllowedSizes * std::min(a_.size, b_.size));
        const Isometry3d backA = toA.inverse(), backB = toB.inverse();
        for (const ContactPoint& p : scratch_.points) {
            SweepPoint& point = out.emplace_back();
            point.onA = backA * (p.position - 0.5 * p.gap * p.normal);
            point.onB = backB * (p.position + 0.5 * p.gap * p.normal);
            point.normal = p.normal;
            point.gap = p.normal.dot(point.onB - point.onA);
        }
    }

    [[nodiscard]] double target() const { return target_; }

private:
    SolidAxis axisAt(double t, double margin = std::numeric_limits<double>::infinity()) {
        const PlacedSolid *a = &solidA_, *b = &solidB_;
        PlacedSolid atA, atB;
        if (t > 0 && !a_.path->still()) {
            atA = movedTo(solidA_, a_.path->at(t), scratch_.a);
            a = &atA;
        }
        if (t > 0 && !b_.path->still()) {
            atB = movedTo(solidB_, b_.path->at(t), roomB_);
            b = &atB;
        }
        ++work_.triangleTests;
        if (manyAxes(solidA_, solidB_) && a_.part->given->hull != nullptr && b_.part->given->hull != nullptr &&
            b_.solid != nullptr)
            return deepest(t);
        return widestGap(*a, *b, margin, 0, SolidMemory{}, scratch_.clip);
    }

    /// Of large hulls.
    SolidAxis deepest(double t) {
        SolidAxis out;
        const Affine3d worldA = a_.path->at(t) * a_.part->given->world, worldB = b_.path->at(t) * b_.part->given->world;
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
        const PlacedSolid atA = movedTo(solidA_, a_.path->at(t), scratch_.a);
        out.kind = SolidAxis::Kind::kSideOfA;
        out.a = sideAlong(atA, normal);
        return out;
    }

    const SweptPart &a_, &b_;
    const PlacedSolid &solidA_, &solidB_;
    double allowed_;
    SweepScratch::Room& roomB_;
    SweepScratch& scratch_;
    QueryWork& work_;
    double farA_, farB_;
    double target_ = 0;
    SolidAxis axis_;
    ConvexCache cache_;
};

/// A triangle as a solid without thickness.
const SolidShape& triangleShape() {
    static const SolidShape shape = [] {
        const std::vector<Vec3d> corners{Vec3d::Zero(), Vec3d::UnitX(), Vec3d::UnitY()};
        return solidShape(*ConvexHull::make(corners));
    }();
    return shape;
}

/// False: it has no area.
bool placeTriangle(const Triangle& t, const Affine3d& world, SweepScratch::Room& room, PlacedSolid& out) {
    Affine3d to = Affine3d::Identity();
    const Vec3d a = world * t[0], ab = world * t[1] - a, ac = world * t[2] - a;
    Vec3d n = ab.cross(ac);
    const double area = n.norm();
    if (!(area > 1e-10 * std::max(ab.squaredNorm(), ac.squaredNorm()))) return false;
    n /= std::sqrt(area);
    to.linear().col(0) = ab;
    to.linear().col(1) = ac;
    to.linear().col(2) = n;
    to.translation() = a;
    const SolidShape& shape = triangleShape();
    room.corners.resize(shape.corners.size());
    room.sides.resize(shape.sides());
    room.edges.resize(placedEdges(shape));
    out = place(shape, to, room.corners, room.sides, room.edges);
    return true;
}

Box grown(Box box, double by) {
    box.lower.array() -= by;
    box.upper.array() += by;
    return box;
}

/// A solid among the faces of a surface.
class FaceSweep {
public:
    FaceSweep(const SweptPart& solid, const SweptPart& faces, bool solidIsA, double allowed, SweepScratch& scratch,
              QueryWork& work)
        : solid_(solid),
          faces_(faces),
          solidIsA_(solidIsA),
          allowed_(allowed),
          scratch_(scratch),
          work_(work),
          farSolid_(farthestFrom(solid.path->centre, solid)) {}

    SweepHit find() {
        SweepHit out;
        const Affine3d& world = faces_.part->given->world;
        const Affine3d back = world.inverse();
        const BodyPath &path = *solid_.path, &ground = *faces_.path;
        // Seen from the surface as the frame begins.
        const auto placeAt = [&](double t) { return ground.at(t).inverse() * path.at(t); };
        const double length = (path.moved - ground.moved).norm() + ground.rate * reachOfGround();
        double pieces = std::ceil(length / (kPieceSizes * 2 * std::max(solid_.solid->radius, 1e-12)));
        if (ground.rate > 0) pieces = std::max(pieces, 8.0);
        const int count = static_cast<int>(std::clamp(pieces, 1.0, kMostPieces));
        for (int piece = 0; piece < count; ++piece) {
            const double from = piece / double(count), to = (piece + 1) / double(count), part = to - from;
            Box box = ballBox(placeAt(from));
            box.extend(ballBox(placeAt(to)));
            double slack = path.arc(farSolid_, part) + allowed_;
            // Turning with the ground adds what an arc of it leaves its chord, and what both together do.
            if (ground.rate > 0)
                slack += part * part * ground.rate *
                         (ground.rate * reachOfGround() + 2 * (path.moved - ground.moved).norm());
            scratch_.faces.clear();
            if (!facesNear(*faces_.part->given->tree, grown(box, slack).transformed(back), work_, scratch_.faces)) {
                out.hit = true;
                out.t = from;
                return out;
            }
            double first = to;
            for (const std::uint32_t face : scratch_.faces) {
                double t = to;
                if (!meets(face, from, first, t) || !(t < first || !out.hit)) continue;
                first = t;
                out.hit = true;
            }
            if (!out.hit) continue;
            out.t = first;
            for (const std::uint32_t face : scratch_.faces) holds(face, first, out.points);
            if (!solidIsA_)
                for (SweepPoint& p : out.points) {
                    std::swap(p.onA, p.onB);
                    p.normal = -p.normal;
                }
            return out;
        }
        return out;
    }

private:
    [[nodiscard]] double reachOfGround() const {
        return (solid_.solid->centre - faces_.path->centre).norm() + solid_.path->moved.norm() + solid_.solid->radius;
    }
    [[nodiscard]] Box ballBox(const Isometry3d& to) const {
        if (solid_.path->rate == 0 && faces_.path->rate == 0) {
            Box box = solid_.solid->box;
            return {box.lower + to.translation(), box.upper + to.translation()};
        }
        const Vec3d centre = to * solid_.solid->centre;
        return grown({centre, centre}, solid_.solid->radius);
    }

    bool meets(std::uint32_t face, double from, double to, double& t) {
        PlacedSolid triangle;
        if (!placeTriangle(faces_.part->given->tree->mesh().triangle(face), faces_.part->given->world, scratch_.face,
                           triangle))
            return false;
        ++work_.triangleTests;
        const double far = (triangle.centre - faces_.path->centre).norm() + triangle.radius;
        SolidSweep sweep(solid_, *solid_.solid, faces_, triangle, farSolid_, far, allowed_, scratch_.b, scratch_,
                         work_);
        // Most stay on their side of its plane.
        const Vec3d n = triangle.sides[0].normal;
        const double at = gapAlong(*solid_.solid, *solid_.path, triangle, *faces_.path, from, n);
        if (at >= -allowed_ && sweep.clears(n, from, to, at, -allowed_)) return false;
        const double behind = gapAlong(*solid_.solid, *solid_.path, triangle, *faces_.path, from, -n);
        if (behind >= -allowed_ && sweep.clears(-n, from, to, behind, -allowed_)) return false;
        return sweep.find(from, to, t);
    }

    void holds(std::uint32_t face, double t, std::vector<SweepPoint>& out) {
        PlacedSolid triangle;
        if (out.size() >= kMostOfEncounter || !placeTriangle(faces_.part->given->tree->mesh().triangle(face),
                                                             faces_.part->given->world, scratch_.face, triangle))
            return;
        const double far = (triangle.centre - faces_.path->centre).norm() + triangle.radius;
        SolidSweep sweep(solid_, *solid_.solid, faces_, triangle, farSolid_, far, allowed_, scratch_.b, scratch_,
                         work_);
        sweep.holds(t, -allowed_ + kSameHit * allowed_, out);
    }

    const SweptPart &solid_, &faces_;
    bool solidIsA_;
    double allowed_;
    SweepScratch& scratch_;
    QueryWork& work_;
    double farSolid_;
};

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

double turningOf(const SweptPart& part) {
    return part.path->rate > 0 ? part.path->rate * farthestFrom(part.path->centre, part) : 0;
}

double allowedDepth(const SweptPart& a, const SweptPart& b) {
    double out = kAllowedSizes * std::min(a.size, b.size);
    for (const SweptPart* part : {&a, &b})
        if (part->solid != nullptr && part->solid->inner > 0) out = std::min(out, kAllowedHalves * part->solid->inner);
    if (!(a.solid != nullptr && a.solid->inner > 0) && !(b.solid != nullptr && b.solid->inner > 0)) return 0;
    return out;
}

SweepHit sweep(const SweptPart& a, const SweptPart& b, const KnownGap& known, SweepScratch& scratch, QueryWork& work) {
    SweepHit out;
    if (a.path->still() && b.path->still()) return out;
    const double farA = farthestFrom(a.path->centre, a), farB = farthestFrom(b.path->centre, b);
    const double way = (a.path->moved - b.path->moved).norm() + a.path->rate * farA + b.path->rate * farB;
    if (a.solid != nullptr && b.solid != nullptr) {
        if (a.solid->sides.empty() || b.solid->sides.empty()) return out;
        const double allowed = allowedDepth(a, b);
        if (known.gap - way >= -allowed) return out;
        SolidSweep sweep(a, *a.solid, b, *b.solid, farA, farB, allowed, scratch.b, scratch, work);
        if (known.gap >= -allowed && !known.normal.isZero(0) &&
            sweep.clears(known.normal, 0, 1, gapAlong(*a.solid, *a.path, *b.solid, *b.path, 0, known.normal), -allowed))
            return out;
        out.hit = sweep.find(0, 1, out.t);
        if (!out.hit) {
            out.t = 1;
            return out;
        }
        sweep.holds(out.t, std::numeric_limits<double>::infinity(), out.points);
        return out;
    }
    if (a.solid != nullptr || b.solid != nullptr) {
        const SweptPart &solid = a.solid != nullptr ? a : b, &faces = a.solid != nullptr ? b : a;
        const double allowed = allowedDepth(a, b);
        if (solid.solid->sides.empty() || (way <= known.slack && known.nearest - way >= -allowed)) return out;
        return FaceSweep(solid, faces, a.solid != nullptr, allowed, scratch, work).find();
    }
    if (way <= kUnseen * known.slop || (known.points.empty() && way <= known.slack)) return out;
    return sweepSurfaces(a, b, known, work);
}

}  // namespace tessera::rigid
