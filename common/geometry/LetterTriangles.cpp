// A letter's contours: flattened, sorted into what is solid and what is a hole, cut into triangles.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>
#include <utility>

#include "common/geometry/EarClipping.h"
#include "common/geometry/Primitives.h"
#include "common/geometry/TextOutlines.h"

namespace tessera {
namespace {

constexpr std::size_t kMostCorners = 16384;  // of a letter, once it is flat
constexpr std::size_t kMostTries = 16;
constexpr double kMostChords = 256;  // of a curve

using Ring = std::vector<OutlinePoint>;

std::int64_t turnAt(const OutlinePoint& a, const OutlinePoint& b, const OutlinePoint& c) {
    return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
           (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
}

/// Chords of equal shares of the parameter. Off by at most h² / 8 of the second derivative, which is at most d (d - 1)
/// times the largest second difference of the d + 1 control points.
void addChords(const OutlinePoint& from, const OutlineSegment& segment, double tolerance, Ring& ring) {
    std::array<OutlinePoint, 4> c{from, segment.points[0], segment.points[1], segment.points[2]};
    const std::uint32_t degree = segment.degree;
    double bend = 0;
    for (std::uint32_t i = 0; i + 2 <= degree; ++i)
        bend = std::max(bend, std::hypot(double{1} * c[i].x - 2.0 * c[i + 1].x + c[i + 2].x,
                                         double{1} * c[i].y - 2.0 * c[i + 1].y + c[i + 2].y));
    const double chords =
        std::clamp(std::ceil(std::sqrt(degree * (degree - 1.0) * bend / (8 * tolerance))), 1.0, kMostChords);
    for (double i = 1; i < chords; ++i) {
        const double t = i / chords, s = 1 - t;
        const auto at = [&](auto coordinate) {
            const double p0 = coordinate(c[0]), p1 = coordinate(c[1]), p2 = coordinate(c[2]), p3 = coordinate(c[3]);
            return degree == 2 ? s * s * p0 + 2 * s * t * p1 + t * t * p2
                               : s * s * s * p0 + 3 * s * s * t * p1 + 3 * s * t * t * p2 + t * t * t * p3;
        };
        ring.push_back({static_cast<std::int32_t>(std::lround(at([](const OutlinePoint& p) { return double(p.x); }))),
                        static_cast<std::int32_t>(std::lround(at([](const OutlinePoint& p) { return double(p.y); })))});
    }
    ring.push_back(c[degree]);
}

Ring flattened(const OutlineContour& contour, double tolerance) {
    Ring ring{contour.start};
    for (const OutlineSegment& segment : contour.segments) addChords(ring.back(), segment, tolerance, ring);
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    while (ring.size() > 1 && ring.back() == ring.front()) ring.pop_back();
    return ring;
}

/// Twice the area, counter-clockwise above 0.
double areaOf(const Ring& ring) {
    double area = 0;
    for (std::size_t i = 0; i < ring.size(); ++i)
        area += static_cast<double>(turnAt(ring[0], ring[i], ring[(i + 1) % ring.size()]));
    return area;
}

/// Nothing where the place is on the ring.
std::optional<int> windingOf(const Ring& ring, const OutlinePoint& p) {
    int winding = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const OutlinePoint &a = ring[i], &b = ring[(i + 1) % ring.size()];
        const std::int64_t side = turnAt(a, b, p);
        if (side == 0 && p.x >= std::min(a.x, b.x) && p.x <= std::max(a.x, b.x) && p.y >= std::min(a.y, b.y) &&
            p.y <= std::max(a.y, b.y))
            return std::nullopt;
        if (a.y <= p.y && b.y > p.y && side > 0) ++winding;
        if (a.y > p.y && b.y <= p.y && side < 0) --winding;
    }
    return winding;
}

/// Of a ring's first corner that is not on the other; 0 where all that are tried are.
int windingAround(const Ring& other, const Ring& ring) {
    for (std::size_t i = 0; i < std::min(ring.size(), kMostTries); ++i)
        if (const std::optional<int> winding = windingOf(other, ring[i])) return *winding;
    return 0;
}

/// A solid part: its rim, and those of its holes, as vertices. Rims have what is solid on their left.
struct Part {
    std::vector<std::uint32_t> rim;
    std::vector<std::vector<std::uint32_t>> holes;
};

/// Cuts from holes to the rim until one outline goes around all.
class Joining {
public:
    Joining(std::span<const OutlinePoint> vertices, Part part, std::uint64_t& steps)
        : vertices_(vertices), outline_(std::move(part.rim)), holes_(std::move(part.holes)), steps_(steps) {
        const auto rightmost = [&](const std::vector<std::uint32_t>& hole) {
            return *std::ranges::max_element(
                hole, {}, [&](std::uint32_t v) { return std::pair(vertices_[v].x, vertices_[v].y); });
        };
        for (auto& hole : holes_) std::rotate(hole.begin(), std::ranges::find(hole, rightmost(hole)), hole.end());
        // The one farthest right first: nothing but the outline is right of it.
        std::ranges::stable_sort(
            holes_, [&](const auto& a, const auto& b) { return vertices_[a.front()].x > vertices_[b.front()].x; });
    }

