/// What the kernel of the field's walk and the rest of this folder hand each other. Plain data: this header is compiled
/// into files of different instruction sets and must bring no inline function with it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/collision/tree/KernelTypes.h"

namespace tessera::kernel {

inline constexpr unsigned kCubeFaces = 6;
inline constexpr unsigned kMostFieldLevels = 9;  ///< level 0 is a whole face of the cube, level l has 2^l × 2^l texels
inline constexpr unsigned kMostFieldParts = 8;

/// What a field says of the surface in a texel's pyramid: it lies between two planes n · x = lower, upper, and between
/// two radii. All in 16 bits, rounded outwards; n is about a unit vector times 32767. Empty: lower above upper.
/// Faces of the cube: 2 · axis + (negative side). On the face of axis c, s is axis (c + 1) % 3 over |c| and t is axis
/// (c + 2) % 3; texel (i, j) is i along s, and j · 2^l + i is its place in the face.
struct FieldTexel {
    std::int16_t normal[3];
    std::int16_t lower, upper;
    std::uint16_t inner, outer;
    std::uint16_t unused;
};

/// One centre and all that is seen from it. Coordinates: the tree's own, less the centre.
struct FieldPart {
    const FieldTexel* texels[kMostFieldLevels];  ///< per level; face · 4^l + place
    unsigned finest;                             ///< level
    float radius;                                ///< nothing is farther from the centre
    float normalUnit, planeUnit, radiusUnit;     ///< what one step of normal, lower and upper, inner and outer is
    /// Of each texel of the finest level the triangles in its pyramid: entries start[texel] … start[texel + 1], each
    /// with a ball around the triangle (x y z r in steps of ballUnit).
    const std::uint32_t* start;
    const std::uint32_t* faces;
    const std::int16_t* ballX;
    const std::int16_t* ballY;
    const std::int16_t* ballZ;
    const std::uint16_t* ballR;
    float ballUnit;
};

/// A tree of oriented boxes that is walked, and the field that its boxes are looked up in.
struct FieldWalkFrame {
    TreeView tree;
    const FieldPart* parts;
    unsigned partCount;
    float linear[9];                        ///< tree's own coordinates to the field's, row by row
    float translation[kMostFieldParts][3];  ///< to each part's
    float slack;                            ///< more than what rounding can do to any position, in the field's lengths
};

struct FieldWalkSink {
    /// Pairs that may meet: a face of the walked tree, one of the field. `flush` is called when there are `enough`; it
    /// empties the list and returns true to end the walk. Room for `capacity`.
    std::uint32_t* walked;
    std::uint32_t* met;
    std::uint32_t count, enough, capacity;
    /// Faces of the walked tree that are too large beside the texels, or too near a centre: for another search.
    std::uint32_t* open;
    std::uint32_t openCount, openCapacity;
    bool (*flush)(FieldWalkSink& sink, void* context);
    void* context;
    std::uint64_t nodeTests, texelTests, triangleTests;
    std::uint64_t limit;  ///< of nodeTests and triangleTests together
    bool exhausted;
};

/// Walks down the whole tree. True: flush ended it, or the work was exhausted.
using FieldWalk = bool (*)(const FieldWalkFrame& frame, FieldWalkSink& sink);

/// Signed distances at the places origin + spacing · (i, j, k), i first; in steps of `unit`, wrong by `doubt` at most.
struct LatticeView {
    const std::int16_t* values;
    std::int32_t size[3];  ///< at least 2 each
    float origin[3];
    float spacing;
    float unit, doubt;
    float boxLower[3], boxUpper[3];  ///< around the surface
    bool isSigned;                   ///< else all are distances
};

struct LatticeFrame {
    TreeView tree;  ///< of oriented boxes
    LatticeView lattice;
    TreeView surface;  ///< what the lattice is of
    float linear[9];   ///< tree's own coordinates to the surface's, row by row: a similarity
    float translation[3];
    float scale;  ///< of it
    float slack;  ///< more than what rounding can do to any position
};

/// How near the tree's surface comes to the lattice's, or how deep it gets: the least signed distance of its points.
struct LatticeSink {
    float width;         ///< wanted: upper - lower at most
    float lower, upper;  ///< out: the least is between them
    float point[3];      ///< out: a point of the tree's surface near that, in the surface's coordinates
    std::uint64_t nodeTests, triangleTests;
    std::uint64_t limit;
    bool exhausted;
};
using LatticeWalk = void (*)(const LatticeFrame& frame, LatticeSink& sink);

/// Distance of a point from the triangles of a tree of oriented boxes, in its own coordinates: at most tolerance too
/// large. `most`: it is known to be at most that.
using PointDistance = float (*)(const TreeView& tree, const float* point, float most, float tolerance);

}  // namespace tessera::kernel
