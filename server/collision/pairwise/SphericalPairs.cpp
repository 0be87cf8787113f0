#include "server/collision/pairwise/SphericalPairs.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/FoundFaces.h"
#include "server/collision/pairwise/SurfacePairs.h"
#include "server/collision/spherical/FieldTouch.h"

namespace tessera::spherical_pairs {
namespace {

/// The trees that are walked beside a field are those of oriented boxes.
template <typename Ask>
auto ofFields(const CollisionShape& a, const CollisionShape& b, const Ask& ask) {
    if (a.sphericalField() != nullptr && b.sphericalField() != nullptr)
        return ask(*a.sphericalField(), *b.sphericalField());
    if (a.sphericalField() != nullptr) return ask(*a.sphericalField(), b.tree(VolumeKind::kObb));
    return ask(a.tree(VolumeKind::kObb), *b.sphericalField());
}

}  // namespace

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    if (a.deforms() || b.deforms()) return surface_pairs::touch(a, b, a_T_b, effort);
    const TouchedPair found = ofFields(a, b, [&](const auto& bodyA, const auto& bodyB) {
        return firstTouching(bodyA, bodyB, a_T_b, effort.work, {.workers = effort.workers});
    });
    return foundTouch(found);
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                   const PairEffort& effort) {
    if (a.deforms() || b.deforms()) return surface_pairs::contacts(a, b, a_T_b, most, effort);
    FacePairs found = ofFields(a, b, [&](const auto& bodyA, const auto& bodyB) {
        return allTouching(bodyA, bodyB, a_T_b, effort.work, {.workers = effort.workers});
    });
    return foundContacts(std::move(found), most);
}

}  // namespace tessera::spherical_pairs
