#include "common/freeform/nurbs/tessellation/TrimOutline.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace tessera {
namespace {

constexpr double kOutside = 1e-5;
constexpr int kMostHalvings = 60;

/// A piece of a curve, and its chord on the lattice.
struct TrimPiece {
    std::vector<Vec3d> points;  // (w·u, w·v, w)
    LatticePoint begin, end;
    std::uint32_t loop = 0;
    int halvings = 0;
};

std::string trimPlaceText(const LatticeSurface& lattice, const LatticePoint& p) {
    std::array<char, 80> text;
    char* at =
        std::to_chars(text.data(), text.data() + 32, lattice.u.toParameter(p.u), std::chars_format::general, 6).ptr;
    *at++ = ' ';
    return "(" +
           std::string(text.data(),
                       std::to_chars(at, at + 32, lattice.v.toParameter(p.v), std::chars_format::general, 6).ptr) +
           ")";
}

/// In spans, not rounded: what a distance in the lattice is measured by.
double inSpans(const ParameterAxis& axis, double parameter) {
    return static_cast<double>(axis.toLattice(parameter)) / static_cast<double>(kLatticeSpan);
}

/// How far the surface moves at most per span of u and of v, within a rectangle given in spans.
struct SurfaceRates {
    double u = 0, v = 0;
};
double rateAlong(const BezierPatch& part, PatchAxis axis) {
    const int n = axis == PatchAxis::kU ? part.degreeU : part.degreeV,
              m = axis == PatchAxis::kU ? part.degreeV : part.degreeU;
    double least = std::numeric_limits<double>::infinity(), most = 0, step = 0;
    const auto at = [&](int i, int j) -> const Vec4d& { return axis == PatchAxis::kU ? part.at(i, j) : part.at(j, i); };
    for (const Vec4d& p : part.points) {
        least = std::min(least, p.w());
        most = std::max(most, p.w());
    }
    // Of a rational curve's derivative (Floater 1992): degree · (most / least weight)² · the longest step. Along u at a
    // given v the curve's control points are means of those of the columns, so steps between any of two neighbouring
    // columns count.
    const bool polynomial = least == most;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j <= m; ++j) {
            const Vec3d from = at(i, j).head<3>() / at(i, j).w();
            for (int k = polynomial ? j : 0; k <= (polynomial ? j : m); ++k)
                step = std::max(step, (at(i + 1, k).head<3>() / at(i + 1, k).w() - from).norm());
        }
    return n * (most / least) * (most / least) * step;
}
SurfaceRates ratesWithin(const LatticeSurface& lattice, const Vec2d& lower, const Vec2d& upper) {
    SurfaceRates rates;
    const auto span = [](const ParameterAxis& axis, double x) {
        return std::min(static_cast<std::size_t>(std::max(x, 0.0)), axis.spans() - 1);
    };
    for (std::size_t j = span(lattice.v, lower.y()); j <= span(lattice.v, upper.y()); ++j)
        for (std::size_t i = span(lattice.u, lower.x()); i <= span(lattice.u, upper.x()); ++i) {
            // Some width, however thin the rectangle is.
            constexpr double kThin = 1e-9;
            const auto within = [](double x, std::size_t k) {
                return std::min(std::max(x - static_cast<double>(k), 0.0), 1.0);
            };
            double u0 = within(lower.x(), i), u1 = within(upper.x(), i), v0 = within(lower.y(), j),
                   v1 = within(upper.y(), j);
            const auto widen = [](double& low, double& high) {
                if (high - low >= kThin) return;
                low = std::max(0.0, low - kThin);
                high = std::min(1.0, high + kThin);
            };
            widen(u0, u1);
            widen(v0, v1);
            const BezierPatch part = partOf(lattice.patch(i, j), u0, u1, v0, v1);
            rates.u = std::max(rates.u, rateAlong(part, PatchAxis::kU) / (u1 - u0));
            rates.v = std::max(rates.v, rateAlong(part, PatchAxis::kV) / (v1 - v0));
        }
    return rates;
}

