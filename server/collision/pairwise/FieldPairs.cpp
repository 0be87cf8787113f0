#include "server/collision/pairwise/FieldPairs.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/FoundFaces.h"
#include "server/collision/representation/HeightFieldQueries.h"

namespace tessera::field_pairs {
namespace {

/// Asks with the bodies that the two are looked at as.
template <typename Ask>
auto ofBodies(const CollisionShape& a, const CollisionShape& b, const Ask& ask) {
    if (a.heightField() != nullptr && b.heightField() != nullptr) return ask(*a.heightField(), *b.heightField());
    if (a.heightField() != nullptr) return ask(*a.heightField(), b.tree());
    return ask(a.tree(), *b.heightField());
}

}  // namespace

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    const TouchedPair found = ofBodies(
        a, b, [&](const auto& bodyA, const auto& bodyB) { return firstTouching(bodyA, bodyB, a_T_b, effort.work); });
    return foundTouch(found);
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                   const PairEffort& effort) {
    FacePairs found = ofBodies(
        a, b, [&](const auto& bodyA, const auto& bodyB) { return allTouching(bodyA, bodyB, a_T_b, effort.work); });
    return foundContacts(std::move(found), most);
}

Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                  const DistanceOptions& options) {
    return ofBodies(a, b, [&](const auto& bodyA, const auto& bodyB) {
        return distanceBetween(bodyA, bodyB, a_T_b, work, options);
    });
}

Impact firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                    const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options) {
    return ofBodies(a, b, [&](const auto& bodyA, const auto& bodyB) {
        return timeOfImpact(bodyA, motionA, bodyB, motionB, work, options);
    });
}

PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    PairDepth out;
    if (touchOf(a, b, {work}).touch == Touch::kNo) out.depth = 0;
    return out;
}

}  // namespace tessera::field_pairs
