#include "common/freeform/nurbs/tessellation/NurbsTriangles.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "common/freeform/PatchBounds.h"
#include "common/freeform/nurbs/tessellation/CellTriangulation.h"
#include "common/freeform/nurbs/tessellation/LeastCells.h"
#include "common/freeform/nurbs/tessellation/SurfaceEdges.h"
#include "common/freeform/nurbs/tessellation/TrimOutline.h"

namespace tessera {
namespace {

struct LatticePointHash {
    std::size_t operator()(const LatticePoint& p) const {
        return std::hash<std::int64_t>{}(p.u) * 0x9E3779B97F4A7C15ull + std::hash<std::int64_t>{}(p.v);
    }
};

struct CellCorner {
    LatticePoint p;
    std::uint32_t cut = 0;  ///< the line on which the side from here to the next corner lies
};
struct TrimStep {
    LatticePoint from, to;
};
/// A convex part of a knot span.
struct Cell {
    std::vector<CellCorner> corners;  // counterclockwise
    std::vector<TrimStep> trims;
    bool isKept = false;  // all of it, known
    BezierPatch patch;    // over the box around the corners
    LatticePoint lower, upper;
};
struct FlatCell {
    std::vector<CellCorner> corners;
    std::vector<TrimStep> trims;
    std::uint32_t spanU = 0, spanV = 0;
};

/// How far a patch, and triangles with corners on it that fill a part of its parameters (`isWhole`: all of them), can
/// be from each other.
double cellError(const BezierPatch& patch, bool isWhole) {
    const auto place = [](const Vec4d& p) -> Vec3d { return p.head<3>() / p.w(); };
    const Vec3d a = place(patch.at(0, 0)), b = place(patch.at(patch.degreeU, 0)),
                c = place(patch.at(patch.degreeU, patch.degreeV)), d = place(patch.at(0, patch.degreeV));
    const Vec3d twist = a - b + c - d;
    // A bilinear patch is off a triangle of its own points by a quarter of its twist, at the same parameters.
    double bend = 0.25 * twist.norm();
    // Seen along the normal of its diagonals it is a quadrangle. Where that is convex, bilinear patch and triangles
    // fill the same plane figure, and no point of either is farther from the plane between the diagonals than the
    // corners are: a quarter of the twist along the normal.
    const Vec3d across = (c - a).cross(d - b);
    const double length = across.norm();
    if (isWhole && length > 1e-6 * (c - a).norm() * (d - b).norm()) {
        const Vec3d normal = across / length;
        const double nothing = -1e-14 * length;
        if ((b - a).cross(d - a).dot(normal) >= nothing && (c - b).cross(a - b).dot(normal) >= nothing &&
            (d - c).cross(b - c).dot(normal) >= nothing && (a - d).cross(c - d).dot(normal) >= nothing)
            bend = std::min(bend, 0.5 * std::abs(twist.dot(normal)));
    }
    // The corners of triangles are off the bilinear patch by no more than other points of the surface are.
    return 2 * bilinearDeviation(patch) + bend;
}

/// What is left to be spent (TessellationLimits::maxSums).
struct SumCount {
    std::size_t left;

