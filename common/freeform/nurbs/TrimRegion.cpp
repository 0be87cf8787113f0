#include "common/freeform/nurbs/TrimRegion.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <utility>

namespace tessera {
namespace {

using ControlPoints = std::array<Vec3d, kMaxNurbsDegree + 1>;

constexpr double kJoin = 1e-5;
constexpr double kEdge = 1e-12;
constexpr int kDeepest = 128;  // halvings: beyond what numbers can tell apart, weights of any ratio included

std::string parametersText(const Vec2d& p) {
    std::array<char, 80> text;
    char* at = std::to_chars(text.data(), text.data() + 32, p.x()).ptr;
    *at++ = ' ';
    return "(" + std::string(text.data(), std::to_chars(at, at + 32, p.y()).ptr) + ")";
}

Vec2d plain(const Vec3d& p) {
    return p.head<2>() / p.z();
}

/// The points of the lower half in `points`, those of the upper half in `upper`.
void halve(ControlPoints& points, ControlPoints& upper, int degree) {
    for (int level = 0; level <= degree; ++level) {
        upper[static_cast<std::size_t>(degree - level)] = points[static_cast<std::size_t>(degree)];
        for (int i = degree; i > level; --i) {
            Vec3d& here = points[static_cast<std::size_t>(i)];
            here = 0.5 * (here + points[static_cast<std::size_t>(i - 1)]);
        }
    }
}

/// How a curve goes around the origin.
struct Crossings {
    double tolerance = 0;
    bool onEdge = false;

