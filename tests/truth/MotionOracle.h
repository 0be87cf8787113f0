/// When do two bodies on their ways first touch? Bounds that are certain, by interval arithmetic (Boost.Interval) on
/// every pair of faces, with none of the library's code: the oracle of timeOfImpact.
///
/// That two faces are apart during a span of time is shown by a direction, fixed in the frame that one of the bodies
/// carries along, along which every corner of the one stays below every corner of the other: their gap at the middle of
/// the span, and bounds on its rate over all of it. Where no direction of a handful does, the span is halved. That
/// bodies meet at a moment is shown by an edge that pierces a face, all five signs certain. So what only grazes is left
/// open.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/query/TimeOfImpact.h"

namespace tessera::truth {

struct FirstContact {
    /// No two points of the bodies meet before it.
    double freeUpTo = 0;
    /// Nor later, up to t = 1.
    bool free = false;
    /// They meet at this moment; the earliest that was found.
    std::optional<double> meetsAt;
};

class MovingBodies {
public:
    /// Rotations whose start and end are half a turn apart, to rounding, have no shorter arc: std::domain_error.
    MovingBodies(const TriangleMesh& a, const BodyMotion& motionA, const TriangleMesh& b, const BodyMotion& motionB);
    ~MovingBodies();

    [[nodiscard]] FirstContact firstContact() const;
    /// At t all points of the one are certainly farther than `distance` from all of the other.
    [[nodiscard]] bool apart(double t, double distance) const;
    /// The same from `from` to `to`; false: that could not be shown.
    [[nodiscard]] bool apart(double from, double to, double distance) const;
    /// Faces certainly pierce each other at t.
    [[nodiscard]] bool meet(double t) const;
    /// No more than this: of two points of the bodies at t.
    [[nodiscard]] double distanceAtMost(double t) const;

    /// Pairs of faces, ascending, that are not certainly apart at t.
    [[nodiscard]] std::vector<FacePair> near(double t) const;
    /// Pairs of faces, ascending, that certainly pierce each other at t, and of which B would certainly have to go
    /// farther than `overlap` along `normal` to leave A behind. The normal is as it is at t = 0; where A turns, it
    /// turns with A.
    [[nodiscard]] std::vector<FacePair> pierced(double t, const Vec3d& normal, double overlap) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tessera::truth
