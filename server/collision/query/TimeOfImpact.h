/// When do two moving bodies first touch?
///
/// Pairs of volumes and of faces are looked at in the order of the time up to which they are known to be apart. That
/// time is where the gap along a direction that separates the two can be closed at the earliest: the gap itself, its
/// rate now along that direction, and a bound on how much the rate can fall (conservative advancement, B. Mirtich 1996;
/// per pair as by M. Tang, Y. J. Kim and D. Manocha, "C2A: Controlled Conservative Advancement for Continuous Collision
/// Detection of Polygonal Models", 2009; second order in time as by X. Zhang et al., 2007). So the first pair of faces
/// that comes up within the tolerance is the answer, and what is never near is never looked at closely.
///
/// Everything is counted in one QueryWork. Answers and counters depend neither on the processor nor on time. Pure
/// functions: any thread, as long as nobody refits the trees meanwhile.
#pragma once

#include <span>
#include <vector>

#include "common/math/Pose.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// A body's way during one step, t from 0 to 1, in a frame that both bodies share: translation and scale linear,
/// rotation by slerp along the shorter arc. A body at rest has equal ends.
struct BodyMotion {
    Pose start, end;
    /// Where the mesh sits in the frame that moves: any finite affine map, mirrored, sheared or flat.
    Affine3d body_T_mesh = Affine3d::Identity();
    /// What carries it, from the shared frame down: each moves in the last one's mesh frame, the body in that of the
    /// last of all. They have no carriers of their own.
    std::vector<BodyMotion> carriers = {};

    /// Of the body, where it is carried.
    [[nodiscard]] Pose at(double t) const;
    /// shared_T_mesh at t.
    [[nodiscard]] Affine3d placeAt(double t) const;
};

/// A direction in which two bodies rest on each other, as a shelf and what stands on it. A pair of faces that comes
/// within the tolerance is held by it, instead of being a hit, where it overlaps along it by little (how far B would
/// have to go along it to leave A behind); then that overlap is bounded at every moment of the way, by the same bounds
/// on rates that keep faces apart. Where it would grow the pair is a hit.
struct Support {
    enum class Turns { kNo, kWithA, kWithB };

    Vec3d normal = Vec3d::UnitZ();  ///< of unit length, in the shared frame at t = 0, from A to B
    Turns turns = Turns::kNo;       ///< as that body turns; holds nothing where that is carried through uneven scales
    double overlap = 0;             ///< pairs that overlap by more are not held
    double rounding = 0;            ///< by so much an overlap may grow
    /// Holds only what goes straight and parts along it, at 60 degrees from it at most.
    bool parting = false;
};

struct ImpactOptions {
    /// In units of the shared frame. Less than rounding can tell (about 1e-13 of the coordinates involved), zero, a
    /// negative number or none at all is taken for as near as rounding can tell.
    double tolerance = 1e-4;
    /// Pairs of faces that are looked at, one by one, at one moment after the other; each costs, and counts as, a
    /// hundred box tests. Where they are not enough (a face as long as a continent that turns by, a hair away), the
    /// answer is not complete. Rigid motions.
    std::uint64_t maxSteps = 100'000;
    /// Rigid motions. Where there are any, a hit names the faces that met and looks for no nearer ones.
    std::span<const Support> supports = {};
    /// Pairs that are left out, ascending. Rigid motions.
    std::span<const FacePair> within = {};
    /// Contact is where the distance is this much, as if both bodies were thicker by it together, at t = 0; and by so
    /// much more at t = 1, linearly in between (balls that grow). In units of the shared frame. Negative at some
    /// moment, or no finite numbers: nothing is known. What Impact and Support call distance and overlap is that of the
    /// thickened bodies; points and normals are those of the bare ones. Rigid motions.
    double margin = 0;
    double marginGrowth = 0;
};

struct Impact {
    bool hit = false;
    /// Never after the first contact, be it at t = 1; 0 when they touch at the start. At t the distance is at most the
    /// tolerance. A motion that comes within the tolerance without touching may be reported as a hit; one that begins
    /// within it and certainly only parts is not.
    double t = 1;
    double distance = 0;           ///< exact, at t
    FacePair faces;                ///< the nearest at t
    Vec3d point = Vec3d::Zero();   ///< in the shared frame at t
    Vec3d normal = Vec3d::Zero();  ///< of a hit: of unit length, from A to B
    int support = -1;              ///< of a hit: held by this one up to t, where it would get deeper
    bool complete = true;          ///< false: the work was exhausted; t is as far as the way is known to be free
};

/// Scale may be non-uniform, negative, zero, or pass through zero: what is left of a flattened body still meets things.
/// Numbers that are not finite and rotations of length zero: nothing is known, which is `complete` = false with t = 0.
/// An empty mesh meets nothing. Trees of any kinds.
[[nodiscard]] Impact timeOfImpact(const TriangleTree& a, const BodyMotion& motionA, const TriangleTree& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options = {});

/// Between two states of deforming bodies: every vertex goes straight from where its tree's mesh has it (t = 0) to its
/// end position (one per vertex, both in one frame). Another number of end positions, and numbers that are not finite:
/// nothing is known, `complete` = false with t = 0.
[[nodiscard]] Impact timeOfImpact(const TriangleTree& a, std::span<const Vec3d> endA, const TriangleTree& b,
                                  std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options = {});

}  // namespace tessera
