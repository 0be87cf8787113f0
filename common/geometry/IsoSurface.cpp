#include "common/geometry/IsoSurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace tessera {
namespace {

using Place = std::array<std::ptrdiff_t, 3>;

/// Directions of edges from their lower end: a bit per axis. 0: no edge, a voxel itself.
constexpr std::size_t kEdgeDirections = 8;

/// Corners of the six tetrahedra of a cell, a bit per axis; those of an odd permutation of the axes are turned around.
struct Tetrahedron {
    std::array<unsigned, 4> corners;
    bool odd;
};
constexpr std::array<Tetrahedron, 6> kTetrahedra = {{{{0, 1, 3, 7}, false},
                                                     {{0, 2, 6, 7}, false},
                                                     {{0, 4, 5, 7}, false},
                                                     {{0, 1, 5, 7}, true},
                                                     {{0, 2, 3, 7}, true},
                                                     {{0, 4, 6, 7}, true}}};

template <typename Number>
class IsoSurfaceMaker {
public:
    IsoSurfaceMaker(const VoxelGrid& grid, double value, std::size_t mostTriangles)
        : grid_(grid),
          value_(value),
          most_(mostTriangles),
          nx_(static_cast<std::ptrdiff_t>(grid.size[0])),
          ny_(static_cast<std::ptrdiff_t>(grid.size[1])),
          nz_(static_cast<std::ptrdiff_t>(grid.size[2])) {
        for (auto& layer : layers_) layer.assign(static_cast<std::size_t>(nx_ * ny_) * kEdgeDirections, kNone);
    }

    Expected<MeshData> make() {
        // One cell more on each side, flat, in which nothing is: what closes the surface.
        for (std::ptrdiff_t z = -1; z < nz_; ++z) {
            for (std::ptrdiff_t y = -1; y < ny_; ++y) cellsOfRow(y, z);
            if (mesh_.indices.size() / 3 > most_)
                return fail(ErrorCode::kLimit,
                            fmt::format("the surface at {} has more than {} triangles", value_, most_));
            // The upper layer becomes the lower one.
            std::swap(layers_[0], layers_[1]);
            std::fill(layers_[1].begin(), layers_[1].end(), kNone);
        }
        return std::move(mesh_);
    }

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    [[nodiscard]] bool within(const Place& p) const {
        return p[0] >= 0 && p[0] < nx_ && p[1] >= 0 && p[1] < ny_ && p[2] >= 0 && p[2] < nz_;
    }
    [[nodiscard]] std::size_t indexOf(const Place& p) const {
        return static_cast<std::size_t>((p[2] * ny_ + p[1]) * nx_ + p[0]);
    }
    [[nodiscard]] double valueAt(const Place& p) const {
        Number number;
        std::memcpy(&number, grid_.voxels.data() + indexOf(p) * sizeof(Number), sizeof(Number));
        return static_cast<double>(number);
    }
    [[nodiscard]] bool inside(const Place& p) const { return within(p) && valueAt(p) >= value_; }

    void cellsOfRow(std::ptrdiff_t y, std::ptrdiff_t z) {
        // Which of the corners at x are inside; those at x + 1 become them.
        const auto column = [&](std::ptrdiff_t x) {
            unsigned bits = 0;
            for (unsigned corner = 0; corner < 8; corner += 2)
                if (inside({x, y + ((corner >> 1) & 1), z + ((corner >> 2) & 1)})) bits |= 1u << corner;
            return bits;
        };
        unsigned left = column(-1);
        for (std::ptrdiff_t x = -1; x < nx_; ++x) {
            const unsigned right = column(x + 1), corners = left | (right << 1);
            left = right;
            if (corners != 0 && corners != 0xffu) cell({x, y, z}, corners);
        }
    }

    void cell(const Place& base, unsigned insideBits) {
        // A cell beyond the border belongs to a face of the box.
        int face = -1;
        const Place last = {nx_ - 1, ny_ - 1, nz_ - 1};
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            if (base[a] == -1) face = 2 * axis;
            if (base[a] == last[a]) face = 2 * axis + 1;
        }
        for (const Tetrahedron& tetrahedron : kTetrahedra) tetra(base, tetrahedron, insideBits, face);
    }

