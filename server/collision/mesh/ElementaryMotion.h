/// When do a corner and a face, two edges or two triangles meet whose corners all go straight? Conservative: a contact
/// is never missed and never reported late.
///
/// Intervals of time are excluded as a whole, in the manner of inclusion-based root isolation (J. M. Snyder, "Interval
/// Analysis for Computer Graphics", 1992; B. Wang et al., "A Large-Scale Benchmark and an Inclusion-Based Algorithm for
/// Continuous Collision Detection", 2021), but without dividing the faces: what excludes an interval is a direction
/// that separates the two convex hulls. Along one direction every corner moves linearly, so the last moment up to which
/// it separates them is known in closed form; the next direction is that of the nearest points at that moment
/// (conservative advancement, B. Mirtich 1996, with each corner's own motion along the direction). Where that creeps,
/// because the direction has to turn with the features, one that turns linearly is tried over a longer interval: every
/// gap is then a quadratic polynomial, positive where its Bernstein coefficients are.
///
/// Rounding: directions are taken as the doubles they are, so they have no error, and neither have moments. Seen from
/// the origin of the computation, a corner's place at a moment has at most four roundings, a gap n·(b - a) six more per
/// product: 24·2^-53·|n|₁·(largest coordinate) bounds them all, and that much is taken off every gap before its sign is
/// used. Quotients that are times are rounded towards the start. So distances below about 1e-14 of the size of what
/// moves count as contact.
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
    double distance = 0;      ///< at t; of a hit
    Vec3d onA, onB;           ///< the nearest points at t; of a hit
    std::uint32_t steps = 0;  ///< moments looked at
    bool complete = true;     ///< false: the steps ran out, and `hit` is a guess that errs towards yes
};

/// All fifteen elementary pairs at once: two closed triangles. Without area they are the segments or points they are.
/// Within the tolerance without being within reach of contact at any later time is no hit.
[[nodiscard]] ElementaryImpact trianglesImpact(const Triangle& aStart, const Triangle& aEnd, const Triangle& bStart,
                                               const Triangle& bEnd, const ElementaryOptions& options = {});

/// The unit direction from A to B along which the gap between two triangles is largest: for two that do not meet the
/// direction of their nearest points, but to rounding, however small the gap is. (The difference of two points that are
/// computed has few right digits left where they are close.) `near`: of nearestPoints. Zero for two points in one
/// place.
[[nodiscard]] Vec3d directionApart(const Triangle& a, const Triangle& b, const NearestPoints& near);

}  // namespace tessera
