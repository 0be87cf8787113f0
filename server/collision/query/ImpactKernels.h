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
};

}  // namespace tessera::kernel
