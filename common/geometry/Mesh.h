/// Meshes: a checked view of a Geometry's arrays, and meshes made from shapes. No scene, no GL.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/Error.h"
#include "common/math/Box.h"

namespace tessera {

/// What MeshData is made up of.
enum class Primitive : std::uint8_t { kTriangles, kPoints, kLines };

/// What some arrays are of. Whoever makes them says so: nobody can tell by looking at them.
enum class MeshKind : std::uint8_t {
    kTriangles,
    kPoints,  ///< balls
    kLines,   ///< as wide on the screen wherever they are
    // Particles (common/drawable/ParticleArrays.h), which nobody collides with:
    kDiscs,    ///< round on the screen
    kStreaks,  ///< lines, each as wide as it says
    kSprites,  ///< squares that face the user's head
    // Scalar fields on screens (common/drawable/VolumeShapes.h):
    kMarched,  ///< a box that rays go through
    kSlices,   ///< planes through it
    // Copies of a mesh (MeshCopies.h):
    kGlyphs,
};
inline constexpr std::size_t kMeshKinds = 9;

/// Arrays of any kind, not yet checked; see common/cores/Geometry.h for the layouts.
struct MeshArrays {
    Blob positions, normals, colors, texcoords, indices, texcoords1;
    Blob lines;     ///< uint32[2] per line, of kLines and kStreaks: so that they are no surface to whoever looks at
                    ///< `indices`
    Blob tangents;  ///< float[4] per vertex
    /// MeshCopy each (MeshCopies.h), of kGlyphs: the mesh is at each of these places, and `colors` are theirs.
    Blob copies;
    MeshKind kind = MeshKind::kTriangles;
    bool sorted = false;     ///< of particles: drawn from the farthest to the nearest; else as the arrays have them
    double pointRadius = 0;  ///< of points; of particles as far as anything reaches around its position
    float lineWidth = 0;     ///< of lines; of streaks the widest; in pixels
};

/// The blobs of MeshArrays.
inline constexpr std::size_t kMeshArrays = 9;

struct MeshLimits {
    std::size_t maxVertices = 64'000'000;
    std::size_t maxTriangles = 64'000'000;
    std::size_t maxLines = 16'000'000;  ///< as triangles that are drawn two each
    std::size_t maxPoints = 8'000'000;  ///< as triangles (Points.h) as many as maxTriangles
    double maxPointRadius = 1e12;
};

/// Says what is wrong: a size that is not a whole number of elements, arrays of different vertex counts, an index out
/// of range (which), a position that is not finite, an absent blob, an array that the kind has not or that it cannot be
/// without, a radius below 0 or of what has none, an order of what is no particles. Costs one pass.
[[nodiscard]] Expected<void> checkMesh(const MeshArrays& arrays, const MeshLimits& limits = {});

/// Bytes [begin, end) of an array.
struct ByteRange {
    std::uint64_t begin = 0, end = 0;
    [[nodiscard]] bool empty() const { return begin >= end; }
};
/// Where a mesh differs from another one whose arrays have the same sizes; ranges in the order of MeshArrays.
using MeshRanges = std::array<ByteRange, kMeshArrays>;
/// Of a mesh that is a sound one but for these ranges: whether it is sound. Costs what they hold.
[[nodiscard]] bool soundWithin(const MeshArrays& arrays, const MeshRanges& ranges);
/// The elements of an array that a range touches.
[[nodiscard]] ByteRange elementsOf(const ByteRange& bytes, std::size_t elementBytes);

/// Local bounds; empty for no vertices.
[[nodiscard]] Box boundsOf(std::span<const float> positions);
/// Of a mesh as it is shown: around points with their radius.
[[nodiscard]] Box shownBounds(const MeshArrays& arrays);
/// As it is shown, wherever the bytes are; points have triangles too.
[[nodiscard]] std::uint64_t triangleCount(const MeshArrays& arrays);
/// Of one of these triangles; nothing where there is no such. `shownRadius`: of points, see Points.h.
[[nodiscard]] std::optional<std::array<Vec3f, 3>> cornersOf(const MeshArrays& arrays, std::uint32_t triangle,
                                                            double shownRadius);

/// A mesh under construction: counter-clockwise triangles seen from outside, lines, or points.
struct MeshData {
    std::vector<float> positions;      ///< xyz
    std::vector<float> normals;        ///< xyz, or empty
    std::vector<float> texcoords;      ///< uv, or empty
    std::vector<float> texcoords1;     ///< a second set, or empty
    std::vector<std::uint8_t> colors;  ///< rgba, or empty
    std::vector<std::uint32_t> indices;
    std::vector<std::uint32_t> lines;  ///< two each; of kLines alone
    std::vector<float> tangents;       ///< xyz and the side, or empty; they say nothing without normals
    Primitive primitive = Primitive::kTriangles;
    double pointRadius = 0;  ///< of points
    float lineWidth = 1;     ///< of lines, in pixels

    /// Nothing to be seen.
    [[nodiscard]] bool empty() const {
        if (primitive == Primitive::kPoints) return positions.empty();
        return primitive == Primitive::kLines ? lines.empty() : indices.empty();
    }
    [[nodiscard]] MeshArrays toArrays() const;
    /// Of triangles alone.
    void append(const MeshData& other, const Affine3d& place);
};

/// Shapes stand on their own centre; lengths in scene units. Texture coordinates go once around, and once over each
/// flat face; on pipes they repeat along it.
[[nodiscard]] MeshData makeBox(const Vec3d& size);
/// Along +Y, closed by caps.
[[nodiscard]] MeshData makeCylinder(double radius, double height, int segments);
/// Along +Y; a ring with a square profile is a tube seen from its end.
[[nodiscard]] MeshData makeTube(double outerRadius, double innerRadius, double height, int segments);
[[nodiscard]] MeshData makeSphere(double radius, int segments);
/// Around +Y.
[[nodiscard]] MeshData makeTorus(double ringRadius, double pipeRadius, int ringSegments, int pipeSegments);
/// A round pipe along a polyline, its bends mitred.
[[nodiscard]] MeshData makePipe(std::span<const Vec3d> path, double radius, int segments);

/// Area-weighted vertex normals where a file has none. Of triangles alone.
void computeNormals(MeshData& mesh);

}  // namespace tessera
