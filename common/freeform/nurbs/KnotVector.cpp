#include "common/freeform/nurbs/KnotVector.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

namespace tessera {
namespace {

std::string numberText(double x) {
    std::array<char, 40> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), x);
    return {text.data(), end.ptr};
}

}  // namespace

Expected<void> checkKnots(const KnotVector& knots, std::size_t count, std::string_view name) {
    const auto wrong = [&](const std::string& what) {
        return fail(ErrorCode::kBadInput, "knots of " + std::string(name) + ": " + what);
    };
    const int p = knots.degree;
    if (p < 1 || p > kMaxNurbsDegree)
        return wrong("degree " + std::to_string(p) + " is not in 1 to " + std::to_string(kMaxNurbsDegree));
    const auto order = static_cast<std::size_t>(p) + 1;
    if (count < order)
        return wrong(std::to_string(count) + " control points are too few for degree " + std::to_string(p));
    if (knots.knots.size() != count + order)
        return wrong("there are " + std::to_string(knots.knots.size()) + ", not the " + std::to_string(count + order) +
                     " that " + std::to_string(count) + " control points of degree " + std::to_string(p) + " need");
    std::size_t equal = 0;
    for (std::size_t i = 0; i < knots.knots.size(); ++i) {
        const double here = knots.knots[i];
        if (!(std::abs(here) <= kMaxNurbsNumber))
            return wrong("number " + std::to_string(i + 1) + " is not finite or too large");
        const double before = i == 0 ? here : knots.knots[i - 1];
        if (here < before) return wrong("number " + std::to_string(i + 1) + " is below the one before");
        if (here > before && here - before < 1 / kMaxNurbsNumber)
            return wrong("numbers " + std::to_string(i) + " and " + std::to_string(i + 1) + " differ by too little");
        equal = i > 0 && here == before ? equal + 1 : 1;
        if (equal > order)
            return wrong("more than " + std::to_string(order) + " are " + numberText(here) + ", degree " +
                         std::to_string(p) + " allows no more");
    }
    if (!(knots.domain().size() > 0)) return wrong("they leave no range in which the surface or curve is defined");
    return {};
}

int spanAt(const KnotVector& knots, double t) {
    const auto first = knots.knots.begin();
    const double end = knots.at(knots.count());
    // At the end: the last span that has an inside.
    const auto above = t >= end ? std::lower_bound(first, knots.knots.end(), end)
                                : std::upper_bound(first, knots.knots.end(), std::max(t, knots.at(knots.degree)));
    return static_cast<int>(above - first) - 1;
}

BasisFunctions basisAt(const KnotVector& knots, double t) {
    BasisFunctions basis;
    basis.span = spanAt(knots, t);
    const int p = knots.degree, k = basis.span;
    const double* const knot = knots.knots.data() + k;
    double* const n = basis.value.data();
    n[0] = 1;
    for (int d = 1; d <= p; ++d) {
        double carried = 0, before = 0;
        for (int r = 0; r < d; ++r) {
            // Of a function of one degree less: what a derivative is a difference of.
            const double low = knot[1 + r - d], high = knot[1 + r], share = n[r] / (high - low);
            basis.derivative[static_cast<std::size_t>(r)] = d * (before - share);
            before = share;
            n[r] = carried + (high - t) * share;
            carried = (t - low) * share;
        }
        basis.derivative[static_cast<std::size_t>(d)] = d * before;
        n[d] = carried;
    }
    return basis;
}

std::vector<KnotSpan> spansWithin(const KnotVector& knots, const ParameterRange& range) {
    std::vector<KnotSpan> spans;
    int equal = 1;  // knots that equal the one where span k begins
    for (int k = 0; k < knots.count(); ++k) {
        equal = k > 0 && knots.at(k) == knots.at(k - 1) ? equal + 1 : 1;
        if (k < knots.degree || knots.at(k) == knots.at(k + 1)) continue;
        const KnotSpan span{.index = k,
                            .begin = std::max(knots.at(k), range.lower),
                            .end = std::min(knots.at(k + 1), range.upper),
                            .joinsPrevious = !spans.empty() && equal <= knots.degree};
        if (span.begin < span.end) spans.push_back(span);
    }
    return spans;
}

}  // namespace tessera
