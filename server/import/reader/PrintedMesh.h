/// Meshes of files for 3D printers, whose triangles have materials and colours of their own: parted into what a
/// Geometry can show.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/Mesh.h"

namespace tessera {

struct PrintedMesh {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    std::vector<std::uint32_t> looks;   ///< of each triangle a number; none: of all 0
    std::vector<std::uint32_t> colors;  ///< of each corner 0xRRGGBBAA, or none
    std::vector<float> texcoords;       ///< of each corner uv, or none
};

/// What of a mesh counts for a look.
struct PrintedLook {
    bool hasColors = false, hasTexcoords = false;
};

struct PrintedPart {
    std::uint32_t look = 0;
    MeshData mesh;
};

/// Leaves out triangles whose vertices do not exist or stand nowhere, and what stands nowhere; what it says is for a
/// note, and empty where all are there.
[[nodiscard]] std::string leaveOutUnsound(PrintedMesh& mesh, const std::string& name);

/// A mesh for each look that a triangle has, by their numbers, without the vertices that nobody names. `smooth`:
/// normals with edges above 60 degrees are worked out before, over all looks, so that a surface of two colours has no
/// edge between; else there are none. Of sound triangles.
[[nodiscard]] std::vector<PrintedPart> partedByLooks(PrintedMesh mesh, std::span<const PrintedLook> looks, bool smooth);

}  // namespace tessera
