/// How far does a capsule get along a straight way before it touches one of some triangles?
///
/// For bodies that are swept and do not turn: a person who walks. Two convex sets that pass each other on a straight
/// way are at a distance that is a convex function of time, so that a tangent of it never overestimates: Newton's steps
/// from the start come to the first contact from before it, and never beyond (conservative advancement, Mirtich 1996,
/// with the slope in the place of a bound).
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

/// All that is no farther than `radius` from the segment from `a` to `b` (a ball, where these are one).
struct Capsule {
    Vec3d a = Vec3d::Zero(), b = Vec3d::Zero();
    double radius = 0;
};

/// Of a segment and a triangle. Both finite.
struct SegmentGap {
    double distance = 0;           ///< 0: they meet
    Vec3d normal = Vec3d::Zero();  ///< of unit length, from the triangle to the segment; zero where they meet
};
[[nodiscard]] SegmentGap gapBetween(const Vec3d& a, const Vec3d& b, const Triangle& triangle);

struct CapsuleHit {
    double t = 0;                  ///< of the way, 0 to 1
    Vec3d normal = Vec3d::Zero();  ///< of unit length, from the obstacle to the capsule
    std::size_t obstacle = 0;
};

/// Where the distance to an obstacle first is the radius, or what remains of it after a relative 1e-6, and would become
/// less. Nothing: the whole way is free. At `t` no obstacle is nearer than the radius, but for those that were at the
/// start: of these nothing comes nearer. An obstacle that the segment itself passes through at the start is in nobody's
/// way: else who is stuck in it would stay so. Of equal times the first obstacle. Finite numbers within 1e6 radii of
/// the origin.
[[nodiscard]] std::optional<CapsuleHit> sweepCapsule(const Capsule& body, const Vec3d& way,
                                                     std::span<const Triangle> obstacles);

}  // namespace tessera