    [[nodiscard]] bool take(std::size_t sums) {
        if (sums > left) return false;
        left -= sums;
        return true;
    }
};
tl::unexpected<Error> tooDear() {
    return fail(ErrorCode::kLimit,
                "it would take too long to make triangles of: fewer knots, lower degrees or a larger tolerance");
}

/// What Bézier patches of all spans take, by blossoms along one axis and then along the other.
std::size_t sumsOfPatches(const NurbsSurface& surface) {
    const NurbsDefinition& d = surface.definition();
    const std::size_t spans = spansWithin(d.u, surface.domain().u).size() * spansWithin(d.v, surface.domain().v).size();
    const auto p = static_cast<std::size_t>(d.u.degree), q = static_cast<std::size_t>(d.v.degree);
    // Control points are at most 2^32, degrees 24.
    return spans * (p + 1) * (q + 1) * (p * (p + 1) + q * (q + 1)) / 2;
}

/// One surface, or one part of it between jumps.
class Tessellation {
public:
    Tessellation(const LatticeSurface& lattice, const SurfaceEdges& edges, const SpanRange& part,
                 const TrimOutline& outline, bool isTrimmed, double tolerance, std::size_t maxTriangles, SumCount& sums,
                 NurbsTriangles& made)
        : lattice_(lattice),
          edges_(edges),
          part_(part),
          outline_(outline),
          isTrimmed_(isTrimmed),
          tolerance_(tolerance),
          maxTriangles_(maxTriangles),
          sums_(sums),
          made_(made) {}

    Expected<void> run() {
        std::unordered_map<std::size_t, std::vector<TrimStep>> trims = trimsBySpan();
        // The lines between spans: those at the low u of each, then those at the low v.
        const std::size_t width = part_.endU - part_.beginU, height = part_.endV - part_.beginV;
        cuts_.resize((width + 1) * height + width * (height + 1));
        const auto lineU = [&](std::size_t i, std::size_t j) {
            return static_cast<std::uint32_t>(j * (width + 1) + i);
        };
        const auto lineV = [&](std::size_t i, std::size_t j) {
            return static_cast<std::uint32_t>((width + 1) * height + j * width + i);
        };
        for (std::size_t j = 0; j < height; ++j) {
            cuts_[lineU(0, j)] = edges_.cutsWithin(SurfaceEdges::kLowU, part_.beginV + j);
            cuts_[lineU(width, j)] = edges_.cutsWithin(SurfaceEdges::kHighU, part_.beginV + j);
        }
        for (std::size_t i = 0; i < width; ++i) {
            cuts_[lineV(i, 0)] = edges_.cutsWithin(SurfaceEdges::kLowV, part_.beginU + i);
            cuts_[lineV(i, height)] = edges_.cutsWithin(SurfaceEdges::kHighV, part_.beginU + i);
        }
        for (std::size_t j = 0; j < height; ++j)
            for (std::size_t i = 0; i < width; ++i) {
                const std::size_t spanU = part_.beginU + i, spanV = part_.beginV + j;
                const LatticePoint lower{static_cast<std::int64_t>(spanU) * kLatticeSpan,
                                         static_cast<std::int64_t>(spanV) * kLatticeSpan};
                const LatticePoint upper{lower.u + kLatticeSpan, lower.v + kLatticeSpan};
                Cell cell{.corners = {{lower, lineV(i, j)},
                                      {{upper.u, lower.v}, lineU(i + 1, j)},
                                      {upper, lineV(i, j + 1)},
                                      {{lower.u, upper.v}, lineU(i, j)}},
                          .trims = std::move(trims[spanV * lattice_.u.spans() + spanU]),
                          .isKept = !isTrimmed_,
                          .patch = lattice_.patch(spanU, spanV),
                          .lower = lower,
                          .upper = upper};
                if (Expected<void> done = flatten(std::move(cell), spanU, spanV); !done) return done;
            }
        for (const FlatCell& cell : cells_) noteVertices(cell);
        for (std::vector<LatticePoint>& cut : cuts_) {
            std::sort(cut.begin(), cut.end());
            cut.erase(std::unique(cut.begin(), cut.end()), cut.end());
        }
        for (const FlatCell& cell : cells_)
            if (Expected<void> done = triangulate(cell); !done) return done;
        return {};
    }

