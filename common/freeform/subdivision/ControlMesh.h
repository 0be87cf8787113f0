/// The control mesh of a subdivision surface, as a file or an application gives it: nothing here is checked yet.
///
/// The words, numbers and defaults are OpenSubdiv's: sharpness from 0 (smooth) to 10 (infinite), in single precision,
/// so that sharpness runs out in the same refinement as there. Values only; any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/Types.h"

namespace tessera {

enum class SubdivisionScheme : std::uint8_t { kCatmullClark, kLoop, kBilinear };

/// Where the mesh ends: faces at a boundary have no surface; the boundary is a smooth curve; the same, but a vertex of
/// one face alone is interpolated.
enum class BoundaryInterpolation : std::uint8_t { kNone, kEdgeOnly, kEdgeAndCorner };

/// How semi-sharp edges lose sharpness: 1 each refinement; or evened out along the crease first (Chaikin).
enum class CreaseMethod : std::uint8_t { kUniform, kChaikin };

/// How Catmull-Clark weighs triangles around an edge: as any polygon; or so that they become smoother.
enum class TriangleRule : std::uint8_t { kPolygon, kSmooth };

/// What is this sharp never becomes smooth.
inline constexpr float kInfiniteSharpness = 10;

struct ControlMesh {
    struct Crease {
        std::uint32_t from = 0, to = 0;  ///< vertices with an edge between them
        float sharpness = kInfiniteSharpness;
    };
    struct Corner {
        std::uint32_t vertex = 0;
        float sharpness = kInfiniteSharpness;
    };

    SubdivisionScheme scheme = SubdivisionScheme::kCatmullClark;
    BoundaryInterpolation boundary = BoundaryInterpolation::kEdgeOnly;
    CreaseMethod creaseMethod = CreaseMethod::kUniform;
    TriangleRule triangles = TriangleRule::kPolygon;
    std::vector<Vec3d> positions;
    std::vector<std::uint32_t> faceSizes;     ///< vertices of each face
    std::vector<std::uint32_t> faceVertices;  ///< counter-clockwise, face after face
    std::vector<Crease> creases;              ///< of an edge that is named twice the last counts; so with corners
    std::vector<Corner> corners;
    std::vector<std::uint32_t> holes;  ///< faces that shape their neighbours and have no surface
};

}  // namespace tessera
