#include "server/collision/rigid_bodies/SolidContacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::rigid {

namespace {

/// Above so many products the library's descent is cheaper than looking at all axes.
constexpr std::size_t kMostProducts = 12'000;
/// Of the radius: so far the triangles of a side may lie below its plane, and more.
constexpr double kFlat = 1e-3;

double gapBeyond(const PlacedSide& side, const PlacedSolid& other) {
    return lowest(other.corners, side.normal) - side.offset;
}

/// Do the edges make a side of the Minkowski difference? (D. Gregorius, "The Separating Axis Test between Convex
/// Polyhedra", GDC 2013: their arcs on the Gauss map cross.)
bool crossing(const PlacedEdge& a, const PlacedEdge& b) {
    const double b1 = b.first.dot(a.crossed), b2 = b.second.dot(a.crossed);
    if (!(b1 * b2 < 0)) return false;
    const double a1 = a.first.dot(b.crossed), a2 = a.second.dot(b.crossed);
    return a1 * a2 < 0 && b1 * a2 < 0;
}

/// False: parallel, or the gap is no wider than `least`.
bool gapOfEdges(const PlacedEdge& a, const PlacedEdge& b, double least, double& gap, Vec3d& normal) {
    Vec3d n = a.along.cross(b.along);
    if (n.dot(a.first + a.second) < 0) n = -n;
    const double wide = n.dot(b.from - a.from), square = n.squaredNorm();
    // Most are told without a root.
    if (least >= 0 && (wide <= 0 || wide * wide <= least * least * square)) return false;
    if (least < 0 && wide < 0 && wide * wide >= least * least * square) return false;
    if (!(square > 1e-8 * a.along.squaredNorm() * b.along.squaredNorm())) return false;
    const double length = std::sqrt(square);
    gap = wide / length;
    normal = n / length;
    return gap > least;
}

/// How far the corners come along a direction, and the farthest.
double heightsOf(const PlacedSolid& solid, const Vec3d& direction, std::vector<double>& heights) {
    double most = -std::numeric_limits<double>::infinity();
    heights.clear();
    for (const Vec3d& c : solid.corners) {
        heights.push_back(direction.dot(c));
        most = std::max(most, heights.back());
    }
    return most;
}

/// Edges that come as far along the direction of the heights.
void reaching(const PlacedSolid& solid, std::span<const double> heights, double least,
              std::vector<std::uint32_t>& out) {
    out.clear();
    for (std::uint32_t e = 0; e < solid.edges.size(); ++e) {
        const SolidShape::Edge& ends = solid.shape->edges[solid.shape->flat ? e / 2 : e];
        if (std::max(heights[ends.from], heights[ends.to]) >= least) out.push_back(e);
    }
}

}  // namespace

SolidAxis widestGap(const PlacedSolid& a, const PlacedSolid& b, double margin, double fine, const SolidMemory& memory,
                    ClipScratch& scratch) {
    SolidAxis best;
    best.gap = -std::numeric_limits<double>::infinity();
    // No wider is what they are parted by along a side: of the other one a ball around its centre is inside.
    double enough = -std::numeric_limits<double>::infinity();
    const auto most = [&](const PlacedSide& plane, const PlacedSolid& other) {
        return plane.normal.dot(other.centre) - other.inner + kFlat * other.radius - plane.offset;
    };
    const auto side = [&](bool ofA, std::uint32_t s) {
        if (most(ofA ? a.sides[s] : b.sides[s], ofA ? b : a) < std::max(best.gap, enough)) return;
        const double gap = ofA ? gapBeyond(a.sides[s], b) : gapBeyond(b.sides[s], a);
        const double better = best.kind == SolidAxis::Kind::kSideOfA && !ofA ? fine : 0;
        if (!(gap > best.gap + better)) return;
        best = {ofA ? SolidAxis::Kind::kSideOfA : SolidAxis::Kind::kSideOfB, ofA ? s : 0, ofA ? 0 : s, gap,
                ofA ? a.sides[s].normal : Vec3d(-b.sides[s].normal)};
    };
    // What held them apart a frame ago mostly does so still.
    if (memory.kind == SolidAxis::Kind::kSideOfA && memory.a < a.sides.size()) side(true, memory.a);
    if (memory.kind == SolidAxis::Kind::kSideOfB && memory.b < b.sides.size()) side(false, memory.b);
    if (memory.kind == SolidAxis::Kind::kEdges && memory.a < a.edges.size() && memory.b < b.edges.size()) {
        SolidAxis edges{SolidAxis::Kind::kEdges, memory.a, memory.b, 0, {}};
        const PlacedEdge &ofA = a.edges[memory.a], &ofB = b.edges[memory.b];
        if (crossing(ofA, ofB) && gapOfEdges(ofA, ofB, margin, edges.gap, edges.normal)) return edges;
    }
    if (best.gap > margin) return best;
    // Which one it is must not depend on where it was looked for first.
    enough = best.gap - fine;
    best = {};
    best.gap = -std::numeric_limits<double>::infinity();
    for (std::uint32_t s = 0; s < a.sides.size(); ++s) {
        side(true, s);
        if (best.gap > margin) return best;
    }
    for (std::uint32_t s = 0; s < b.sides.size(); ++s) {
        side(false, s);
        if (best.gap > margin) return best;
    }
    // Where they are nearest, or deepest in each other, edges of both reach across the gap along any direction.
    const double farthestA = heightsOf(a, best.normal, scratch.heights),
                 farthestB = heightsOf(b, -best.normal, scratch.heightsOfOther), wide = std::max(margin, 0.0);
    reaching(a, scratch.heights, -farthestB - wide, scratch.edgesA);
    reaching(b, scratch.heightsOfOther, -farthestA - wide, scratch.edgesB);
    SolidAxis edges;
    edges.gap = best.gap + fine;
    for (const std::uint32_t i : scratch.edgesA)
        for (const std::uint32_t j : scratch.edgesB) {
            double gap = 0;
            Vec3d normal;
            if (!crossing(a.edges[i], b.edges[j]) || !gapOfEdges(a.edges[i], b.edges[j], edges.gap, gap, normal))
                continue;
            edges = {SolidAxis::Kind::kEdges, i, j, gap, normal};
            if (gap > margin) return edges;
        }
    return edges.kind == SolidAxis::Kind::kEdges ? edges : best;
}