    /// What does not come into it is left out of `rims`, to which all others are added.
    std::vector<std::uint32_t> outline(std::vector<std::vector<std::uint32_t>>& rims) {
        rims.push_back(outline_);
        for (std::size_t h = 0; h < holes_.size(); ++h) {
            const std::optional<std::size_t> corner = nearestSeen(h);
            if (!corner) continue;  // it crosses the rim: filled
            const auto at = outline_.begin() + static_cast<std::ptrdiff_t>(*corner) + 1;
            std::vector<std::uint32_t> around = holes_[h];
            around.insert(around.end(), {holes_[h].front(), outline_[*corner]});
            outline_.insert(at, around.begin(), around.end());
            rims.push_back(holes_[h]);
        }
        return std::move(outline_);
    }

private:
    [[nodiscard]] const OutlinePoint& corner(std::size_t i) const { return vertices_[outline_[i % outline_.size()]]; }

    /// The nearest corner of the outline that a cut from the hole's first leads to without meeting anything.
    [[nodiscard]] std::optional<std::size_t> nearestSeen(std::size_t hole) {
        const OutlinePoint& from = vertices_[holes_[hole].front()];
        std::vector<std::pair<double, std::size_t>> nearest;
        steps_ -= std::min<std::uint64_t>(steps_, outline_.size());
        if (steps_ == 0) return std::nullopt;
        for (std::size_t i = 0; i < outline_.size(); ++i)
            nearest.emplace_back(std::hypot(double(corner(i).x) - from.x, double(corner(i).y) - from.y), i);
        std::sort(nearest.begin(), nearest.end());
        for (const auto& [distance, i] : nearest) {
            const auto& cut = corner(i);
            const OutlinePoint &before = corner(i + outline_.size() - 1), &after = corner(i + 1);
            if (cut == from || !isInCone(before, cut, after, from) || meets(outline_, from, cut)) continue;
            bool free = true;
            for (std::size_t other = hole; other < holes_.size() && free; ++other)
                free = !meets(holes_[other], from, cut);
            if (free) return i;
            if (steps_ == 0) break;
        }
        return std::nullopt;
    }

    /// Whether the way from `corner` to `p` begins inside, which is left of the ways to and from the corner.
    static bool isInCone(const OutlinePoint& before, const OutlinePoint& corner, const OutlinePoint& after,
                         const OutlinePoint& p) {
        if (turnAt(before, corner, after) > 0) return turnAt(before, corner, p) > 0 && turnAt(corner, after, p) > 0;
        return turnAt(before, corner, p) > 0 || turnAt(corner, after, p) > 0;
    }

