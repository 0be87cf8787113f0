#include "server/collision/mesh/TriangleContact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

Vec3d areaNormal(const Triangle& t) {
    const Vec3d e = t[1] - t[0], f = t[2] - t[0], side = t[2] - t[1];
    // A first corner that is far from both others: what is between these is lost in its edges' last digits.
    constexpr double kFar = 1e6;
    if (std::min(e.squaredNorm(), f.squaredNorm()) > kFar * side.squaredNorm()) return e.cross(side);
    return e.cross(f);
}

Vec3d unit(const Vec3d& v) {
    const double largest = v.cwiseAbs().maxCoeff();
    if (!(largest > 0)) return Vec3d::Zero();
    return (v / largest).normalized();
}

Vec3d longestEdge(const Triangle& t) {
    Vec3d best = t[1] - t[0];
    for (const Vec3d& e : {Vec3d(t[2] - t[1]), Vec3d(t[0] - t[2])})
        if (e.squaredNorm() > best.squaredNorm()) best = e;
    return best;
}

/// `preferred` made a unit vector, or something across `along`, or anything at all: a normal is never missing.
Vec3d normalOr(const Vec3d& preferred, const Vec3d& along) {
    const Vec3d n = unit(preferred);
    if (n != Vec3d::Zero()) return n;
    const Vec3d d = unit(along);
    return d != Vec3d::Zero() ? unit(d.unitOrthogonal()) : Vec3d(Vec3d::UnitX());
}

/// One end of a triangle's interval on the line in which two planes meet.
struct End {
    double at = 0;
    Vec3d point = Vec3d::Zero();
};

/// At most one per edge.
struct Ends {
    std::array<End, 3> at;
    std::size_t count = 0;

    void push_back(const End& end) { at[count++] = end; }
    [[nodiscard]] bool empty() const { return count == 0; }
    [[nodiscard]] std::size_t size() const { return count; }
    [[nodiscard]] End* begin() { return at.data(); }
    [[nodiscard]] End* end() { return at.data() + count; }
    [[nodiscard]] const End* begin() const { return at.data(); }
    [[nodiscard]] const End* end() const { return at.data() + count; }
    [[nodiscard]] const End& front() const { return at[0]; }
    [[nodiscard]] const End& back() const { return at[count - 1]; }
};

/// Where the edges of `t` pierce a plane, given the exact sides and the distances of its corners.
Ends piercings(const Triangle& t, const std::array<int, 3>& side, const Vec3d& distance) {
    Ends ends;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (side[i] == 0) {
            ends.push_back({0, t[i]});
        } else if (side[i] * side[j] < 0) {
            const double a = distance[static_cast<int>(i)];
            const double b = distance[static_cast<int>(j)];
            const double f = a != b ? std::clamp(a / (a - b), 0.0, 1.0) : 0.5;
            ends.push_back({0, t[i] + f * (t[j] - t[i])});
        }
    }
    return ends;
}

std::pair<End, End> intervalAlong(Ends& ends, const Vec3d& direction) {
    for (End& e : ends) e.at = direction.dot(e.point);
    const auto byPlace = [](const End& x, const End& y) { return x.at < y.at; };
    const auto [low, high] = std::minmax_element(ends.begin(), ends.end(), byPlace);
    return {*low, *high};
}

Vec3d distancesTo(const Triangle& plane, const Vec3d& unitNormal, const Triangle& t) {
    return {unitNormal.dot(t[0] - plane[0]), unitNormal.dot(t[1] - plane[0]), unitNormal.dot(t[2] - plane[0])};
}

bool allOnIt(const std::array<int, 3>& s) {
    return s[0] == 0 && s[1] == 0 && s[2] == 0;
}

TriangleContact atPoint(const Vec3d& p, const Vec3d& normal) {
    return {p, p, p, normal};
}