    /// Why `run` failed: the limit of triangles.
    [[nodiscard]] bool wereTooMany() const { return tooMany_; }

private:
    [[nodiscard]] LatticePoint interpolated(const LatticePoint& a, const LatticePoint& b, LatticeProduct part,
                                            LatticeProduct whole) const {
        const auto along = [&](std::int64_t from, std::int64_t to) {
            const LatticeProduct product = static_cast<LatticeProduct>(to - from) * part, half = whole / 2;
            return from +
                   static_cast<std::int64_t>(product >= 0 ? (product + half) / whole : -((-product + half) / whole));
        };
        return {along(a.u, b.u), along(a.v, b.v)};
    }

    /// The outline cut at the knots.
    [[nodiscard]] std::unordered_map<std::size_t, std::vector<TrimStep>> trimsBySpan() const {
        std::unordered_map<std::size_t, std::vector<TrimStep>> bySpan;
        const auto place = [&](const TrimStep& s) {
            // Along a line between spans: of those on both sides.
            const auto spansOf = [](std::int64_t a, std::int64_t b, std::size_t begin, std::size_t end) {
                const std::int64_t low = std::min(a, b), high = std::max(a, b);
                std::vector<std::size_t> spans;
                const std::int64_t first = low / kLatticeSpan;
                if (low == high && low % kLatticeSpan == 0 && first > 0)
                    spans.push_back(static_cast<std::size_t>(first) - 1);
                spans.push_back(static_cast<std::size_t>(first));
                std::erase_if(spans, [&](std::size_t k) { return k < begin || k >= end; });
                return spans;
            };
            for (const std::size_t j : spansOf(s.from.v, s.to.v, part_.beginV, part_.endV))
                for (const std::size_t i : spansOf(s.from.u, s.to.u, part_.beginU, part_.endU))
                    bySpan[j * lattice_.u.spans() + i].push_back(s);
        };
        const auto crossings = [&](const LatticePoint& a, const LatticePoint& b, bool alongU) {
            std::vector<LatticePoint> points{a};
            const std::int64_t from = alongU ? a.u : a.v, to = alongU ? b.u : b.v;
            const std::int64_t low = std::min(from, to) / kLatticeSpan + 1,
                               high = (std::max(from, to) - 1) / kLatticeSpan;
            for (std::int64_t k = low; k <= high; ++k) {
                const std::int64_t line = (from < to ? k : low + high - k) * kLatticeSpan;
                // Products of the whole domain: in long double, then onto the line.
                const long double part = static_cast<long double>(line - from) / static_cast<long double>(to - from);
                const std::int64_t other =
                    (alongU ? a.v : a.u) +
                    std::llround(part * static_cast<long double>(alongU ? b.v - a.v : b.u - a.u));
                points.push_back(alongU ? LatticePoint{line, other} : LatticePoint{other, line});
            }
            points.push_back(b);
            return points;
        };
        for (const std::vector<LatticePoint>& loop : outline_.loops)
            for (std::size_t k = 0; k < loop.size(); ++k) {
                const std::vector<LatticePoint> byU = crossings(loop[k], loop[(k + 1) % loop.size()], true);
                for (std::size_t m = 0; m + 1 < byU.size(); ++m) {
                    const std::vector<LatticePoint> byV = crossings(byU[m], byU[m + 1], false);
                    for (std::size_t n = 0; n + 1 < byV.size(); ++n)
                        if (byV[n] != byV[n + 1]) place({byV[n], byV[n + 1]});
                }
            }
        return bySpan;
    }

