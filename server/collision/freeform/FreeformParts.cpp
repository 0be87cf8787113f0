#include "server/collision/freeform/FreeformParts.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/freeform/BezierTriangle.h"

namespace tessera {
namespace {

/// Beyond so many all parts are forgotten before the next query: about 11 MiB.
constexpr std::size_t kMostKept = std::size_t{1} << 14, kPartsOfBlock = 2;
/// Of the parameters' range: halving goes no further.
constexpr double kSmallestSide = 1e-13;

struct BernsteinValues {
    std::array<double, kMaxNurbsDegree + 1> value, slope;
    BernsteinValues(int degree, double t) {
        value[0] = 1;
        for (int d = 1; d <= degree; ++d) {
            if (d == degree)
                for (int i = 0; i <= degree; ++i)
                    slope[static_cast<std::size_t>(i)] = degree * ((i > 0 ? at(i - 1) : 0) - (i < degree ? at(i) : 0));
            at(d) = 0;
            for (int i = d; i > 0; --i) at(i) = (1 - t) * at(i) + t * at(i - 1);
            value[0] *= 1 - t;
        }
        if (degree == 0) slope[0] = 0;
    }
    double& at(int i) { return value[static_cast<std::size_t>(i)]; }
};

/// A bicubic patch's point and derivatives, of 16 points as x, y, z.
inline PartPoint evaluateBicubic(const double* coordinates, double s, double t) {
    const auto values = [](double at) {
        return std::array<double, 4>{(1 - at) * (1 - at) * (1 - at), 3 * at * (1 - at) * (1 - at),
                                     3 * at * at * (1 - at), at * at * at};
    };
    const auto slopes = [](double at) {
        const double low = 3 * (1 - at) * (1 - at), middle = 6 * at * (1 - at), high = 3 * at * at;
        return std::array<double, 4>{-low, low - middle, middle - high, high};
    };
    const std::array<double, 4> bs = values(s), ds = slopes(s), bt = values(t), dt = slopes(t);
    PartPoint out;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double* const p = coordinates + 16 * axis;
        std::array<double, 4> value, slope;  // of the four curves along t
        for (std::size_t i = 0; i < 4; ++i)
            value[i] = (bt[0] * p[i] + bt[1] * p[4 + i]) + (bt[2] * p[8 + i] + bt[3] * p[12 + i]);
        for (std::size_t i = 0; i < 4; ++i)
            slope[i] = (dt[0] * p[i] + dt[1] * p[4 + i]) + (dt[2] * p[8 + i] + dt[3] * p[12 + i]);
        const auto a = static_cast<Eigen::Index>(axis);
        out.point[a] = (bs[0] * value[0] + bs[1] * value[1]) + (bs[2] * value[2] + bs[3] * value[3]);
        out.ds[a] = (ds[0] * value[0] + ds[1] * value[1]) + (ds[2] * value[2] + ds[3] * value[3]);
        out.dt[a] = (bs[0] * slope[0] + bs[1] * slope[1]) + (bs[2] * slope[2] + bs[3] * slope[3]);
    }
    return out;
}

/// De Casteljau at the middle of `count` numbers that lie `stride` apart: `high` becomes the upper half, `low` the
/// lower one.
inline void halveCurve(double* low, double* high, int count, std::size_t stride) {
    for (int level = 0; level < count; ++level) {
        low[static_cast<std::size_t>(level) * stride] = high[0];
        for (int i = 0; i + 1 < count - level; ++i) {
            double& here = high[static_cast<std::size_t>(i) * stride];
            here = 0.5 * (here + high[static_cast<std::size_t>(i + 1) * stride]);
        }
    }
}

/// A corner that nothing moves, of more than one face: refinement turns its edges towards each other without end (their
/// vectors shrink by 0.65 around three faces, what parts them by 0.41), so it is a spike. CornerLimit's tangents are
/// the control points' edges there, another pair after each refinement.
bool hasNoTangentPlane(const TaggedMesh& mesh, std::uint32_t corner) {
    if (!isFixedCorner(mesh, corner)) return false;
    const Sector sector = sectorOf(mesh, 0, corner);
    return sector.faces.size() > 1 && (isInfinitelySharp(mesh.vertexSharpness[corner]) || !sector.closed);
}

}  // namespace