bool manyAxes(const PlacedSolid& a, const PlacedSolid& b) {
    return a.sides.size() * b.corners.size() + b.sides.size() * a.corners.size() + a.edges.size() * b.edges.size() >
           kMostProducts;
}

namespace {

/// The incident side over the reference's, and the gaps along the reference's normal.
void clipSides(const PlacedSolid& reference, std::uint32_t side, const PlacedSolid& incident, const Vec3d& shift,
               bool referenceIsA, double margin, ClipScratch& scratch, std::vector<ContactPoint>& out) {
    const PlacedSide& plane = reference.sides[side];
    scratch.polygon.clear();
    for (const std::uint32_t c : incident.shape->outline(sideAlong(incident, -plane.normal)))
        scratch.polygon.push_back(incident.corners[c] + shift);
    clipToOutline(reference.corners, reference.shape->outline(side), plane.normal, reference.turn, scratch);
    for (const Vec3d& shifted : scratch.polygon) {
        const Vec3d p = shifted - shift;
        const double gap = plane.normal.dot(p) - plane.offset;
        if (gap <= margin)
            out.push_back({p - 0.5 * gap * plane.normal, referenceIsA ? plane.normal : Vec3d(-plane.normal), gap});
    }
}

void sideManifold(const PlacedSolid& a, const PlacedSolid& b, bool ofA, std::uint32_t side, double gap,
                  const SolidQuery& query, ClipScratch& scratch, std::vector<ContactPoint>& out) {
    const PlacedSolid &reference = ofA ? a : b, &incident = ofA ? b : a;
    const std::size_t first = out.size();
    clipSides(reference, side, incident, Vec3d::Zero(), ofA, query.margin, scratch, out);
    if (!(gap > 0)) {
        // The sides that face each other may overlap beside where the solids are deepest in each other, or not at all.
        double least = 0;
        for (std::size_t i = first; i < out.size(); ++i) least = std::min(least, out[i].gap);
        if (least <= 0.5 * gap) return;
        const PlacedSide& plane = reference.sides[side];
        const Vec3d* deepest = &incident.corners.front();
        for (const Vec3d& c : incident.corners)
            if (plane.normal.dot(c) < plane.normal.dot(*deepest)) deepest = &c;
        out.push_back({*deepest - 0.5 * gap * plane.normal, ofA ? plane.normal : Vec3d(-plane.normal), gap});
        return;
    }
    if (!scratch.polygon.empty()) return;
    // Beside each other: they may be above each other once they have come down to the plane.
    const Vec3d approach = ofA ? query.approach : Vec3d(-query.approach);
    const double closing = -reference.sides[side].normal.dot(approach);
    if (closing > gap)
        clipSides(reference, side, incident, approach * (gap / closing), ofA, query.margin, scratch, out);
}

}  // namespace

void contactManifold(const PlacedSolid& a, const PlacedSolid& b, const SolidAxis& axis, const SolidQuery& query,
                     ClipScratch& scratch, std::vector<ContactPoint>& out) {
    if (axis.kind == SolidAxis::Kind::kEdges) {
        const PlacedEdge &e = a.edges[axis.a], &f = b.edges[axis.b];
        Vec3d onA, onB;
        nearestOfSegments(e.from, e.along, f.from, f.along, onA, onB);
        out.push_back({0.5 * (onA + onB), axis.normal, axis.gap});
        return;
    }
    const bool ofA = axis.kind == SolidAxis::Kind::kSideOfA;
    sideManifold(a, b, ofA, ofA ? axis.a : axis.b, axis.gap, query, scratch, out);
}

