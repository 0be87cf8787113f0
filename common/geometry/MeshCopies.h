/// One mesh at many places (MeshArrays::copies), as glyphs are: each turned, and scaled along its own Y axis and
/// across.
#pragma once

#include <array>
#include <cstddef>

#include "common/geometry/Mesh.h"

namespace tessera {

/// A corner c of the mesh lies at place + turn (width c.x, length c.y, width c.z).
struct MeshCopy {
    std::array<float, 3> place{};
    float width = 1;
    std::array<float, 4> turn{0, 0, 0, 1};  ///< a quaternion of length 1: x, y, z, w
    float length = 1;
    std::array<float, 3> padding{};
};
static_assert(sizeof(MeshCopy) == 48);

[[nodiscard]] inline std::size_t copyCount(const MeshArrays& arrays) {
    return static_cast<std::size_t>(arrays.copies.sizeBytes() / sizeof(MeshCopy));
}

/// The corners of the box around the mesh, as the copy has it turned: those with a lower x first, of these those with a
/// lower y.
[[nodiscard]] std::array<Vec3d, 8> cornersOfCopy(const MeshCopy& copy, const Box& mesh);

/// Around the copies [first, end) as single precision places them; boxes of copies that are not shown are points. The
/// mesh and the copies are here.
[[nodiscard]] Box boundsOfCopies(const MeshArrays& arrays, std::size_t first, std::size_t end);

}  // namespace tessera
