/// Sets of balls against triangle trees, height fields, convex hulls and each other: touching, contacts, distance,
/// depth, first contact.
///
/// Trees and fields are surfaces, hulls are solid. `a_T_b` is any finite affine map from B's frame to A's; lengths,
/// points and normals are in A's frame. A's balls are balls there. B's are, where the map is a similarity; any other
/// map makes ellipsoids of them, and they are taken for the balls around these: the radius grows by the map's largest
/// singular value, so that nothing is missed. Whoever wants it exact takes the set for A.
///
/// Balls touch where the distance, computed in double, is at most the sum of radii times 1 + 1e-12: touching counts,
/// and so does what rounding cannot tell from it (a distance has an error of some 1e-15 of the coordinates in A's
/// frame). Without any radius a point touches by the exact predicates, as the same point in a TriangleTree or a
/// ConvexHull does.
///
/// A point's number is its face; a hull has one face, 0. Thread-safe; answers and counters do not depend on the
/// processor but for those of trees (TriangleTree.h).
#pragma once

#include <concepts>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/representation/HeightField.h"
#include "server/collision/representation/PointSet.h"

namespace tessera {

/// A set of balls and one of the others, in either order.
template <typename A, typename B>
concept WithBalls = (std::same_as<A, PointSet> && (std::same_as<B, PointSet> || std::same_as<B, TriangleTree> ||
                                                   std::same_as<B, HeightField> || std::same_as<B, ConvexHull>)) ||
                    (std::same_as<B, PointSet> &&
                     (std::same_as<A, TriangleTree> || std::same_as<A, HeightField> || std::same_as<A, ConvexHull>));

/// One pair that touches, if any does: any of them, but always the same.
template <typename A, typename B>
requires WithBalls<A, B>
[[nodiscard]] TouchedPair firstTouching(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work);

template <typename A, typename B>
requires WithBalls<A, B>
[[nodiscard]] FacePairs allTouching(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work);

struct BallContact {
    FacePair faces;
    Vec3d point = Vec3d::Zero();    ///< halfway between where each is deepest in the other
    Vec3d normal = Vec3d::UnitX();  ///< of unit length, from A to B: the way in which B has to go to be free of A
    /// How far it has to: the sum of the radii less the distance of the centres, or of the centre and the triangle; of
    /// a centre within a hull the sum of the radii and the centre's depth.
    double depth = 0;
};
struct BallContacts {
    std::vector<BallContact> contacts;  ///< by ascending faces
    bool complete = true;               ///< false: the work was exhausted or `most` were found
};
/// One for each pair that allTouching finds, the first `most` of them. A centre on a triangle is pushed to its outside;
/// of two equal centres B's along x.
template <typename A, typename B>
requires WithBalls<A, B>
[[nodiscard]] BallContacts contactsBetween(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work,
                                           std::size_t most = ~std::size_t{0});

/// As distanceBetween of trees; 0 where some pair touches. onA and onB are on the balls.
template <typename A, typename B>
requires WithBalls<A, B>
[[nodiscard]] Distance distanceBetween(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work,
                                       const DistanceOptions& options = {});

struct BallDepth {
    bool touching = false;
    BallContact deepest;   ///< of all pairs; where none touches the nearest, its depth minus the distance
    bool known = true;     ///< false: one of them is empty, or the work was exhausted
    bool complete = true;  ///< false: the work was exhausted
};
template <typename A, typename B>
requires WithBalls<A, B>
[[nodiscard]] BallDepth depthBetween(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work);

/// As timeOfImpact of trees. Balls grow and shrink with their body's scale: exactly where it scales evenly and does not
/// turn inside out on the way; else they are never too small. `distance` and `point` are those of the balls. A margin
/// in the options comes on top of the radii. A hull's sides are divided into a tree first.
template <typename A, typename B>
requires WithBalls<A, B>
[[nodiscard]] Impact timeOfImpact(const A& a, const BodyMotion& motionA, const B& b, const BodyMotion& motionB,
                                  QueryWork& work, const ImpactOptions& options = {});

/// Points whose balls overlap a box, in the set's frame; appended, ascending. False: the work was exhausted.
[[nodiscard]] bool facesNear(const PointSet& points, const Box& box, QueryWork& work,
                             std::vector<std::uint32_t>& faces);

}  // namespace tessera
