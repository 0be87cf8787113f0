/// Balls as closed meshes of triangles, so fine that the truth lies between two of them: one that lies in the ball, one
/// that holds it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "common/geometry/Mesh.h"
#include "common/geometry/Points.h"

namespace tessera::test {

/// An icosahedron whose faces are cut in four so many times, corners on the ball of radius 1.
struct FineBall {
    std::vector<Vec3d> corners;
    std::vector<std::uint32_t> indices;
    double within = 1;  ///< the largest ball in it
};

inline const FineBall& fineBall(int level) {
    static std::map<int, FineBall> made;
    FineBall& ball = made[level];
    if (!ball.corners.empty()) return ball;
    if (level == 0) {
        const double g = (1 + std::sqrt(5.0)) / 2;
        for (const Vec3d& c :
             {Vec3d(-1, g, 0), Vec3d(1, g, 0), Vec3d(-1, -g, 0), Vec3d(1, -g, 0), Vec3d(0, -1, g), Vec3d(0, 1, g),
              Vec3d(0, -1, -g), Vec3d(0, 1, -g), Vec3d(g, 0, -1), Vec3d(g, 0, 1), Vec3d(-g, 0, -1), Vec3d(-g, 0, 1)})
            ball.corners.push_back(c.normalized());
        ball.indices = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                        4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                        6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
    } else {
        const FineBall& coarser = fineBall(level - 1);
        ball.corners = coarser.corners;
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, isNew] =
                middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(ball.corners.size()));
            if (isNew) ball.corners.push_back((ball.corners[a] + ball.corners[b]).normalized());
            return at->second;
        };
        for (std::size_t i = 0; i < coarser.indices.size(); i += 3) {
            const std::uint32_t a = coarser.indices[i], b = coarser.indices[i + 1], c = coarser.indices[i + 2];
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            ball.indices.insert(ball.indices.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
        }
    }
    for (std::size_t i = 0; i < ball.indices.size(); i += 3) {
        const Vec3d &a = ball.corners[ball.indices[i]], &b = ball.corners[ball.indices[i + 1]],
                    &c = ball.corners[ball.indices[i + 2]];
        ball.within = std::min(ball.within, std::abs((b - a).cross(c - a).normalized().dot(a)));
    }
    return ball;
}

/// The coarsest that is nowhere farther off than `most` of its radius.
inline int levelFor(double most) {
    int level = 1;
    while (level < 7 && 1 - fineBall(level).within > most) ++level;
    return level;
}

/// Points as such balls, of the point's colour, normal and texture coordinates. `radiusOf`: of each, by its number,
/// that of the mesh's corners; 0: it is left away.
template <typename RadiusOf>
MeshData ballsOf(const MeshData& points, int level, const RadiusOf& radiusOf) {
    const FineBall& ball = fineBall(level);
    MeshData mesh;
    const std::size_t count = points.positions.size() / 3;
    const auto repeat = [](const auto& from, auto& to, std::size_t width, std::size_t i) {
        if (!from.empty())
            to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(width * i),
                      from.begin() + static_cast<std::ptrdiff_t>(width * (i + 1)));
    };
    for (std::size_t i = 0; i < count; ++i) {
        const double radius = radiusOf(i);
        if (!(radius > 0)) continue;
        const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
        for (const Vec3d& corner : ball.corners) {
            for (int k = 0; k < 3; ++k)
                mesh.positions.push_back(static_cast<float>(
                    double{points.positions[3 * i + static_cast<std::size_t>(k)]} + radius * corner[k]));
            if (points.normals.empty())
                for (int k = 0; k < 3; ++k) mesh.normals.push_back(static_cast<float>(corner[k]));
            repeat(points.normals, mesh.normals, 3, i);
            repeat(points.colors, mesh.colors, 4, i);
            repeat(points.texcoords, mesh.texcoords, 2, i);
            repeat(points.texcoords1, mesh.texcoords1, 2, i);
        }
        for (const std::uint32_t index : ball.indices) mesh.indices.push_back(first + index);
    }
    return mesh;
}

}  // namespace tessera::test
