/// Meshes and maps that fields find hard, from a seed.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

class FieldRandom {
public:
    explicit FieldRandom(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    unsigned below(unsigned n) { return static_cast<unsigned>(engine_() % n); }
    Vec3d inBox(double half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }
    Quatd rotation() {
        Quatd q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        return q.norm() < 1e-3 ? Quatd::Identity() : q.normalized();
    }

private:
    std::mt19937_64 engine_;
};

struct FieldMesh {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;

    void corner(const Vec3d& p) {
        indices.push_back(static_cast<std::uint32_t>(positions.size() / 3));
        positions.insert(positions.end(), {p[0], p[1], p[2]});
    }
    void triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        corner(a);
        corner(b);
        corner(c);
    }
    [[nodiscard]] TriangleMesh make() const {
        return TriangleMesh::make(std::span<const double>(positions), indices).value();
    }
};

/// A surface over angles: rings × 2 rings quads, radius as told.
template <typename Radius>
FieldMesh ballLike(unsigned rings, const Radius& radius) {
    FieldMesh mesh;
    const auto at = [&](unsigned i, unsigned j) {
        const double a = std::numbers::pi * i / rings, b = std::numbers::pi * (j % (2 * rings)) / rings;
        const Vec3d d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
        return Vec3d(radius(d) * d);
    };
    for (unsigned i = 0; i < rings; ++i)
        for (unsigned j = 0; j < 2 * rings; ++j) {
            if (i > 0) mesh.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
            if (i + 1 < rings) mesh.triangle(at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
        }
    return mesh;
}

inline FieldMesh torus(unsigned rings, double thick) {
    FieldMesh mesh;
    const auto at = [&](unsigned i, unsigned j) {
        const double a = 2 * std::numbers::pi * (i % (2 * rings)) / (2 * rings),
                     b = 2 * std::numbers::pi * (j % rings) / rings;
        return Vec3d((1 + thick * std::cos(b)) * std::cos(a), (1 + thick * std::cos(b)) * std::sin(a),
                     thick * std::sin(b));
    };
    for (unsigned i = 0; i < 2 * rings; ++i)
        for (unsigned j = 0; j < rings; ++j) {
            mesh.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
            mesh.triangle(at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
        }
    return mesh;
}

inline constexpr unsigned kFieldMeshKinds = 10;

/// Each kind of mesh that the field has to take: star-shaped, with a handle, long, flat, open, soup, large beside small
/// triangles, through the centre, without area, on a coarse grid of numbers (where everything touches).
inline TriangleMesh fieldMesh(unsigned kind, FieldRandom& random) {
    FieldMesh mesh;
    switch (kind % kFieldMeshKinds) {
        case 0:
            return ballLike(8 + random.below(8),
                            [](const Vec3d& d) { return 1 + 0.2 * std::sin(5 * d[0]) * std::cos(4 * d[1]); })
                .make();
        case 1:
            return torus(6 + random.below(6), random.uniform(0.1, 0.6)).make();
        case 2: {
            mesh = ballLike(12, [](const Vec3d&) { return 1.0; });
            const double stretch = random.uniform(5, 30);
            for (std::size_t i = 0; i < mesh.positions.size(); i += 3) mesh.positions[i] *= stretch;
            return mesh.make();
        }
        case 3:
            mesh = ballLike(10, [](const Vec3d&) { return 1.0; });
            for (std::size_t i = 0; i < mesh.positions.size(); i += 3) mesh.positions[i + 1] *= 1e-4;
            return mesh.make();
        case 4:
            for (unsigned i = 0; i < 14; ++i)
                for (unsigned j = 0; j < 14; ++j) {
                    const auto at = [&](unsigned x, unsigned y) {
                        return Vec3d(x / 7.0 - 1, y / 7.0 - 1, 0.3 * std::sin(0.7 * x) * std::cos(0.5 * y));
                    };
                    mesh.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
                    if ((i + j) % 5 != 0) mesh.triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                }
            return mesh.make();
        case 5:
            for (int i = 0; i < 300; ++i) {
                const Vec3d p = random.inBox(1);
                mesh.triangle(p, p + random.inBox(0.2), p + random.inBox(0.2));
            }
            return mesh.make();
        case 6:
            mesh = ballLike(10, [](const Vec3d&) { return 0.4; });
            for (int i = 0; i < 6; ++i) mesh.triangle(random.inBox(2), random.inBox(2), random.inBox(2));
            return mesh.make();
        case 7:
            for (int i = 0; i < 40; ++i) {
                const Vec3d p = random.inBox(1), q = random.inBox(1);
                mesh.triangle(p, q, -(p + q));  // its middle is the origin
                mesh.triangle(Vec3d::Zero(), p, q);
            }
            return mesh.make();
        case 8:
            for (int i = 0; i < 60; ++i) {
                const Vec3d p = random.inBox(1), q = random.inBox(1);
                if (i % 3 == 0)
                    mesh.triangle(p, p, p);
                else if (i % 3 == 1)
                    mesh.triangle(p, q, p);
                else
                    mesh.triangle(p, p + 0.5 * (q - p), q);
            }
            return mesh.make();
        default:
            for (int i = 0; i < 150; ++i) {
                const auto grid = [&] { return Vec3d(random.below(5), random.below(5), random.below(5)); };
                mesh.triangle(grid(), grid(), grid());
            }
            return mesh.make();
    }
}

enum class FieldMap { kRigid, kScaled, kMirrored, kStretched, kOnGrid, kFar };
inline constexpr unsigned kFieldMaps = 6;

inline Affine3d fieldMap(FieldMap kind, FieldRandom& random) {
    Affine3d m = Affine3d::Identity();
    m.linear() = random.rotation().toRotationMatrix();
    m.translation() = random.inBox(1.5);
    switch (kind) {
        case FieldMap::kRigid:
            break;
        case FieldMap::kScaled:
            m.linear() *= std::pow(10, random.uniform(-2, 2));
            break;
        case FieldMap::kMirrored:
            m.linear() *= Vec3d(-random.uniform(0.5, 2), 1, 1).asDiagonal();
            break;
        case FieldMap::kStretched:
            m.linear() *= Vec3d(random.uniform(0.01, 3), random.uniform(0.3, 3), 1).asDiagonal();
            break;
        case FieldMap::kOnGrid:
            m.linear() = Mat3d::Identity();
            m.translation() = Vec3d(random.below(3), random.below(3), random.below(3));
            break;
        case FieldMap::kFar:
            m.translation() *= 1e4;
            break;
    }
    return m;
}

}  // namespace tessera