    /// Halves it until it is flat.
    Expected<void> flatten(Cell whole, std::size_t spanU, std::size_t spanV) {
        std::vector<Cell> open;
        open.push_back(std::move(whole));
        while (!open.empty()) {
            Cell cell = std::move(open.back());
            open.pop_back();
            if (cell.trims.empty() && !cell.isKept) {
                if (!outline_.keeps(middleOf(cell))) continue;
                cell.isKept = true;
            }
            const double error = cellError(cell.patch, cell.trims.empty());
            if (error <= (cell.trims.empty() ? tolerance_ : 0.5 * tolerance_)) {
                sureTriangles_ += cell.trims.empty() && cell.corners.size() == 4 && hasFourCorners(cell.patch) ? 2
                                  : cell.trims.empty()                                                         ? 1
                                                                                                               : 0;
                if (made_.triangles.size() + sureTriangles_ > maxTriangles_) return tooMany();
                made_.error = std::max(made_.error, cell.trims.empty() ? error : error + 0.5 * tolerance_);
                cells_.push_back({std::move(cell.corners), std::move(cell.trims), static_cast<std::uint32_t>(spanU),
                                  static_cast<std::uint32_t>(spanV)});
                continue;
            }
            const auto points =
                static_cast<std::size_t>(cell.patch.degreeU + 1) * static_cast<std::size_t>(cell.patch.degreeV + 1);
            if (!sums_.take(points * static_cast<std::size_t>(cell.patch.degreeU + cell.patch.degreeV + 2)))
                return tooDear();
            const PatchAxis better = lessFlatAxis(cell.patch),
                            other = better == PatchAxis::kU ? PatchAxis::kV : PatchAxis::kU;
            std::vector<Cell> parts;
            for (const PatchAxis axis : {better, other}) {
                if (!mayHalve(cell, axis)) continue;
                const LatticePoint at{cell.lower.u + (cell.upper.u - cell.lower.u) / 2,
                                      cell.lower.v + (cell.upper.v - cell.lower.v) / 2};
                parts = cutBy(cell, at,
                              axis == PatchAxis::kU ? LatticePoint{at.u, at.v + 1} : LatticePoint{at.u + 1, at.v});
                break;
            }
            if (parts.empty() && cell.corners.size() == 4 && cell.upper.u - cell.lower.u >= 2 &&
                cell.upper.v - cell.lower.v >= 2) {
                // Two edges meet here that may not be cut: along the diagonals, so that each part has one of them.
                for (const Cell& half : cutBy(cell, cell.lower, cell.upper))
                    for (Cell& quarter : cutBy(half, {cell.lower.u, cell.upper.v}, {cell.upper.u, cell.lower.v}))
                        parts.push_back(std::move(quarter));
            }
            if (parts.size() < 2)
                return fail(ErrorCode::kLimit,
                            "the surface bends too much within 2^-40 of a knot span for this tolerance");
            for (std::size_t k = parts.size(); k > 0; --k) open.push_back(std::move(parts[k - 1]));
        }
        return {};
    }

    tl::unexpected<Error> tooMany() {
        tooMany_ = true;
        return fail(ErrorCode::kLimit, "more than " + std::to_string(maxTriangles_) + " triangles");
    }
    /// At four places: two triangles for certain, whatever its neighbours put on its sides.
    static bool hasFourCorners(const BezierPatch& patch) {
        const auto place = [&](int i, int j) -> Vec3d { return patch.at(i, j).head<3>() / patch.at(i, j).w(); };
        const std::array<Vec3d, 4> p{place(0, 0), place(patch.degreeU, 0), place(patch.degreeU, patch.degreeV),
                                     place(0, patch.degreeV)};
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t k = i + 1; k < 4; ++k)
                if (p[i] == p[k]) return false;
        return true;
    }

    static LatticePoint middleOf(const Cell& cell) {
        LatticePoint sum;
        for (const CellCorner& c : cell.corners) {
            sum.u += c.p.u - cell.lower.u;
            sum.v += c.p.v - cell.lower.v;
        }
        const auto count = static_cast<std::int64_t>(cell.corners.size());
        return {cell.lower.u + sum.u / count, cell.lower.v + sum.v / count};
    }