std::uint32_t FreeformParts::root() {
    if (moves_ != shape_.moves() || parts_.size() + kPartsOfBlock * blocks_.size() > kMostKept) {
        parts_.clear();
        coordinates_.clear();
        blocks_.clear();
        moves_ = shape_.moves();
    }
    if (parts_.empty()) {
        parts_.push_back(makeGroup(0, true));
        PartBlock& alone = blocks_.emplace_back();
        alone.count = 1;
        alone.set(0, boxAround(parts_[0]));
    }
    return 0;
}

std::size_t FreeformParts::takePoints(std::span<const Vec3d> points) {
    const std::size_t at = coordinates_.size();
    coordinates_.resize(at + 3 * points.size());
    double* out = coordinates_.data() + at;
    for (int axis = 0; axis < 3; ++axis)
        for (const Vec3d& p : points) *out++ = p[axis];
    return at;
}

std::vector<Vec3d> FreeformParts::pointsAt(std::size_t at, std::size_t count) const {
    const double *x = coordinates_.data() + at, *y = x + count, *z = y + count;
    std::vector<Vec3d> points(count);
    for (std::size_t i = 0; i < count; ++i) points[i] = {x[i], y[i], z[i]};
    return points;
}

FreeformPart FreeformParts::makeGroup(std::uint32_t node, bool whole) {
    const FreeformShape::Node& from = shape_.nodes()[node];
    FreeformPart part;
    if (from.isLeaf) {
        makeFace(part, from.first, whole);
        return part;
    }
    part.face = node;
    if (!whole) return part;
    std::array<Vec3d, 8> corners;
    for (std::size_t i = 0; i < 8; ++i)
        for (Eigen::Index axis = 0; axis < 3; ++axis)
            corners[i][axis] = ((i >> axis) & 1) != 0 ? from.box.upper[axis] : from.box.lower[axis];
    part.points = 8;
    part.at = takePoints(corners);
    Eigen::Index thin = 0;
    from.box.size().minCoeff(&thin);
    part.normal = Vec3d::Unit(thin);
    part.center = from.box.center();
    finish(part);
    return part;
}

/// Radius and extent along the normal, of whatever has a center, a normal and points.
void FreeformParts::finish(FreeformPart& part) {
    const double *x = coordinates_.data() + part.at, *y = x + part.points, *z = y + part.points;
    double far = 0;
    for (std::uint32_t i = 0; i < part.points; ++i) {
        const double dx = x[i] - part.center.x(), dy = y[i] - part.center.y(), dz = z[i] - part.center.z();
        far = std::max(far, dx * dx + dy * dy + dz * dz);
    }
    part.radius = std::sqrt(far);
    const Extent extent = extentAlong(part, part.normal);
    const double here = part.normal.dot(part.center);
    part.low = extent.least - here;
    part.high = extent.most - here;
}

/// The sample of a patch or triangle: its middle.
void FreeformParts::project(FreeformPart& part) {
    part.middle = part.kind == FreeformPart::Kind::kPatch ? Vec2d(0.5, 0.5) : Vec2d(1.0 / 3, 1.0 / 3);
    const PartPoint p = evaluate(part, part.middle.x(), part.middle.y());
    part.center = p.point;
    part.hasSample = isThere(part, part.middle.x(), part.middle.y());
    const Vec3d across = p.ds.cross(p.dt);
    const double length = across.norm();
    part.normal = length > 0 && std::isfinite(length) ? Vec3d(across / length) : Vec3d(Vec3d::UnitZ());
    finish(part);
}

