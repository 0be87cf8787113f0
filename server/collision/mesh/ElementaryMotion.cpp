#include "server/collision/mesh/ElementaryMotion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/Box.h"
#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

template <std::size_t N>
using Corners = std::array<Vec3d, N>;

/// Corners on their way, seen from an origin near to them.
template <std::size_t N>
struct Moving {
    Corners<N> start, end;
    [[nodiscard]] Corners<N> at(double t) const {
        Corners<N> out;
        for (std::size_t i = 0; i < N; ++i) out[i] = (1 - t) * start[i] + t * end[i];
        return out;
    }
};

template <std::size_t N>
Box swept(const Corners<N>& start, const Corners<N>& end) {
    Box box;
    for (std::size_t i = 0; i < N; ++i) {
        box.extend(start[i]);
        box.extend(end[i]);
    }
    return box;
}

/// Open interval of times; empty where it does not hold the moment in question.
struct Times {
    double from = 0, to = 1;
};

/// Narrows to the times at which a gap is positive that runs linearly from g0 to g1 over [0, 1]. Both are lower bounds
/// already; the quotients round towards less.
void keepPositive(double g0, double g1, Times& times) {
    constexpr double kOutwards = 8 * exact::kRounding;
    if (g0 > 0 && g1 > 0) return;
    if (g0 > 0)
        times.to = std::min(times.to, g0 / (g0 - g1) * (1 - kOutwards));
    else if (g1 > 0)
        times.from = std::max(times.from, g0 / (g0 - g1) * (1 + kOutwards));
    else
        times.to = 0;
}

template <std::size_t NA, std::size_t NB>
class Advancement {
public:
    Advancement(const Moving<NA>& a, const Moving<NB>& b, double slack) : a_(a), b_(b) {
        for (const Corners<NA>* c : {&a.start, &a.end})
            for (const Vec3d& p : *c) reach_ = std::max(reach_, p.cwiseAbs().maxCoeff());
        for (const Corners<NB>* c : {&b.start, &b.end})
            for (const Vec3d& p : *c) reach_ = std::max(reach_, p.cwiseAbs().maxCoeff());
        // The header's analysis; the last summand is for products that underflow.
        perUnit_ = 24 * exact::kRounding * reach_;
        fixed_ = 2.001 * slack + 1e-290;
    }

    /// The times at which the direction, of about unit length, separates A (behind) from B.
    [[nodiscard]] Times separated(const Vec3d& n) const {
        const double error = perUnit_ * n.cwiseAbs().sum() + fixed_;
        std::array<double, NA> a0, a1;
        std::array<double, NB> b0, b1;
        for (std::size_t i = 0; i < NA; ++i) {
            a0[i] = n.dot(a_.start[i]) + error;
            a1[i] = n.dot(a_.end[i]) + error;
        }
        for (std::size_t j = 0; j < NB; ++j) {
            b0[j] = n.dot(b_.start[j]);
            b1[j] = n.dot(b_.end[j]);
        }
        Times times{0, 1};
        for (std::size_t i = 0; i < NA; ++i)
            for (std::size_t j = 0; j < NB; ++j) keepPositive(b0[j] - a0[i], b1[j] - a1[i], times);
        return times;
    }

    /// Does a direction that turns linearly from n0 to n1 separate them all the way between the moments of two pairs
    /// of places? Every gap is then a quadratic polynomial; it is positive where its Bernstein coefficients are.
    [[nodiscard]] bool separatedThroughout(const Corners<NA>& a0, const Corners<NB>& b0, const Vec3d& n0,
                                           const Corners<NA>& a1, const Corners<NB>& b1, const Vec3d& n1) const {
        const double error = perUnit_ * std::max(n0.cwiseAbs().sum(), n1.cwiseAbs().sum()) + fixed_;
        for (std::size_t i = 0; i < NA; ++i)
            for (std::size_t j = 0; j < NB; ++j) {
                const Vec3d gap0 = b0[j] - a0[i], gap1 = b1[j] - a1[i];
                if (!(n0.dot(gap0) > error && n1.dot(gap1) > error && 0.5 * (n0.dot(gap1) + n1.dot(gap0)) > error))
                    return false;
            }
        return true;
    }

private:
    const Moving<NA>& a_;
    const Moving<NB>& b_;
    double reach_ = 0, perUnit_, fixed_;
};

Vec3d unitOrZero(const Vec3d& v) {
    const double length = v.stableNorm();
    return length > 0 ? Vec3d(v / length) : Vec3d(Vec3d::Zero());
}

/// The first steps go by the nearest points alone, which mostly is enough.
constexpr std::uint32_t kStepsAlone = 3;

/// A corner or an edge as the triangle it is.
Triangle asTriangle(const Corners<1>& p) {
    return {p[0], p[0], p[0]};
}
Triangle asTriangle(const Corners<2>& e) {
    return {e[0], e[1], e[1]};
}
Triangle asTriangle(const Triangle& t) {
    return t;
}