namespace {

bool contactsOfLargeHulls(const SolidPart& a, const SolidPart& b, const SolidQuery& query, SolidMemory& memory,
                          ClipScratch& scratch, QueryWork& work, std::vector<ContactPoint>& out, SolidGap& parted) {
    ConvexWork supports;
    supports.limit = work.limit - std::min(work.limit, work.boxTests + work.triangleTests);
    const Affine3d a_T_b = a.world->inverse() * *b.world;
    const HullDepth depth = hullDepth(*a.hull, *b.hull, a_T_b, supports, &memory.cache);
    work.boxTests += supports.supports;
    if (!std::isfinite(depth.depth)) return false;
    // Of a scaled frame neither lengths nor right angles are the world's; points map as points, and planes as planes.
    const Vec3d onA = *a.world * depth.onA, onB = *a.world * depth.onB;
    Vec3d normal = a.world->linear().inverse().transpose() * depth.normal;
    if (!(normal.norm() > 0)) return false;
    normal.normalize();
    const double gap = normal.dot(onB - onA);
    parted = {gap, normal};
    if (gap > query.margin) return true;
    const std::uint32_t sideA = sideAlong(*a.placed, normal), sideB = sideAlong(*b.placed, -normal);
    const bool ofA = a.placed->sides[sideA].normal.dot(normal) >= -b.placed->sides[sideB].normal.dot(normal);
    const double sideGap =
        ofA ? gapBeyond(a.placed->sides[sideA], *b.placed) : gapBeyond(b.placed->sides[sideB], *a.placed);
    const std::size_t first = out.size();
    if (sideGap >= gap - query.fine - 0.1 * std::abs(gap))
        sideManifold(*a.placed, *b.placed, ofA, ofA ? sideA : sideB, sideGap, query, scratch, out);
    if (out.size() == first) out.push_back({0.5 * (onA + onB), normal, gap});
    return true;
}

}  // namespace

std::uint32_t sideAlong(const PlacedSolid& solid, const Vec3d& direction) {
    std::uint32_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::uint32_t s = 0; s < solid.sides.size(); ++s) {
        const double along = solid.sides[s].normal.dot(direction);
        if (along > most) {
            most = along;
            best = s;
        }
    }
    return best;
}

void nearestOfSegments(const Vec3d& p, const Vec3d& u, const Vec3d& q, const Vec3d& v, Vec3d& onP, Vec3d& onQ) {
    const Vec3d r = p - q;
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), ur = u.dot(r), vr = v.dot(r);
    const double denominator = uu * vv - uv * uv;
    const double s = denominator > 1e-12 * uu * vv ? std::clamp((uv * vr - vv * ur) / denominator, 0.0, 1.0) : 0;
    const double t = vv > 0 ? std::clamp((uv * s + vr) / vv, 0.0, 1.0) : 0;
    onP = p + s * u;
    onQ = q + t * v;
}

void clipToOutline(std::span<const Vec3d> corners, std::span<const std::uint32_t> outline, const Vec3d& normal,
                   double turn, ClipScratch& scratch) {
    for (std::size_t i = 0; i < outline.size() && !scratch.polygon.empty(); ++i) {
        const Vec3d& from = corners[outline[i]];
        const Vec3d& to = corners[outline[i + 1 == outline.size() ? 0 : i + 1]];
        const Vec3d out = turn * (to - from).cross(normal);
        const double offset = out.dot(from);
        scratch.other.clear();
        Vec3d before = scratch.polygon.back();
        double beforeOut = out.dot(before) - offset;
        for (const Vec3d& p : scratch.polygon) {
            const double pOut = out.dot(p) - offset;
            if ((pOut > 0) != (beforeOut > 0))
                scratch.other.push_back(before + (p - before) * (beforeOut / (beforeOut - pOut)));
            if (!(pOut > 0)) scratch.other.push_back(p);
            before = p;
            beforeOut = pOut;
        }
        std::swap(scratch.polygon, scratch.other);
    }
}

bool contactsOfSolids(const SolidPart& a, const SolidPart& b, const SolidQuery& query, SolidMemory& memory,
                      ClipScratch& scratch, QueryWork& work, std::vector<ContactPoint>& out, SolidGap& parted) {
    const PlacedSolid &pa = *a.placed, &pb = *b.placed;
    if (pa.sides.empty() || pb.sides.empty()) return true;
    const std::size_t first = out.size();
    if (manyAxes(pa, pb)) {
        if (!contactsOfLargeHulls(a, b, query, memory, scratch, work, out, parted)) return false;
    } else {
        work.boxTests += pa.sides.size() + pb.sides.size();
        if (work.exhausted()) return false;
        const SolidAxis axis = widestGap(pa, pb, query.margin, query.fine, memory, scratch);
        if (axis.kind == SolidAxis::Kind::kNone) return true;
        memory.kind = axis.kind;
        memory.a = axis.a;
        memory.b = axis.b;
        // Which of many wide gaps was found depends on where it was looked for first.
        parted = axis.gap > query.margin ? SolidGap{query.margin, Vec3d::Zero()} : SolidGap{axis.gap, axis.normal};
        if (axis.gap > query.margin) return true;
        contactManifold(pa, pb, axis, query, scratch, out);
    }
    reduceContacts(out, first, query.near);
    return true;
}

}  // namespace tessera::rigid