void FreeformParts::addNeighbourhood(FreeformPart& part, const NeighbourhoodGraph::Node& node,
                                     std::span<const Vec3d> points, bool whole) {
    if (node.spline) {
        if (node.spline->count() == 16) {
            std::array<Vec3d, 16> spline;
            for (std::size_t i = 0; i < 16; ++i) spline[i] = node.spline->apply(i, points);
            part.kind = FreeformPart::Kind::kPatch;
            part.degreeU = part.degreeV = 3;
            part.points = 16;
            part.at = takePoints(bezierOfSpline(spline));
        } else {
            std::array<Vec3d, 12> spline;
            for (std::size_t i = 0; i < 12; ++i) spline[i] = node.spline->apply(i, points);
            part.kind = FreeformPart::Kind::kTriangle;
            part.degreeU = 4;
            part.points = 15;
            part.at = takePoints(bezierOfBoxSpline(spline));
        }
        if (whole) project(part);
        return;
    }
    part.kind = FreeformPart::Kind::kNeighbourhood;
    part.node = &node;
    part.controls = static_cast<std::uint32_t>(points.size());
    if (!whole) {
        part.at = takePoints(points);
        return;
    }
    hull_.clear();
    hullOfNeighbourhood(*shape_.subdivision()->graph, node, points, kHullLevels, hull_);
    // A box along the face around that.
    const std::size_t opposite = node.faceSize() == 3 ? 1 : 2;
    Mat3d frame = Mat3d::Identity();
    const Vec3d across = points[0] - points[opposite],
                up = across.cross(node.faceSize() == 3 ? points[0] - points[2] : points[1] - points[3]);
    if (up.norm() > 0 && std::isfinite(up.norm())) {
        frame.col(0) = across.normalized();
        frame.col(2) = up.normalized();
        frame.col(1) = frame.col(2).cross(frame.col(0));
    }
    Box box;
    for (const Vec3d& p : hull_) box.extend(frame.transpose() * p);
    std::array<Vec3d, 8> corners;
    for (std::size_t i = 0; i < 8; ++i) {
        for (Eigen::Index axis = 0; axis < 3; ++axis)
            corners[i][axis] = ((i >> axis) & 1) != 0 ? box.upper[axis] : box.lower[axis];
        corners[i] = frame * corners[i];
    }
    part.points = 8;
    part.at = takePoints(corners);
    (void)takePoints(points);
    const std::uint32_t corner = part.corner < node.faceSize() ? part.corner : 0;
    const SparseRows& rows = shape_.subdivision()->graph->limitAt(node, corner).rows;
    part.center = rows.apply(0, points);
    const bool triangle = node.faceSize() == 3;
    part.middle = triangle ? Vec2d(corner == 1 ? 1 : 0, corner == 2 ? 1 : 0)
                           : Vec2d(corner == 1 || corner == 2 ? 1 : 0, corner >= 2 ? 1 : 0);
    part.hasSample = part.center.allFinite();
    part.normal = frame.col(2);
    finish(part);
}

void FreeformParts::makeFace(FreeformPart& part, std::uint32_t face, bool whole) {
    if (shape_.nurbs()) {
        const FreeformShape::NurbsPatch& from = shape_.nurbs()->patches[face];
        part.kind = FreeformPart::Kind::kPatch;
        part.face = from.surface;
        part.degreeU = static_cast<std::uint8_t>(from.patch.degreeU);
        part.degreeV = static_cast<std::uint8_t>(from.patch.degreeV);
        part.rational = !from.polynomial;
        part.crossed = from.crossed;
        part.origin = {from.over.u.lower, from.over.v.lower};
        part.alongU = {from.over.u.size(), 0};
        part.alongV = {0, from.over.v.size()};
        points_.clear();
        for (const Vec4d& p : from.patch.points) points_.push_back(p.head<3>() / p.w());
        part.points = static_cast<std::uint32_t>(points_.size());
        part.at = takePoints(points_);
        if (part.rational) {
            for (Eigen::Index axis = 0; axis < 4; ++axis)
                for (const Vec4d& p : from.patch.points) coordinates_.push_back(p[axis]);
        }
        if (whole) project(part);
        return;
    }
    if (!shape_.subdivision()) {
        part.kind = FreeformPart::Kind::kTriangle;
        part.degreeU = 1;
        part.face = face;
        part.points = 3;
        part.at = takePoints(shape_.mesh().triangle(face));
        if (whole) project(part);
        return;
    }
    const FreeformShape::Subdivision& s = *shape_.subdivision();
    part.face = s.faces[face];
    const PtexFace ptex = s.topology->ptexFace(part.face);
    const NeighbourhoodGraph::Face& base = s.graph->faceOf(ptex.face);
    points_.clear();
    for (const std::uint32_t p : base.points) points_.push_back(s.positions[p]);
    if (ptex.corner == kNoIndex) {
        addNeighbourhood(part, *base.node, points_, whole);
        return;
    }
    const NeighbourhoodGraph::Child& child = s.graph->childOf(*base.node, ptex.corner);
    child.points.apply(points_, finer_);
    points_.swap(finer_);
    addNeighbourhood(part, *child.node, points_, whole);
}