/// `nearest(cornersA, cornersB)`: the nearest points.
template <std::size_t NA, std::size_t NB, typename Nearest>
ElementaryImpact advance(const Corners<NA>& aStart, const Corners<NA>& aEnd, const Corners<NB>& bStart,
                         const Corners<NB>& bEnd, const ElementaryOptions& options, Nearest&& nearest) {
    ElementaryImpact out;
    out.t = options.upTo;
    const Box boxA = swept(aStart, aEnd), boxB = swept(bStart, bEnd);
    // Comparisons of what was given: nothing is rounded but the slack's sum.
    const double slack = 2.001 * options.slack;
    if (((boxB.lower - boxA.upper).array() > slack).any() || ((boxA.lower - boxB.upper).array() > slack).any())
        return out;

    const Vec3d origin = 0.5 * (boxA.lower.cwiseMax(boxB.lower) + boxA.upper.cwiseMin(boxB.upper));
    Moving<NA> a{aStart, aEnd};
    Moving<NB> b{bStart, bEnd};
    for (Corners<NA>* c : {&a.start, &a.end})
        for (Vec3d& p : *c) p -= origin;
    for (Corners<NB>* c : {&b.start, &b.end})
        for (Vec3d& p : *c) p -= origin;
    const Advancement<NA, NB> advancement(a, b, options.slack);

    double t = 0, before = 0, distanceBefore = 0, boldness = 1;
    for (;;) {
        ++out.steps;
        const Corners<NA> aNow = a.at(t);
        const Corners<NB> bNow = b.at(t);
        const NearestPoints near = nearest(aNow, bNow);
        const Vec3d n = directionApart(asTriangle(aNow), asTriangle(bNow), near);
        const auto reached = [&](const Vec3d& direction) {
            const Times times = advancement.separated(direction);
            return times.from <= t && times.to > t ? times.to : t;
        };
        double next = reached(n);
        const bool within = near.distance <= options.tolerance;
        if (out.steps > kStepsAlone && next < options.upTo && !within) {
            const bool nearing = near.distance < distanceBefore;
            const double target = nearing ? t + near.distance * (t - before) / (distanceBefore - near.distance) : 1.0;
            const double then = t + boldness * (std::min(target, options.upTo) - t);
            const Corners<NA> aThen = a.at(then);
            const Corners<NB> bThen = b.at(then);
            const NearestPoints nearThen = nearest(aThen, bThen);
            const Vec3d nThen = directionApart(asTriangle(aThen), asTriangle(bThen), nearThen);
            const bool ok = advancement.separatedThroughout(aNow, bNow, n, aThen, bThen, nThen);
            boldness = ok ? std::min(1.0, 2 * boldness) : 0.5 * boldness;
            if (ok) next = std::max(next, then);
        }
        if (within && next < options.upTo) {
            // Within the tolerance, but perhaps passing for good: square to a face or to two edges that is often seen.
            const Triangle x = asTriangle(aNow), y = asTriangle(bNow);
            const Vec3d e = x[1] - x[0], f = y[1] - y[0];
            for (const Vec3d& square : {Vec3d(e.cross(x[2] - x[0])), Vec3d(f.cross(y[2] - y[0])), Vec3d(e.cross(f))}) {
                const Vec3d direction = unitOrZero(square);
                next = std::max({next, reached(direction), reached(-direction)});
            }
        }
        if (next >= options.upTo) return out;
        const bool stalled = next <= t;
        out.complete = stalled || within || out.steps < options.mostSteps;
        if (stalled || within || !out.complete) {
            out.hit = true;
            out.t = t;
            out.distance = near.distance;
            out.onA = near.onA + origin;
            out.onB = near.onB + origin;
            return out;
        }
        before = t;
        distanceBefore = near.distance;
        t = next;
    }
}

/// The gap that a direction leaves between A, behind, and B.
double gapAlong(const Vec3d& n, const Triangle& a, const Triangle& b) {
    return std::min({n.dot(b[0]), n.dot(b[1]), n.dot(b[2])}) - std::max({n.dot(a[0]), n.dot(a[1]), n.dot(a[2])});
}

}  // namespace

Vec3d directionApart(const Triangle& a, const Triangle& b, const NearestPoints& near) {
    Vec3d best = unitOrZero(near.onB - near.onA);
    double widest = best == Vec3d::Zero() ? -std::numeric_limits<double>::infinity() : gapAlong(best, a, b);
    if (widest >= 0.999 * near.distance && widest > 0) return best;
    const auto offer = [&](const Vec3d& direction) {
        const Vec3d n = unitOrZero(direction);
        if (n == Vec3d::Zero()) return;
        for (const Vec3d& d : {n, Vec3d(-n)}) {
            const double gap = gapAlong(d, a, b);
            if (gap > widest) {
                widest = gap;
                best = d;
            }
        }
    };
    // Whatever is nearest to what: faces, two edges, a corner and an edge, two corners.
    for (const Triangle* t : {&a, &b}) offer(((*t)[1] - (*t)[0]).cross((*t)[2] - (*t)[0]));
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const Vec3d alongA = a[(i + 1) % 3] - a[i], alongB = b[(j + 1) % 3] - b[j];
            offer(alongA.cross(alongB));
            for (const Vec3d& edge : {alongA, alongB}) {
                const double length = edge.squaredNorm();
                if (!(length > 0)) continue;
                // Corner i of A and corner j of B stand for all pairs of which one is on this edge. Square to it twice:
                // of what is left of a long way the first time, few digits are right, and the edge is long.
                const auto square = [&](const Vec3d& v) -> Vec3d { return v - v.dot(edge) / length * edge; };
                offer(square(unitOrZero(square(b[j] - a[i]))));
            }
            offer(b[j] - a[i]);
        }
    return best;
}

ElementaryImpact trianglesImpact(const Triangle& aStart, const Triangle& aEnd, const Triangle& bStart,
                                 const Triangle& bEnd, const ElementaryOptions& options) {
    const auto nearest = [](const Triangle& a, const Triangle& b) { return nearestPoints(a, b); };
    ElementaryImpact out = advance<3, 3>(aStart, aEnd, bStart, bEnd, options, nearest);
    // Corners and edges may be apart where an edge goes through the other's inside.
    const Moving<3> a{aStart, aEnd}, b{bStart, bEnd};
    if (out.hit && out.distance > options.tolerance && trianglesIntersect(a.at(out.t), b.at(out.t))) {
        out.distance = 0;
        out.onB = out.onA;
    }
    return out;
}

}  // namespace tessera