TriangleContact betweenNearest(const Triangle& a, const Triangle& b, const Vec3d& nA, const Vec3d& nB) {
    const NearestPoints near = nearestPoints(a, b);
    const Vec3d gap = near.onB - near.onA;
    Vec3d normal = nA - nB;
    if (unit(normal) == Vec3d::Zero()) normal = longestEdge(a).cross(longestEdge(b));
    // A gap of rounding size has no direction worth the name.
    const double size = std::max(longestEdge(a).norm(), longestEdge(b).norm());
    if (near.distance > 1e-12 * size) normal = gap;
    return atPoint(0.5 * (near.onA + near.onB), normalOr(normal, longestEdge(a)));
}

/// Cuts `subject` by the prism over the edges of `window` (Sutherland and Hodgman 1974).
std::vector<Vec3d> clip(const Triangle& subject, const Triangle& window, const Vec3d& windowNormal) {
    std::vector<Vec3d> polygon(subject.begin(), subject.end());
    for (std::size_t i = 0; i < 3 && !polygon.empty(); ++i) {
        const Vec3d inward = unit(windowNormal.cross(window[(i + 1) % 3] - window[i]));
        std::vector<Vec3d> kept;
        for (std::size_t k = 0; k < polygon.size(); ++k) {
            const Vec3d& p = polygon[k];
            const Vec3d& q = polygon[(k + 1) % polygon.size()];
            const double dp = inward.dot(p - window[i]);
            const double dq = inward.dot(q - window[i]);
            if (dp >= 0) kept.push_back(p);
            if ((dp < 0) != (dq < 0)) kept.push_back(p + dp / (dp - dq) * (q - p));
        }
        polygon = std::move(kept);
    }
    return polygon;
}

TriangleContact ofOverlap(const std::vector<Vec3d>& polygon, const Vec3d& normal) {
    TriangleContact contact = atPoint(polygon.front(), normal);
    double longest = 0;
    for (const Vec3d& p : polygon)
        for (const Vec3d& q : polygon)
            if ((q - p).squaredNorm() > longest) {
                longest = (q - p).squaredNorm();
                contact.from = p;
                contact.to = q;
            }
    contact.point = 0.5 * (contact.from + contact.to);
    return contact;
}

TriangleContact coplanarContact(const Triangle& a, const Triangle& b, const Vec3d& nA, const Vec3d& nB) {
    const std::vector<Vec3d> polygon = nB != Vec3d::Zero() ? clip(a, b, nB) : clip(b, a, nA);
    if (polygon.empty()) return betweenNearest(a, b, nA, nB);
    // Faces that look at each other push along A's outside; nearly equal normals cancel to nothing worth keeping.
    const Vec3d apart = nA - nB;
    return ofOverlap(polygon, normalOr(apart.norm() > 1e-6 ? apart : nA, longestEdge(a)));
}

/// `thin` has no area; `t` has.
TriangleContact segmentContact(const Triangle& thin, const Triangle& t, const Vec3d& unitNormal, const Vec3d& normal) {
    Ends ends = piercings(thin, sidesOf(t, thin), distancesTo(t, unitNormal, thin));
    if (ends.empty()) return atPoint(nearestPoints(thin, t).onB, normal);
    Vec3d middle = Vec3d::Zero();
    for (const End& e : ends) middle += e.point;
    return atPoint(middle / static_cast<double>(ends.size()), normal);
}

/// A triangle that is no needle, for plainCrossing.
struct Plain {
    const Triangle& t;
    Vec3d normal;
    double size2 = 0;  ///< of its longest edge
    bool good = false;

    explicit Plain(const Triangle& triangle) : t(triangle) {
        const Vec3d e = t[1] - t[0], g = t[2] - t[0], across = e.cross(g);
        const double ee = e.squaredNorm(), gg = g.squaredNorm(), square = across.squaredNorm();
        // Angles above 1e-4: then the normal is good to 1e-12. The rest is for numbers too large or small to square.
        good = square > 1e-8 * ee * gg && square > 1e-250 && square < 1e250;
        size2 = std::max({ee, gg, (g - e).squaredNorm()});
        normal = across * (1 / std::sqrt(square));
    }
};

