#include "tests/truth/StraightOracle.h"

#include <array>
#include <map>
#include <vector>

namespace tessera::truth {
namespace {

using P = RationalPoint;

P operator+(const P& a, const P& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
P operator-(const P& a, const P& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
P operator*(const Rational& s, const P& a) {
    return {s * a.x, s * a.y, s * a.z};
}
Rational dot(const P& a, const P& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
P cross(const P& a, const P& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
bool isZero(const P& a) {
    return a.x == 0 && a.y == 0 && a.z == 0;
}

struct Solid {
    std::vector<P> corners;
    std::vector<std::array<std::uint32_t, 2>> edges;
    std::vector<std::array<std::uint32_t, 3>> faces;

    Solid(const TriangleMesh& mesh, const Pose& pose) {
        std::map<std::array<double, 3>, std::uint32_t> known;
        std::map<std::array<std::uint32_t, 2>, bool> edgeKnown;
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
            std::array<std::uint32_t, 3> face{};
            for (unsigned i = 0; i < 3; ++i) {
                const Vec3d p = mesh.corner(f, i);
                const auto [at, isNew] =
                    known.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(corners.size()));
                if (isNew) corners.push_back(placed(pose, exactly(p)));
                face[i] = at->second;
            }
            faces.push_back(face);
            for (unsigned i = 0; i < 3; ++i) {
                const std::uint32_t u = face[i], v = face[(i + 1) % 3];
                if (edgeKnown.try_emplace({std::min(u, v), std::max(u, v)}, true).second) edges.push_back({u, v});
            }
        }
    }
};

/// p is on the plane of the triangle.
bool holds(const P& a, const P& b, const P& c, const P& n, const P& p) {
    return dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 && dot(cross(a - c, p - c), n) >= 0;
}

/// Collects the moments at which features of B, which goes along d, are first at features of A. The least moment at
/// which two convex sets meet is one of those: a corner of a linear program whose constraints are edges and faces.
struct Search {
    const Solid &a, &b;
    const P d;
    std::optional<Rational> first;

    void offer(const Rational& t) {
        if (t < 0 || t > 1 || (first && *first <= t)) return;
        first = t;
    }
    /// p + t·way on a face.
    void pointFace(const P& p, const P& way, const Solid& solid, const std::array<std::uint32_t, 3>& face) {
        const P &x = solid.corners[face[0]], &y = solid.corners[face[1]], &z = solid.corners[face[2]];
        const P n = cross(y - x, z - x);
        const Rational rate = dot(n, way), off = dot(n, x - p);
        if (rate != 0) {
            const Rational t = off / rate;
            if (t >= 0 && t <= 1 && holds(x, y, z, n, p + t * way)) offer(t);
        } else if (off == 0 && holds(x, y, z, n, p)) {
            offer(0);
        }
    }
    /// p + t·way on the segment from x to y.
    void pointEdge(const P& p, const P& way, const P& x, const P& y) {
        const P u = y - x, off = x - p;
        const P normal = cross(way, u);
        if (!isZero(normal)) {
            // t·way - s·u = off
            if (dot(normal, off) != 0) return;
            const Rational size = dot(normal, normal), t = dot(cross(off, u), normal) / size,
                           s = dot(cross(off, way), normal) / size;
            if (s >= 0 && s <= 1) offer(t);
            return;
        }
        if (!isZero(cross(off, u))) return;
        const Rational length = dot(u, u), here = dot(p - x, u) / length, rate = dot(way, u) / length;
        if (here >= 0 && here <= 1) return offer(0);
        if (rate == 0) return;
        offer((Rational(here < 0 ? 0 : 1) - here) / rate);
    }
    void edges(const P& x, const P& y, const P& p, const P& q) {
        // x + s·u = p + r·w + t·d
        const P u = y - x, w = q - p, off = p - x;
        const Rational whole = dot(u, cross(w, d));
        if (whole == 0) return;  // then a corner comes first
        const Rational s = dot(off, cross(w, d)) / whole, r = -dot(u, cross(off, d)) / whole,
                       t = -dot(u, cross(w, off)) / whole;
        if (s >= 0 && s <= 1 && r >= 0 && r <= 1) offer(t);
    }
    void run() {
        const P back = Rational(-1) * d;
        for (const P& p : b.corners)
            for (const auto& face : a.faces) pointFace(p, d, a, face);
        for (const P& p : a.corners)
            for (const auto& face : b.faces) pointFace(p, back, b, face);
        for (const auto& e : a.edges) {
            for (const P& p : b.corners) pointEdge(p, d, a.corners[e[0]], a.corners[e[1]]);
            for (const auto& f : b.edges) edges(a.corners[e[0]], a.corners[e[1]], b.corners[f[0]], b.corners[f[1]]);
        }
        for (const auto& e : b.edges)
            for (const P& p : a.corners) pointEdge(p, back, b.corners[e[0]], b.corners[e[1]]);
        // In each other as they begin: an edge in a face, or, all in one plane, across an edge.
        if ((!first || *first > 0) && (crossed(a, b) || crossed(b, a) || edgesCross())) first = 0;
    }
    [[nodiscard]] bool edgesCross() const {
        for (const auto& e : a.edges)
            for (const auto& f : b.edges) {
                const P &x = a.corners[e[0]], &p = b.corners[f[0]];
                const P u = a.corners[e[1]] - x, w = b.corners[f[1]] - p, off = p - x, n = cross(u, w);
                if (isZero(n) || dot(off, n) != 0) continue;
                const Rational size = dot(n, n), s = dot(cross(off, w), n) / size, r = dot(cross(off, u), n) / size;
                if (s >= 0 && s <= 1 && r >= 0 && r <= 1) return true;
            }
        return false;
    }
    static bool crossed(const Solid& edged, const Solid& faced) {
        for (const auto& e : edged.edges)
            for (const auto& f : faced.faces) {
                const P &p = edged.corners[e[0]], &q = edged.corners[e[1]];
                const P &x = faced.corners[f[0]], &y = faced.corners[f[1]], &z = faced.corners[f[2]];
                const P n = cross(y - x, z - x);
                const Rational above = dot(n, p - x), below = dot(n, q - x);
                if (above * below > 0 || above == below) continue;
                if (holds(x, y, z, n, p + (above / (above - below)) * (q - p))) return true;
            }
        return false;
    }
};

}  // namespace

P placed(const Pose& pose, const P& p) {
    const Rational w(pose.rotation.w());
    const P v{Rational(pose.rotation.x()), Rational(pose.rotation.y()), Rational(pose.rotation.z())};
    const P scaled{Rational(pose.scale.x()) * p.x, Rational(pose.scale.y()) * p.y, Rational(pose.scale.z()) * p.z};
    // q p q* / |q|²
    const Rational size = w * w + dot(v, v);
    const P turned = (w * w - dot(v, v)) * scaled + (2 * dot(v, scaled)) * v + (2 * w) * cross(v, scaled);
    return (1 / size) * turned + exactly(pose.translation);
}

std::optional<Rational> firstStraightContact(const TriangleMesh& a, const BodyMotion& motionA, const TriangleMesh& b,
                                             const BodyMotion& motionB) {
    const Solid solidA(a, motionA.start), solidB(b, motionB.start);
    const auto way = [](const BodyMotion& m) { return exactly(m.end.translation) - exactly(m.start.translation); };
    Search search{solidA, solidB, way(motionB) - way(motionA), {}};
    search.run();
    return search.first;
}

}  // namespace tessera::truth
