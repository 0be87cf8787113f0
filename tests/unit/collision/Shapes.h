/// Closed meshes for tests, counter-clockwise seen from outside, centred on the origin.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera::shapes {

struct Soup {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    void vertex(const Vec3d& p) {
        for (int i = 0; i < 3; ++i) positions.push_back(static_cast<float>(p[i]));
    }
    [[nodiscard]] TriangleMesh mesh() const { return *TriangleMesh::make(std::span<const float>(positions), indices); }
};

inline Soup box(const Vec3d& size) {
    Soup soup;
    for (int i = 0; i < 8; ++i)
        soup.vertex(
            Vec3d((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(), (i & 4 ? 0.5 : -0.5) * size.z()));
    soup.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                    2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return soup;
}

/// A sheet in the plane z = 0 of two triangles, seen from +z.
inline Soup sheet(double width, double height) {
    Soup soup;
    for (int i = 0; i < 4; ++i) soup.vertex(Vec3d((i & 1 ? 0.5 : -0.5) * width, (i & 2 ? 0.5 : -0.5) * height, 0));
    soup.indices = {0, 1, 3, 0, 3, 2};
    return soup;
}

inline Soup sphere(double radius, std::uint32_t rings, std::uint32_t segments) {
    Soup soup;
    soup.vertex(Vec3d(0, 0, radius));
    for (std::uint32_t i = 1; i < rings; ++i)
        for (std::uint32_t j = 0; j < segments; ++j) {
            const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / segments;
            soup.vertex(radius *
                        Vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
        }
    soup.vertex(Vec3d(0, 0, -radius));
    const auto at = [&](std::uint32_t ring, std::uint32_t j) { return 1 + (ring - 1) * segments + j % segments; };
    const std::uint32_t south = 1 + (rings - 1) * segments;
    const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        soup.indices.insert(soup.indices.end(), {a, b, c});
    };
    for (std::uint32_t j = 0; j < segments; ++j) {
        face(0, at(1, j), at(1, j + 1));
        for (std::uint32_t i = 1; i + 1 < rings; ++i) {
            face(at(i, j), at(i + 1, j), at(i + 1, j + 1));
            face(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
        face(at(rings - 1, j), south, at(rings - 1, j + 1));
    }
    return soup;
}

}  // namespace tessera::shapes