    /// Whether a cut through its middle leaves the surface's edges alone.
    [[nodiscard]] bool mayHalve(const Cell& cell, PatchAxis axis) const {
        const bool alongU = axis == PatchAxis::kU;
        const std::int64_t low = alongU ? cell.lower.u : cell.lower.v,
                           size = (alongU ? cell.upper.u : cell.upper.v) - low, middle = low + size / 2;
        if (size < 2) return false;
        for (std::size_t k = 0; k < cell.corners.size(); ++k) {
            const LatticePoint &a = cell.corners[k].p, &b = cell.corners[(k + 1) % cell.corners.size()].p;
            if (alongU ? a.v != b.v || std::min(a.u, b.u) >= middle || std::max(a.u, b.u) <= middle
                       : a.u != b.u || std::min(a.v, b.v) >= middle || std::max(a.v, b.v) <= middle)
                continue;
            const LatticePoint p = alongU ? LatticePoint{middle, a.v} : LatticePoint{a.u, middle};
            if (alongU && a.v == edges_.lowV() && !edges_.mayHave(SurfaceEdges::kLowV, p)) return false;
            if (alongU && a.v == edges_.highV() && !edges_.mayHave(SurfaceEdges::kHighV, p)) return false;
            if (!alongU && a.u == edges_.lowU() && !edges_.mayHave(SurfaceEdges::kLowU, p)) return false;
            if (!alongU && a.u == edges_.highU() && !edges_.mayHave(SurfaceEdges::kHighU, p)) return false;
        }
        return true;
    }

    /// On the left and on the right of the line through a and b; those that have an area.
    std::vector<Cell> cutBy(const Cell& cell, const LatticePoint& a, const LatticePoint& b) {
        const auto cut = static_cast<std::uint32_t>(cuts_.size());
        cuts_.emplace_back();
        std::vector<Cell> parts;
        for (const bool left : {true, false}) {
            const auto sideOf = [&](const LatticePoint& p) { return left ? crossOf(a, b, p) : -crossOf(a, b, p); };
            Cell part{.corners = {}, .trims = {}, .isKept = cell.isKept, .patch = {}, .lower = {}, .upper = {}};
            bool inside = false;
            for (std::size_t k = 0; k < cell.corners.size(); ++k) {
                const CellCorner& here = cell.corners[k];
                const LatticePoint& next = cell.corners[(k + 1) % cell.corners.size()].p;
                const LatticeProduct s = sideOf(here.p), t = sideOf(next);
                inside = inside || s > 0;
                // A side that ends on the line is followed by the cut, where the next one leads away.
                if (s > 0 || (s == 0 && t > 0)) part.corners.push_back(here);
                if (s == 0 && t <= 0) part.corners.push_back({here.p, cut});
                if (s > 0 && t < 0) part.corners.push_back({interpolated(here.p, next, s, s - t), cut});
                if (s < 0 && t > 0) part.corners.push_back({interpolated(next, here.p, t, t - s), here.cut});
            }
            if (!inside) continue;
            for (const TrimStep& step : cell.trims) {
                const LatticeProduct s = sideOf(step.from), t = sideOf(step.to);
                if (s >= 0 && t >= 0) {
                    part.trims.push_back(step);
                } else if (s > 0 || t > 0) {
                    // From the positive end of the left side always, so that both sides have the same place.
                    const bool fromLeft = (s > 0) == left;
                    const LatticePoint &p = fromLeft ? step.from : step.to, &q = fromLeft ? step.to : step.from;
                    const LatticeProduct pSide = crossOf(a, b, p), qSide = crossOf(a, b, q);
                    const LatticePoint at = interpolated(p, q, pSide, pSide - qSide);
                    cuts_[cut].push_back(at);
                    if (s > 0 && at != step.from) part.trims.push_back({step.from, at});
                    if (t > 0 && at != step.to) part.trims.push_back({at, step.to});
                }
            }
            part.lower = part.upper = part.corners.front().p;
            for (const CellCorner& c : part.corners) {
                part.lower = {std::min(part.lower.u, c.p.u), std::min(part.lower.v, c.p.v)};
                part.upper = {std::max(part.upper.u, c.p.u), std::max(part.upper.v, c.p.v)};
            }
            const auto within = [](std::int64_t x, std::int64_t low, std::int64_t high) {
                return static_cast<double>(x - low) / static_cast<double>(high - low);
            };
            part.patch = partOf(cell.patch, within(part.lower.u, cell.lower.u, cell.upper.u),
                                within(part.upper.u, cell.lower.u, cell.upper.u),
                                within(part.lower.v, cell.lower.v, cell.upper.v),
                                within(part.upper.v, cell.lower.v, cell.upper.v));
            parts.push_back(std::move(part));
        }
        return parts;
    }

