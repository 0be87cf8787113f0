/// Small bodies, and brute force over every pair of their faces.
#pragma once

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera::bodies {

class Body {
public:
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;

    std::uint32_t vertex(const Vec3d& p) {
        positions.insert(positions.end(), {p.x(), p.y(), p.z()});
        return static_cast<std::uint32_t>(positions.size() / 3 - 1);
    }
    void face(std::uint32_t a, std::uint32_t b, std::uint32_t c) { indices.insert(indices.end(), {a, b, c}); }
    [[nodiscard]] TriangleMesh mesh() const { return *TriangleMesh::make(std::span<const double>(positions), indices); }
    /// Built when first asked for.
    [[nodiscard]] const TriangleTree& tree() const {
        if (!tree_) tree_ = std::make_shared<TriangleTree>(mesh());
        return *tree_;
    }
    [[nodiscard]] Body moved(const Vec3d& by) const {
        Body out;
        for (std::size_t i = 0; i < positions.size(); ++i)
            out.positions.push_back(positions[i] + by[static_cast<int>(i % 3)]);
        out.indices = indices;
        return out;
    }
    [[nodiscard]] Body with(const Body& other) const {
        Body out;
        out.positions = positions;
        out.indices = indices;
        const auto first = static_cast<std::uint32_t>(positions.size() / 3);
        out.positions.insert(out.positions.end(), other.positions.begin(), other.positions.end());
        for (const std::uint32_t i : other.indices) out.indices.push_back(first + i);
        return out;
    }

private:
    mutable std::shared_ptr<TriangleTree> tree_;
};

inline Body box(const Vec3d& size) {
    Body out;
    for (int i = 0; i < 8; ++i)
        out.vertex(
            Vec3d((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(), (i & 4 ? 0.5 : -0.5) * size.z()));
    out.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                   2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return out;
}

inline Body sheet(double width, double height) {
    Body out;
    for (int i = 0; i < 4; ++i) out.vertex(Vec3d((i & 1 ? 0.5 : -0.5) * width, (i & 2 ? 0.5 : -0.5) * height, 0));
    out.indices = {0, 1, 3, 0, 3, 2};
    return out;
}

/// A sheet of n by n squares in the plane z = 0.
inline Body grid(std::uint32_t n, double size) {
    Body out;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t j = 0; j <= n; ++j)
            out.vertex(Vec3d(size * i / n - 0.5 * size, size * j / n - 0.5 * size, 0));
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            const std::uint32_t v = i * (n + 1) + j;
            out.face(v, v + n + 1, v + n + 2);
            out.face(v, v + n + 2, v + 1);
        }
    return out;
}

/// Poles on the z axis.
inline Body sphere(double radius, std::uint32_t rings, std::uint32_t segments) {
    Body out;
    out.vertex(Vec3d(0, 0, radius));
    for (std::uint32_t i = 1; i < rings; ++i)
        for (std::uint32_t j = 0; j < segments; ++j) {
            const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / segments;
            out.vertex(radius *
                       Vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
        }
    const std::uint32_t south = out.vertex(Vec3d(0, 0, -radius));
    const auto at = [&](std::uint32_t ring, std::uint32_t j) { return 1 + (ring - 1) * segments + j % segments; };
    for (std::uint32_t j = 0; j < segments; ++j) {
        out.face(0, at(1, j), at(1, j + 1));
        for (std::uint32_t i = 1; i + 1 < rings; ++i) {
            out.face(at(i, j), at(i + 1, j), at(i + 1, j + 1));
            out.face(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
        out.face(at(rings - 1, j), south, at(rings - 1, j + 1));
    }
    return out;
}

/// About the z axis.
inline Body torus(double radius, double thickness, std::uint32_t n, std::uint32_t m) {
    Body out;
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j) {
            const double phi = 2 * std::numbers::pi * i / n, psi = 2 * std::numbers::pi * j / m;
            const double r = radius + thickness * std::cos(psi);
            out.vertex(Vec3d(r * std::cos(phi), r * std::sin(phi), thickness * std::sin(psi)));
        }
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return i % n * m + j % m; };
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j) {
            out.face(at(i, j), at(i + 1, j), at(i + 1, j + 1));
            out.face(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
    return out;
}

/// Triangles of their own, segments and points among them, within a cube of side 2.
inline Body soup(std::mt19937& random, int faces) {
    std::uniform_real_distribution<double> u(-1, 1);
    Body out;
    for (int i = 0; i < faces; ++i) {
        const Vec3d middle = 0.7 * Vec3d(u(random), u(random), u(random));
        const std::uint32_t a = out.vertex(middle + 0.3 * Vec3d(u(random), u(random), u(random)));
        const std::uint32_t b = out.vertex(middle + 0.3 * Vec3d(u(random), u(random), u(random)));
        const std::uint32_t c = out.vertex(middle + 0.3 * Vec3d(u(random), u(random), u(random)));
        out.face(a, i % 7 == 3 ? a : b, i % 5 == 2 ? a : c);
    }
    return out;
}

inline std::filesystem::path dataFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data";
}

/// `v` and `f` lines of a Wavefront OBJ, polygons fanned.
inline Body readObj(const std::filesystem::path& file) {
    Body out;
    std::ifstream in(file);
    std::string line, word;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        word.clear();
        words >> word;
        if (word == "v") {
            double x = 0, y = 0, z = 0;
            words >> x >> y >> z;
            out.vertex(Vec3d(x, y, z));
        } else if (word == "f") {
            std::vector<std::uint32_t> corners;
            while (words >> word) corners.push_back(static_cast<std::uint32_t>(std::stoul(word) - 1));
            for (std::size_t i = 2; i < corners.size(); ++i) out.face(corners[0], corners[i - 1], corners[i]);
        }
    }
    return out;
}

inline std::vector<Triangle> facesOf(const TriangleMesh& mesh, const Affine3d& pose) {
    std::vector<Triangle> out;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) out.push_back(transformed(pose, mesh.triangle(f)));
    return out;
}

inline Box boxOf(const Triangle& t) {
    Box box;
    for (const Vec3d& p : t) box.extend(p);
    return box;
}

/// By the exact predicate on every pair of faces whose boxes overlap.
inline bool touching(const std::vector<Triangle>& a, const std::vector<Triangle>& b) {
    std::vector<Box> boxes;
    for (const Triangle& t : b) boxes.push_back(boxOf(t));
    for (const Triangle& t : a) {
        const Box box = boxOf(t);
        for (std::size_t j = 0; j < b.size(); ++j)
            if (box.overlaps(boxes[j]) && trianglesIntersect(t, b[j])) return true;
    }
    return false;
}
inline bool touching(const Body& a, const Affine3d& poseA, const Body& b, const Affine3d& poseB) {
    return touching(facesOf(a.mesh(), poseA), facesOf(b.mesh(), poseB));
}

/// The least over all pairs of faces; 0 where two meet.
inline double distance(const std::vector<Triangle>& a, const std::vector<Triangle>& b) {
    double least = std::numeric_limits<double>::infinity();
    for (const Triangle& x : a)
        for (const Triangle& y : b) least = std::min(least, nearestPoints(x, y).distance);
    return touching(a, b) ? 0 : least;
}
inline double distance(const Body& a, const Affine3d& poseA, const Body& b, const Affine3d& poseB) {
    return distance(facesOf(a.mesh(), poseA), facesOf(b.mesh(), poseB));
}

}  // namespace tessera::bodies