class TrimFlattening {
public:
    TrimFlattening(const NurbsSurface& surface, const LatticeSurface& lattice, double tolerance, std::size_t maxPieces)
        : surface_(surface), lattice_(lattice), tolerance_(tolerance), maxPieces_(maxPieces) {}

    Expected<TrimOutline> make() {
        std::vector<TrimPiece> whole;
        for (const TrimRegion::Segment& s : surface_.region().segments()) {
            if (Expected<void> inside = checkInside(s); !inside) return tl::unexpected(inside.error());
            whole.push_back({s.points, onLatticeAt(s.begin), onLatticeAt(s.end), s.loop, 0});
        }
        Expected<std::vector<TrimPiece>> pieces = halvedUntilNear(whole);
        // Thin places ask for pieces as fine as they are: chords that cross are halved until they do not, or the curves
        // do.
        while (pieces) {
            std::vector<bool> crossed(pieces->size());
            const Expected<bool> any = findCrossings(*pieces, crossed);
            if (!any) return tl::unexpected(any.error());
            if (!*any) return oriented(*pieces);
            pieces = halvedOnce(*pieces, crossed);
        }
        return tl::unexpected(pieces.error());
    }

private:
    [[nodiscard]] LatticePoint onLatticeAt(const Vec2d& p) const {
        return {lattice_.u.toLattice(p.x()), lattice_.v.toLattice(p.y())};
    }
    static Vec2d plainOf(const Vec3d& p) { return p.head<2>() / p.z(); }
    [[nodiscard]] Vec2d spansAt(const Vec2d& p) const {
        return {inSpans(lattice_.u, p.x()), inSpans(lattice_.v, p.y())};
    }

    Expected<void> checkInside(const TrimRegion::Segment& s) const {
        const ParameterRectangle& d = surface_.domain();
        const Vec2d near(kOutside * d.u.size(), kOutside * d.v.size());
        // Its control points say so where they are inside; else the curve's own halves tell.
        std::vector<std::pair<std::vector<Vec3d>, int>> open{{s.points, 0}};
        while (!open.empty()) {
            auto [points, depth] = std::move(open.back());
            open.pop_back();
            bool inside = true;
            for (const Vec3d& p : points) inside = inside && isInside(plainOf(p), near);
            if (inside) continue;
            if (!isInside(plainOf(points.front()), near) || !isInside(plainOf(points.back()), near) ||
                depth == kMostHalvings)
                return fail(ErrorCode::kBadInput, nameOf(s.loop) + " leaves the surface's domain near " +
                                                      trimPlaceText(lattice_, onLatticeAt(plainOf(points.back()))));
            auto [first, second] = halves(points);
            open.emplace_back(std::move(first), depth + 1);
            open.emplace_back(std::move(second), depth + 1);
        }
        return {};
    }
    [[nodiscard]] bool isInside(const Vec2d& p, const Vec2d& near) const {
        const ParameterRectangle& d = surface_.domain();
        return p.x() >= d.u.lower - near.x() && p.x() <= d.u.upper + near.x() && p.y() >= d.v.lower - near.y() &&
               p.y() <= d.v.upper + near.y();
    }
    [[nodiscard]] std::string nameOf(std::uint32_t loop) const {
        return std::string(surface_.region().loops()[loop] == LoopRole::kHole ? "hole" : "outer loop") + " (loop " +
               std::to_string(loop + 1) + ")";
    }

    static std::pair<std::vector<Vec3d>, std::vector<Vec3d>> halves(std::vector<Vec3d> points) {
        std::vector<Vec3d> upper(points.size());
        const std::size_t n = points.size();
        for (std::size_t level = 0; level < n; ++level) {
            upper[n - 1 - level] = points[n - 1];
            for (std::size_t i = n - 1; i > level; --i) points[i] = 0.5 * (points[i] + points[i - 1]);
        }
        return {std::move(points), std::move(upper)};
    }