    void noteVertices(const FlatCell& cell) {
        for (std::size_t k = 0; k < cell.corners.size(); ++k) {
            const CellCorner &here = cell.corners[k], &next = cell.corners[(k + 1) % cell.corners.size()];
            std::vector<LatticePoint>& cut = cuts_[here.cut];
            cut.push_back(here.p);
            cut.push_back(next.p);
            for (const TrimStep& step : cell.trims)
                for (const LatticePoint& p : {step.from, step.to})
                    if (isBetween(p, here.p, next.p) && turnOf(here.p, next.p, p) == 0) cut.push_back(p);
        }
    }

    Expected<void> triangulate(const FlatCell& cell) {
        std::vector<LatticePoint> rim;
        for (std::size_t k = 0; k < cell.corners.size(); ++k) {
            const CellCorner &here = cell.corners[k], &next = cell.corners[(k + 1) % cell.corners.size()];
            const std::vector<LatticePoint>& cut = cuts_[here.cut];
            rim.push_back(here.p);
            if (here.p < next.p) {
                for (auto p = std::upper_bound(cut.begin(), cut.end(), here.p); p != cut.end() && *p < next.p; ++p)
                    rim.push_back(*p);
            } else {
                for (auto p = std::lower_bound(cut.begin(), cut.end(), here.p); p != cut.begin() && next.p < *(p - 1);
                     --p)
                    rim.push_back(*(p - 1));
            }
        }
        if (rim.size() == 4 && cell.trims.empty()) {
            const Vec3d a = placeAt(rim[0]), b = placeAt(rim[1]), c = placeAt(rim[2]), d = placeAt(rim[3]);
            // A quadrangle by its shorter diagonal; one with a side that is a point has one way only.
            const std::size_t first = (b - d).squaredNorm() < (a - c).squaredNorm() ? 1 : 0;
            for (const std::size_t k : {first, first + 2})
                if (Expected<void> done = addTriangle({rim[k % 4], rim[(k + 1) % 4], rim[(k + 2) % 4]}, cell); !done)
                    return done;
            return {};
        }
        CellTriangulation cellTriangles(rim, [this](const LatticePoint& p) { return placeAt(p); });
        for (const TrimStep& step : cell.trims) cellTriangles.trim(step.from, step.to);
        cellTriangles.improve();
        const std::vector<std::array<LatticePoint, 3>> kept = cellTriangles.kept(true);
        if (!cellTriangles.sound()) return fail(ErrorCode::kBadInput, "loops of its trims cross or touch");
        for (const std::array<LatticePoint, 3>& t : kept)
            if (Expected<void> done = addTriangle(t, cell); !done) return done;
        return {};
    }
    Expected<void> addTriangle(const std::array<LatticePoint, 3>& t, const FlatCell& cell) {
        const Vec3d a = placeAt(t[0]), b = placeAt(t[1]), c = placeAt(t[2]);
        if (a == b || b == c || c == a) return {};
        if (made_.triangles.size() == maxTriangles_) return tooMany();
        made_.triangles.push_back({vertexAt(t[0], cell), vertexAt(t[1], cell), vertexAt(t[2], cell)});
        return {};
    }

