/// Grids of heights as meshes, in every order and shape that a height field may come in.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera::terrains {

using Random = std::mt19937_64;

inline double between(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

struct Terrain {
    std::uint32_t columns = 12, rows = 9;  ///< of vertices
    double width = 2, depth = 2;           ///< about the origin
    std::function<double(double, double)> height = [](double, double) { return 0.0; };
    double uneven = 0;  ///< up to 0.9: of a cell's size
    /// Vertices by one of the eight orders; 8: shuffled. Faces likewise; 8: shuffled.
    unsigned vertexOrder = 0, faceOrder = 0;
    int heightAxis = 2;
    /// 0, 1: that diagonal; 2: alternating; 3: any.
    unsigned diagonals = 0;
    bool anyWinding = false;  ///< corners in any order
    double holes = 0;         ///< share of triangles left out
    bool asFloats = true;
};

struct Grid {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    [[nodiscard]] TriangleMesh mesh() const { return *TriangleMesh::make(std::span<const double>(positions), indices); }
};

/// The numbers of a grid's places in one of the eight row-major orders, or in any.
inline std::vector<std::uint32_t> numbers(Random& random, std::uint32_t columns, std::uint32_t rows, unsigned order) {
    std::vector<std::uint32_t> out;
    for (std::uint32_t row = 0; row < rows; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t c = order & 1U ? columns - 1 - column : column, r = order & 2U ? rows - 1 - row : row;
            out.push_back(order & 4U ? c * rows + r : r * columns + c);
        }
    if (order == 8) std::shuffle(out.begin(), out.end(), random);
    return out;
}

inline Grid make(Random& random, const Terrain& t) {
    const auto lines = [&](std::uint32_t count, double size) {
        std::vector<double> out;
        for (std::uint32_t i = 0; i < count; ++i) {
            const double x = size * ((i + (t.uneven > 0 ? between(random, 0, t.uneven) : 0)) / (count - 1) - 0.5);
            out.push_back(t.asFloats ? static_cast<double>(static_cast<float>(x)) : x);
        }
        return out;
    };
    const std::vector<double> xs = lines(t.columns, t.width), ys = lines(t.rows, t.depth);
    const std::vector<std::uint32_t> vertex = numbers(random, t.columns, t.rows, t.vertexOrder);
    Grid out;
    out.positions.resize(3 * vertex.size());
    for (std::uint32_t r = 0; r < t.rows; ++r)
        for (std::uint32_t c = 0; c < t.columns; ++c) {
            const double h = t.height(xs[c], ys[r]);
            const std::size_t at = 3 * std::size_t{vertex[r * t.columns + c]};
            const auto axis = static_cast<std::size_t>(t.heightAxis);
            out.positions[at + (axis + 1) % 3] = xs[c];
            out.positions[at + (axis + 2) % 3] = ys[r];
            out.positions[at + axis] = t.asFloats ? static_cast<double>(static_cast<float>(h)) : h;
        }
    const std::uint32_t across = t.columns - 1, along = t.rows - 1;
    const std::vector<std::uint32_t> cells = numbers(random, across, along, t.faceOrder);
    std::vector<std::array<std::uint32_t, 3>> faces(2 * cells.size());
    for (std::uint32_t r = 0; r < along; ++r)
        for (std::uint32_t c = 0; c < across; ++c) {
            const auto corner = [&](std::uint32_t i) { return vertex[(r + i / 2) * t.columns + c + i % 2]; };
            const bool other =
                t.diagonals == 1 || (t.diagonals == 2 && (r + c) % 2) || (t.diagonals == 3 && random() % 2);
            const std::size_t first = 2 * std::size_t{cells[r * across + c]};
            faces[first] =
                other ? std::array{corner(0), corner(1), corner(2)} : std::array{corner(0), corner(1), corner(3)};
            faces[first + 1] =
                other ? std::array{corner(1), corner(3), corner(2)} : std::array{corner(0), corner(3), corner(2)};
        }
    if (t.faceOrder == 8) std::shuffle(faces.begin(), faces.end(), random);
    for (std::array<std::uint32_t, 3>& face : faces) {
        if (t.holes > 0 && between(random, 0, 1) < t.holes) continue;
        if (t.anyWinding) std::shuffle(face.begin(), face.end(), random);
        out.indices.insert(out.indices.end(), face.begin(), face.end());
    }
    if (out.indices.empty()) out.indices.assign(faces[0].begin(), faces[0].end());
    return out;
}

/// Hills, steps, planes, spikes.
inline std::function<double(double, double)> anyHeights(Random& random) {
    const double steep = between(random, 0.1, 1.5), u = between(random, 1, 6), v = between(random, 1, 6);
    switch (random() % 5) {
        case 0:
            return [=](double x, double y) { return 0.2 * steep * std::sin(u * x) * std::cos(v * y); };
        case 1:
            return [](double, double) { return 0.0; };
        case 2:
            return [=](double x, double y) { return 0.3 * steep * x + 0.2 * y; };
        case 3:
            return [=](double x, double) { return x > 0 ? 0.5 * steep : 0.0; };
        default:
            return [noise = std::make_shared<Random>(random()), steep](double, double) {
                return 0.2 * steep * between(*noise, -1, 1);
            };
    }
}

/// Any of all that.
inline Terrain anyTerrain(Random& random) {
    Terrain t;
    t.columns = 2 + static_cast<std::uint32_t>(random() % 24);
    t.rows = 2 + static_cast<std::uint32_t>(random() % 24);
    t.height = anyHeights(random);
    t.uneven = random() % 2 ? between(random, 0, 0.9) : 0;
    t.vertexOrder = static_cast<unsigned>(random() % 9);
    t.faceOrder = static_cast<unsigned>(random() % 9);
    t.heightAxis = static_cast<int>(random() % 3);
    t.diagonals = static_cast<unsigned>(random() % 4);
    t.anyWinding = random() % 2 == 0;
    t.holes = random() % 3 ? 0 : between(random, 0, 0.6);
    t.asFloats = random() % 3 != 0;
    return t;
}

}  // namespace tessera::terrains
