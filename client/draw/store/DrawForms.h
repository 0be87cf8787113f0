/// How GL draws each kind of item: what of a mesh lies in which buffer, and what a vertex shader is told. A row each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "client/render/DrawList.h"
#include "common/geometry/Mesh.h"

namespace tessera {

/// One vertex as the vertex array describes it to GL.
struct MeshVertex {
    std::array<float, 3> position;
    std::array<float, 3> normal;         ///< zero: none, shaded by the face
    std::array<std::uint16_t, 4> color;  ///< linear, normalised
    std::array<float, 2> texcoord, texcoord1;
};
static_assert(sizeof(MeshVertex) == 48);
/// One of a mesh that is drawn with a normal map.
struct MappedVertex {
    MeshVertex vertex;
    std::array<std::int16_t, 4> tangent;  ///< along u, of unit length or zero, and the side; as numbers up to 1
};
static_assert(sizeof(MappedVertex) == 56);

/// Of points, which a vertex shader fetches by its number: position and colour (RGBA bytes, sRGB); then their normal,
/// where they have some; then both texture coordinates, where they have any.
using PointTexel = std::array<std::uint32_t, 4>;

/// What points have besides positions: bits of MeshRange::pointParts. Of a call, not of its mesh: that its item makes
/// ellipsoids of its balls.
inline constexpr std::uint8_t kPointColors = 1, kPointNormals = 2, kPointTexcoords = 4, kPointStretched = 8;
/// Whether lengths become others in one direction than in another: by so much that it can be seen.
[[nodiscard]] bool isStretched(const Mat3d& linear);

/// GL's buffers of meshes, each of one sort of element.
enum class MeshStore : std::uint8_t { kVertices, kMappedVertices, kIndices, kTexels };
inline constexpr std::size_t kMeshStores = 4;
[[nodiscard]] constexpr std::size_t elementBytes(MeshStore store) {
    constexpr std::array<std::size_t, kMeshStores> kBytes = {sizeof(MeshVertex), sizeof(MappedVertex),
                                                             sizeof(std::uint32_t), sizeof(PointTexel)};
    return kBytes[static_cast<std::size_t>(store)];
}

/// Elements in each of them.
struct MeshSize {
    std::array<std::uint64_t, kMeshStores> elements{};
    [[nodiscard]] std::size_t bytes() const;
    MeshSize& operator+=(const MeshSize& other);
};

/// So many units in one of the buffers, each of so many elements: what is written is whole units.
struct MeshPart {
    MeshStore store = MeshStore::kVertices;
    std::uint64_t units = 0, elementsPerUnit = 1;
    [[nodiscard]] std::uint64_t elements() const { return units * elementsPerUnit; }
    [[nodiscard]] std::size_t unitBytes() const { return elementsPerUnit * elementBytes(store); }
};

/// The arrays that these are asked about have passed checkMesh, but where it says otherwise.
struct DrawForm {
    MeshKind kind;
    const char* define;  ///< the vertex shader's word for it
    /// How a mesh is written, one part after the other. Of any arrays.
    std::array<MeshPart, 2> (*parts)(const MeshArrays&);
    /// Tells the bytes of some units, in pieces.
    void (*write)(const MeshArrays&, MeshStore, const ByteRange& units, const std::function<void(ByteSpan)>& tell);
    /// An array, by its place in MeshArrays, of so many bytes a unit: who edits a range of it edits those units of a
    /// part.
    struct Follows {
        std::size_t array, bytesPerUnit;
        MeshStore store;
    };
    std::span<const Follows> follows;  ///< none: ranges tell nothing, and meshes are written anew
    bool normals;                      ///< there always are some, whatever the arrays say
    /// Null where vertices are attributes. Else they are fetched by their number, from what the first part holds, and
    /// things are what is drawn of a mesh, not triangles.
    struct Fetched {
        std::uint64_t things = 0;
        std::uint64_t before = 0;       ///< units of the first part that are none of them
        unsigned numberBits = 0;        ///< the vertices of a thing have 2^numberBits numbers
        std::uint32_t indicesEach = 3;  ///< of a thing
        std::uint32_t atOnce = 0;       ///< so many have indices, the second part; 0: those that all points share
    };
    Fetched (*fetched)(const MeshArrays&);
    /// Each sample's ray finds it: its depth is that sample's own, no mirror turns it around, and its item may stretch
    /// it. Its colours are told with its place.
    bool balls = false;
    enum class Sides : std::uint8_t { kMaterial, kOne, kBoth };
    Sides sides = Sides::kMaterial;  ///< that are seen: as the material says, or whatever it says
    bool castRays = false;           ///< what is solid ends its rays: depth is looked up, not tested
    /// ItemRecord::size; null: 0.
    std::array<std::uint32_t, 2> (*size)(const DrawItem&, const Mat3d& eye_R_item) = nullptr;
};
[[nodiscard]] const DrawForm& formOf(MeshKind kind);

[[nodiscard]] MeshSize sizeOf(const MeshArrays& arrays);
/// See kPointColors; of copies Fetched::numberBits; 0 of others.
[[nodiscard]] std::uint8_t pointPartsOf(const MeshArrays& arrays);

/// The edges of triangles as lines, each once; or their corners, each a line from it to itself, which is drawn as a
/// square. The arrays have passed checkMesh.
[[nodiscard]] MeshArrays outlineOf(const MeshArrays& arrays, std::int64_t fill);
/// So much of the distance nearer than its surface an outline lies.
inline constexpr float kOutlineNearer = 1.0f / 2048;

/// Eight vertex numbers a point, of which three are the triangle that it is seen in from outside, three what it is seen
/// in from inside (PointVertex.glsl): dividing by eight costs nothing.
inline constexpr std::uint32_t kNumbersPerPoint = 8, kIndicesPerPoint = 3;
/// So many points at a time: all that two bytes can number.
inline constexpr std::uint32_t kPointsAtOnce = 65536 / kNumbersPerPoint;
/// The indices of that many points; with their insides twice as many, first the inside of each.
[[nodiscard]] std::vector<std::uint16_t> sharedPointIndices(bool insides);
/// The vertices' numbers of one triangle of a mesh: by its own indices; of points two each, the inside first.
[[nodiscard]] std::array<std::uint32_t, 3> cornersOf(MeshKind kind, std::span<const std::uint32_t> indices,
                                                     std::uint32_t triangle);
/// sRGB bytes as linear numbers: those of MeshVertex::color, as GL makes numbers of them.
[[nodiscard]] std::array<float, 256> linearNumbers();

}  // namespace tessera
