#include "server/collision/rigid_bodies/FaceSweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/rigid_bodies/SolidSweep.h"

namespace tessera::rigid {

namespace {

/// In allowed depths: what is so much less deep holds too.
constexpr double kSameHit = 0.3;
/// A way is looked at in pieces of so many sizes: the boxes around them hold few faces.
constexpr double kPieceSizes = 3;
constexpr double kMostPieces = 64;
/// Of the square of the longer of two edges: triangles with less area meet nothing.
constexpr double kNoArea = 1e-10;
constexpr double kSameAxis = 1 - 1e-9;  ///< cosine
constexpr double kAny = std::numeric_limits<double>::infinity();

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
    if (!(area > kNoArea * std::max(ab.squaredNorm(), ac.squaredNorm()))) return false;
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

/// A solid on a piece of its way, beside triangles that stay where they are. Most are passed: some axis that is quickly
/// found tells.
class Passing {
public:
    /// `far`: no point of the solid is farther from the path's centre. `scratch.axes`: normals of what it rests on.
    Passing(const PlacedSolid& solid, const BodyPath& path, double far, double from, double to, SweepScratch& scratch)
        : from_(scratch.from.corners), to_(scratch.cornersTo), axes_(scratch.axes), arc_(path.arc(far, to - from)) {
        const Isometry3d first = path.at(from), last = path.at(to);
        from_.clear();
        to_.clear();
        for (const Vec3d& c : solid.corners) {
            from_.push_back(first * c);
            to_.push_back(last * c);
            box_.extend(from_.back());
            box_.extend(to_.back());
        }
        centre_ = 0.5 * (first * solid.centre + last * solid.centre);
        for (PlacedSide& axis : scratch.axes) axis.offset = leastAlong(axis.normal);
        if (from == 0) {
            sides_ = solid.sides;
            return;
        }
        scratch.from.sides.clear();
        for (const PlacedSide& side : solid.sides) {
            const Vec3d normal = first.linear() * side.normal;
            scratch.from.sides.push_back({normal, side.offset + normal.dot(first.translation())});
        }
        sides_ = scratch.from.sides;
    }

    /// By how much more than the target they are kept apart at least; below 0: perhaps not. Triangles without area are
    /// passed.
    [[nodiscard]] double clears(const Triangle& t, double target) const {
        const double gap = target + arc_;
        double room = -1;
        const auto parts = [&](double by) { return (room = by - gap) >= 0; };
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax({t[0][k], t[1][k], t[2][k]});
            if (parts(low - box_.upper[k]) || parts(box_.lower[k] - high)) return room;
        }
        const Vec3d ab = t[1] - t[0], ac = t[2] - t[0];
        Vec3d n = ab.cross(ac);
        const double area = n.norm();
        if (!(area > kNoArea * std::max(ab.squaredNorm(), ac.squaredNorm()))) return kAny;
        n /= area;
        const double offset = n.dot(t[0]);
        if (parts(leastAlong(n) - offset) || parts(offset + leastAlong(-n))) return room;
        for (const PlacedSide& axis : axes_)
            if (parts(axis.offset - mostOf(t, axis.normal))) return room;
        const Vec3d nearest = nearestOnTriangle(t, centre_), away = centre_ - nearest;
        if (const double distance = away.norm(); distance > 0) {
            const Vec3d axis = away / distance;
            if (parts(leastAlong(axis) - mostOf(t, axis))) return room;
        }
        for (const PlacedSide& side : sides_) {
            const double least = -mostOf(t, -side.normal);
            if (least - side.offset >= gap && parts(least + std::min(-side.offset, lowest(to_, -side.normal))))
                return room;
        }
        return -1;
    }

private:
    [[nodiscard]] double leastAlong(const Vec3d& n) const { return std::min(lowest(from_, n), lowest(to_, n)); }
    static double mostOf(const Triangle& t, const Vec3d& n) {
        return std::max({n.dot(t[0]), n.dot(t[1]), n.dot(t[2])});
    }

    std::vector<Vec3d>&from_, &to_;
    std::span<const PlacedSide> axes_;   ///< and how far it comes down along them
    double arc_;                         ///< no corner leaves the straight line between its places by more
    std::span<const PlacedSide> sides_;  ///< where the piece begins
    Vec3d centre_;                       ///< halfway
    Box box_;
};

/// A solid among the faces of a surface.
class FaceSweep {
public:
    FaceSweep(const SweptPart& solid, const SweptPart& faces, bool solidIsA, const KnownGap& known, double way,
              double allowed, SweepScratch& scratch, QueryWork& work, bool wantPoints)
        : solid_(solid),
          faces_(faces),
          solidIsA_(solidIsA),
          known_(known),
          way_(way),
          wantPoints_(wantPoints),
          allowed_(allowed),
          scratch_(scratch),
          work_(work),
          farSolid_(farthestOf(solid)) {
        scratch.axes.clear();
        for (const ContactPoint& p : known.points) {
            const Vec3d normal = solidIsA ? Vec3d(-p.normal) : p.normal;
            const auto same = [&](const PlacedSide& axis) { return axis.normal.dot(normal) > kSameAxis; };
            if (std::ranges::none_of(scratch.axes, same)) scratch.axes.push_back({normal, 0});
        }
    }

