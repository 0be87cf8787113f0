/// When do a corner and a face, two edges or two triangles meet whose corners all go straight? Conservative: a contact
/// is never missed and never reported late.
///
/// Intervals of time are excluded as a whole, in the manner of inclusion-based root isolation (J. M. Snyder, "Interval
/// Analysis for Computer Graphics", 1992; B. Wang et al., "A Large-Scale Benchmark and an Inclusion-Based Algorithm for
/// Continuous Collision Detection", 2021), but without dividing the faces: what excludes an interval is a direction
/// that separates the two convex hulls at both of its ends. Along one direction every corner moves linearly, so that
/// it separates them in between as well, and the last moment to which it does is known in closed form. The next
/// direction is that of the nearest points at that moment (conservative advancement, B. Mirtich 1996, with the motion
/// bound of each corner along the direction).
///
/// Rounding: a direction is taken as the doubles it is, so it has no error. The gap n·(b - a) between two corners at
/// an end is computed with at most five roundings per product; 16·2^-53·|n|₁·(largest distance of a corner from the
/// origin of the computation) bounds the sum of them, and that much is taken off every gap before its sign is used.
/// Times are rounded towards the start. So distances below about 1e-14 of the size of what moves count as contact.
///
/// Coordinates: finite, below 1e50. Pure functions, safe from any thread.
#pragma once

#include <array>
#include <cstdint>

#include "server/collision/mesh/TriangleContact.h"

namespace tessera {

struct ElementaryOptions {
    /// How near is a hit, in the coordinates' unit; 0: as near as rounding can tell.
    double tolerance = 1e-6;
    /// The true corners may be this far from the given ones, at any moment. Nothing is missed for them either.
    double slack = 0;
    /// What happens later is of no interest.
    double upTo = 1;
    /// Of moments looked at. After that many the answer is the conservative one.
    std::uint32_t mostSteps = 500;
};

struct ElementaryImpact {
    bool hit = false;
    /// Nothing touches before it. On a hit the distance then is at most the tolerance (or what slack and rounding leave
    /// undecided); without one it is `upTo`.
    double t = 1;
    double distance = 0;    ///< at t; of a hit
    Vec3d onA, onB;         ///< the nearest points at t; of a hit
    std::uint32_t steps = 0;  ///< moments looked at
    bool complete = true;   ///< false: the steps ran out, and `hit` is a guess that errs towards yes
};

/// Within the tolerance without being within reach of contact at any later time is no hit.
[[nodiscard]] ElementaryImpact vertexFaceImpact(const Vec3d& vertexStart, const Vec3d& vertexEnd,
                                                const Triangle& faceStart, const Triangle& faceEnd,
                                                const ElementaryOptions& options = {});

using Edge = std::array<Vec3d, 2>;

[[nodiscard]] ElementaryImpact edgeEdgeImpact(const Edge& aStart, const Edge& aEnd, const Edge& bStart,
                                              const Edge& bEnd, const ElementaryOptions& options = {});

/// All fifteen elementary pairs at once: two closed triangles. Without area they are the segments or points they are.
[[nodiscard]] ElementaryImpact trianglesImpact(const Triangle& aStart, const Triangle& aEnd, const Triangle& bStart,
                                               const Triangle& bEnd, const ElementaryOptions& options = {});

}  // namespace tessera