    [[nodiscard]] bool meets(const std::vector<std::uint32_t>& ring, const OutlinePoint& from, const OutlinePoint& to) {
        steps_ -= std::min<std::uint64_t>(steps_, ring.size());
        const auto sign = [](std::int64_t v) { return (v > 0) - (v < 0); };
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const OutlinePoint &a = vertices_[ring[i]], &b = vertices_[ring[(i + 1) % ring.size()]];
            const int sideA = sign(turnAt(from, to, a)), sideB = sign(turnAt(from, to, b));
            if (sideA == 0 && a != from && a != to && std::min(from.x, to.x) <= a.x && a.x <= std::max(from.x, to.x) &&
                std::min(from.y, to.y) <= a.y && a.y <= std::max(from.y, to.y))
                return true;
            if (sideA * sideB < 0 && sign(turnAt(a, b, from)) * sign(turnAt(a, b, to)) < 0) return true;
        }
        return false;
    }

    std::span<const OutlinePoint> vertices_;
    std::vector<std::uint32_t> outline_;
    std::vector<std::vector<std::uint32_t>> holes_;
    std::uint64_t& steps_;
};

GridPoint onGrid(const OutlinePoint& p) {
    return {std::int64_t{p.x} + (GridPoint::kMost >> 1), std::int64_t{p.y} + (GridPoint::kMost >> 1)};
}

}  // namespace

Expected<LetterTriangles> trianglesOf(const LetterShape& shape, double tolerance) {
    LetterTriangles made;
    std::vector<Ring> rings;
    std::vector<double> areas;
    std::size_t corners = 0;
    for (const OutlineContour& contour : shape) {
        Ring ring = flattened(contour, std::max(tolerance, 1.0));
        corners += ring.size();
        if (corners > kMostCorners)
            return fail(ErrorCode::kLimit, "a letter has more corners than 16384, curves as chords");
        const double area = areaOf(ring);
        if (ring.size() < 3 || area == 0) continue;
        rings.push_back(std::move(ring));
        areas.push_back(area);
    }
    // What it costs to ask each ring for each other; cuts and ears are counted as they come.
    std::uint64_t steps = kMostClipSteps * corners;
    if (rings.size() * corners > steps) return fail(ErrorCode::kLimit, "a letter has too many contours");
    // Rings that something begins or ends at: rims turn left around it, holes right.
    std::vector<Part> parts;
    std::vector<std::size_t> ringOfPart;
    const auto addVertices = [&](const Ring& ring, bool backwards) {
        std::vector<std::uint32_t> vertices;
        for (const OutlinePoint& p : ring) {
            vertices.push_back(static_cast<std::uint32_t>(made.vertices.size()));
            made.vertices.push_back(p);
        }
        if (backwards) std::ranges::reverse(vertices);
        return vertices;
    };
    std::vector<std::size_t> holes;
    for (std::size_t r = 0; r < rings.size(); ++r) {
        int outside = 0;
        for (std::size_t other = 0; other < rings.size(); ++other)
            if (other != r) outside += windingAround(rings[other], rings[r]);
        const int inside = outside + (areas[r] > 0 ? 1 : -1);
        if (outside == 0) {
            parts.push_back({.rim = addVertices(rings[r], areas[r] < 0), .holes = {}});
            ringOfPart.push_back(r);
        } else if (inside == 0) {
            holes.push_back(r);
        }
    }
    for (const std::size_t hole : holes) {
        Part* around = nullptr;
        double least = 0;
        for (std::size_t p = 0; p < parts.size(); ++p) {
            const double area = std::abs(areas[ringOfPart[p]]);
            if (windingAround(rings[ringOfPart[p]], rings[hole]) == 0 || (around && area >= least)) continue;
            around = &parts[p];
            least = area;
        }
        if (around) around->holes.push_back(addVertices(rings[hole], areas[hole] > 0));
    }
    for (Part& part : parts) {
        const std::vector<std::uint32_t> outline = Joining(made.vertices, std::move(part), steps).outline(made.rims);
        std::vector<GridPoint> grid;
        for (const std::uint32_t vertex : outline) grid.push_back(onGrid(made.vertices[vertex]));
        const Expected<std::vector<std::uint32_t>> triangles = clipEars(grid, steps);
        if (!triangles) return tl::unexpected(triangles.error());
        for (const std::uint32_t cornerOfIt : *triangles) made.triangles.push_back(outline[cornerOfIt]);
    }
    return made;
}

}  // namespace tessera