    struct Place {
        Vec3d place;
        std::vector<std::pair<std::uint64_t, std::uint32_t>> vertices;  // of a span
    };
    Place& known(const LatticePoint& p) {
        const auto [found, isNew] = places_.try_emplace(p);
        if (isNew) {
            if (const std::optional<Vec3d> edge = edges_.at(p)) {
                found->second.place = *edge;
            } else {
                // Between two spans the lower one says it, for both.
                const auto span = [](std::int64_t x, std::size_t begin) {
                    const auto s = static_cast<std::size_t>(x / kLatticeSpan);
                    return x % kLatticeSpan == 0 && s > begin ? s - 1 : s;
                };
                const std::size_t spanU = span(p.u, part_.beginU), spanV = span(p.v, part_.beginV);
                found->second.place = evaluate(lattice_.patch(spanU, spanV), ParameterAxis::within(p.u, spanU),
                                               ParameterAxis::within(p.v, spanV))
                                          .point.array() +
                                      0.0;
            }
        }
        return found->second;
    }
    Vec3d placeAt(const LatticePoint& p) { return known(p).place; }

    /// With the normal that the surface has there in the cell's span.
    std::uint32_t vertexAt(const LatticePoint& p, const FlatCell& cell) {
        Place& place = known(p);
        const std::uint64_t span = std::uint64_t{cell.spanV} << 32 | cell.spanU;
        for (const auto& [of, vertex] : place.vertices)
            if (of == span) return vertex;
        const SurfacePoint at = evaluate(lattice_.patch(cell.spanU, cell.spanV), ParameterAxis::within(p.u, cell.spanU),
                                         ParameterAxis::within(p.v, cell.spanV));
        constexpr double kSmooth = 1e-6;
        for (const auto& [of, vertex] : place.vertices)
            if ((made_.normals[vertex] - at.normal).norm() < kSmooth) {
                const std::uint32_t same = vertex;
                place.vertices.emplace_back(span, same);
                return same;
            }
        const auto made = static_cast<std::uint32_t>(made_.positions.size());
        made_.positions.push_back(place.place);
        made_.normals.push_back(at.normal);
        made_.parameters.emplace_back(lattice_.u.toParameter(p.u), lattice_.v.toParameter(p.v));
        place.vertices.emplace_back(span, made);
        return made;
    }

    const LatticeSurface& lattice_;
    const SurfaceEdges& edges_;
    const SpanRange part_;
    const TrimOutline& outline_;
    const bool isTrimmed_;
    const double tolerance_;
    const std::size_t maxTriangles_;
    SumCount& sums_;
    NurbsTriangles& made_;
    std::vector<std::vector<LatticePoint>> cuts_;  ///< the vertices on each line that cells lie along
    std::vector<FlatCell> cells_;
    std::size_t sureTriangles_ = 0;  ///< that these have at least
    bool tooMany_ = false;
    std::unordered_map<LatticePoint, Place, LatticePointHash> places_;
};

/// A cusp has no normal: there the triangles say.
void fillNormals(NurbsTriangles& made) {
    std::vector<Vec3d> sums;
    for (std::size_t i = 0; i < made.normals.size(); ++i)
        if (made.normals[i].isZero(0)) sums.resize(made.normals.size(), Vec3d::Zero());
    if (sums.empty()) return;
    for (const auto& t : made.triangles) {
        const Vec3d across =
            (made.positions[t[1]] - made.positions[t[0]]).cross(made.positions[t[2]] - made.positions[t[0]]);
        for (const std::uint32_t v : t) sums[v] += across;
    }
    for (std::size_t i = 0; i < sums.size(); ++i)
        if (made.normals[i].isZero(0))
            made.normals[i] = sums[i].norm() > 0 ? sums[i].normalized() : Vec3d(Vec3d::UnitZ());
}

/// Between which spans an axis jumps.
std::vector<std::pair<std::size_t, std::size_t>> joinedSpans(const std::vector<bool>& joins) {
    std::vector<std::pair<std::size_t, std::size_t>> parts;
    for (std::size_t s = 0; s < joins.size(); ++s) {
        if (s == 0 || !joins[s]) parts.emplace_back(s, s);
        parts.back().second = s + 1;
    }
    return parts;
}

/// About the least tolerance whose triangles are not too many, of one whose are: there are up to two hundred times as
/// many as cells for certain. Cells go with 1 / tolerance, those of what bends along one axis alone with its root.
/// Where nothing is certain, one that is a hundred times as large.
double toleranceThatDoes(const NurbsSurface& surface, const LatticeSurface& lattice, double tolerance,
                         std::size_t maxTriangles) {
    constexpr double kTrianglesPerSureCell = 256, kFiner = 100;
    // Far below what is asked for, where the rims of rectangles do not count.
    const double fine = leastCells(surface, lattice, tolerance / kFiner),
                 finer = leastCells(surface, lattice, tolerance / kFiner / kFiner);
    if (!(fine > 0) || !(finer > fine)) return kFiner * tolerance;
    const double power = std::clamp(std::log(finer / fine) / std::log(kFiner), 0.5, 1.0);
    return tolerance *
           std::max(2.0,
                    std::pow(kTrianglesPerSureCell * fine / static_cast<double>(maxTriangles), 1 / power) / kFiner);
}

}  // namespace

