#include "server/collision/mesh/TriangleTriangle.h"

#include <algorithm>
#include <optional>
#include <span>

#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

using Signs = std::array<int, 3>;

struct Segment3 {
    Vec3d from, to;
};

/// An axis along which the three points do not collapse to a line; none where they lie on a line in space. The
/// projection along it is one to one on their plane.
std::optional<int> faithfulAxis(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d n = (b - a).cross(c - a).cwiseAbs();
    int order[3] = {0, 1, 2};
    std::sort(order, order + 3, [&](int i, int j) { return n[i] > n[j]; });
    for (const int axis : order)
        if (orient2d(project(a, axis), project(b, axis), project(c, axis)) != 0) return axis;
    return std::nullopt;
}

/// c is known to lie on the line through a and b.
bool withinSpan(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    return std::min(a.x(), b.x()) <= c.x() && c.x() <= std::max(a.x(), b.x()) && std::min(a.y(), b.y()) <= c.y() &&
           c.y() <= std::max(a.y(), b.y());
}

/// Closed segments in the plane, points included.
bool segmentsIntersect(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d) {
    const int abc = orient2d(a, b, c);
    const int abd = orient2d(a, b, d);
    const int cda = orient2d(c, d, a);
    const int cdb = orient2d(c, d, b);
    if (abc * abd < 0 && cda * cdb < 0) return true;
    return (abc == 0 && withinSpan(a, b, c)) || (abd == 0 && withinSpan(a, b, d)) ||
           (cda == 0 && withinSpan(c, d, a)) || (cdb == 0 && withinSpan(c, d, b));
}

/// `t` has area.
bool pointInTriangle(const std::array<Vec2d, 3>& t, const Vec2d& p) {
    const int s0 = orient2d(t[0], t[1], p);
    const int s1 = orient2d(t[1], t[2], p);
    const int s2 = orient2d(t[2], t[0], p);
    return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

/// Both in one plane, on which the projection along `axis` is one to one. `a` has area, `b` may have none.
bool coplanarIntersect(const Triangle& a, const Triangle& b, int axis) {
    const std::array<Vec2d, 3> p{project(a[0], axis), project(a[1], axis), project(a[2], axis)};
    const std::array<Vec2d, 3> q{project(b[0], axis), project(b[1], axis), project(b[2], axis)};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            if (segmentsIntersect(p[i], p[(i + 1) % 3], q[j], q[(j + 1) % 3])) return true;
    // No edges meet: one lies inside the other, or they are apart.
    if (pointInTriangle(p, q[0])) return true;
    return orient2d(q[0], q[1], q[2]) != 0 && pointInTriangle(q, p[0]);
}

/// The set that a triangle without area is. Along a line lexicographic order is the order of the points.
Segment3 asSegment(const Triangle& t) {
    const auto [low, high] = std::minmax_element(t.begin(), t.end(), lexicographicallyLess);
    return {*low, *high};
}

bool segmentsIntersect(const Segment3& s, const Segment3& t) {
    if (orient3d(s.from, s.to, t.from, t.to) != 0) return false;
    const std::array<Vec3d, 4> p{s.from, s.to, t.from, t.to};
    for (std::size_t left = 0; left < 4; ++left) {
        const auto axis = faithfulAxis(p[left], p[(left + 1) % 4], p[(left + 2) % 4]);
        if (!axis) continue;
        return segmentsIntersect(project(p[0], *axis), project(p[1], *axis), project(p[2], *axis),
                                 project(p[3], *axis));
    }
    // All on one line: intervals.
    return !lexicographicallyLess(t.to, s.from) && !lexicographicallyLess(s.to, t.from);
}

/// `t` has area and lies in the plane on which `axis` is faithful only if the segment does.
bool segmentMeetsTriangle(const Segment3& s, const Triangle& t, int axis) {
    const int from = orient3d(t[0], t[1], t[2], s.from);
    const int to = orient3d(t[0], t[1], t[2], s.to);
    if (from * to > 0) return false;
    if (from == 0 && to == 0) return coplanarIntersect(t, {s.from, s.to, s.to}, axis);
    const int e0 = orient3d(s.from, s.to, t[0], t[1]);
    const int e1 = orient3d(s.from, s.to, t[1], t[2]);
    const int e2 = orient3d(s.from, s.to, t[2], t[0]);
    return (e0 >= 0 && e1 >= 0 && e2 >= 0) || (e0 <= 0 && e1 <= 0 && e2 <= 0);
}

/// One of them lies in the other's plane, or has no plane.
bool flatIntersect(const Triangle& a, const Triangle& b) {
    const auto axisA = faithfulAxis(a[0], a[1], a[2]);
    const auto axisB = faithfulAxis(b[0], b[1], b[2]);
    if (axisA && axisB) return coplanarIntersect(a, b, *axisA);
    if (axisA) return segmentMeetsTriangle(asSegment(b), a, *axisA);
    if (axisB) return segmentMeetsTriangle(asSegment(a), b, *axisB);
    return segmentsIntersect(asSegment(a), asSegment(b));
}

bool sameStrictSide(const Signs& s) {
    return (s[0] > 0 && s[1] > 0 && s[2] > 0) || (s[0] < 0 && s[1] < 0 && s[2] < 0);
}
bool allZero(const Signs& s) {
    return s[0] == 0 && s[1] == 0 && s[2] == 0;
}

struct Apex {
    std::size_t index;  ///< the corner that the plane separates from the other two
    bool below;         ///< it lies on the negative side (or the others on the positive)
};

/// Signs neither all zero nor all on one strict side.
Apex apexOf(const Signs& s) {
    for (std::size_t i = 0; i < 3; ++i) {
        const int j = s[(i + 1) % 3];
        const int k = s[(i + 2) % 3];
        if (s[i] > 0 && j <= 0 && k <= 0) return {i, false};
        if (s[i] < 0 && j >= 0 && k >= 0) return {i, true};
    }
    for (std::size_t i = 0; i < 3; ++i)
        if (s[i] == 0) return {i, s[(i + 1) % 3] > 0};
    return {0, false};
}

}  // namespace