    void tetra(const Place& base, const Tetrahedron& t, unsigned insideBits, int face) {
        unsigned in = 0;
        for (unsigned i = 0; i < 4; ++i) in |= ((insideBits >> t.corners[i]) & 1u) << i;
        if (in == 0 || in == 15) return;
        // Even permutations of the corners: the first one, or the first two, are on a side of their own.
        static constexpr std::array<std::array<unsigned, 4>, 4> kOne = {
            {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}}};
        static constexpr std::array<std::array<unsigned, 4>, 6> kTwo = {
            {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}}};
        const auto vertex = [&](unsigned a, unsigned b) {
            return (in >> a & 1u) != 0 ? vertexBetween(base, t.corners[a], t.corners[b], face)
                                       : vertexBetween(base, t.corners[b], t.corners[a], face);
        };
        for (const auto& [i, j, k, l] : kOne) {
            const bool alone = in == (1u << i), allButOne = in == (15u & ~(1u << i));
            if (!alone && !allButOne) continue;
            triangle(vertex(i, j), vertex(i, k), vertex(i, l), t.odd != allButOne);
            return;
        }
        for (const auto& [i, j, k, l] : kTwo) {
            if (in != ((1u << i) | (1u << j)) && in != ((1u << k) | (1u << l))) continue;
            const bool turned = in == ((1u << k) | (1u << l));
            const std::array<std::uint32_t, 4> quad = {vertex(i, k), vertex(i, l), vertex(j, l), vertex(j, k)};
            triangle(quad[0], quad[1], quad[2], t.odd != turned);
            triangle(quad[0], quad[2], quad[3], t.odd != turned);
            return;
        }
    }

    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool turned) {
        if (a == b || b == c || c == a) return;  // it has shrunk to an edge, whose other side has too
        if (turned) std::swap(b, c);
        mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
    }

    [[nodiscard]] static Place cornerOf(const Place& base, unsigned corner) {
        return {base[0] + static_cast<std::ptrdiff_t>(corner & 1u),
                base[1] + static_cast<std::ptrdiff_t>(corner >> 1 & 1u),
                base[2] + static_cast<std::ptrdiff_t>(corner >> 2 & 1u)};
    }

    /// Where the field has the value between a corner inside and one that is not.
    std::uint32_t vertexBetween(const Place& base, unsigned insideCorner, unsigned outsideCorner, int face) {
        const Place from = cornerOf(base, insideCorner), to = cornerOf(base, outsideCorner);
        double share = 0;
        if (within(to)) {
            const double a = valueAt(from), b = valueAt(to);
            share = (a - value_) / (a - b);
        }
        // At a voxel itself there is one vertex, whatever edge leads there.
        Place key = from;
        unsigned direction = 0;
        if (share > 0) {
            direction = insideCorner ^ outsideCorner;
            for (std::size_t axis = 0; axis < 3; ++axis) key[axis] = std::min(from[axis], to[axis]);
        }
        const std::size_t of = indexOf(key) * kEdgeDirections + direction;
        std::uint32_t& known = face >= 0
                                   ? caps_.try_emplace(of * 6 + static_cast<std::size_t>(face), kNone).first->second
                                   : layers_[static_cast<std::size_t>(key[2] - base[2])][of % layers_[0].size()];
        if (known != kNone) return known;
        known = static_cast<std::uint32_t>(mesh_.positions.size() / 3);
        Vec3d normal = Vec3d::Zero();
        if (face >= 0) {
            normal[face / 2] = face % 2 == 0 ? -1 : 1;
        } else {
            normal = -((1 - share) * gradientAt(from) + share * gradientAt(to));
            const double length = normal.norm();
            // None where the field is flat: a triangle's own then.
            if (length > 0 && std::isfinite(length))
                normal /= length;
            else
                normal = Vec3d::Zero();
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double step = static_cast<double>(from[axis]) +
                                (share > 0 ? share * static_cast<double>(to[axis] - from[axis]) : 0.0);
            const auto a = static_cast<Eigen::Index>(axis);
            mesh_.positions.push_back(static_cast<float>(grid_.origin[a] + grid_.spacing[a] * step));
            mesh_.normals.push_back(static_cast<float>(normal[a]));
        }
        return known;
    }

    /// Central differences, one-sided at the border.
    [[nodiscard]] Vec3d gradientAt(const Place& p) const {
        Vec3d gradient;
        const Place last = {nx_ - 1, ny_ - 1, nz_ - 1};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Place before = p, after = p;
            before[axis] = std::max<std::ptrdiff_t>(0, p[axis] - 1);
            after[axis] = std::min(last[axis], p[axis] + 1);
            const auto a = static_cast<Eigen::Index>(axis);
            gradient[a] = (valueAt(after) - valueAt(before)) /
                          (static_cast<double>(after[axis] - before[axis]) * grid_.spacing[a]);
        }
        return gradient;
    }

    const VoxelGrid& grid_;
    double value_;
    std::size_t most_;
    std::ptrdiff_t nx_, ny_, nz_;
    MeshData mesh_;
    std::array<std::vector<std::uint32_t>, 2>
        layers_;  ///< vertices of the layers below and above the cells, by lower end and direction
    std::unordered_map<std::size_t, std::uint32_t> caps_;
};

}  // namespace

