#include "server/collision/pairwise/SphericalBezierPairs.h"

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/SurfacePairs.h"
#include "server/collision/spherical_bezier/SphericalBezierTouch.h"

namespace tessera::spherical_bezier_pairs {
namespace {

struct Ball {
    Vec3d centre;
    double radius;
};

Ball around(const CollisionShape& shape) {
    return {shape.bounds().center(), 0.5 * shape.bounds().size().norm()};
}

/// Whether the patches show the two apart.
bool areApart(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work) {
    if (a.faceCount() == 0 || b.faceCount() == 0) return true;
    const SphericalBezierBound *patchesA = a.sphericalBezier(), *patchesB = b.sphericalBezier();
    if (patchesA != nullptr && patchesB != nullptr)
        return patchesThatMayMeet(*patchesA, *patchesB, a_T_b, work).empty();
    const std::optional<double> scale = similarityScale(a_T_b);
    if (!scale) return false;
    if (patchesA != nullptr) {
        const Ball ball = around(b);
        return !mayMeetBall(*patchesA, a_T_b * ball.centre, *scale * ball.radius, work);
    }
    const Ball ball = around(a);
    return !mayMeetBall(*patchesB, a_T_b.inverse() * ball.centre, ball.radius / *scale, work);
}

}  // namespace

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    if (!effort.work.exhausted() && areApart(a, b, a_T_b, effort.work)) return {};
    return surface_pairs::touch(a, b, a_T_b, effort);
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                   const PairEffort& effort) {
    if (!effort.work.exhausted() && areApart(a, b, a_T_b, effort.work)) return {};
    return surface_pairs::contacts(a, b, a_T_b, most, effort);
}

}  // namespace tessera::spherical_bezier_pairs