Expected<NurbsTriangles> tessellate(const NurbsSurface& surface, double tolerance, const TessellationLimits& limits) {
    if (!(tolerance > 0)) return fail(ErrorCode::kBadInput, "a tolerance has to be above 0");
    SumCount sums{limits.maxSums};
    if (!sums.take(sumsOfPatches(surface))) return tooDear();
    const Expected<LatticeSurface> lattice = onLattice(surface);
    if (!lattice) return tl::unexpected(lattice.error());
    const bool isTrimmed = !surface.region().loops().empty();
    // Known before anything is halved. Slivers along trims may be less than half of what there is.
    if (const double least = (isTrimmed ? 0.5 : 1) * leastCells(surface, *lattice, tolerance);
        least > static_cast<double>(limits.maxTriangles))
        return fail(
            ErrorCode::kLimit,
            fmt::format(
                "a tolerance of {:.3g} takes at least {:.2g} triangles, and {} are the most: about {:.2g} would do",
                tolerance, least, limits.maxTriangles,
                toleranceThatDoes(surface, *lattice, tolerance, limits.maxTriangles)));
    TrimOutline outline;
    if (isTrimmed) {
        Expected<TrimOutline> made = outlineOf(surface, *lattice, 0.5 * tolerance, limits.maxTriangles);
        if (!made) return tl::unexpected(made.error());
        outline = std::move(*made);
    }
    NurbsTriangles made;
    for (const auto& [beginV, endV] : joinedSpans(lattice->joinsV))
        for (const auto& [beginU, endU] : joinedSpans(lattice->joinsU)) {
            const SpanRange part{beginU, endU, beginV, endV};
            // An eighth: however thin the cells along an edge are, twice their deviation leaves room for that across.
            const Expected<SurfaceEdges> edges =
                SurfaceEdges::make(surface, *lattice, part, 0.125 * tolerance, limits.maxTriangles);
            if (!edges) return tl::unexpected(edges.error());
            Tessellation of(*lattice, *edges, part, outline, isTrimmed, tolerance, limits.maxTriangles, sums, made);
            if (Expected<void> done = of.run(); !done) {
                if (!of.wereTooMany()) return tl::unexpected(done.error());
                return fail(ErrorCode::kLimit,
                            fmt::format("a tolerance of {:.3g} takes more than {} triangles, the most that there may "
                                        "be: about {:.2g} would do",
                                        tolerance, limits.maxTriangles,
                                        toleranceThatDoes(surface, *lattice, tolerance, limits.maxTriangles)));
            }
        }
    fillNormals(made);
    return made;
}

}  // namespace tessera
