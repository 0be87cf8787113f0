/// When do two bodies first touch that go straight, without turning or growing? In rational arithmetic
/// (Boost.Multiprecision), so that what only grazes, and what touches at the very start or end, is decided as well.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <optional>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/query/TimeOfImpact.h"

namespace tessera::truth {

using Rational = boost::multiprecision::cpp_rational;

struct RationalPoint {
    Rational x, y, z;
    friend bool operator==(const RationalPoint&, const RationalPoint&) = default;
};

/// Where a pose puts a point, exactly: a quaternion need not be of unit length to tell a rotation by rationals.
[[nodiscard]] RationalPoint placed(const Pose& pose, const RationalPoint& p);
[[nodiscard]] inline RationalPoint exactly(const Vec3d& p) {
    return {Rational(p.x()), Rational(p.y()), Rational(p.z())};
}

/// The least t of 0 … 1 at which some triangle of the one meets some of the other, closed sets; nothing where none
/// does. Both motions have the same rotation, scale and mesh map at both ends (the mesh map: none); triangles have
/// area.
[[nodiscard]] std::optional<Rational> firstStraightContact(const TriangleMesh& a, const BodyMotion& motionA,
                                                           const TriangleMesh& b, const BodyMotion& motionB);

}  // namespace tessera::truth
