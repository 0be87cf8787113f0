/// A subdivision surface as Bézier patches, each with a bound of how far it is from the surface.
///
/// What is regular is exact: bicubic, or quartic over triangles. What is not is an approximation with an error, and is
/// split where that exceeds a tolerance; three of the four parts beside an irregular vertex are then regular.
///
/// The error is a bound, by these steps. (1) All masks of subdivision are affine with weights of 0 or more, so the
/// surface of a neighbourhood lies in the hull of its points, after any number of refinements. (2) On a part that is a
/// polynomial, the difference to the approximation is a Bézier patch as well, whose length is nowhere more than its
/// longest control point. (3) On a part that is none, surface and approximation lie in the hulls of their points; about
/// any point c, no point of one is farther from one of the other than the farthest of the one from c and the farthest
/// of the other from c together. (4) The parts cover the face. Rounding is allowed for by 1e-13 of the largest
/// coordinate. So |surface(u, v) - patch(u, v)| is at most the error at every (u, v), and the patches, inflated by
/// their errors, contain the surface.
///
/// Not thread-safe: the graph is one thread's.
#pragma once

#include <variant>

#include "common/freeform/BezierPatch.h"
#include "common/freeform/BezierTriangle.h"
#include "common/freeform/subdivision/NeighbourhoodGraph.h"

namespace tessera {

struct SurfacePatch {
    std::uint32_t ptex = 0;
    /// The patch's (s, t) is the ptex face's (u + size · s, v + size · t). Below 0: a triangle that is turned over.
    double u = 0, v = 0, size = 1;
    double error = 0;
    std::variant<BezierPatch, BezierTriangle> shape;
};

struct PatchOptions {
    double tolerance =
        1e-3;  ///< in units of the control points; a patch may exceed it after kMostLevels, and says so by its error
    /// Approximations and the bound of steps 2 and 3; else only flat patches with the hull of the points around them as
    /// their error: rougher.
    bool approximate = true;
    std::size_t mostPatches = std::size_t{1} << 22;
};

/// Where a vertex's neighbourhood shrinks slowest, by 0.69 a level, 1e-5 of it is left.
inline constexpr int kMostPatchLevels = 30;

/// Of these ptex faces, in their order; of those without surface (holes) none. kBadInput: a face or number of positions
/// that is none, a tolerance that is not above 0, the bilinear scheme. kLimit: more than mostPatches.
[[nodiscard]] Expected<std::vector<SurfacePatch>> patchesOf(NeighbourhoodGraph& graph, std::span<const Vec3d> positions,
                                                            std::span<const std::uint32_t> ptexFaces,
                                                            const PatchOptions& options);
/// Of all.
[[nodiscard]] Expected<std::vector<SurfacePatch>> patchesOf(NeighbourhoodGraph& graph, std::span<const Vec3d> positions,
                                                            const PatchOptions& options);

[[nodiscard]] SurfacePoint evaluate(const SurfacePatch& patch, double s, double t);

}  // namespace tessera