    /// Of the control points the farthest from the chord, in spans; the curve is within their hull.
    [[nodiscard]] bool isNear(const TrimPiece& piece) const {
        const Vec2d a = spansAt(plainOf(piece.points.front())), b = spansAt(plainOf(piece.points.back()));
        Vec2d lower = a.cwiseMin(b), upper = a.cwiseMax(b), most = Vec2d::Zero();
        std::vector<Vec2d> off;
        for (const Vec3d& control : piece.points) {
            const Vec2d p = spansAt(plainOf(control));
            const double length = (b - a).squaredNorm(),
                         t = length > 0 ? std::min(std::max((p - a).dot(b - a) / length, 0.0), 1.0) : 0.0;
            off.push_back((p - a - t * (b - a)).cwiseAbs());
            most = most.cwiseMax(off.back());
            lower = lower.cwiseMin(p);
            upper = upper.cwiseMax(p);
        }
        constexpr double kNothing = 1e-12;  // a lattice unit
        if (most.maxCoeff() <= kNothing) return true;
        constexpr double kMostSpans = 4;
        if ((upper - lower).maxCoeff() > kMostSpans) return false;
        // No thinner than a quarter of its length: what a rational surface is known by else says little.
        const Vec2d least = Vec2d::Constant(0.25 * (upper - lower).maxCoeff());
        const Vec2d middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower).cwiseMax(least);
        const SurfaceRates rates = ratesWithin(lattice_, middle - half, middle + half);
        double farthest = 0;
        for (const Vec2d& o : off) farthest = std::max(farthest, rates.u * o.x() + rates.v * o.y());
        return farthest <= tolerance_;
    }

    [[nodiscard]] tl::unexpected<Error> tooMany() const {
        return fail(ErrorCode::kLimit,
                    "trims need more than " + std::to_string(maxPieces_) + " pieces for this tolerance");
    }
    [[nodiscard]] std::array<TrimPiece, 2> halvesOf(const TrimPiece& p) const {
        auto [first, second] = halves(p.points);
        const LatticePoint middle = onLatticeAt(plainOf(second.front()));
        return {TrimPiece{std::move(first), p.begin, middle, p.loop, p.halvings + 1},
                TrimPiece{std::move(second), middle, p.end, p.loop, p.halvings + 1}};
    }
    Expected<std::vector<TrimPiece>> halvedOnce(const std::vector<TrimPiece>& pieces,
                                                const std::vector<bool>& wanted) const {
        std::vector<TrimPiece> made;
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            if (made.size() + 2 > maxPieces_) return tooMany();
            if (!wanted[i]) {
                made.push_back(pieces[i]);
                continue;
            }
            for (TrimPiece& half : halvesOf(pieces[i])) made.push_back(std::move(half));
        }
        return made;
    }
    Expected<std::vector<TrimPiece>> halvedUntilNear(const std::vector<TrimPiece>& pieces) const {
        std::vector<TrimPiece> made, open;
        for (const TrimPiece& piece : pieces) {
            open.push_back(piece);
            while (!open.empty()) {
                TrimPiece p = std::move(open.back());
                open.pop_back();
                if (p.halvings >= kMostHalvings || isNear(p)) {
                    if (made.size() == maxPieces_) return tooMany();
                    made.push_back(std::move(p));
                    continue;
                }
                std::array<TrimPiece, 2> half = halvesOf(p);
                open.push_back(std::move(half[1]));
                open.push_back(std::move(half[0]));
            }
        }
        return made;
    }

    /// Whether two chords meet elsewhere than in a common end, or at one's end within the other.
    static bool meet(const TrimPiece& a, const TrimPiece& b) {
        const int c = turnOf(a.begin, a.end, b.begin), d = turnOf(a.begin, a.end, b.end);
        const int e = turnOf(b.begin, b.end, a.begin), f = turnOf(b.begin, b.end, a.end);
        if (c == 0 && d == 0) {
            const auto [aLow, aHigh] = std::minmax(a.begin, a.end);
            const auto [bLow, bHigh] = std::minmax(b.begin, b.end);
            return std::max(aLow, bLow) < std::min(aHigh, bHigh);
        }
        return c * d < 0 && e * f < 0;
    }
    [[nodiscard]] bool isStraight(const TrimPiece& p) const {
        const Vec2d a = spansAt(plainOf(p.points.front())), b = spansAt(plainOf(p.points.back()));
        constexpr double kNothing = 1e-11;
        for (const Vec3d& control : p.points) {
            const Vec2d at = spansAt(plainOf(control));
            const double length = (b - a).squaredNorm(),
                         t = length > 0 ? std::min(std::max((at - a).dot(b - a) / length, 0.0), 1.0) : 0.0;
            if ((at - a - t * (b - a)).cwiseAbs().maxCoeff() > kNothing) return false;
        }
        return true;
    }

    Expected<bool> findCrossings(const std::vector<TrimPiece>& pieces, std::vector<bool>& crossed) const {
        constexpr std::size_t kMostPairs = 20'000'000;
        std::vector<std::uint32_t> order(pieces.size()), active;
        for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
        const auto low = [&](std::uint32_t i) { return std::min(pieces[i].begin.u, pieces[i].end.u); };
        std::sort(order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return std::pair(low(a), a) < std::pair(low(b), b); });
        std::size_t pairs = 0;
        bool any = false;
        for (const std::uint32_t i : order) {
            const TrimPiece& a = pieces[i];
            std::erase_if(active,
                          [&](std::uint32_t k) { return std::max(pieces[k].begin.u, pieces[k].end.u) < low(i); });
            pairs += active.size();
            if (pairs > kMostPairs) return fail(ErrorCode::kLimit, "trims have too many pieces beside each other");
            for (const std::uint32_t k : active) {
                const TrimPiece& b = pieces[k];
                if (std::max(a.begin.v, a.end.v) < std::min(b.begin.v, b.end.v) ||
                    std::max(b.begin.v, b.end.v) < std::min(a.begin.v, a.end.v))
                    continue;
                if (a.begin == a.end || b.begin == b.end || !meet(a, b)) continue;
                const bool straightA = a.halvings >= kMostHalvings || isStraight(a),
                           straightB = b.halvings >= kMostHalvings || isStraight(b);
                if (straightA && straightB) return crossingOf(a, b);
                crossed[i] = crossed[i] || !straightA;
                crossed[k] = crossed[k] || !straightB;
                any = true;
            }
            active.push_back(i);
        }
        return any;
    }
    [[nodiscard]] tl::unexpected<Error> crossingOf(const TrimPiece& a, const TrimPiece& b) const {
        const std::string where = " near " + trimPlaceText(lattice_, a.begin);
        if (a.loop == b.loop)
            return fail(ErrorCode::kBadInput, nameOf(a.loop) + " crosses itself, or runs along itself," + where);
        return fail(ErrorCode::kBadInput, nameOf(std::min(a.loop, b.loop)) + " and " +
                                              nameOf(std::max(a.loop, b.loop)) + " cross, or run along each other," +
                                              where);
    }

    Expected<TrimOutline> oriented(const std::vector<TrimPiece>& pieces) const {
        const std::span<const LoopRole> roles = surface_.region().loops();
        std::vector<std::vector<LatticePoint>> loops(roles.size());
        for (const TrimPiece& p : pieces)
            if (p.begin != p.end) loops[p.loop].push_back(p.begin);
        TrimOutline outline{.loops = {},
                            .keepsOutside = std::find(roles.begin(), roles.end(), LoopRole::kOuter) == roles.end()};
        for (std::size_t l = 0; l < loops.size(); ++l) {
            if (loops[l].size() < 3) continue;  // a point
            int outside = outline.keepsOutside ? 1 : 0;
            for (std::size_t k = 0; k < loops.size(); ++k)
                if (k != l && goesAround(loops[k], loops[l])) outside += roles[k] == LoopRole::kHole ? -1 : 1;
            const int inside = outside + (roles[l] == LoopRole::kHole ? -1 : 1);
            if ((inside > 0) == (outside > 0)) continue;  // the same on both sides
            std::vector<LatticePoint> loop = loops[l];
            if (isCounterclockwise(loop) != (inside > 0)) std::reverse(loop.begin(), loop.end());
            dropAlongEdges(loop);
            outline.loops.push_back(std::move(loop));
        }
        return outline;
    }

    /// The edges of the domain are cut where their own curves say: neighbours cut them at the same places.
    void dropAlongEdges(std::vector<LatticePoint>& loop) const {
        const auto isOnEdge = [&](const LatticePoint& a, const LatticePoint& b) {
            return (a.u == b.u && (a.u == 0 || a.u == lattice_.u.end())) ||
                   (a.v == b.v && (a.v == 0 || a.v == lattice_.v.end()));
        };
        std::vector<LatticePoint> left;
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const LatticePoint &here = loop[i], &next = loop[(i + 1) % loop.size()],
                               &previous = left.empty() ? loop.back() : left.back();
            if (!(isOnEdge(previous, here) && isOnEdge(here, next) && isBetween(here, previous, next) &&
                  turnOf(previous, here, next) == 0))
                left.push_back(here);
        }
        loop = std::move(left);
    }

    static bool isCounterclockwise(const std::vector<LatticePoint>& loop) {
        const std::size_t n = loop.size(),
                          k = static_cast<std::size_t>(std::min_element(loop.begin(), loop.end()) - loop.begin());
        return turnOf(loop[(k + n - 1) % n], loop[k], loop[(k + 1) % n]) > 0;
    }
    static int windingAround(const std::vector<LatticePoint>& loop, const LatticePoint& p, bool& onIt) {
        int winding = 0;
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const LatticePoint &a = loop[i], &b = loop[(i + 1) % loop.size()];
            if ((a.v > p.v && b.v > p.v) || (a.v < p.v && b.v < p.v)) continue;
            const int turn = turnOf(a, b, p);
            if (turn == 0 && std::min(a, b) <= p && p <= std::max(a, b)) onIt = true;
            if (a.v <= p.v && b.v > p.v && turn > 0) ++winding;
            if (b.v <= p.v && a.v > p.v && turn < 0) --winding;
        }
        return winding;
    }
    /// Loops that do not cross: by any vertex that is not on the other.
    static bool goesAround(const std::vector<LatticePoint>& outer, const std::vector<LatticePoint>& inner) {
        for (const LatticePoint& p : inner) {
            bool onIt = false;
            const int winding = outer.size() < 3 ? 0 : windingAround(outer, p, onIt);
            if (!onIt) return winding != 0;
        }
        return false;
    }

    const NurbsSurface& surface_;
    const LatticeSurface& lattice_;
    double tolerance_;
    std::size_t maxPieces_;
};

}  // namespace

bool TrimOutline::keeps(const LatticePoint& p) const {
    int around = keepsOutside ? 1 : 0;
    for (const std::vector<LatticePoint>& loop : loops)
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const LatticePoint &a = loop[i], &b = loop[(i + 1) % loop.size()];
            if (a.v <= p.v && b.v > p.v && turnOf(a, b, p) > 0) ++around;
            if (b.v <= p.v && a.v > p.v && turnOf(a, b, p) < 0) --around;
        }
    return around > 0;
}

Expected<TrimOutline> outlineOf(const NurbsSurface& surface, const LatticeSurface& lattice, double tolerance,
                                std::size_t maxPieces) {
    return TrimFlattening(surface, lattice, tolerance, maxPieces).make();
}

}  // namespace tessera