bool FreeformParts::isThere(const FreeformPart& part, double s, double t) const {
    if (!part.crossed) return true;
    const FreeformShape::Nurbs& nurbs = *shape_.nurbs();
    return nurbs.surfaces[part.face].region().side(part.origin + s * part.alongU + t * part.alongV) !=
           TrimSide::kTrimmedAway;
}

/// False: trimming takes all of it away.
bool FreeformParts::settleTrim(FreeformPart& part) const {
    if (!part.crossed) return true;
    const Vec2d upper = part.origin + part.alongU + part.alongV;
    const RectangleSide side = shape_.nurbs()->surfaces[part.face].region().side(
        ParameterRectangle{{part.origin.x(), upper.x()}, {part.origin.y(), upper.y()}});
    part.crossed = side == RectangleSide::kCrossed;
    return side != RectangleSide::kTrimmedAway;
}

bool FreeformParts::isSmallest(const FreeformPart& part) const {
    if (part.kind == FreeformPart::Kind::kGroup) return false;
    const double reach = std::max(1.0, part.origin.cwiseAbs().maxCoeff());
    return std::max(part.alongU.cwiseAbs().maxCoeff(), part.alongV.cwiseAbs().maxCoeff()) < kSmallestSide * reach;
}

/// Quarter `c` of a neighbourhood.
FreeformPart FreeformParts::quarterOf(const FreeformPart& part, std::span<const Vec3d> points, std::uint32_t c,
                                      bool whole) {
    const bool triangle = part.node->faceSize() == 3;
    const NeighbourhoodGraph::Child& child = shape_.subdivision()->graph->childOf(*part.node, c);
    child.points.apply(points, finer_);
    FreeformPart quarter;
    quarter.face = part.face;
    quarter.corner = static_cast<std::uint8_t>(triangle && c == 3 ? 0 : c);
    quarter.alongU = 0.5 * part.alongU;
    quarter.alongV = 0.5 * part.alongV;
    quarter.origin = part.origin;
    if (c == 1 || (c == 2 && !triangle)) quarter.origin += quarter.alongU;
    if (c == 2 || (c == 3 && !triangle)) quarter.origin += quarter.alongV;
    if (triangle && c == 3) {
        quarter.origin += quarter.alongU + quarter.alongV;
        quarter.alongU = -quarter.alongU;
        quarter.alongV = -quarter.alongV;
    }
    addNeighbourhood(quarter, *child.node, finer_, whole);
    return quarter;
}

void FreeformParts::divide(std::uint32_t which) {
    if (parts_[which].divided) return;
    const auto first = static_cast<std::uint32_t>(parts_.size());
    const FreeformPart part = parts_[which];
    switch (part.kind) {
        case FreeformPart::Kind::kGroup:
            for (std::uint32_t i = 0; i < 2; ++i)
                parts_.push_back(makeGroup(shape_.nodes()[part.face].first + i, true));
            break;
        case FreeformPart::Kind::kPatch:
        case FreeformPart::Kind::kTriangle:
            for (FreeformPart& half : part.kind == FreeformPart::Kind::kPatch ? halve(part) : halveTriangle(part)) {
                if (!settleTrim(half)) continue;
                project(half);
                parts_.push_back(half);
            }
            break;
        case FreeformPart::Kind::kNeighbourhood: {
            const std::vector<Vec3d> points = pointsAt(controlsAt(part), part.controls);
            for (std::uint32_t c = 0; c < 4; ++c) parts_.push_back(quarterOf(part, points, c, true));
            break;
        }
    }
    parts_[which].firstChild = first;
    parts_[which].children = static_cast<std::uint8_t>(parts_.size() - first);
    parts_[which].divided = true;
}

