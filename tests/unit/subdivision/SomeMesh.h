/// Control meshes for tests: shapes, and shapes with random tags.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <set>

#include "common/freeform/subdivision/ControlMesh.h"

namespace tessera::test {

inline ControlMesh meshOf(std::vector<Vec3d> positions, const std::vector<std::vector<std::uint32_t>>& faces,
                          SubdivisionScheme scheme) {
    ControlMesh mesh{.scheme = scheme};
    mesh.positions = std::move(positions);
    for (const auto& face : faces) {
        mesh.faceSizes.push_back(static_cast<std::uint32_t>(face.size()));
        mesh.faceVertices.insert(mesh.faceVertices.end(), face.begin(), face.end());
    }
    return mesh;
}

/// `columns` × `rows` quadrilaterals, in Loop's scheme each cut in two; closed to a torus or not.
inline ControlMesh gridMesh(std::uint32_t columns, std::uint32_t rows, bool torus, SubdivisionScheme scheme) {
    const std::uint32_t w = torus ? columns : columns + 1, h = torus ? rows : rows + 1;
    std::vector<Vec3d> positions;
    for (std::uint32_t y = 0; y < h; ++y) {
        for (std::uint32_t x = 0; x < w; ++x) positions.emplace_back(x, y, 0.3 * ((x * 7 + y * 3) % 5));
    }
    std::vector<std::vector<std::uint32_t>> faces;
    for (std::uint32_t y = 0; y < rows; ++y) {
        for (std::uint32_t x = 0; x < columns; ++x) {
            const std::uint32_t a = y * w + x, b = y * w + (x + 1) % w, c = (y + 1) % h * w + (x + 1) % w,
                                d = (y + 1) % h * w + x;
            if (scheme == SubdivisionScheme::kLoop) {
                faces.push_back({a, b, c});
                faces.push_back({a, c, d});
            } else {
                faces.push_back({a, b, c, d});
            }
        }
    }
    return meshOf(std::move(positions), faces, scheme);
}

/// Two poles with `valence` faces each: triangles around them; quadrilaterals between them but in Loop's scheme.
inline ControlMesh poleMesh(std::uint32_t valence, SubdivisionScheme scheme) {
    std::vector<Vec3d> positions{{0, 0, 1}, {0, 0, -1}};
    std::vector<std::vector<std::uint32_t>> faces;
    for (std::uint32_t i = 0; i < valence; ++i) {
        const double angle = 6.283185307179586 * i / valence;
        positions.emplace_back(std::cos(angle), std::sin(angle), 0.5);
        positions.emplace_back(1.2 * std::cos(angle), std::sin(angle), -0.5);
        const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % valence);
        faces.push_back({0, a, b});
        faces.push_back({1, b + 1, a + 1});
        if (scheme == SubdivisionScheme::kLoop) {
            faces.push_back({a, a + 1, b + 1});
            faces.push_back({a, b + 1, b});
        } else {
            faces.push_back({a, a + 1, b + 1, b});
        }
    }
    return meshOf(std::move(positions), faces, scheme);
}

/// One of the above, faces taken out, points moved, creases, corners, holes and options at random.
inline ControlMesh someMesh(std::mt19937_64& random) {
    const auto pick = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
    std::uniform_real_distribution<double> some(-1, 1);
    const SubdivisionScheme scheme = pick(2) == 0 ? SubdivisionScheme::kLoop : SubdivisionScheme::kCatmullClark;
    ControlMesh mesh =
        pick(2) == 0 ? gridMesh(3 + pick(3), 3 + pick(3), pick(2) == 0, scheme) : poleMesh(3 + pick(6), scheme);
    // Some faces fewer: boundaries, and places that are no manifold.
    const std::uint32_t removed = pick(3) == 0 ? pick(4) : 0;
    for (std::uint32_t i = 0; i < removed && mesh.faceSizes.size() > 2; ++i) {
        const std::uint32_t face = pick(static_cast<std::uint32_t>(mesh.faceSizes.size()));
        std::ptrdiff_t begin = 0;
        for (std::uint32_t f = 0; f < face; ++f) begin += mesh.faceSizes[f];
        mesh.faceVertices.erase(mesh.faceVertices.begin() + begin,
                                mesh.faceVertices.begin() + begin + mesh.faceSizes[face]);
        mesh.faceSizes.erase(mesh.faceSizes.begin() + face);
    }
    for (Vec3d& p : mesh.positions) p += 0.4 * Vec3d(some(random), some(random), some(random));
    const auto sharpness = [&] { return pick(3) == 0 ? kInfiniteSharpness : static_cast<float>(pick(300)) / 100.0F; };
    const std::uint32_t creases = pick(3) == 0 ? 0 : pick(12);
    for (std::uint32_t i = 0; i < creases; ++i) {
        std::uint32_t face = pick(static_cast<std::uint32_t>(mesh.faceSizes.size())), begin = 0;
        for (std::uint32_t f = 0; f < face; ++f) begin += mesh.faceSizes[f];
        const std::uint32_t side = pick(mesh.faceSizes[face]);
        mesh.creases.push_back({mesh.faceVertices[begin + side],
                                mesh.faceVertices[begin + (side + 1) % mesh.faceSizes[face]], sharpness()});
    }
    for (std::uint32_t i = pick(4); i > 1; --i)
        mesh.corners.push_back({pick(static_cast<std::uint32_t>(mesh.positions.size())), sharpness()});
    if (pick(4) == 0) mesh.holes.push_back(pick(static_cast<std::uint32_t>(mesh.faceSizes.size())));
    mesh.boundary = pick(2) == 0   ? BoundaryInterpolation::kEdgeOnly
                    : pick(6) == 0 ? BoundaryInterpolation::kNone
                                   : BoundaryInterpolation::kEdgeAndCorner;
    mesh.creaseMethod = pick(4) == 0 ? CreaseMethod::kChaikin : CreaseMethod::kUniform;
    mesh.triangles = pick(4) == 0 ? TriangleRule::kSmooth : TriangleRule::kPolygon;
    return mesh;
}

/// Seeds from 1, or that of TESSERA_SEED alone.
struct Seeds {
    std::uint64_t first = 1, count;
    explicit Seeds(std::uint64_t usual) : count(usual) {
        if (const char* one = std::getenv("TESSERA_SEED")) {
            first = std::strtoull(one, nullptr, 10);
            count = 1;
        }
    }
};
#define TESSERA_TRACE_SEED(program, seed) \
    SCOPED_TRACE(::testing::Message() << "TESSERA_SEED=" << (seed) << " build/bin/" program)

/// Somewhere in a ptex face.
inline std::pair<double, double> somePlace(std::mt19937_64& random, bool triangle) {
    std::uniform_real_distribution<double> some(0, 1);
    double u = some(random), v = some(random);
    if (triangle && u + v > 1) std::tie(u, v) = std::pair(1 - u, 1 - v);
    return {u, v};
}

}  // namespace tessera::test
