#include "server/import/reader/DxfHatch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/geometry/TextOutlines.h"
#include "common/math/Box.h"

namespace tessera {
namespace {

constexpr std::int64_t kIsPolyline = 2;
constexpr double kPerDegree = std::numbers::pi / 180;
/// Of all rings: as a letter's.
constexpr std::size_t kMostCorners = 16384;
constexpr std::size_t kMostSteps = 20'000'000;

/// Groups in the order of the file: what they mean depends on those before.
class Boundaries {
public:
    Boundaries(const DxfRecord& record, const DxfChords& chords) : record_(record), chords_(chords) {}

    std::vector<DxfPath> read() {
        std::vector<DxfPath> rings;
        const double z = record_.number(30, 0);
        while (skipTo(92)) {
            const bool isPolyline = (take().integer() & kIsPolyline) != 0;
            DxfPath ring = isPolyline ? readPolyline() : readEdges();
            for (Vec3d& corner : ring) corner.z() = z;
            if (ring.size() > 2) rings.push_back(std::move(ring));
        }
        return rings;
    }

private:
    [[nodiscard]] bool atEnd() const { return at_ >= record_.groups.size(); }
    [[nodiscard]] int code() const { return atEnd() ? -1 : record_.groups[at_].code; }
    const DxfGroup& take() { return record_.groups[at_++]; }
    bool skipTo(int wanted) {
        while (!atEnd() && code() != wanted) ++at_;
        return !atEnd();
    }
    /// The values of an edge, up to the next edge or path; of splines several of a code.
    [[nodiscard]] DxfRecord takeEdge() {
        DxfRecord edge;
        while (!atEnd() && code() != 72 && code() != 92 && code() != 97 && code() != 75) edge.groups.push_back(take());
        return edge;
    }

    DxfPath readPolyline() {
        std::vector<Vec3d> corners;
        std::vector<double> bulges;
        for (; !atEnd() && code() != 92 && code() != 97 && code() != 75; ++at_) {
            const DxfGroup& group = record_.groups[at_];
            if (group.code == 10) {
                corners.emplace_back(group.number(), 0, 0);
                bulges.push_back(0);
            }
            if (corners.empty()) continue;
            if (group.code == 20) corners.back().y() = group.number();
            if (group.code == 42) bulges.back() = group.number();
        }
        DxfPath ring;
        for (std::size_t i = 0; i < corners.size(); ++i)
            if (ring.empty())
                ring.push_back(corners[i]);
            else
                addDxfBulge(ring, corners[i], bulges[i - 1], chords_);
        if (!ring.empty()) addDxfBulge(ring, corners.front(), bulges.back(), chords_);
        return ring;
    }

    DxfPath readEdges() {
        DxfPath ring;
        while (!atEnd() && code() != 92 && code() != 75 && code() != 97) {
            if (code() != 72) {
                ++at_;
                continue;
            }
            const std::int64_t kind = take().integer();
            DxfPath edge = pathOf(kind, takeEdge());
            // A spline's own 97 counts points that it goes through.
            if (kind == 4 && code() == 97) {
                ++at_;
                (void)takeEdge();
            }
            if (edge.empty()) continue;
            // Edges may run either way; each goes on from where the one before ends.
            if (!ring.empty() && (edge.back() - ring.back()).norm() < (edge.front() - ring.back()).norm())
                std::ranges::reverse(edge);
            ring.insert(ring.end(), edge.begin(), edge.end());
        }
        return ring;
    }