double VoxelGrid::at(std::size_t x, std::size_t y, std::size_t z) const {
    const std::byte* from = voxels.data() + ((z * size[1] + y) * size[0] + x) * bytesOf(format);
    const auto read = [from](auto number) {
        std::memcpy(&number, from, sizeof number);
        return static_cast<double>(number);
    };
    switch (format) {
        case VoxelFormat::kUint8:
            return read(std::uint8_t{});
        case VoxelFormat::kUint16:
            return read(std::uint16_t{});
        case VoxelFormat::kInt16:
            return read(std::int16_t{});
        case VoxelFormat::kFloat:
            break;
    }
    return read(float{});
}

double VoxelGrid::linearAt(const Vec3d& steps) const {
    std::array<std::size_t, 3> lower{};
    Vec3d share;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        const double step = std::clamp(steps[a], 0.0, static_cast<double>(size[axis] - 1));
        lower[axis] = std::min(static_cast<std::size_t>(step), size[axis] - 2);
        share[a] = step - static_cast<double>(lower[axis]);
    }
    double sum = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        double weight = 1;
        for (unsigned axis = 0; axis < 3; ++axis) {
            const double s = share[static_cast<Eigen::Index>(axis)];
            weight *= (corner >> axis & 1u) != 0 ? s : 1 - s;
        }
        sum += weight * at(lower[0] + (corner & 1u), lower[1] + (corner >> 1 & 1u), lower[2] + (corner >> 2 & 1u));
    }
    return sum;
}

Expected<MeshData> isoSurface(const VoxelGrid& grid, double value, std::size_t mostTriangles) {
    switch (grid.format) {
        case VoxelFormat::kUint8:
            return IsoSurfaceMaker<std::uint8_t>(grid, value, mostTriangles).make();
        case VoxelFormat::kUint16:
            return IsoSurfaceMaker<std::uint16_t>(grid, value, mostTriangles).make();
        case VoxelFormat::kInt16:
            return IsoSurfaceMaker<std::int16_t>(grid, value, mostTriangles).make();
        case VoxelFormat::kFloat:
            break;
    }
    return IsoSurfaceMaker<float>(grid, value, mostTriangles).make();
}

namespace {

/// Half as many numbers along each axis, two at least, whose first and last lie where the grid's do.
std::array<std::size_t, 3> coarserSize(const std::array<std::size_t, 3>& size) {
    std::array<std::size_t, 3> half{};
    for (std::size_t axis = 0; axis < 3; ++axis) half[axis] = std::max<std::size_t>(2, (size[axis] + 1) / 2);
    return half;
}

std::vector<float> sampled(const VoxelGrid& grid, const std::array<std::size_t, 3>& size) {
    Vec3d stride;
    for (std::size_t axis = 0; axis < 3; ++axis)
        stride[static_cast<Eigen::Index>(axis)] =
            static_cast<double>(grid.size[axis] - 1) / static_cast<double>(size[axis] - 1);
    std::vector<float> numbers;
    numbers.reserve(size[0] * size[1] * size[2]);
    for (std::size_t z = 0; z < size[2]; ++z)
        for (std::size_t y = 0; y < size[1]; ++y)
            for (std::size_t x = 0; x < size[0]; ++x)
                numbers.push_back(static_cast<float>(
                    grid.linearAt(Vec3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z))
                                      .cwiseProduct(stride))));
    return numbers;
}

}  // namespace

MeshData isoSurfaceWithin(const VoxelGrid& grid, double value, std::size_t mostTriangles) {
    if (Expected<MeshData> all = isoSurface(grid, value, mostTriangles)) return std::move(*all);
    VoxelGrid coarse = grid;
    for (;;) {
        const std::array<std::size_t, 3> size = coarserSize(coarse.size);
        if (size == coarse.size) return {};  // a single cell
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<Eigen::Index>(axis);
            coarse.spacing[a] =
                grid.spacing[a] * (static_cast<double>(grid.size[axis] - 1) / static_cast<double>(size[axis] - 1));
        }
        coarse.size = size;
        coarse.format = VoxelFormat::kFloat;
        const std::vector<float> numbers = sampled(grid, size);
        coarse.voxels = std::as_bytes(std::span(numbers));
        if (Expected<MeshData> fits = isoSurface(coarse, value, mostTriangles)) return std::move(*fits);
    }
}

}  // namespace tessera