std::array<FreeformPart, 2> FreeformParts::halve(const FreeformPart& part) {
    const auto n = static_cast<std::size_t>(part.degreeU), m = static_cast<std::size_t>(part.degreeV),
               count = (n + 1) * (m + 1);
    // Along the side that is longer in space, so that parts stay round.
    double longU = 0, longV = 0;
    {
        const double *x = coordinates_.data() + part.at, *y = x + count, *z = y + count;
        const auto square = [&](std::size_t a, std::size_t b) {
            const double dx = x[a] - x[b], dy = y[a] - y[b], dz = z[a] - z[b];
            return dx * dx + dy * dy + dz * dz;
        };
        for (std::size_t j = 0; j <= m; ++j) {
            double length = 0;
            for (std::size_t i = 0; i < n; ++i) length += square(j * (n + 1) + i + 1, j * (n + 1) + i);
            longU = std::max(longU, length * static_cast<double>(n));
        }
        for (std::size_t i = 0; i <= n; ++i) {
            double length = 0;
            for (std::size_t j = 0; j < m; ++j) length += square((j + 1) * (n + 1) + i, j * (n + 1) + i);
            longV = std::max(longV, length * static_cast<double>(m));
        }
    }
    // Where one parameter has come to its end, the other.
    const double reach = kSmallestSide * std::max(1.0, part.origin.cwiseAbs().maxCoeff());
    const bool alongU = part.alongV.y() < reach || (part.alongU.x() >= reach && longU >= longV);

    const std::size_t size = count * (part.rational ? 7 : 3), from = part.rational ? 3 : 0,
                      channels = part.rational ? 4 : 3;
    FreeformPart low = part, high = part;
    low.divided = high.divided = false;
    low.block = high.block = kNoIndex;
    low.at = coordinates_.size();
    high.at = low.at + size;
    coordinates_.resize(high.at + size);
    const double* source = coordinates_.data() + part.at;
    double *l = coordinates_.data() + low.at, *h = coordinates_.data() + high.at;
    std::copy(source + from * count, source + (from + channels) * count, h + from * count);
    for (std::size_t channel = from; channel < from + channels; ++channel) {
        double *lc = l + channel * count, *hc = h + channel * count;
        if (alongU)
            for (std::size_t j = 0; j <= m; ++j)
                halveCurve(lc + j * (n + 1), hc + j * (n + 1), static_cast<int>(n + 1), 1);
        else
            for (std::size_t i = 0; i <= n; ++i) halveCurve(lc + i, hc + i, static_cast<int>(m + 1), n + 1);
    }
    if (part.rational)
        for (double* half : {l, h})
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    half[axis * count + i] = half[(3 + axis) * count + i] / half[6 * count + i];
    Vec2d& side = alongU ? low.alongU : low.alongV;
    side *= 0.5;
    (alongU ? high.alongU : high.alongV) = side;
    high.origin += side;
    return {low, high};
}

std::array<FreeformPart, 2> FreeformParts::halveTriangle(const FreeformPart& part) {
    const int degree = part.degreeU;
    const std::array<Vec2d, 3> corners{part.origin, part.origin + part.alongU, part.origin + part.alongV};
    const double* points = coordinates_.data() + part.at;
    const std::size_t count = part.points;
    // Where corner `o` counts `here` times, and the next ones so often.
    const auto placeOf = [&](int o, int here, int next, int before) {
        std::array<int, 3> times{};
        times[static_cast<std::size_t>(o)] = here;
        times[static_cast<std::size_t>((o + 1) % 3)] = next;
        times[static_cast<std::size_t>((o + 2) % 3)] = before;
        return BezierTriangle::index(degree, times[1], times[2]);
    };
    // The edge along which control points are farthest from each other, opposite to corner `o`: an edge that is folded
    // has its ends together, and would never be halved if these alone were looked at.
    int o = 0;
    double longest = -1;
    for (int k = 0; k < 3; ++k)
        for (int here = 0; here < degree; ++here) {
            double length = 0;
            for (int i = 0; i < degree - here; ++i) {
                const std::size_t from = placeOf(k, here, degree - here - i, i),
                                  to = placeOf(k, here, degree - here - i - 1, i + 1);
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const double d = points[axis * count + from] - points[axis * count + to];
                    length += d * d;
                }
            }
            length *= degree - here;  // a curve whose points are evenly spread has the square of its length
            if (length > longest) {
                longest = length;
                o = k;
            }
        }
    // Where corner o counts k times, the points are those of a curve between the other two: each is halved.
    const auto place = [&](int here, int next, int before) { return placeOf(o, here, next, before); };
    FreeformPart a = part, b = part;
    a.divided = b.divided = false;
    a.block = b.block = kNoIndex;
    a.at = coordinates_.size();
    b.at = a.at + 3 * count;
    coordinates_.resize(b.at + 3 * count);
    std::array<double, 32> low{}, high{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double* from = coordinates_.data() + part.at + axis * count;
        double *toA = coordinates_.data() + a.at + axis * count, *toB = coordinates_.data() + b.at + axis * count;
        for (int k = 0; k <= degree; ++k) {
            const int n = degree - k;
            for (int i = 0; i <= n; ++i) high[static_cast<std::size_t>(i)] = from[place(k, n - i, i)];
            halveCurve(low.data(), high.data(), n + 1, 1);
            // New corners: o, o + 1, the middle; and o, the middle, o + 2.
            for (int i = 0; i <= n; ++i) {
                toA[BezierTriangle::index(degree, n - i, i)] = low[static_cast<std::size_t>(i)];
                toB[BezierTriangle::index(degree, n - i, i)] = high[static_cast<std::size_t>(i)];
            }
        }
    }
    const auto corner = [&](int k) { return corners[static_cast<std::size_t>((o + k) % 3)]; };
    const Vec2d middle = 0.5 * (corner(1) + corner(2));
    a.origin = b.origin = corner(0);
    a.alongU = corner(1) - corner(0);
    a.alongV = b.alongU = middle - corner(0);
    b.alongV = corner(2) - corner(0);
    return {a, b};
}

