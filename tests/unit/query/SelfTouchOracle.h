/// The definition of self-collision on integer coordinates, by the corners of what two triangles have in common.
#pragma once

#include <vector>

#include "tests/unit/collision/RationalOracle.h"

namespace tessera::oracle {

/// A point with a common denominator: p / w, w > 0.
struct Fraction {
    Point p;
    Wide w = 1;
};

inline Point times(const Point& p, Wide w) {
    return {p.x * w, p.y * w, p.z * w};
}
inline Point plus(const Point& a, const Point& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline bool same(const Point& a, const Point& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}
inline bool inTriangle(const Fraction& f, const IntTriangle& t) {
    return inTriangle(f.p, {times(t[0], f.w), times(t[1], f.w), times(t[2], f.w)});
}

/// All points of both triangles at which their common part can have a corner: it is the hull of these.
inline std::vector<Fraction> cornersOfCommonPart(const IntTriangle& a, const IntTriangle& b) {
    std::vector<Fraction> candidates;
    for (const IntTriangle& t : {a, b})
        for (const Point& p : t) candidates.push_back({p, 1});
    for (int turn = 0; turn < 2; ++turn) {
        const IntTriangle &s = turn ? b : a, &t = turn ? a : b;
        const Point n = cross(t[1] - t[0], t[2] - t[0]);
        for (std::size_t i = 0; i < 3; ++i) {
            const Point &u = s[i], &v = s[(i + 1) % 3];
            // Through the other's plane.
            const Wide hu = dot(n, u - t[0]), hv = dot(n, v - t[0]);
            if (sign(hu) * sign(hv) < 0) {
                const Wide wu = hu < 0 ? -hu : hu, wv = hv < 0 ? -hv : hv;
                candidates.push_back({plus(times(u, wv), times(v, wu)), wu + wv});
            }
            // Across one of the other's edges.
            for (std::size_t j = 0; j < 3; ++j) {
                const Point &c = t[j], d = t[(j + 1) % 3] - c, e = v - u;
                const Point across = cross(e, d);
                const Wide square = dot(across, across);
                if (square == 0 || dot(across, c - u) != 0) continue;
                candidates.push_back({plus(times(u, square), times(e, dot(cross(c - u, d), across))), square});
            }
        }
    }
    std::vector<Fraction> out;
    for (const Fraction& f : candidates)
        if (inTriangle(f, a) && inTriangle(f, b)) out.push_back(f);
    return out;
}

/// `shared`: the positions of the corners that the faces share.
inline bool touchBeyond(const IntTriangle& a, const IntTriangle& b, const std::vector<Point>& shared) {
    if (shared.size() == 3) return !isZero(cross(a[1] - a[0], a[2] - a[0]));
    for (const Fraction& f : cornersOfCommonPart(a, b)) {
        if (shared.empty()) return true;
        if (!onSegment(f.p, times(shared.front(), f.w), times(shared.back(), f.w))) return true;
    }
    return false;
}

}  // namespace tessera::oracle
