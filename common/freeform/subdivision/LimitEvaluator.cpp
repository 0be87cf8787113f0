#include "common/freeform/subdivision/LimitEvaluator.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "common/freeform/BezierTriangle.h"

namespace tessera {
namespace {

/// Beyond this many steps a point is the corner that it is nearest to: 2e-13 of a face's size remains at the slowest
/// shrinking vertex (0.69 a step).
constexpr int kMostSteps = 80;

Vec3d unitNormal(const Vec3d& du, const Vec3d& dv) {
    const Vec3d across = du.cross(dv);
    const double area = across.norm();
    return area > 1e-12 * du.norm() * dv.norm() ? Vec3d(across / area) : Vec3d::Zero();
}

/// Values and derivatives of the four cubic B-splines.
struct CubicBasis {
    std::array<double, 4> value, slope;
    explicit CubicBasis(double t) {
        const double s = 1 - t;
        value = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6,
                 t * t * t / 6};
        slope = {-s * s / 2, (-4 * t + 3 * t * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
    }
};

SurfacePoint splinePoint(const SparseRows& spline, std::span<const Vec3d> points, double u, double v) {
    SurfacePoint out;
    if (spline.count() == 16) {
        const CubicBasis bu(u), bv(v);
        for (std::size_t y = 0; y < 4; ++y) {
            for (std::size_t x = 0; x < 4; ++x) {
                const Vec3d p = spline.apply(4 * y + x, points);
                out.point += bu.value[x] * bv.value[y] * p;
                out.du += bu.slope[x] * bv.value[y] * p;
                out.dv += bu.value[x] * bv.slope[y] * p;
            }
        }
        return out;
    }
    std::array<Vec3d, 12> box;
    for (std::size_t i = 0; i < 12; ++i) box[i] = spline.apply(i, points);
    const auto bezier = bezierOfBoxSpline(box);
    return evaluate(BezierTriangle{.degree = 4, .points = {bezier.begin(), bezier.end()}}, u, v);
}

/// Which child holds a point, where in it, and how its derivatives turn into the parent's.
struct Descent {
    std::uint32_t child = 0;
    double scale = 2;
};
Descent intoQuadrilateral(double& u, double& v) {
    const bool right = u >= 0.5, up = v >= 0.5;
    u = 2 * u - (right ? 1 : 0);
    v = 2 * v - (up ? 1 : 0);
    return {up ? (right ? 2U : 3U) : (right ? 1U : 0U)};
}
Descent intoTriangle(double& u, double& v) {
    if (u >= 0.5) {
        u = 2 * u - 1;
        v = 2 * v;
        return {1};
    }
    if (v >= 0.5) {
        u = 2 * u;
        v = 2 * v - 1;
        return {2};
    }
    if (u + v <= 0.5) {
        u = 2 * u;
        v = 2 * v;
        return {0};
    }
    u = 1 - 2 * u;
    v = 1 - 2 * v;
    return {3, -2};
}

/// The corner that u, v is exactly, or -1.
int exactCorner(double u, double v, bool triangle) {
    if (triangle) return u == 0 && v == 0 ? 0 : u == 1 && v == 0 ? 1 : u == 0 && v == 1 ? 2 : -1;
    if ((u != 0 && u != 1) || (v != 0 && v != 1)) return -1;
    return v == 0 ? (u == 0 ? 0 : 1) : (u == 0 ? 3 : 2);
}
int nearestCorner(double u, double v, bool triangle) {
    if (triangle) return u >= 0.5 ? 1 : v >= 0.5 ? 2 : 0;
    return v < 0.5 ? (u < 0.5 ? 0 : 1) : (u < 0.5 ? 3 : 2);
}

/// Tangents along the edge that leaves a corner and against the one that arrives, as derivatives by u and v.
void tangentsToDerivatives(SurfacePoint& p, const Vec3d& out, const Vec3d& in, int corner, bool triangle) {
    if (triangle) {
        // The edges lead along (1, 0), (-1, 1), (0, -1), and backwards.
        if (corner == 0)
            std::tie(p.du, p.dv) = std::pair<Vec3d, Vec3d>(out, in);
        else if (corner == 1)
            std::tie(p.du, p.dv) = std::pair<Vec3d, Vec3d>(-in, out - in);
        else
            std::tie(p.du, p.dv) = std::pair<Vec3d, Vec3d>(in - out, -out);
        return;
    }
    switch (corner) {
        case 0:
            p.du = out;
            p.dv = in;
            break;
        case 1:
            p.du = -in;
            p.dv = out;
            break;
        case 2:
            p.du = -out;
            p.dv = -in;
            break;
        default:
            p.du = in;
            p.dv = -out;
            break;
    }
}

}  // namespace

Expected<SurfacePoint> LimitEvaluator::evaluate(std::span<const Vec3d> positions, const PtexPoint& at) {
    const auto where = [&] { return "face " + std::to_string(at.face); };
    if (positions.size() != topology_.controlPointCount())
        return fail(ErrorCode::kBadInput, "there are not as many positions as control points");
    if (at.face >= topology_.ptexFaceCount()) {
        return fail(ErrorCode::kBadInput, where() + ": there are " + std::to_string(topology_.ptexFaceCount()));
    }
    const bool triangle = topology_.scheme() == SubdivisionScheme::kLoop;
    constexpr double kSlack = 1e-9;
    double u = at.u, v = at.v;
    if (!(u >= -kSlack && v >= -kSlack && u <= 1 + kSlack && v <= 1 + kSlack) || (triangle && u + v > 1 + kSlack)) {
        return fail(ErrorCode::kBadInput, where() + (triangle ? ": u, v and u + v have to be from 0 to 1"
                                                              : ": u and v have to be from 0 to 1"));
    }
    u = std::clamp(u, 0.0, 1.0);
    v = std::clamp(v, 0.0, triangle ? 1 - u : 1.0);
    const PtexFace face = topology_.ptexFace(at.face);
    if (!topology_.hasSurface(face.face))
        return fail(ErrorCode::kRefused, where() + " is a hole, or beside a boundary that is not interpolated");
    if (topology_.scheme() == SubdivisionScheme::kBilinear) return bilinear(positions, face, u, v);
    graph_.shrink();
    const NeighbourhoodGraph::Face& base = graph_.faceOf(face.face);
    points_.resize(base.points.size());
    for (std::size_t i = 0; i < points_.size(); ++i) points_[i] = positions[base.points[i]];
    return smooth(face, u, v);
}

SurfacePoint LimitEvaluator::bilinear(std::span<const Vec3d> positions, const PtexFace& face, double u,
                                      double v) const {
    const auto vertices = topology_.mesh().verticesOf(face.face);
    const std::size_t n = vertices.size();
    std::array<Vec3d, 4> p;
    if (face.corner == kNoIndex) {
        for (std::size_t i = 0; i < 4; ++i) p[i] = positions[vertices[i]];
    } else {
        const Vec3d &here = positions[vertices[face.corner]], &next = positions[vertices[(face.corner + 1) % n]],
                    &before = positions[vertices[(face.corner + n - 1) % n]];
        Vec3d middle = Vec3d::Zero();
        for (const std::uint32_t i : vertices) middle += positions[i] / static_cast<double>(n);
        p = {here, (here + next) / 2, middle, (here + before) / 2};
    }
    SurfacePoint out;
    out.point = (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[3] + u * p[2]);
    out.du = (1 - v) * (p[1] - p[0]) + v * (p[2] - p[3]);
    out.dv = (1 - u) * (p[3] - p[0]) + u * (p[2] - p[1]);
    out.normal = unitNormal(out.du, out.dv);
    return out;
}

SurfacePoint LimitEvaluator::smooth(const PtexFace& face, double u, double v) {
    const bool triangle = topology_.scheme() == SubdivisionScheme::kLoop;
    const NeighbourhoodGraph::Node* node = graph_.faceOf(face.face).node;
    Vec3d origin = Vec3d::Zero();
    double scale = 1;
    const auto descend = [&](std::uint32_t which, std::uint32_t corner) {
        // The corner that the part lies at is the origin from here on.
        const Vec3d center = points_[corner];
        for (Vec3d& p : points_) p -= center;
        origin += center;
        const NeighbourhoodGraph::Child& child = graph_.childOf(*node, which);
        child.points.apply(points_, finer_);
        points_.swap(finer_);
        node = child.node;
    };
    if (face.corner != kNoIndex) descend(face.corner, face.corner);
    SurfacePoint out;
    for (int step = 0;; ++step) {
        if (node->spline) {
            out = splinePoint(*node->spline, points_, u, v);
            break;
        }
        const int corner = step < kMostSteps ? exactCorner(u, v, triangle) : nearestCorner(u, v, triangle);
        if (corner >= 0) {
            const SparseRows& rows = graph_.limitAt(*node, static_cast<std::uint32_t>(corner)).rows;
            out.point = rows.apply(0, points_);
            tangentsToDerivatives(out, rows.apply(1, points_), rows.apply(2, points_), corner, triangle);
            break;
        }
        const Descent d = triangle ? intoTriangle(u, v) : intoQuadrilateral(u, v);
        descend(d.child, d.child < 3 || !triangle ? d.child : 0);
        scale *= d.scale;
    }
    out.point += origin;
    out.normal = unitNormal(out.du, out.dv);
    out.du *= scale;
    out.dv *= scale;
    return out;
}

}  // namespace tessera
