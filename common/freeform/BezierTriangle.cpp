#include "common/freeform/BezierTriangle.h"

namespace tessera {
namespace {

/// One step of de Casteljau's algorithm in place; the degree is one lower afterwards.
void triangleStep(std::vector<Vec3d>& points, int degree, double u, double v) {
    const double w = 1 - u - v;
    for (int j = 0; j < degree; ++j) {
        for (int i = 0; i + j < degree; ++i) {
            const Vec3d mixed = w * points[BezierTriangle::index(degree, i, j)] +
                                u * points[BezierTriangle::index(degree, i + 1, j)] +
                                v * points[BezierTriangle::index(degree, i, j + 1)];
            // Rows become shorter, so what is written lies at or before what was read.
            points[BezierTriangle::index(degree - 1, i, j)] = mixed;
        }
    }
}

}  // namespace

Box boxOf(const BezierTriangle& triangle) {
    Box box;
    for (const Vec3d& p : triangle.points) box.extend(p);
    return box;
}

SurfacePoint evaluate(const BezierTriangle& triangle, double u, double v) {
    SurfacePoint out;
    if (triangle.degree < 1) {
        out.point = triangle.points.front();
        return out;
    }
    std::vector<Vec3d> points = triangle.points;
    for (int degree = triangle.degree; degree > 1; --degree) triangleStep(points, degree, u, v);
    out.point = (1 - u - v) * points[0] + u * points[1] + v * points[2];
    out.du = triangle.degree * (points[1] - points[0]);
    out.dv = triangle.degree * (points[2] - points[0]);
    const Vec3d across = out.du.cross(out.dv);
    const double area = across.norm();
    if (area > 1e-10 * out.du.norm() * out.dv.norm()) out.normal = across / area;
    return out;
}

BezierTriangle partOf(const BezierTriangle& triangle, const std::array<Vec2d, 3>& corners) {
    // Each point is the blossom at as many of each corner as its indices say.
    BezierTriangle out = triangle;
    std::vector<Vec3d> points;
    for (int j = 0; j <= triangle.degree; ++j) {
        for (int i = 0; i + j <= triangle.degree; ++i) {
            points = triangle.points;
            for (int step = 0; step < triangle.degree; ++step) {
                const Vec2d& c = corners[step < i ? 1 : step < i + j ? 2 : 0];
                triangleStep(points, triangle.degree - step, c.x(), c.y());
            }
            out.at(i, j) = points[0];
        }
    }
    return out;
}

std::array<BezierTriangle, 4> split(const BezierTriangle& triangle) {
    const Vec2d a(0, 0), b(1, 0), c(0, 1), ab(0.5, 0), bc(0.5, 0.5), ca(0, 0.5);
    return {partOf(triangle, {a, ab, ca}), partOf(triangle, {ab, b, bc}), partOf(triangle, {ca, bc, c}),
            partOf(triangle, {bc, ca, ab})};
}

}  // namespace tessera