    /// What the curve adds to twice the winding number, by the ray along +u: -1 and 1 per crossing, as the signs of its
    /// ends say. Every way out of here tells them as they are, so that those of a closed loop cancel.
    int along(ControlPoints& points, int degree, bool beginsAbove, bool endsAbove, int depth) {
        Vec2d lower = plain(points[0]), upper = lower;
        for (int i = 1; i <= degree; ++i) {
            const Vec2d p = plain(points[static_cast<std::size_t>(i)]);
            lower = lower.cwiseMin(p);
            upper = upper.cwiseMax(p);
        }
        const int crossing = static_cast<int>(endsAbove) - static_cast<int>(beginsAbove);
        if (upper.x() < -tolerance) return 0;
        if (upper.y() < -tolerance || lower.y() > tolerance || lower.x() > tolerance) return crossing;
        if (((upper - lower).array() <= tolerance).all() || depth == kDeepest) {
            onEdge = true;
            return crossing;
        }
        ControlPoints rest;
        halve(points, rest, degree);
        const bool middleAbove = rest[0].y() >= 0;
        const int crossingBefore = along(points, degree, beginsAbove, middleAbove, depth + 1);
        return crossingBefore + along(rest, degree, middleAbove, endsAbove, depth + 1);
    }
};

/// Whether a curve comes into a rectangle, told no closer than `grain`.
bool enters(ControlPoints& points, int degree, const Vec2d& lower, const Vec2d& upper, const Vec2d& grain, int depth) {
    Vec2d low = plain(points[0]), high = low;
    for (int i = 1; i <= degree; ++i) {
        const Vec2d p = plain(points[static_cast<std::size_t>(i)]);
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    if ((low.array() > upper.array()).any() || (high.array() < lower.array()).any()) return false;
    if (((high - low).array() <= grain.array()).all() || depth == kDeepest) return true;
    if ((low.array() >= lower.array()).all() && (high.array() <= upper.array()).all()) return true;
    ControlPoints rest;
    halve(points, rest, degree);
    return enters(points, degree, lower, upper, grain, depth + 1) ||
           enters(rest, degree, lower, upper, grain, depth + 1);
}

Expected<std::vector<TrimRegion::Segment>> segmentsOf(const TrimCurve& curve) {
    if (Expected<void> sound = checkKnots(curve.knots, curve.points.size(), "a curve"); !sound)
        return tl::unexpected(sound.error());
    for (const Vec3d& p : curve.points) {
        if (!(p.z() >= 1 / kMaxNurbsWeight && p.z() <= kMaxNurbsWeight))
            return fail(ErrorCode::kBadInput, "a weight is not above 0, or not in 1e-12 to 1e12");
        if (!(plain(p).cwiseAbs().maxCoeff() <= kMaxNurbsNumber))
            return fail(ErrorCode::kBadInput, "a control point is not finite or too large");
    }
    const ParameterRange domain = curve.knots.domain(),
                         range = {std::min(curve.begin, curve.end), std::max(curve.begin, curve.end)};
    if (!(range.size() > 0))
        return fail(ErrorCode::kBadInput, "the curve is used from a parameter to the same one, or to none");
    if (!(range.lower >= domain.lower && range.upper <= domain.upper))
        return fail(ErrorCode::kBadInput, "the curve is used beyond the range of its knots");
    const std::vector<KnotSpan> spans = spansWithin(curve.knots, range);
    const std::vector<Vec3d> points = bezierPoints(curve.knots, spans, curve.points.data(), 1);
    const auto order = static_cast<std::ptrdiff_t>(curve.knots.degree) + 1;
    std::vector<TrimRegion::Segment> segments(spans.size());
    for (std::size_t k = 0; k < spans.size(); ++k) {
        const auto first = points.begin() + static_cast<std::ptrdiff_t>(k) * order;
        segments[k].points.assign(first, first + order);
    }
    if (curve.begin > curve.end) {
        std::reverse(segments.begin(), segments.end());
        for (TrimRegion::Segment& s : segments) std::reverse(s.points.begin(), s.points.end());
    }
    return segments;
}

/// Has each segment begin where the one before ends. Where they are too far apart, says between which.
Expected<void> join(std::span<TrimRegion::Segment> loop) {
    double largest = 0;
    for (const TrimRegion::Segment& s : loop)
        for (const Vec3d& p : s.points) largest = std::max(largest, plain(p).cwiseAbs().maxCoeff());
    for (std::size_t k = 0; k < loop.size(); ++k) {
        TrimRegion::Segment& here = loop[k];
        TrimRegion::Segment& next = loop[(k + 1) % loop.size()];
        const Vec2d end = plain(here.points.back()), begin = plain(next.points.front());
        if ((end - begin).norm() > kJoin * largest)
            return fail(ErrorCode::kBadInput, "it is open: a curve ends at " + parametersText(end) +
                                                  ", the next begins at " + parametersText(begin));
        const double weight = here.points.back().z();
        here.points.back() = {weight * begin.x(), weight * begin.y(), weight};
        here.end = next.begin = begin;
    }
    for (TrimRegion::Segment& s : loop) {
        s.lower = s.begin.cwiseMin(s.end);
        s.upper = s.begin.cwiseMax(s.end);
        for (const Vec3d& p : s.points) {
            s.lower = s.lower.cwiseMin(plain(p));
            s.upper = s.upper.cwiseMax(plain(p));
        }
    }
    return {};
}

double largestOf(const ParameterRectangle& r) {
    return std::max({std::abs(r.u.lower), std::abs(r.u.upper), std::abs(r.v.lower), std::abs(r.v.upper)});
}

}  // namespace

TrimCurve polyline(std::span<const Vec2d> points) {
    TrimCurve curve{
        .knots = {.degree = 1, .knots = {0}}, .points = {}, .begin = 0, .end = static_cast<double>(points.size()) - 1};
    for (std::size_t i = 0; i < points.size(); ++i) {
        curve.points.emplace_back(points[i].x(), points[i].y(), 1);
        curve.knots.knots.push_back(static_cast<double>(i));
    }
    curve.knots.knots.push_back(curve.end);
    return curve;
}

TrimCurve circle(const Vec2d& center, double radius) {
    TrimCurve curve{
        .knots = {.degree = 2, .knots = {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}}, .points = {}, .begin = 0, .end = 4};
    constexpr std::array<std::array<int, 2>, 9> kSquare = {
        {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}, {1, 0}}};
    for (std::size_t i = 0; i < kSquare.size(); ++i) {
        const double w = i % 2 == 0 ? 1 : std::sqrt(0.5);
        const Vec2d p = center + radius * Vec2d(kSquare[i][0], kSquare[i][1]);
        curve.points.emplace_back(w * p.x(), w * p.y(), w);
    }
    return curve;
}

TrimRegion::TrimRegion(const ParameterRectangle& rectangle)
    : rectangle_(rectangle), tolerance_(kEdge * largestOf(rectangle)) {}

Expected<TrimRegion> TrimRegion::make(const ParameterRectangle& rectangle, std::span<const TrimLoop> loops) {
    TrimRegion region(rectangle);
    for (std::size_t l = 0; l < loops.size(); ++l) {
        const std::string name = std::string(loops[l].role == LoopRole::kHole ? "hole" : "outer loop") + " (loop " +
                                 std::to_string(l + 1) + ")";
        if (loops[l].curves.empty()) return fail(ErrorCode::kBadInput, name + " has no curves");
        const std::size_t first = region.segments_.size();
        for (std::size_t c = 0; c < loops[l].curves.size(); ++c) {
            Expected<std::vector<Segment>> segments = segmentsOf(loops[l].curves[c]);
            if (!segments) return failWith(name + ", curve " + std::to_string(c + 1), segments.error());
            for (Segment& s : *segments) {
                s.loop = static_cast<std::uint32_t>(l);
                region.segments_.push_back(std::move(s));
            }
        }
        if (Expected<void> joined = join(std::span(region.segments_).subspan(first)); !joined)
            return failWith(name, joined.error());
        region.loops_.push_back(loops[l].role);
        region.hasOuter_ = region.hasOuter_ || loops[l].role == LoopRole::kOuter;
    }
    for (const Segment& s : region.segments_)
        region.tolerance_ =
            std::max(region.tolerance_, kEdge * std::max(s.lower.cwiseAbs().maxCoeff(), s.upper.cwiseAbs().maxCoeff()));
    return region;
}

TrimSide TrimRegion::side(const Vec2d& point) const {
    if (!(point.x() >= rectangle_.u.lower && point.x() <= rectangle_.u.upper && point.y() >= rectangle_.v.lower &&
          point.y() <= rectangle_.v.upper))
        return TrimSide::kTrimmedAway;
    Crossings crossings{.tolerance = tolerance_};
    int around = hasOuter_ ? 0 : 1;  // loops that go around the point
    std::size_t next = 0;
    for (std::size_t loop = 0; loop < loops_.size(); ++loop) {
        int winding = 0;
        for (; next < segments_.size() && segments_[next].loop == loop; ++next) {
            const Segment& s = segments_[next];
            if (s.upper.x() < point.x() - tolerance_ || s.upper.y() < point.y() - tolerance_ ||
                s.lower.y() > point.y() + tolerance_)
                continue;
            const bool beginsAbove = s.begin.y() >= point.y(), endsAbove = s.end.y() >= point.y();
            if (s.lower.x() > point.x() + tolerance_) {
                winding += static_cast<int>(endsAbove) - static_cast<int>(beginsAbove);
                continue;
            }
            // About the point, so that rounding is as small as what is left near it.
            ControlPoints points;
            for (std::size_t i = 0; i < s.points.size(); ++i) {
                const Vec3d& p = s.points[i];
                points[i] = {p.x() - point.x() * p.z(), p.y() - point.y() * p.z(), p.z()};
            }
            winding += crossings.along(points, static_cast<int>(s.points.size()) - 1, beginsAbove, endsAbove, 0);
        }
        if (winding != 0) around += loops_[loop] == LoopRole::kHole ? -1 : 1;
    }
    if (crossings.onEdge) return TrimSide::kOnEdge;
    return around > 0 ? TrimSide::kKept : TrimSide::kTrimmedAway;
}

RectangleSide TrimRegion::side(const ParameterRectangle& part) const {
    const Vec2d lower(part.u.lower, part.v.lower), upper(part.u.upper, part.v.upper);
    const Vec2d domainLower(rectangle_.u.lower, rectangle_.v.lower),
        domainUpper(rectangle_.u.upper, rectangle_.v.upper);
    if ((upper.array() < domainLower.array()).any() || (lower.array() > domainUpper.array()).any())
        return RectangleSide::kTrimmedAway;
    if ((lower.array() < domainLower.array()).any() || (upper.array() > domainUpper.array()).any())
        return RectangleSide::kCrossed;
    const Vec2d grain = (upper - lower) / 16;
    for (const Segment& s : segments_) {
        if ((s.lower.array() > upper.array()).any() || (s.upper.array() < lower.array()).any()) continue;
        ControlPoints points;
        std::copy(s.points.begin(), s.points.end(), points.begin());
        if (enters(points, static_cast<int>(s.points.size()) - 1, lower, upper, grain, 0))
            return RectangleSide::kCrossed;
    }
    return side(Vec2d(0.5 * (lower + upper))) == TrimSide::kTrimmedAway ? RectangleSide::kTrimmedAway
                                                                        : RectangleSide::kKept;
}

}  // namespace tessera
