#include "common/freeform/nurbs/tessellation/SurfaceEdges.h"

#include <algorithm>
#include <string>
#include <utility>

namespace tessera {
namespace {

/// No zero has a sign: equal places are equal bits.
Vec3d edgePlace(const Vec4d& p) {
    return (p.head<3>() / p.w()).array() + 0.0;
}

/// How far a rational curve is from its chord at the same parameter (as bilinearDeviation, of one parameter): the same
/// bits from either end.
double edgeDeviation(const std::vector<Vec4d>& points) {
    const std::size_t n = points.size() - 1;
    const Vec3d begin = edgePlace(points.front()), end = edgePlace(points.back());
    double most = 0, least = 0;
    for (std::size_t k = 0; k <= n + 1; ++k) {
        const double before = static_cast<double>(k), after = static_cast<double>(n + 1 - k);
        Vec3d low = Vec3d::Zero(), high = Vec3d::Zero();
        double lowWeight = 0, highWeight = 0;
        if (k <= n) {
            lowWeight = after * points[k].w();
            low = lowWeight * (edgePlace(points[k]) - begin);
        }
        if (k > 0) {
            highWeight = before * points[k - 1].w();
            high = highWeight * (edgePlace(points[k - 1]) - end);
        }
        most = std::max(most, (low + high).norm());
        least = k == 0 ? lowWeight + highWeight : std::min(least, lowWeight + highWeight);
    }
    return most / least;
}

std::array<std::vector<Vec4d>, 2> edgeHalves(std::vector<Vec4d> points) {
    std::vector<Vec4d> upper(points.size());
    const std::size_t n = points.size();
    for (std::size_t level = 0; level < n; ++level) {
        upper[n - 1 - level] = points[n - 1];
        for (std::size_t i = n - 1; i > level; --i) points[i] = 0.5 * (points[i] + points[i - 1]);
    }
    return {std::move(points), std::move(upper)};
}

Vec3d edgePoint(std::vector<Vec4d> points, double t) {
    for (std::size_t level = points.size() - 1; level > 0; --level)
        for (std::size_t i = 0; i < level; ++i) points[i] = (1 - t) * points[i] + t * points[i + 1];
    return edgePlace(points.front());
}

/// A boundary row of control points as Bézier curves. Made from the end whose numbers come first: two surfaces that
/// have it the other way round make the same bits.
std::vector<std::vector<Vec4d>> rowCurves(const KnotVector& knots, std::vector<Vec4d> row) {
    const auto comesFirst = [](const Vec4d& a, const Vec4d& b) {
        return std::lexicographical_compare(a.data(), a.data() + 4, b.data(), b.data() + 4);
    };
    KnotVector used = knots;
    bool turned = false;
    for (std::size_t i = 0, k = row.size() - 1; i < k; ++i, --k)
        if (row[i] != row[k]) {
            turned = comesFirst(row[k], row[i]);
            break;
        }
    if (turned) {
        std::reverse(row.begin(), row.end());
        std::reverse(used.knots.begin(), used.knots.end());
        for (double& k : used.knots) k = -k;
    }
    const std::vector<KnotSpan> spans = spansWithin(used, used.domain());
    const std::vector<Vec4d> points = bezierPoints(used, spans, row.data(), 1);
    const std::size_t order = static_cast<std::size_t>(used.degree) + 1;
    std::vector<std::vector<Vec4d>> curves;
    for (std::size_t s = 0; s < spans.size(); ++s) {
        curves.emplace_back(points.begin() + static_cast<std::ptrdiff_t>(s * order),
                            points.begin() + static_cast<std::ptrdiff_t>((s + 1) * order));
        if (turned) std::reverse(curves.back().begin(), curves.back().end());
    }
    if (turned) std::reverse(curves.begin(), curves.end());
    return curves;
}

/// Whether an end of the knots is where the surface has its control points.
bool isClamped(const KnotVector& knots, bool high) {
    for (int i = 0; i < knots.degree; ++i)
        if (high ? knots.at(knots.count() + i) != knots.at(knots.count() + i + 1) && i + 1 < knots.degree
                 : knots.at(i + 1) != knots.at(knots.degree))
            return false;
    return true;
}

}  // namespace

Expected<SurfaceEdges> SurfaceEdges::make(const NurbsSurface& surface, const LatticeSurface& lattice,
                                          const SpanRange& part, double tolerance, std::size_t maxPoints) {
    const NurbsDefinition& d = surface.definition();
    SurfaceEdges edges;
    edges.part_ = part;
    edges.lowU_ = static_cast<std::int64_t>(part.beginU) * kLatticeSpan;
    edges.highU_ = static_cast<std::int64_t>(part.endU) * kLatticeSpan;
    edges.lowV_ = static_cast<std::int64_t>(part.beginV) * kLatticeSpan;
    edges.highV_ = static_cast<std::int64_t>(part.endV) * kLatticeSpan;
    double reach = 0;
    for (const Vec4d& p : d.points) reach = std::max(reach, edgePlace(p).cwiseAbs().maxCoeff());
    const double nothing = std::min(1e-12 * reach, tolerance);
    const auto countU = static_cast<std::size_t>(d.u.count()), countV = static_cast<std::size_t>(d.v.count());

    for (const Edge edge : {kLowU, kHighU, kLowV, kHighV}) {
        const bool alongV = edge <= kHighU, high = edge == kHighU || edge == kHighV;
        const std::size_t first = alongV ? part.beginV : part.beginU, last = alongV ? part.endV : part.endU;
        const std::size_t spansAcross = alongV ? lattice.u.spans() : lattice.v.spans();
        const std::size_t across = alongV ? (high ? part.endU - 1 : part.beginU) : (high ? part.endV - 1 : part.beginV);
        std::vector<SpanCurve>& curves = edges.curves_[edge];
        curves.resize(last - first);
        // The control points of the edge itself, where it has some.
        const KnotVector &along = alongV ? d.v : d.u, &over = alongV ? d.u : d.v;
        const ParameterRange domain = alongV ? surface.domain().v : surface.domain().u,
                             overDomain = alongV ? surface.domain().u : surface.domain().v;
        const bool outer = high ? across + 1 == spansAcross && overDomain.upper == over.domain().upper
                                : across == 0 && overDomain.lower == over.domain().lower;
        if (outer && isClamped(over, high) && domain == along.domain()) {
            std::vector<Vec4d> row;
            for (std::size_t k = 0; k < (alongV ? countV : countU); ++k)
                row.push_back(alongV ? d.points[k * countU + (high ? countU - 1 : 0)]
                                     : d.points[(high ? countV - 1 : 0) * countU + k]);
            std::vector<std::vector<Vec4d>> whole = rowCurves(along, std::move(row));
            for (std::size_t s = first; s < last; ++s) curves[s - first].points = std::move(whole[s]);
        } else {
            for (std::size_t s = first; s < last; ++s) {
                const BezierPatch& patch = alongV ? lattice.patch(across, s) : lattice.patch(s, across);
                for (int k = 0; k <= (alongV ? patch.degreeV : patch.degreeU); ++k)
                    curves[s - first].points.push_back(alongV ? patch.at(high ? patch.degreeU : 0, k)
                                                              : patch.at(k, high ? patch.degreeV : 0));
            }
        }
    }
    const auto same = [&](const std::vector<SpanCurve>& a, const std::vector<SpanCurve>& b) {
        for (std::size_t s = 0; s < a.size(); ++s)
            for (std::size_t k = 0; k < a[s].points.size(); ++k)
                if ((edgePlace(a[s].points[k]) - edgePlace(b[s].points[k])).cwiseAbs().maxCoeff() > nothing ||
                    std::abs(a[s].points[k].w() - b[s].points[k].w()) > 1e-12 * a[s].points[k].w())
                    return false;
        return true;
    };
    edges.closedU_ = same(edges.curves_[kLowU], edges.curves_[kHighU]);
    edges.closedV_ = same(edges.curves_[kLowV], edges.curves_[kHighV]);
    if (edges.closedU_) edges.curves_[kHighU] = edges.curves_[kLowU];
    if (edges.closedV_) edges.curves_[kHighV] = edges.curves_[kLowV];

    std::size_t made = 0;
    for (std::vector<SpanCurve>& curves : edges.curves_) {
        for (std::size_t s = 0; s < curves.size(); ++s) {
            SpanCurve& curve = curves[s];
            const Vec3d place = edgePlace(curve.points.front());
            const bool isPoint = std::all_of(curve.points.begin(), curve.points.end(), [&](const Vec4d& p) {
                return (edgePlace(p) - place).cwiseAbs().maxCoeff() <= nothing;
            });
            if (isPoint) {
                curve.pole = s > 0 && curves[s - 1].pole ? *curves[s - 1].pole : place;
                continue;
            }
            struct Piece {
                std::vector<Vec4d> points;
                std::int64_t begin, size;
            };
            std::vector<Piece> open{{curve.points, 0, kLatticeSpan}};
            while (!open.empty()) {
                Piece piece = std::move(open.back());
                open.pop_back();
                if (edgeDeviation(piece.points) <= tolerance) {
                    if (piece.begin > 0) {
                        curve.cuts.push_back(piece.begin);
                        curve.places.push_back(edgePlace(piece.points.front()));
                    }
                    if (++made > maxPoints)
                        return fail(ErrorCode::kLimit, "an edge needs more than " + std::to_string(maxPoints) +
                                                           " points for this tolerance");
                    continue;
                }
                if (piece.size == 1)
                    return fail(ErrorCode::kLimit, "an edge bends too much within 2^-40 of a knot span");
                std::array<std::vector<Vec4d>, 2> half = edgeHalves(std::move(piece.points));
                open.push_back({std::move(half[1]), piece.begin + piece.size / 2, piece.size / 2});
                open.push_back({std::move(half[0]), piece.begin, piece.size / 2});
            }
        }
    }
    return edges;
}

bool SurfaceEdges::mayHave(Edge edge, const LatticePoint& p) const {
    const std::int64_t along = edge <= kHighU ? p.v : p.u;
    if (along % kLatticeSpan == 0) return true;
    const auto span = static_cast<std::size_t>(along / kLatticeSpan);
    const SpanCurve& c = curve(edge, span);
    return c.pole ||
           std::binary_search(c.cuts.begin(), c.cuts.end(), along - static_cast<std::int64_t>(span) * kLatticeSpan);
}

std::vector<LatticePoint> SurfaceEdges::cutsWithin(Edge edge, std::size_t span) const {
    std::vector<LatticePoint> points;
    for (const std::int64_t cut : curve(edge, span).cuts) {
        const std::int64_t along = static_cast<std::int64_t>(span) * kLatticeSpan + cut;
        points.push_back(edge == kLowU    ? LatticePoint{lowU_, along}
                         : edge == kHighU ? LatticePoint{highU_, along}
                         : edge == kLowV  ? LatticePoint{along, lowV_}
                                          : LatticePoint{along, highV_});
    }
    return points;
}

std::optional<Vec3d> SurfaceEdges::at(const LatticePoint& asked) const {
    LatticePoint p = asked;
    if (closedU_ && p.u == highU_) p.u = lowU_;
    if (closedV_ && p.v == highV_) p.v = lowV_;
    const auto on = [&](Edge edge, bool poleOnly) -> std::optional<Vec3d> {
        const bool alongV = edge <= kHighU;
        const std::int64_t along = alongV ? p.v : p.u, low = alongV ? lowV_ : lowU_, high = alongV ? highV_ : highU_;
        auto span = static_cast<std::size_t>(along / kLatticeSpan);
        std::int64_t within = along % kLatticeSpan;
        // Between two spans either may be a pole.
        if (within == 0 && along > low && (along == high || curve(edge, span - 1).pole)) {
            --span;
            within = kLatticeSpan;
        }
        const SpanCurve& c = curve(edge, span);
        if (c.pole) return c.pole;
        if (poleOnly) return std::nullopt;
        if (within == 0) return edgePlace(c.points.front());
        if (within == kLatticeSpan) return edgePlace(c.points.back());
        const auto cut = std::lower_bound(c.cuts.begin(), c.cuts.end(), within);
        if (cut != c.cuts.end() && *cut == within) return c.places[static_cast<std::size_t>(cut - c.cuts.begin())];
        return edgePoint(c.points, static_cast<double>(within) / static_cast<double>(kLatticeSpan));
    };
    std::optional<Vec3d> place;
    for (const bool poleOnly : {true, false}) {
        if (!place && p.u == lowU_) place = on(kLowU, poleOnly);
        if (!place && p.u == highU_) place = on(kHighU, poleOnly);
        if (!place && p.v == lowV_) place = on(kLowV, poleOnly);
        if (!place && p.v == highV_) place = on(kHighV, poleOnly);
    }
    return place;
}

}  // namespace tessera