/// Where a triangle's edges pass through the other's plane, by the distances of its corners: two ends. False where a
/// sign is not certain, or an edge runs along the plane so closely that rounding moves its end by more than 1e-7 sizes.
bool piercePlainly(const Triangle& t, const Vec3d& d, double size, Vec3d (&ends)[2]) {
    if (!(d.cwiseAbs().minCoeff() > 1e-9 * size)) return false;
    const bool up[3] = {d[0] > 0, d[1] > 0, d[2] > 0};
    if (up[0] == up[1] && up[1] == up[2]) return false;
    const int apex = up[0] == up[1] ? 2 : up[0] == up[2] ? 1 : 0;
    for (int k = 0; k < 2; ++k) {
        const int other = (apex + 1 + k) % 3;
        const double way = d[apex] - d[other];
        if (!(std::abs(way) > 1e-4 * size)) return false;
        const auto from = static_cast<std::size_t>(apex), to = static_cast<std::size_t>(other);
        ends[k] = t[from] + d[apex] / way * (t[to] - t[from]);
    }
    return true;
}

/// Nearly all contacts of real meshes: nothing about them is in doubt, so nothing exact is asked.
std::optional<TriangleContact> plainCrossing(const Triangle& ta, const Triangle& tb) {
    const Plain a(ta), b(tb);
    if (!a.good || !b.good) return std::nullopt;
    const Vec3d across = a.normal.cross(b.normal);
    const double sine2 = across.squaredNorm();
    if (!(sine2 > 1e-8)) return std::nullopt;
    const double size = std::sqrt(std::max(a.size2, b.size2));
    const Vec3d distancesA = distancesTo(tb, b.normal, ta), distancesB = distancesTo(ta, a.normal, tb);
    Vec3d endsA[2], endsB[2];
    if (!piercePlainly(ta, distancesA, size, endsA) || !piercePlainly(tb, distancesB, size, endsB)) return std::nullopt;
    const Vec3d line = across * (1 / std::sqrt(sine2));
    const auto along = [&](const Vec3d& p) { return line.dot(p - ta[0]); };
    const double a0 = along(endsA[0]), a1 = along(endsA[1]), b0 = along(endsB[0]), b1 = along(endsB[1]);
    const Vec3d &lowA = endsA[a0 <= a1 ? 0 : 1], &highA = endsA[a0 <= a1 ? 1 : 0];
    const Vec3d &lowB = endsB[b0 <= b1 ? 0 : 1], &highB = endsB[b0 <= b1 ? 1 : 0];
    const double low = std::max(std::min(a0, a1), std::min(b0, b1)),
                 high = std::min(std::max(a0, a1), std::max(b0, b1));
    if (!(high - low > 1e-6 * size)) return std::nullopt;

    TriangleContact contact;
    contact.from = std::min(a0, a1) >= std::min(b0, b1) ? lowA : lowB;
    contact.to = std::max(a0, a1) <= std::max(b0, b1) ? highA : highB;
    contact.point = 0.5 * (contact.from + contact.to);
    // wayOut(a, b, normal of a), and the other way round: the plane of the one is its farthest point.
    const double alongA = -distancesB.minCoeff(), againstB = -distancesA.minCoeff();
    if (std::abs(alongA - againstB) <= 1e-12 * size)
        contact.normal = normalOr(a.normal - b.normal, line);
    else
        contact.normal = alongA < againstB ? a.normal : Vec3d(-b.normal);
    return contact;
}

