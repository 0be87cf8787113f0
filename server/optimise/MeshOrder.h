/// A mesh's vertices and triangles in another order, and coarser meshes of the same surface. Pure functions, any
/// thread.
#pragma once

#include <cstddef>
#include <vector>

#include "common/cores/Geometry.h"

namespace tessera {

/// Of triangles with indices whose arrays have passed checkMesh and are here: the same surface, corner by corner to the
/// bit. Vertices that are equal in all their arrays, bit by bit, are one; vertices that no triangle has are gone;
/// triangles follow each other so that a vertex is used again soon, and vertices stand in the order in which triangles
/// want them (meshoptimizer; A. Sander, D. Nehab, J. Barczak, "Fast triangle reordering for vertex locality and reduced
/// overdraw", 2007). Runs of kTrianglesOfARun keep their place, as renderers cull them; `spatial` sorts them anew
/// first.
[[nodiscard]] Geometry ordered(const Geometry& mesh, bool spatial);

/// As client/render cuts large meshes.
inline constexpr std::size_t kTrianglesOfARun = 256;

struct CoarserMesh {
    Geometry mesh;
    double error =
        0;  ///< how far, about, its surface is from the finest one, in the mesh's own coordinates (see coarserMeshes)
};
/// Each with half of the triangles of the one before, down to about `fewest`, by collapses of edges (meshoptimizer; M.
/// Garland, P. Heckbert, "Surface simplification using quadric error metrics", 1997). `error` is the simplification's
/// own, an estimate: no bound. Their vertices are some of the mesh's. Ends early where a mesh cannot be halved without
/// an error above a tenth of its size.
[[nodiscard]] std::vector<CoarserMesh> coarserMeshes(const Geometry& mesh, std::size_t fewest);

}  // namespace tessera
