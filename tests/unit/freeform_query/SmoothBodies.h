/// Bodies for tests of freeform queries, and what is known of them without these queries: closed forms, and points of
/// limit surfaces.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "common/freeform/nurbs/NurbsShapes.h"
#include "common/freeform/subdivision/LimitEvaluator.h"
#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera::test {

/// `TESSERA_SEED=N` repeats one.
inline std::vector<std::uint64_t> seedsOf(std::uint64_t count) {
    if (const char* one = std::getenv("TESSERA_SEED")) return {std::strtoull(one, nullptr, 10)};
    std::vector<std::uint64_t> seeds(count);
    for (std::uint64_t i = 0; i < count; ++i) seeds[i] = i;
    return seeds;
}
inline std::string repeat(std::uint64_t seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_freeform_query";
}

struct Chance {
    std::mt19937_64 engine;
    explicit Chance(std::uint64_t seed) : engine(seed) {}
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
    }
    Vec3d direction() {
        for (;;) {
            const Vec3d d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
            if (d.norm() > 0.1 && d.norm() <= 1) return d.normalized();
        }
    }
    Quatd rotation() { return Quatd(Eigen::AngleAxisd(uniform(0, 3.14159), direction())); }
};

inline FreeformShape sphere(double radius) {
    return FreeformShape::ofNurbs({sphereSurface(radius).value()}).value();
}

/// A cage of quads around a ball: `rings` along each edge of a cube, pushed about. Corners are of valence 3, and so
/// irregular.
inline ControlMesh lumpyCube(Chance& chance, int rings, double roughness) {
    ControlMesh mesh;
    std::vector<std::array<int, 3>> keys;
    const auto vertex = [&](int x, int y, int z) {
        for (std::size_t i = 0; i < keys.size(); ++i)
            if (keys[i] == std::array<int, 3>{x, y, z}) return static_cast<std::uint32_t>(i);
        keys.push_back({x, y, z});
        const Vec3d p = Vec3d(x, y, z) / rings * 2 - Vec3d::Ones();
        mesh.positions.push_back(p.normalized() * chance.uniform(1 - roughness, 1 + roughness));
        return static_cast<std::uint32_t>(keys.size() - 1);
    };
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {0, rings})
            for (int j = 0; j < rings; ++j)
                for (int i = 0; i < rings; ++i) {
                    const auto at = [&](int u, int v) {
                        std::array<int, 3> k{};
                        k[static_cast<std::size_t>(axis)] = side;
                        k[static_cast<std::size_t>((axis + 1) % 3)] = u;
                        k[static_cast<std::size_t>((axis + 2) % 3)] = v;
                        return vertex(k[0], k[1], k[2]);
                    };
                    std::array<std::uint32_t, 4> quad{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
                    if (side == 0) std::swap(quad[1], quad[3]);
                    mesh.faceSizes.push_back(4);
                    mesh.faceVertices.insert(mesh.faceVertices.end(), quad.begin(), quad.end());
                }
    return mesh;
}

/// Each quad into two triangles, for Loop's scheme.
inline ControlMesh asTriangles(const ControlMesh& quads) {
    ControlMesh mesh;
    mesh.scheme = SubdivisionScheme::kLoop;
    mesh.positions = quads.positions;
    for (std::size_t f = 0; f < quads.faceSizes.size(); ++f) {
        const std::uint32_t* q = quads.faceVertices.data() + 4 * f;
        mesh.faceVertices.insert(mesh.faceVertices.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
        mesh.faceSizes.insert(mesh.faceSizes.end(), {3, 3});
    }
    return mesh;
}

/// Points of the limit surface on a grid of n × n in each ptex face, as triangles; and how far the surface is from
/// these, as its points at the middles of triangles and of their long sides tell: twice the largest, since between them
/// it can be farther.
struct Tessellation {
    TriangleMesh mesh;
    double error = 0;
};
inline Tessellation tessellate(const ControlMesh& control, int n) {
    const SubdivisionTopology topology = SubdivisionTopology::build(control).value();
    LimitEvaluator evaluator(topology);
    const bool loop = control.scheme == SubdivisionScheme::kLoop;
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    double error = 0;
    for (std::uint32_t f = 0; f < topology.ptexFaceCount(); ++f) {
        if (!topology.hasSurface(topology.ptexFace(f).face)) continue;
        const auto at = [&](double i, double j) {
            return evaluator.evaluate(control.positions, {f, i / n, j / n}).value().point;
        };
        const auto base = static_cast<std::uint32_t>(positions.size() / 3);
        std::vector<Vec3d> points;
        std::vector<std::uint32_t> row;  // where each row begins
        for (int j = 0; j <= n; ++j) {
            row.push_back(static_cast<std::uint32_t>(points.size()));
            for (int i = 0; i <= (loop ? n - j : n); ++i) points.push_back(at(i, j));
        }
        const auto triangle = [&](std::array<std::uint32_t, 3> t, const std::array<Vec2d, 3>& where) {
            for (const std::uint32_t v : t) indices.push_back(base + v);
            for (const std::size_t k : {std::size_t{1}, std::size_t{3}}) {
                const Vec2d uv =
                    k == 3 ? Vec2d((where[0] + where[1] + where[2]) / 3) : Vec2d((where[k] + where[(k + 1) % 3]) / 2);
                const Vec3d flat = k == 3 ? Vec3d((points[t[0]] + points[t[1]] + points[t[2]]) / 3)
                                          : Vec3d((points[t[k]] + points[t[(k + 1) % 3]]) / 2);
                error = std::max(error, (at(uv.x(), uv.y()) - flat).norm());
            }
        };
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < (loop ? n - j : n); ++i) {
                const std::uint32_t a = row[static_cast<std::size_t>(j)] + static_cast<std::uint32_t>(i),
                                    c = row[static_cast<std::size_t>(j) + 1] + static_cast<std::uint32_t>(i);
                triangle({a, a + 1, c}, {Vec2d(i, j), Vec2d(i + 1, j), Vec2d(i, j + 1)});
                if (!loop || i + j + 1 < n)
                    triangle({a + 1, c + 1, c}, {Vec2d(i + 1, j), Vec2d(i + 1, j + 1), Vec2d(i, j + 1)});
            }
        for (const Vec3d& p : points) positions.insert(positions.end(), {p.x(), p.y(), p.z()});
    }
    return {TriangleMesh::make(std::span<const double>(positions), indices).value(), 2 * error};
}

}  // namespace tessera::test
