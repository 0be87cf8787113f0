/// The surface in a box of voxels where a scalar field has one value.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/geometry/Mesh.h"

namespace tessera {

enum class VoxelFormat : std::uint8_t { kUint8, kUint16, kInt16, kFloat };
[[nodiscard]] constexpr std::size_t bytesOf(VoxelFormat format) {
    return format == VoxelFormat::kUint8 ? 1 : format == VoxelFormat::kFloat ? 4 : 2;
}

/// A view of numbers at the corners of a grid of cells, x first, then y, then z; little-endian.
struct VoxelGrid {
    VoxelFormat format = VoxelFormat::kUint8;
    std::array<std::size_t, 3> size{};  ///< numbers along each axis, at least two
    Vec3d origin = Vec3d::Zero();       ///< of the first
    Vec3d spacing = Vec3d::Ones();      ///< above 0
    ByteSpan voxels;                    ///< exactly size x · y · z numbers, floats finite

    [[nodiscard]] std::size_t count() const { return size[0] * size[1] * size[2]; }
    [[nodiscard]] double at(std::size_t x, std::size_t y, std::size_t z) const;
    /// Linear along each axis between the eight around a place of the grid, in steps of the grid; outside of it that of
    /// its nearest place.
    [[nodiscard]] double linearAt(const Vec3d& steps) const;
};

/// Around what is at least `value`: triangles counter-clockwise seen from where the field is less, with normals along
/// its gradient. The field is taken as linear in each of the six tetrahedra that share a cell's long diagonal, the same
/// in all cells (Freudenthal's; surfaces of tetrahedra: Doi and Koide, "An efficient method of triangulating
/// equi-valued surfaces by using tetrahedral cells", 1991): neighbours agree on every face, so there are no ambiguous
/// cells and no cracks. Where the field is above the value at the border of the grid, faces of the box close the
/// surface, with the box's normals: it is always closed, each edge run along as often one way as the other. kLimit:
/// more than `mostTriangles`.
[[nodiscard]] Expected<MeshData> isoSurface(const VoxelGrid& grid, double value, std::size_t mostTriangles);

/// The same; where it had more than `mostTriangles`, of the field as numbers half as many along each axis tell it (of
/// the same box, linear in between), or half of these, …: a surface that is coarser instead of none.
[[nodiscard]] MeshData isoSurfaceWithin(const VoxelGrid& grid, double value, std::size_t mostTriangles);

/// A layer, x · y, may have so many numbers: what `isoSurface` keeps at a time.
inline constexpr std::size_t kMostVoxelsOfLayer = std::size_t{1} << 22;

}  // namespace tessera
