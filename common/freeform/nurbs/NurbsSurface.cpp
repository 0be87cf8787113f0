#include "common/freeform/nurbs/NurbsSurface.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace tessera {
namespace {

Expected<ParameterRange> rangeOf(const KnotVector& knots, const std::optional<ParameterRange>& wanted,
                                 std::string_view name) {
    const ParameterRange domain = knots.domain();
    if (!wanted) return domain;
    if (!(wanted->size() >= 1 / kMaxNurbsNumber))
        return fail(ErrorCode::kBadInput, "the range of " + std::string(name) + " is empty or descends");
    if (!(wanted->lower >= domain.lower && wanted->upper <= domain.upper))
        return fail(ErrorCode::kBadInput, "the range of " + std::string(name) + " goes beyond what its knots define");
    return *wanted;
}

/// The patches over some spans of each axis.
std::vector<ParameterPatch> patchesOver(const NurbsDefinition& d, const std::vector<KnotSpan>& spansU,
                                        const std::vector<KnotSpan>& spansV) {
    const auto countU = static_cast<std::size_t>(d.u.count()), countV = static_cast<std::size_t>(d.v.count());
    const auto orderU = static_cast<std::size_t>(d.u.degree) + 1, orderV = static_cast<std::size_t>(d.v.degree) + 1;
    const std::size_t width = spansU.size() * orderU;
    // Every row along u, then every column of what came of them along v.
    std::vector<Vec4d> rows;
    rows.reserve(width * countV);
    for (std::size_t j = 0; j < countV; ++j) {
        const std::vector<Vec4d> row = bezierPoints(d.u, spansU, d.points.data() + j * countU, 1);
        rows.insert(rows.end(), row.begin(), row.end());
    }
    std::vector<ParameterPatch> patches(spansU.size() * spansV.size());
    for (std::size_t b = 0; b < spansV.size(); ++b)
        for (std::size_t a = 0; a < spansU.size(); ++a) {
            const KnotSpan &u = spansU[a], &v = spansV[b];
            patches[b * spansU.size() + a] = {
                {.degreeU = d.u.degree, .degreeV = d.v.degree, .points = std::vector<Vec4d>(orderU * orderV)},
                {{u.begin, u.end}, {v.begin, v.end}}};
        }
    for (std::size_t column = 0; column < width; ++column) {
        const std::vector<Vec4d> points = bezierPoints(d.v, spansV, rows.data() + column, width);
        for (std::size_t k = 0; k < points.size(); ++k)
            patches[k / orderV * spansU.size() + column / orderU].patch.at(static_cast<int>(column % orderU),
                                                                           static_cast<int>(k % orderV)) = points[k];
    }
    return patches;
}

}  // namespace

Expected<NurbsSurface> NurbsSurface::make(NurbsDefinition d) {
    // Both counts hang on the number of points, so each axis is judged by the count that its knots and degree ask for.
    for (const bool isU : {true, false}) {
        const KnotVector& knots = isU ? d.u : d.v;
        const std::size_t order =
            knots.degree < 0 || knots.degree > kMaxNurbsDegree ? 1 : static_cast<std::size_t>(knots.degree) + 1;
        const std::size_t count = knots.knots.size() > order ? knots.knots.size() - order : 0;
        if (Expected<void> sound = checkKnots(knots, count, isU ? "u" : "v"); !sound)
            return tl::unexpected(sound.error());
    }
    const std::size_t countU = static_cast<std::size_t>(d.u.count()), countV = static_cast<std::size_t>(d.v.count());
    if (d.points.size() % countU != 0 || d.points.size() / countU != countV)
        return fail(ErrorCode::kBadInput, "there are " + std::to_string(d.points.size()) + " control points, not the " +
                                              std::to_string(countU) + " by " + std::to_string(countV) +
                                              " that degrees and knots ask for");
    for (std::size_t i = 0; i < d.points.size(); ++i) {
        const Vec4d& p = d.points[i];
        if (!(p.w() >= 1 / kMaxNurbsWeight && p.w() <= kMaxNurbsWeight))
            return fail(ErrorCode::kBadInput, "the weight of control point " + std::to_string(i + 1) +
                                                  " is not above 0, or not in 1e-12 to 1e12");
        if (!((p.head<3>() / p.w()).cwiseAbs().maxCoeff() <= kMaxNurbsNumber))
            return fail(ErrorCode::kBadInput, "control point " + std::to_string(i + 1) + " is not finite or too large");
    }
    const Expected<ParameterRange> u = rangeOf(d.u, d.rangeU, "u"), v = rangeOf(d.v, d.rangeV, "v");
    if (!u) return tl::unexpected(u.error());
    if (!v) return tl::unexpected(v.error());
    Expected<TrimRegion> region = TrimRegion::make({*u, *v}, d.loops);
    if (!region) return tl::unexpected(region.error());
    return NurbsSurface(std::move(d), std::move(*region));
}