bool isDegenerate(const Triangle& t) {
    return !faithfulAxis(t[0], t[1], t[2]);
}

// P. Guigue, O. Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates", 2003.
bool trianglesIntersect(const Triangle& a, const Triangle& b) {
    Signs ofB;
    for (std::size_t i = 0; i < 3; ++i) ofB[i] = orient3d(a[0], a[1], a[2], b[i]);
    if (sameStrictSide(ofB)) return false;
    Signs ofA;
    for (std::size_t i = 0; i < 3; ++i) ofA[i] = orient3d(b[0], b[1], b[2], a[i]);
    if (sameStrictSide(ofA)) return false;
    // A triangle without area gives nothing but zeros, so it ends here too.
    if (allZero(ofA) || allZero(ofB)) return flatIntersect(a, b);

    // The planes cross in a line; each triangle covers an interval of it, bounded by the two edges at its apex. With
    // both apexes on the positive sides the intervals overlap iff two orientations say so (section 3 of the paper).
    const Apex apexA = apexOf(ofA);
    const Apex apexB = apexOf(ofB);
    const Vec3d& p1 = a[apexA.index];
    const Vec3d* q1 = &a[(apexA.index + 1) % 3];
    const Vec3d* r1 = &a[(apexA.index + 2) % 3];
    const Vec3d& p2 = b[apexB.index];
    const Vec3d* q2 = &b[(apexB.index + 1) % 3];
    const Vec3d* r2 = &b[(apexB.index + 2) % 3];
    if (apexA.below) std::swap(q2, r2);
    if (apexB.below) std::swap(q1, r1);
    return orient3d(p1, *q1, p2, *q2) <= 0 && orient3d(p1, *r1, *r2, p2) <= 0;
}

}  // namespace tessera