/// Of triangles with area that meet and are not in one plane.
std::optional<TriangleContact> crossing(const Triangle& a, const Triangle& b, const std::array<int, 3>& sidesA,
                                        const std::array<int, 3>& sidesB) {
    const Vec3d nA = outside(a), nB = outside(b);
    const Vec3d distancesA = distancesTo(b, nB, a), distancesB = distancesTo(a, nA, b);
    Ends endsA = piercings(a, sidesA, distancesA);
    Ends endsB = piercings(b, sidesB, distancesB);
    if (endsA.empty() || endsB.empty()) return std::nullopt;
    Vec3d line = nA.cross(nB);
    const double size = std::max(longestEdge(a).norm(), longestEdge(b).norm());
    if (unit(line) == Vec3d::Zero()) line = endsA.back().point - endsA.front().point;
    line = unit(line);
    const auto [lowA, highA] = intervalAlong(endsA, line);
    const auto [lowB, highB] = intervalAlong(endsB, line);
    const End& low = lowA.at >= lowB.at ? lowA : lowB;
    const End& high = highA.at <= highB.at ? highA : highB;

    TriangleContact contact;
    contact.from = low.point;
    contact.to = high.point;
    contact.point = 0.5 * (low.point + high.point);
    if (low.at > high.at) contact.from = contact.to = contact.point;  // they touch, and rounding parted them
    const auto off = [&](const Vec3d& p) {
        return std::max((nearestOnTriangle(a, p) - p).norm(), (nearestOnTriangle(b, p) - p).norm());
    };
    if (std::max(off(contact.from), off(contact.to)) > 1e-9 * size) {
        // A needle's plane is not to be had from rounded corners, nor is the line: an end on both triangles will do.
        Vec3d best = contact.point;
        for (const Ends* ends : {&endsA, &endsB})
            for (const End& e : *ends)
                if (off(e.point) < off(best)) best = e.point;
        contact.from = contact.to = contact.point = best;
    }
    const double alongA = wayOut(a, b, nA);
    const double againstB = wayOut(a, b, -nB);
    if (std::abs(alongA - againstB) <= 1e-12 * size)
        contact.normal = normalOr(nA - nB, line);
    else
        contact.normal = alongA < againstB ? nA : Vec3d(-nB);
    return contact;
}

}  // namespace

Vec3d outside(const Triangle& t) {
    return unit(areaNormal(t));
}

double wayOut(const Triangle& a, const Triangle& b, const Vec3d& direction) {
    const double farthest = std::max({direction.dot(a[0]), direction.dot(a[1]), direction.dot(a[2])});
    const double nearest = std::min({direction.dot(b[0]), direction.dot(b[1]), direction.dot(b[2])});
    return farthest - nearest;
}

TriangleContact contactOf(const Triangle& a, const Triangle& b) {
    if (const std::optional<TriangleContact> contact = plainCrossing(a, b)) return *contact;
    const bool thinA = isDegenerate(a);
    const bool thinB = isDegenerate(b);
    const Vec3d nA = thinA ? Vec3d(Vec3d::Zero()) : outside(a);
    const Vec3d nB = thinB ? Vec3d(Vec3d::Zero()) : outside(b);
    if (!trianglesIntersect(a, b) || (thinA && thinB)) return betweenNearest(a, b, nA, nB);

    if (thinB) {
        if (!allOnIt(sidesOf(a, b))) return segmentContact(b, a, nA, nA);
        return coplanarContact(a, b, nA, nB);
    }
    const std::array<int, 3> sidesA = sidesOf(b, a);
    if (allOnIt(sidesA)) return coplanarContact(a, b, nA, nB);
    if (thinA) return segmentContact(a, b, nB, -nB);
    if (const std::optional<TriangleContact> contact = crossing(a, b, sidesA, sidesOf(a, b))) return *contact;
    return betweenNearest(a, b, nA, nB);
}

namespace {

/// Of a triangle that is long and thin, or has no area: its normal has few digits, or none. The edges are right however
/// thin it is. Inside, the longest edge and what is square to it span a triangle that lies beside the real one by no
/// more than coordinates are rounded.
Vec3d nearestOnThin(const Triangle& t, const Vec3d& p) {
    Vec3d best = t[0];
    const auto offer = [&](const Vec3d& q) {
        if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
    };
    std::size_t from = 0;
    double square = -1;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d &a = t[i], &b = t[(i + 1) % 3];
        offer(nearestOnSegments(p, p, a, b).onB);
        if (const double length = (b - a).squaredNorm(); length > square) {
            square = length;
            from = i;
        }
    }
    if (!(square > 0)) return best;
    const Vec3d along = t[(from + 1) % 3] - t[from], side = t[(from + 2) % 3] - t[from], away = p - t[from];
    const double corner = side.dot(along) / square;
    Vec3d across = side - corner * along;
    across -= across.dot(along) / square * along;  // of what is left of a long way the first time, few digits are right
    const double width = across.squaredNorm();
    if (!(width > 0)) return best;
    const double x = away.dot(along) / square, y = away.dot(across) / width;
    if (y > 0 && x > y * corner && 1 - x > y * (1 - corner)) offer(t[from] + x * along + y * across);
    return best;
}

}  // namespace

