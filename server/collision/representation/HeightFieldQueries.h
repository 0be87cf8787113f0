/// Height fields against triangle trees and against each other: touching, contacts, distance, first contact; rays.
///
/// As the queries of trees (query/*.h), with the same answers: faces are those of the mesh, every yes and no is
/// trianglesIntersect's on A's vertices and B's mapped to A's frame in double, distances are the same to the bit.
/// `a_T_b` is any finite affine map. Of several pairs that meet, firstTouching may name another one than trees do;
/// times of impact differ within the tolerance. Thread-safe; answers and counters do not depend on the processor but
/// for those of spheres and oriented boxes of trees (TriangleTree.h).
#pragma once

#include <optional>
#include <span>

#include "server/collision/query/ContactQuery.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/RayQuery.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/representation/HeightField.h"

namespace tessera {

/// Any map will do, but one that flattens B, or nearly, makes a field that is B as dear as a walk down both bodies.
/// What is small is dear by its own size alone, not by the field's.
[[nodiscard]] TouchedPair firstTouching(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                        QueryWork& work);
[[nodiscard]] TouchedPair firstTouching(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b,
                                        QueryWork& work);
[[nodiscard]] TouchedPair firstTouching(const HeightField& a, const HeightField& b, const Affine3d& a_T_b,
                                        QueryWork& work);

[[nodiscard]] FacePairs allTouching(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                    QueryWork& work);
[[nodiscard]] FacePairs allTouching(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b,
                                    QueryWork& work);
[[nodiscard]] FacePairs allTouching(const HeightField& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work);

[[nodiscard]] BodyContacts contactsBetween(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                           QueryWork& work, std::size_t most = ~std::size_t{0});
[[nodiscard]] BodyContacts contactsBetween(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b,
                                           QueryWork& work, std::size_t most = ~std::size_t{0});
[[nodiscard]] BodyContacts contactsBetween(const HeightField& a, const HeightField& b, const Affine3d& a_T_b,
                                           QueryWork& work, std::size_t most = ~std::size_t{0});

[[nodiscard]] Distance distanceBetween(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                       QueryWork& work, const DistanceOptions& options = {});
[[nodiscard]] Distance distanceBetween(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b,
                                       QueryWork& work, const DistanceOptions& options = {});
[[nodiscard]] Distance distanceBetween(const HeightField& a, const HeightField& b, const Affine3d& a_T_b,
                                       QueryWork& work, const DistanceOptions& options = {});

[[nodiscard]] Impact timeOfImpact(const HeightField& a, const BodyMotion& motionA, const TriangleTree& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options = {});
[[nodiscard]] Impact timeOfImpact(const TriangleTree& a, const BodyMotion& motionA, const HeightField& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options = {});
[[nodiscard]] Impact timeOfImpact(const HeightField& a, const BodyMotion& motionA, const HeightField& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options = {});

/// Between two states: every vertex goes straight to its end position, one per vertex of the mesh (a field's may leave
/// their places in the grid). No end positions for a field: it rests. Those faces of a field that come near are put
/// into a tree.
[[nodiscard]] Impact timeOfImpact(const HeightField& a, std::span<const Vec3d> endA, const TriangleTree& b,
                                  std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options = {});
[[nodiscard]] Impact timeOfImpact(const TriangleTree& a, std::span<const Vec3d> endA, const HeightField& b,
                                  std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options = {});

/// As of a tree (FacesNear.h).
[[nodiscard]] bool facesNear(const HeightField& field, const Box& box, QueryWork& work,
                             std::vector<std::uint32_t>& faces);

/// As of a tree (RayQuery.h).
[[nodiscard]] std::optional<RayHit> castRay(const HeightField& field, const Ray& ray, double maxT);

}  // namespace tessera
