/// How long are bounding volumes and triangles of two moving bodies certain to stay apart? Sixteen pairs at once.
///
/// Plain data: this header is compiled into files of different instruction sets and must bring no inline function with
/// it. Every lane does the same IEEE operations whatever the instruction set (nothing is contracted), so answers and
/// counters do not depend on the processor.
#pragma once

#include "server/collision/tree/KernelTypes.h"

namespace tessera::kernel {

/// One body at one moment, from its tree's own coordinates to a frame that both share, and the same map's rate of
/// change per unit of time.
struct MovingFrame {
    float linear[9];  ///< row by row
    float translation[3];
    float turning[9];
    float drift[3];
    float axes[9];       ///< linear / scale, for a similarity; else linear
    float scale;         ///< of a similarity; else 1
    float stretch;       ///< no length grows by more
    float growth;        ///< the reach of a box along a direction changes by at most this, times its half diagonal
    float swelling;      ///< and the reach of a sphere, times its radius
    float axis[3];       ///< about which the body turns
    float acceleration;  ///< of its points, at most, at any time of interest; it is square to the axis
};

/// Two bodies at one moment, in the shared frame. Its lengths are of the order of the bodies' sizes.
struct ImpactFrame {
    MovingFrame a, b;
    bool similarity;   ///< both maps
    float rest;        ///< what the rate of approach can rise by per unit of time beside that
    float slack;       ///< more than what rounding can do to a distance
    float rateSlack;   ///< and to the rate at which it changes
    float horizon;     ///< the time of interest: of two directions the one is taken that holds longer within it
    float thickness;   ///< contact is where they are so far apart
    float thickening;  ///< by so much that rises per unit of time
};

/// A bounding volume as a box with three unit axes (square to each other for a similarity), in the shared frame.
struct PlacedBox {
    float centre[3], velocity[3];
    float axis[9];  ///< one after the other
    float half[3];
    float bend[3];           ///< how much the rate along its axes can fall per unit of time, because of both bodies
    float own[3];            ///< the box's reach along its own axes
    float growth;            ///< of its reach along any direction
    float radius, swelling;  ///< of the sphere around it
};

/// Four triangles whose corners go straight: rows as of a leaf (kLeafRows of kLeafFaces), in double. Where there are
/// fewer, any numbers will do.
struct StraightLeaf {
    double start[kLeafRows * kLeafFaces], end[kLeafRows * kLeafFaces];
};

/// The planes of four triangles as they begin (lanes 0 to 3) and, along the same normals, those triangles as they end
/// (4 to 7). Where there are fewer, the first again.
struct alignas(64) LeafPlanes {
    static constexpr unsigned kLanes = 2 * kLeafFaces;
    double normal[3][kLanes], size[3][kLanes];  ///< and how large its coordinates are
    double corner[3][kLanes];                   ///< the first of each triangle
    double low[kLanes], high[kLanes];  ///< of the others along the normal, seen from there, and a margin beside
};

/// A box as it begins and as it ends.
struct StraightBox {
    double centre[3][2], half[3][2];
};

struct ImpactKernels {
    /// The volume of a slot.
    void (*place[kShapes])(const TreeView& tree, const ImpactFrame& f, const MovingFrame& frame, Slot slot,
                           PlacedBox& out);
    /// For how long the 16 children of a node are certain to be apart from a volume of the other body: 0 where that is
    /// not certain at all; of no meaning where there is no child. First for maps that are similarities, then for
    /// others.
    void (*nodeTimes[2][kShapes])(const TreeView& tree, const MovingFrame& frame, std::uint32_t node,
                                  const PlacedBox& other, const ImpactFrame& f, float* times);
    /// The same for the triangles of two leaves: times[4 i + j] for triangle i of A's leaf and j of B's. Of no meaning
    /// where there is no triangle.
    void (*leafTimes)(const float* cornersA, const float* cornersB, const ImpactFrame& f, float* times);
    /// Bit 4 i + j: no direction that is square to a face or to two edges at the start shows triangle i of A and j of B
    /// farther apart than the margin all along. Between two gaps along one direction that gap is never less than the
    /// smaller one. Those of triangles that are not there are of no meaning. The margin holds what rounding does to a
    /// corner, 64 times.
    std::uint32_t (*meetingOnTheWay)(const StraightLeaf& a, const StraightLeaf& b, double margin);
    /// The same at the start alone; `end` is not read.
    std::uint32_t (*meetingAtStart)(const StraightLeaf& a, const StraightLeaf& b, double margin);
    /// The box begins, and ends if that is asked, on one side of each of the planes.
    bool (*besidePlanes)(const LeafPlanes& planes, const StraightBox& box, bool throughout);
};

}  // namespace tessera::kernel
