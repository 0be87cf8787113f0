#include "common/freeform/nurbs/tessellation/ParameterLattice.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace tessera {

std::int64_t ParameterAxis::toLattice(double parameter) const {
    if (!(parameter > breaks_.front())) return 0;
    if (parameter >= breaks_.back()) return end();
    const auto span =
        static_cast<std::size_t>(std::upper_bound(breaks_.begin(), breaks_.end(), parameter) - breaks_.begin()) - 1;
    const double part = (parameter - breaks_[span]) / (breaks_[span + 1] - breaks_[span]);
    return static_cast<std::int64_t>(span) * kLatticeSpan + std::llround(part * static_cast<double>(kLatticeSpan));
}

double ParameterAxis::toParameter(std::int64_t unit) const {
    const std::size_t span = spanOf(unit);
    const double part = within(unit, span);
    return (1 - part) * breaks_[span] + part * breaks_[span + 1];
}

std::size_t ParameterAxis::spanOf(std::int64_t unit) const {
    return std::min(static_cast<std::size_t>(std::max<std::int64_t>(unit, 0) / kLatticeSpan), spans() - 1);
}

Expected<LatticeSurface> onLattice(const NurbsSurface& surface) {
    const NurbsDefinition& d = surface.definition();
    const auto axis = [](const std::vector<KnotSpan>& spans) {
        std::vector<double> breaks;
        for (const KnotSpan& s : spans) breaks.push_back(s.begin);
        breaks.push_back(spans.back().end);
        return ParameterAxis(std::move(breaks));
    };
    const auto joins = [](const std::vector<KnotSpan>& spans) {
        std::vector<bool> joined;
        for (const KnotSpan& s : spans) joined.push_back(s.joinsPrevious);
        return joined;
    };
    const std::vector<KnotSpan> alongU = spansWithin(d.u, surface.domain().u),
                                alongV = spansWithin(d.v, surface.domain().v);
    if (std::max(alongU.size(), alongV.size()) > kMostLatticeSpans)
        return fail(ErrorCode::kLimit, "more than " + std::to_string(kMostLatticeSpans) + " knot spans");
    LatticeSurface made{axis(alongU), axis(alongV), {}, joins(alongU), joins(alongV)};
    for (ParameterPatch& p : bezierPatches(surface)) made.patches.push_back(std::move(p.patch));
    return made;
}

BezierPatch partOf(const BezierPatch& patch, double lowerU, double upperU, double lowerV, double upperV) {
    BezierPatch part = patch;
    const auto cut = [&part](PatchAxis axis, double lower, double upper) {
        if (upper < 1) part = split(part, axis, upper)[0];
        if (lower > 0) part = split(part, axis, lower / upper)[1];
    };
    cut(PatchAxis::kU, lowerU, upperU);
    cut(PatchAxis::kV, lowerV, upperV);
    return part;
}

}  // namespace tessera