NurbsPoint evaluate(const NurbsSurface& surface, double u, double v) {
    const NurbsDefinition& d = surface.definition();
    const ParameterRectangle& domain = surface.domain();
    NurbsPoint result{.at = {}, .side = surface.region().side(Vec2d(u, v))};
    // In this order: what is no number becomes the lower end.
    u = std::min(std::max(domain.u.lower, u), domain.u.upper);
    v = std::min(std::max(domain.v.lower, v), domain.v.upper);
    const BasisFunctions alongU = basisAt(d.u, u), alongV = basisAt(d.v, v);
    const auto countU = static_cast<std::size_t>(d.u.count());
    Vec4d point = Vec4d::Zero(), du = Vec4d::Zero(), dv = Vec4d::Zero();
    Box around;
    for (int j = 0; j <= d.v.degree; ++j) {
        const auto firstU = static_cast<std::size_t>(alongU.span - d.u.degree),
                   atV = static_cast<std::size_t>(alongV.span - d.v.degree + j);
        const Vec4d* row = d.points.data() + atV * countU + firstU;
        Vec4d inRow = Vec4d::Zero(), slope = Vec4d::Zero();
        for (int i = 0; i <= d.u.degree; ++i) {
            inRow += alongU.value[static_cast<std::size_t>(i)] * row[i];
            slope += alongU.derivative[static_cast<std::size_t>(i)] * row[i];
            around.extend(row[i].head<3>() * (1 / row[i].w()));
        }
        point += alongV.value[static_cast<std::size_t>(j)] * inRow;
        du += alongV.value[static_cast<std::size_t>(j)] * slope;
        dv += alongV.derivative[static_cast<std::size_t>(j)] * inRow;
    }
    const double w = point.w(), reach = around.size().maxCoeff();
    SurfacePoint& at = result.at;
    at.point = point.head<3>() / w;
    at.du = (du.head<3>() - du.w() * at.point) / w;
    at.dv = (dv.head<3>() - dv.w() * at.point) / w;
    const auto spanOf = [](const KnotVector& knots, int k) { return ParameterRange{knots.at(k), knots.at(k + 1)}; };
    const ParameterRectangle span{spanOf(d.u, alongU.span), spanOf(d.v, alongV.span)};
    // A derivative that is nearly nothing beside the control points may be rounding alone: the patch knows better, and
    // what normals tend to.
    constexpr double kSmall = 1e-6;
    if (std::min(at.du.cwiseAbs().maxCoeff() * span.u.size(), at.dv.cwiseAbs().maxCoeff() * span.v.size()) >
        kSmall * reach)
        at.normal = normalAlong(at.du, at.dv);
    if (at.normal.isZero()) {
        const BezierPatch patch = patchesOver(d, spansWithin(d.u, span.u), spansWithin(d.v, span.v)).front().patch;
        at.normal = evaluate(patch, (u - span.u.lower) / span.u.size(), (v - span.v.lower) / span.v.size()).normal;
    }
    return result;
}

std::vector<ParameterPatch> bezierPatches(const NurbsSurface& surface) {
    const NurbsDefinition& d = surface.definition();
    return patchesOver(d, spansWithin(d.u, surface.domain().u), spansWithin(d.v, surface.domain().v));
}

}  // namespace tessera
