/// Which part of a parameter rectangle is kept: loops of NURBS curves around it, and holes in it.
///
/// A point is kept where more outer loops than holes go around it, whichever way they run; without an outer loop the
/// whole rectangle counts as one. So islands in holes are kept. A loop goes around a point if its winding number is not
/// zero: loops that cross themselves, or each other, have an answer everywhere. What lies outside the rectangle is
/// never kept.
///
/// Exact but for rounding: a curve is split (de Casteljau) only while the box of its control points holds the point;
/// apart from that its ends tell how often it crosses the ray to the right. No curve is sampled. Immutable: any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/nurbs/KnotVector.h"
#include "common/math/Types.h"

namespace tessera {

struct ParameterRectangle {
    ParameterRange u, v;
};

/// A curve in a surface's parameters.
struct TrimCurve {
    KnotVector knots;
    std::vector<Vec3d> points;  ///< (w·u, w·v, w) with w above 0
    double begin = 0, end = 1;  ///< of the curve's parameter; begin above end: it is followed backwards
};
/// Straight from point to point; closes nothing by itself.
[[nodiscard]] TrimCurve polyline(std::span<const Vec2d> points);
/// Counterclockwise from (centre.x + radius, centre.y), exactly.
[[nodiscard]] TrimCurve circle(const Vec2d& center, double radius);

enum class LoopRole : std::uint8_t { kOuter, kHole };
/// Curves that follow each other and end where they begin.
struct TrimLoop {
    LoopRole role = LoopRole::kOuter;
    std::vector<TrimCurve> curves;
};

enum class TrimSide : std::uint8_t { kKept, kOnEdge, kTrimmedAway };
enum class RectangleSide : std::uint8_t { kKept, kCrossed, kTrimmedAway };

class TrimRegion {
public:
    /// A piece of a loop: a rational Bézier curve, (w·u, w·v, w).
    struct Segment {
        std::vector<Vec3d> points;
        Vec2d begin, end;    ///< the next segment of the loop begins where this one ends, bit for bit
        Vec2d lower, upper;  ///< around its control points
        std::uint32_t loop = 0;
    };

    /// All of the rectangle.
    explicit TrimRegion(const ParameterRectangle& rectangle = {});
    /// Refuses by name: knots or numbers that make no curve, a range that a curve has not, an empty loop, one that is
    /// open. Ends that are apart by no more than 1e-5 of the largest coordinate, what two numbers of six digits can
    /// differ by, are joined.
    [[nodiscard]] static Expected<TrimRegion> make(const ParameterRectangle& rectangle,
                                                   std::span<const TrimLoop> loops);

    /// Right where the point is farther than 4 · `tolerance` from every curve. kOnEdge only where it is not; such a
    /// point may also be told to be on one of the sides.
    [[nodiscard]] TrimSide side(const Vec2d& point) const;
    /// Of a closed rectangle: kKept and kTrimmedAway are true of all its points (but for 4 · `tolerance`). kCrossed: a
    /// curve comes nearer to it than 1/16 of its sides, or it leaves the domain in part.
    [[nodiscard]] RectangleSide side(const ParameterRectangle& part) const;

    /// 1e-12 of the largest coordinate of rectangle and curves.
    [[nodiscard]] double tolerance() const { return tolerance_; }
    [[nodiscard]] const ParameterRectangle& rectangle() const { return rectangle_; }
    [[nodiscard]] std::span<const Segment> segments() const { return segments_; }  ///< loop by loop, in order
    [[nodiscard]] std::span<const LoopRole> loops() const { return loops_; }

private:
    ParameterRectangle rectangle_;
    std::vector<Segment> segments_;
    std::vector<LoopRole> loops_;
    bool hasOuter_ = false;
    double tolerance_ = 0;
};

}  // namespace tessera
