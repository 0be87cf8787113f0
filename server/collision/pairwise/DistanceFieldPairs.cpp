#include "server/collision/pairwise/DistanceFieldPairs.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/HullPairs.h"
#include "server/collision/pairwise/SurfacePairs.h"
#include "server/collision/spherical/DistanceLattice.h"

namespace tessera::distance_field_pairs {
namespace {

const TriangleTree& boxTree(const CollisionShape& shape) {
    return shape.tree(VolumeKind::kObb);
}

/// Whose field is looked up in: the faces of the other, who has fewer, are walked, unless only one field serves.
bool inFieldOfA(const CollisionShape& a, const CollisionShape& b, bool fieldOfBServes) {
    if (a.distanceField() == nullptr) return false;
    if (b.distanceField() == nullptr || !fieldOfBServes) return true;
    return b.faceCount() <= a.faceCount();
}

Distance exactly(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                 const DistanceOptions& options) {
    return surface_pairs::distance(a, b, a_T_b, work, options);
}

}  // namespace

Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                  const DistanceOptions& options) {
    const std::optional<double> scale = similarityScale(a_T_b);
    const bool ofA = inFieldOfA(a, b, scale.has_value());
    const bool serves = ofA || (b.distanceField() != nullptr && scale);
    if (!serves || a.deforms() || b.deforms()) return exactly(a, b, a_T_b, work, options);
    // Lengths in the field's frame are so many of A's.
    const double length = ofA ? 1 : *scale;
    const DistanceLattice& field = ofA ? *a.distanceField() : *b.distanceField();
    const Affine3d b_T_a = a_T_b.inverse();
    const Expected<SignedDistance> found =
        surfaceDistance(field, boxTree(ofA ? b : a), ofA ? a_T_b : b_T_a, options.upperBound / length, work);
    if (!found) return exactly(a, b, a_T_b, work, options);
    Distance out;
    if (found->complete && !found->farther && found->distance <= found->error) {
        // Whether they meet is known exactly: 0 says so, and nothing else does.
        const PairTouch touch = surface_pairs::touch(a, b, a_T_b, {work});
        if (touch.touch == Touch::kYes) {
            out.distance = 0;
            out.faces = touch.faces.front();
            out.onA = out.onB = contactOf(a.triangle(out.faces.a), transformed(a_T_b, b.triangle(out.faces.b))).point;
            return out;
        }
        if (touch.touch == Touch::kUnknown) {
            out.complete = false;
            out.distance = 0;
            return out;
        }
    }
    out.complete = found->complete;
    out.farther = found->farther;
    out.error = found->error * length;
    out.distance = found->farther ? options.upperBound : found->distance * length;
    out.faces = {kWhole, kWhole};
    if (!out.complete) {
        out.distance = std::max(0.0, (found->distance - found->error) * length);
        if (!std::isfinite(out.distance)) out.distance = 0;
        out.error = 0;
    }
    const Vec3d onOther = found->point, onField = found->point - found->distance * found->normal;
    out.onA = ofA ? onField : Vec3d(a_T_b * onOther);
    out.onB = ofA ? onOther : Vec3d(a_T_b * onField);
    return out;
}

Distance distanceToHull(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                        const DistanceOptions& options) {
    return hull_pairs::orWithin(distance(a, b, a_T_b, work, options), a, b, a_T_b, work);
}

PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    const auto sides = [](const CollisionShape& shape) {
        return shape.distanceField() != nullptr && shape.distanceField()->isSigned();
    };
    const std::optional<double> scaleA = similarityScale(a.world), scaleB = similarityScale(b.world);
    const bool byA = sides(a.shape) && scaleA, byB = sides(b.shape) && scaleB;
    if (!byA && !byB) return surface_pairs::depth(a, b, work);
    const PlacedShape &frame = byA ? a : b, &other = byA ? b : a;
    const Affine3d frame_T_other = frame.world.inverse() * other.world;
    const Expected<SignedDistance> found =
        byA && byB ? signedDistance(*a.shape.distanceField(), *b.shape.distanceField(), frame_T_other, work)
                   : signedDistance(*frame.shape.distanceField(), boxTree(other.shape), frame_T_other, work);
    if (!found) return surface_pairs::depth(a, b, work);
    PairDepth out;
    if (!found->complete) return out;
    const double length = byA ? *scaleA : *scaleB;
    out.depth = std::max(0.0, -found->distance) * length;
    // Nothing is less deep than 0.
    out.error = std::max(0.0, found->error - std::max(0.0, found->distance)) * length;
    out.point = frame.world * found->point;
    const Vec3d normal = frame.world.linear() * found->normal;
    if (normal.norm() > 0) out.normal = (byA ? 1 : -1) * normal.normalized();
    if (byA && byB) return out;
    // How deep the field's own points are in the other nobody has said: of what crosses, its regions do.
    PairDepth regions = surface_pairs::depth(a, b, work);
    if (!regions.depth || *regions.depth <= *out.depth) return out;
    regions.error = std::max(0.0, *out.depth + out.error - *regions.depth);
    return regions;
}

}  // namespace tessera::distance_field_pairs