/// C. Ericson, Real-Time Collision Detection, 5.1.5. The areas va, vb and vc are products with the normal and not
/// d1·d4 - d3·d2, which is the same but loses the digits of thin triangles twice over.
Vec3d nearestOnTriangle(const Triangle& t, const Vec3d& p) {
    const Vec3d ab = t[1] - t[0], ac = t[2] - t[0], bc = t[2] - t[1], ap = p - t[0];
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return t[0];
    const Vec3d bp = p - t[1];
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return t[1];
    // Of the two shortest edges, whose angle is the widest.
    const double squareAb = ab.squaredNorm(), squareAc = ac.squaredNorm(), squareBc = bc.squaredNorm();
    Vec3d n = ab.cross(ac);
    if (squareAc > squareBc && squareAc >= squareAb)
        n = ab.cross(bc);
    else if (squareAb > squareBc)
        n = ac.cross(bc);
    const double square = n.squaredNorm(), longest = std::max({squareAb, squareAc, squareBc});
    // A thousand times as long as wide.
    if (!(square > 1e-6 * longest * longest)) return nearestOnThin(t, p);
    const double vc = n.dot(ap.cross(bp));
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return d1 == d3 ? t[0] : Vec3d(t[0] + d1 / (d1 - d3) * ab);
    const Vec3d cp = p - t[2];
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return t[2];
    const double vb = n.dot(cp.cross(ap));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return d2 == d6 ? t[0] : Vec3d(t[0] + d2 / (d2 - d6) * ac);
    const double va = n.dot(bp.cross(cp));
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double length = (d4 - d3) + (d5 - d6);
        return length == 0 ? t[1] : Vec3d(t[1] + (d4 - d3) / length * bc);
    }
    return p - n.dot(ap) / square * n;
}

/// Nearest points of two segments (Ericson, 5.1.9).
NearestPoints nearestOnSegments(const Vec3d& p1, const Vec3d& q1, const Vec3d& p2, const Vec3d& q2) {
    const Vec3d d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
    const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r);
    double s = 0, t = 0;
    if (a > 0 && e > 0) {
        // |d1 × d2|² and not a·e - b²: of nearly parallel segments that difference has no digit left.
        const Vec3d across = d1.cross(d2);
        const double c = d1.dot(r), b = d1.dot(d2), square = across.squaredNorm();
        if (square > 0) s = std::clamp(d2.cross(r).dot(across) / square, 0.0, 1.0);
        t = (b * s + f) / e;
        if (t < 0) {
            t = 0;
            s = std::clamp(-c / a, 0.0, 1.0);
        } else if (t > 1) {
            t = 1;
            s = std::clamp((b - c) / a, 0.0, 1.0);
        }
    } else if (a > 0) {
        s = std::clamp(-d1.dot(r) / a, 0.0, 1.0);
    } else if (e > 0) {
        t = std::clamp(f / e, 0.0, 1.0);
    }
    NearestPoints out{p1 + s * d1, p2 + t * d2, 0};
    out.distance = (out.onA - out.onB).norm();
    return out;
}

NearestPoints nearestPoints(const Triangle& a, const Triangle& b) {
    NearestPoints best;
    best.distance = std::numeric_limits<double>::infinity();
    const auto offer = [&](const Vec3d& onA, const Vec3d& onB) {
        const double distance = (onA - onB).norm();
        if (distance < best.distance) best = {onA, onB, distance};
    };
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const NearestPoints near = nearestOnSegments(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]);
            offer(near.onA, near.onB);
        }
    for (const Vec3d& p : a) offer(p, nearestOnTriangle(b, p));
    for (const Vec3d& p : b) offer(nearestOnTriangle(a, p), p);
    return best;
}

}  // namespace tessera
