/// Places in a surface's parameters as integers, so that what is left of a line and what is on it is known exactly.
///
/// Each knot span is 2^40 units wide, whatever its width in u or v. Values only; any thread.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

inline constexpr std::int64_t kLatticeSpan = std::int64_t{1} << 40;
inline constexpr std::size_t kMostLatticeSpans = std::size_t{1}
                                                 << 19;  ///< along one axis: no product of differences overflows
__extension__ using LatticeProduct = __int128;

struct LatticePoint {
    std::int64_t u = 0, v = 0;
    friend auto operator<=>(const LatticePoint&, const LatticePoint&) = default;
};

/// Above 0: c is to the left of the way from a to b; 0: on its line. Exact.
[[nodiscard]] inline LatticeProduct crossOf(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
    return static_cast<LatticeProduct>(b.u - a.u) * (c.v - a.v) - static_cast<LatticeProduct>(b.v - a.v) * (c.u - a.u);
}
[[nodiscard]] inline int turnOf(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
    const LatticeProduct cross = crossOf(a, b, c);
    return cross > 0 ? 1 : cross < 0 ? -1 : 0;
}
/// Of points on one line: whether p is strictly between the others.
[[nodiscard]] inline bool isBetween(const LatticePoint& p, const LatticePoint& a, const LatticePoint& b) {
    return (a < p && p < b) || (b < p && p < a);
}

/// The knots of one axis that begin and end spans.
class ParameterAxis {
public:
    explicit ParameterAxis(std::vector<double> breaks) : breaks_(std::move(breaks)) {}

    [[nodiscard]] std::size_t spans() const { return breaks_.size() - 1; }
    [[nodiscard]] std::int64_t end() const { return static_cast<std::int64_t>(spans()) * kLatticeSpan; }
    /// The nearest unit; of what lies outside, the nearest end.
    [[nodiscard]] std::int64_t toLattice(double parameter) const;
    [[nodiscard]] double toParameter(std::int64_t unit) const;
    /// In which span it is, and where in it, 0 to 1; at a knot the span above, at the end the last.
    [[nodiscard]] std::size_t spanOf(std::int64_t unit) const;
    [[nodiscard]] static double within(std::int64_t unit, std::size_t span) {
        return static_cast<double>(unit - static_cast<std::int64_t>(span) * kLatticeSpan) /
               static_cast<double>(kLatticeSpan);
    }

private:
    std::vector<double> breaks_;
};

/// A surface cut at its knots.
struct LatticeSurface {
    ParameterAxis u, v;
    std::vector<BezierPatch> patches;  ///< u fastest
    std::vector<bool> joinsU, joinsV;  ///< per span: continuous with the one before

    [[nodiscard]] const BezierPatch& patch(std::size_t spanU, std::size_t spanV) const {
        return patches[spanV * u.spans() + spanU];
    }
};
/// Refused (kLimit) beyond kMostLatticeSpans along an axis.
[[nodiscard]] Expected<LatticeSurface> onLattice(const NurbsSurface& surface);

/// The part of a patch over [lowerU, upperU] × [lowerV, upperV] of its [0, 1]².
[[nodiscard]] BezierPatch partOf(const BezierPatch& patch, double lowerU, double upperU, double lowerV, double upperV);

}  // namespace tessera
