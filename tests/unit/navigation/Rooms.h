/// Houses of thin sheets for a walker, and a judge of where he is that knows nothing of how he got there.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "common/math/Box.h"
#include "server/sim/navigation/Walker.h"

namespace tessera {

/// How often a closed surface goes around a point: 1 within, 0 without. The solid angles of its faces as they are seen
/// from there, in long double (Van Oosterom and Strackee 1983).
inline double windingNumber(const std::vector<Triangle>& closed, const Vec3d& from) {
    using Real = long double;
    using Point = Eigen::Matrix<Real, 3, 1>;
    Real sum = 0;
    for (const Triangle& t : closed) {
        const Point a = (t[0] - from).cast<Real>(), b = (t[1] - from).cast<Real>(), c = (t[2] - from).cast<Real>();
        const Real la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return static_cast<double>(sum / (4 * std::numbers::pi_v<Real>));
}

/// A closed box of sheets without thickness, each face of a grid of triangles whose inner points are shaken along the
/// face.
inline std::vector<Triangle> roomOf(const Box& box, int cells, std::mt19937& random) {
    std::uniform_real_distribution<double> shake(-0.3, 0.3);
    std::vector<Triangle> faces;
    const Vec3d size = box.size();
    for (int axis = 0; axis < 3; ++axis)
        for (const bool high : {false, true}) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            std::vector<Vec3d> points;
            for (int i = 0; i <= cells; ++i)
                for (int j = 0; j <= cells; ++j) {
                    const bool inner = i > 0 && j > 0 && i < cells && j < cells;
                    Vec3d p = high ? box.upper : box.lower;
                    p[u] = box.lower[u] + size[u] * (i + (inner ? shake(random) : 0)) / cells;
                    p[v] = box.lower[v] + size[v] * (j + (inner ? shake(random) : 0)) / cells;
                    points.push_back(p);
                }
            const auto at = [&](int i, int j) { return points[static_cast<std::size_t>(i * (cells + 1) + j)]; };
            for (int i = 0; i < cells; ++i)
                for (int j = 0; j < cells; ++j) {
                    Triangle one = {at(i, j), at(i + 1, j), at(i + 1, j + 1)},
                             other = {at(i, j), at(i + 1, j + 1), at(i, j + 1)};
                    if (!high) {
                        std::swap(one[1], one[2]);
                        std::swap(other[1], other[2]);
                    }
                    faces.push_back(one);
                    faces.push_back(other);
                }
        }
    return faces;
}

/// All faces of a scene that is so small that each is looked at.
inline Surroundings surroundingsOf(const std::vector<Triangle>& faces) {
    return {.facesIn =
                [&faces](const Box& box, std::vector<Triangle>& found) {
                    for (const Triangle& t : faces) {
                        Box around;
                        for (const Vec3d& corner : t) around.extend(corner);
                        if (around.overlaps(box)) found.push_back(t);
                    }
                    return true;
                },
            .hit =
                [&faces](const Ray& ray) {
                    double nearest = std::numeric_limits<double>::infinity();
                    for (const Triangle& t : faces) {
                        const Vec3d n = (t[1] - t[0]).cross(t[2] - t[0]);
                        const double along = n.dot(ray.direction);
                        if (along == 0) continue;
                        const double at = n.dot(t[0] - ray.origin) / along;
                        if (!(at >= 0) || at >= nearest) continue;
                        const Vec3d p = ray.origin + at * ray.direction;
                        bool inside = true;
                        for (std::size_t i = 0; i < 3; ++i)
                            inside = inside && n.dot((t[(i + 1) % 3] - t[i]).cross(p - t[i])) >= 0;
                        if (inside) nearest = at;
                    }
                    return std::optional(nearest);
                }};
}

inline void addBox(std::vector<Triangle>& faces, const Vec3d& lower, const Vec3d& upper) {
    std::mt19937 still;
    Box box;
    box.extend(lower);
    box.extend(upper);
    for (const Triangle& t : roomOf(box, 1, still)) faces.push_back(t);
}

}  // namespace tessera