Vec3d FreeformParts::normalAtSample(const FreeformPart& part) const {
    const std::uint32_t corner = part.corner < part.node->faceSize() ? part.corner : 0;
    if (hasNoTangentPlane(part.node->mesh, corner)) return Vec3d::Zero();
    const std::vector<Vec3d> points = pointsAt(controlsAt(part), part.controls);
    const SparseRows& rows = shape_.subdivision()->graph->limitAt(*part.node, corner).rows;
    const Vec3d du = rows.apply(1, points), dv = rows.apply(2, points), across = du.cross(dv);
    // As LimitEvaluator has it: below this there is no tangent plane.
    const double area = across.norm();
    return area > 1e-12 * du.norm() * dv.norm() ? Vec3d(across / area) : Vec3d::Zero();
}

PartPoint FreeformParts::evaluate(const FreeformPart& part, double s, double t) const {
    const double* const base = coordinates_.data() + part.at;
    const std::size_t count = part.points;
    PartPoint out;
    if (part.kind == FreeformPart::Kind::kTriangle) {
        const int degree = part.degreeU;
        std::array<double, 45> work;  // degree 8 at most
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<Eigen::Index>(axis);
            std::copy(base + axis * count, base + (axis + 1) * count, work.begin());
            for (int d = degree; d > 1; --d)
                for (int j = 0; j < d; ++j)
                    for (int i = 0; i + j < d; ++i)
                        work[BezierTriangle::index(d - 1, i, j)] = (1 - s - t) * work[BezierTriangle::index(d, i, j)] +
                                                                   s * work[BezierTriangle::index(d, i + 1, j)] +
                                                                   t * work[BezierTriangle::index(d, i, j + 1)];
            out.point[a] = (1 - s - t) * work[0] + s * work[1] + t * work[2];
            out.ds[a] = degree * (work[1] - work[0]);
            out.dt[a] = degree * (work[2] - work[0]);
        }
        return out;
    }
    const int n = part.degreeU, m = part.degreeV;
    if (n == 3 && m == 3 && !part.rational) return evaluateBicubic(base, s, t);
    const BernsteinValues bs(n, s), bt(m, t);
    std::array<double, 4> p{}, ps{}, pt{};
    const std::size_t from = part.rational ? 3 : 0, channels = part.rational ? 4 : 3;
    for (std::size_t channel = 0; channel < channels; ++channel) {
        const double* row = base + (from + channel) * count;
        for (std::size_t j = 0; j <= static_cast<std::size_t>(m); ++j) {
            double value = 0, slope = 0;
            for (std::size_t i = 0; i <= static_cast<std::size_t>(n); ++i, ++row) {
                value += bs.value[i] * *row;
                slope += bs.slope[i] * *row;
            }
            p[channel] += bt.value[j] * value;
            ps[channel] += bt.value[j] * slope;
            pt[channel] += bt.slope[j] * value;
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        const double w = part.rational ? p[3] : 1;
        out.point[a] = p[axis] / w;
        out.ds[a] = (ps[axis] - (part.rational ? ps[3] * out.point[a] : 0)) / w;
        out.dt[a] = (pt[axis] - (part.rational ? pt[3] * out.point[a] : 0)) / w;
    }
    return out;
}

}  // namespace tessera