    [[nodiscard]] DxfPath pathOf(std::int64_t kind, const DxfRecord& edge) const {
        DxfPath path;
        const Vec3d center = edge.point(10), second = edge.point(11);
        const bool counterClockwise = edge.integer(73, 1) != 0;
        double start = edge.number(50, 0) * kPerDegree, end = edge.number(51, 360) * kPerDegree;
        double sweep = end - start;
        if (!(sweep > 1e-12)) sweep += 2 * std::numbers::pi;
        // Angles of those that go clockwise are counted that way.
        if (!counterClockwise) start = -start, sweep = -sweep;
        if (kind == 1) return {center, second};
        if (kind == 2) {
            const double radius = edge.number(40, 0);
            addDxfEllipse(path, center, Vec3d(radius, 0, 0), Vec3d(0, radius, 0), start, sweep, chords_);
        } else if (kind == 3) {
            const Vec3d minor = edge.number(40, 1) * Vec3d(-second.y(), second.x(), 0);
            addDxfEllipse(path, center, second, minor, start, sweep, chords_);
        } else if (kind == 4) {
            DxfSpline spline;
            spline.degree = static_cast<std::size_t>(std::clamp<std::int64_t>(edge.integer(94, 3), 0, 99));
            spline.knots = edge.numbers(40);
            spline.weights = edge.numbers(42);
            spline.points = edge.points(10);
            path = dxfSplinePath(spline, chords_);
        }
        return path;
    }

    const DxfRecord& record_;
    const DxfChords& chords_;
    std::size_t at_ = 0;
};

bool isInside(const DxfPath& ring, const Vec3d& p) {
    bool inside = false;
    for (std::size_t i = 0, before = ring.size() - 1; i < ring.size(); before = i++) {
        const Vec3d &a = ring[before], &b = ring[i];
        if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
            inside = !inside;
    }
    return inside;
}

double areaOf(const DxfPath& ring) {
    double area = 0;
    for (std::size_t i = 0, before = ring.size() - 1; i < ring.size(); before = i++)
        area += ring[before].x() * ring[i].y() - ring[i].x() * ring[before].y();
    return area;
}

/// Whether something of the ring is inside the other one: most of some corners, as rings may touch.
bool isWithin(const DxfPath& other, const DxfPath& ring) {
    std::size_t inside = 0, tried = 0;
    for (std::size_t i = 0; i < ring.size() && tried < 5; i += ring.size() / 5 + 1, ++tried)
        inside += isInside(other, ring[i]);
    return 2 * inside > tried;
}

}  // namespace

std::vector<DxfPath> dxfHatchRings(const DxfRecord& record, const DxfChords& chords) {
    return Boundaries(record, chords).read();
}

/// The triangulation of letters takes what contours wind around. Even and odd becomes that where rings turn by turns,
/// one way and the other, from outside in.
Expected<DxfFill> dxfFilled(const std::vector<DxfPath>& rings) {
    Box box;
    std::size_t corners = 0;
    for (const DxfPath& ring : rings) {
        corners += ring.size();
        for (const Vec3d& corner : ring) box.extend(corner);
    }
    if (corners > kMostCorners || rings.size() * corners * 5 > kMostSteps)
        return fail(ErrorCode::kLimit, "a hatch has too many corners");
    DxfFill fill;
    const double side = rings.empty() ? 0 : box.size().head<2>().maxCoeff();
    if (!(side > 0) || !std::isfinite(side)) return fill;
    const double step = side / (OutlinePoint::kFarthest / 2.0);
    LetterShape shape;
    for (const DxfPath& ring : rings) {
        std::size_t depth = 0;
        for (const DxfPath& other : rings) depth += &other != &ring && isWithin(other, ring);
        DxfPath turned = ring;
        if ((areaOf(ring) > 0) != (depth % 2 == 0)) std::ranges::reverse(turned);
        OutlineContour contour;
        for (const Vec3d& corner : turned) {
            const Vec3d at = (corner - box.lower) / step;
            const OutlinePoint point{static_cast<std::int32_t>(std::lround(at.x())),
                                     static_cast<std::int32_t>(std::lround(at.y()))};
            if (&corner == &turned.front())
                contour.start = point;
            else
                contour.segments.push_back({1, {point}});
        }
        shape.push_back(std::move(contour));
    }
    const Expected<LetterTriangles> made = trianglesOf(shape, 1);
    if (!made) return fail(ErrorCode::kLimit, "a hatch has too many corners");
    for (const OutlinePoint& vertex : made->vertices)
        fill.corners.emplace_back(box.lower.x() + step * vertex.x, box.lower.y() + step * vertex.y, box.lower.z());
    fill.triangles = made->triangles;
    return fill;
}

}  // namespace tessera