    SweepHit find() {
        SweepHit out;
        const bool allKnown = way_ <= known_.slack;
        if (allKnown) {
            out.room = nearByAll();
            if (scratch_.faces.empty()) return out;
        } else {
            // Faces that are not near enough to be looked at are as far away as may be sunk in.
            out.room = 2 * allowed_;
        }
        const Affine3d& world = faces_.part->given->world;
        const Affine3d back = world.inverse();
        const BodyPath &path = *solid_.path, &ground = *faces_.path;
        // Seen from the surface as the frame begins.
        const auto placeAt = [&](double t) { return ground.at(t).inverse() * path.at(t); };
        const double length = (path.moved - ground.moved).norm() + ground.rate * reachOfGround();
        double pieces = std::ceil(length / (kPieceSizes * 2 * std::max(solid_.solid->radius, 1e-12)));
        if (ground.rate > 0) pieces = std::max(pieces, 8.0);
        // One where it is not a number: the order of these arguments says so.
        const int count = static_cast<int>(std::min(kMostPieces, std::max(1.0, pieces)));
        for (int piece = 0; piece < count; ++piece) {
            const double from = piece / double(count), to = (piece + 1) / double(count), part = to - from;
            if (!allKnown) {
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
            }
            double first = to;
            std::optional<Passing> passing;
            if (ground.still()) passing.emplace(*solid_.solid, path, farSolid_, from, to, scratch_);
            for (const std::uint32_t face : scratch_.faces) {
                if (passing) {
                    if (const double room = passing->clears(placed(face), -allowed_); room >= 0) {
                        out.room = std::min(out.room, room);
                        continue;
                    }
                }
                double t = to;
                if (!meets(face, from, first, t, out.room) || !(t < first || !out.hit)) continue;
                first = t;
                out.hit = true;
            }
            if (!out.hit) continue;
            out.t = first;
            if (!wantPoints_) return out;
            const double deep = -allowed_ + kSameHit * allowed_;
            if (passing) passing.emplace(*solid_.solid, path, farSolid_, first, first, scratch_);
            for (const std::uint32_t face : scratch_.faces)
                if (!passing || passing->clears(placed(face), deep) < 0) holds(face, first, deep, out.points);
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
    /// Those that may be met on a way that is no longer than what was looked at. How much nearer all others might come.
    double nearByAll() {
        double room = known_.slack - way_ + allowed_;
        scratch_.faces.clear();
        for (const NearFace& near : known_.faces) {
            const double left = near.gap - way_ + allowed_;
            if (left >= 0)
                room = std::min(room, left);
            else
                scratch_.faces.push_back(near.face);
        }
        return room;
    }

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

    bool meets(std::uint32_t face, double from, double to, double& t, double& room) {
        PlacedSolid triangle;
        if (!placeTriangle(faces_.part->given->tree->mesh().triangle(face), faces_.part->given->world, scratch_.face,
                           triangle))
            return false;
        ++work_.triangleTests;
        SolidSweep sweep = sweepOf(triangle);
        if (!faces_.path->still()) {
            // Most stay on their side of its plane.
            const Vec3d n = triangle.sides[0].normal;
            if (sweep.keptApartByB(-n, from, to) || sweep.keptApartByB(n, from, to)) {
                room = std::min(room, sweep.room());
                return false;
            }
        }
        if (sweep.find(from, to, t)) return true;
        room = std::min(room, sweep.room());
        return false;
    }

    [[nodiscard]] SolidSweep sweepOf(const PlacedSolid& triangle) const {
        const double far = (triangle.centre - faces_.path->centre).norm() + triangle.radius;
        return {solid_, *solid_.solid, farSolid_, faces_, triangle, far, allowed_, scratch_, work_};
    }

    [[nodiscard]] Triangle placed(std::uint32_t face) const {
        return tessera::transformed(faces_.part->given->world, faces_.part->given->tree->mesh().triangle(face));
    }

    /// What is as deep as that.
    void holds(std::uint32_t face, double t, double deep, std::vector<SweepPoint>& out) {
        PlacedSolid triangle;
        if (out.size() >= kMostOfEncounter || !placeTriangle(faces_.part->given->tree->mesh().triangle(face),
                                                             faces_.part->given->world, scratch_.face, triangle))
            return;
        sweepOf(triangle).holds(t, deep, out);
    }

    const SweptPart &solid_, &faces_;
    bool solidIsA_;
    const KnownGap& known_;
    double way_;
    bool wantPoints_;
    double allowed_;
    SweepScratch& scratch_;
    QueryWork& work_;
    double farSolid_;
};

}  // namespace

SweepHit sweepAmongFaces(const SweptPart& solid, const SweptPart& faces, bool solidIsA, const KnownGap& known,
                         double way, double allowed, SweepScratch& scratch, QueryWork& work, bool wantPoints) {
    return FaceSweep(solid, faces, solidIsA, known, way, allowed, scratch, work, wantPoints).find();
}

}  // namespace tessera::rigid
