/// Knot vectors: what B-spline curves and surfaces have in common along one parameter. Basis functions, blossoms,
/// spans.
///
/// Piegl and Tiller, The NURBS Book, chapter 2 (basis functions); Ramshaw, Blossoms are polar forms (1989); Boehm,
/// Inserting new knots into B-spline curves (1980). Values only; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

inline constexpr int kMaxNurbsDegree = 24;
/// Knots, coordinates: no larger; non-empty spans no narrower than its inverse. So that no product of what is read
/// overflows.
inline constexpr double kMaxNurbsNumber = 1e30;
inline constexpr double kMaxNurbsWeight = 1e12;  ///< and none below its inverse

struct ParameterRange {
    double lower = 0, upper = 1;
    [[nodiscard]] double size() const { return upper - lower; }
    friend bool operator==(const ParameterRange&, const ParameterRange&) = default;
};

/// Knots in ascending order, degree + 1 more than there are control points. Clamped or not; as many equal ones as
/// degree + 1 (the curve may jump there). The curve is defined from knot `degree` to the one before the last `degree`.
struct KnotVector {
    int degree = 3;
    std::vector<double> knots;

    [[nodiscard]] int count() const { return static_cast<int>(knots.size()) - degree - 1; }  ///< of control points
    [[nodiscard]] ParameterRange domain() const { return {at(degree), at(count())}; }
    [[nodiscard]] double at(int i) const { return knots[static_cast<std::size_t>(i)]; }
};

/// What is wrong with it for so many control points, if anything: "knots of u: …".
[[nodiscard]] Expected<void> checkKnots(const KnotVector& knots, std::size_t count, std::string_view name);

/// The i with knot(i) <= t < knot(i + 1) in the domain; at the domain's end, and beyond, the last span that is not
/// empty.
[[nodiscard]] int spanAt(const KnotVector& knots, double t);

/// The degree + 1 basis functions that are not zero on a span, of control points span − degree and those that follow,
/// and their derivatives.
struct BasisFunctions {
    int span = 0;
    std::array<double, kMaxNurbsDegree + 1> value, derivative;  ///< the first degree + 1 alone
};
[[nodiscard]] BasisFunctions basisAt(const KnotVector& knots, double t);

/// A span that is not empty, within a range.
struct KnotSpan {
    int index = 0;
    double begin = 0, end = 0;
    bool joinsPrevious = false;  ///< the curve is continuous where this span begins and another one of the list ends
};
[[nodiscard]] std::vector<KnotSpan> spansWithin(const KnotVector& knots, const ParameterRange& range);

/// The blossom of the polynomial on a span: `argument(r)` for r = 1 … degree. All arguments t: the curve's point at t.
/// `stride` between control points. Convex sums wherever the arguments lie in the span.
template <typename Point, typename Argument>
[[nodiscard]] Point blossom(const KnotVector& knots, int span, const Point* controls, std::size_t stride,
                            const Argument& argument) {
    const int p = knots.degree;
    std::array<Point, kMaxNurbsDegree + 1> d;
    for (int j = 0; j <= p; ++j)
        d[static_cast<std::size_t>(j)] = controls[static_cast<std::size_t>(span - p + j) * stride];
    for (int r = 1; r <= p; ++r) {
        const double x = argument(r);
        for (int j = p; j >= r; --j) {
            const double low = knots.at(span - p + j), high = knots.at(span + 1 + j - r);
            const double part = (x - low) / (high - low);
            d[static_cast<std::size_t>(j)] =
                (1 - part) * d[static_cast<std::size_t>(j - 1)] + part * d[static_cast<std::size_t>(j)];
        }
    }
    return d[static_cast<std::size_t>(p)];
}

/// The curve as a Bézier curve per span, degree + 1 points each, one after the other. Where a curve is continuous, the
/// end of a span and the beginning of the next are the same bits.
template <typename Point>
[[nodiscard]] std::vector<Point> bezierPoints(const KnotVector& knots, const std::vector<KnotSpan>& spans,
                                              const Point* controls, std::size_t stride) {
    const int p = knots.degree;
    std::vector<Point> points;
    points.reserve(spans.size() * static_cast<std::size_t>(p + 1));
    for (const KnotSpan& span : spans)
        for (int i = 0; i <= p; ++i) {
            if (i == 0 && span.joinsPrevious)
                points.push_back(Point(points.back()));
            else
                points.push_back(blossom(knots, span.index, controls, stride,
                                         [&](int r) { return r <= i ? span.end : span.begin; }));
        }
    return points;
}

}  // namespace tessera
