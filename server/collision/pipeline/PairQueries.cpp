#include "server/collision/pipeline/PairQueries.h"

#include <algorithm>
#include <cmath>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/objects/ConservativeBox.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/response/PairTouch.h"

namespace tessera {
namespace {

/// Part of `inner` within the hull of `outer`. Asked only of surfaces that do not meet: then each face is in it as a
/// whole or not at all.
bool inside(const Part& outer, const Part& inner, QueryWork& work) {
    const ConvexHull& hull = *outer.shape->hull;
    const Affine3d outer_T_inner = outer.world.inverse() * inner.world;
    const Box near = boxAround(outer_T_inner.inverse(), hull.bounds());
    const TriangleTree& tree = inner.shape->tree;
    if (!near.overlaps(tree.mesh().bounds())) return false;
    std::vector<std::uint32_t> faces;
    if (!facesNear(tree, near, work, faces)) return false;
    return std::ranges::any_of(faces, [&](std::uint32_t face) {
        const Vec3d p = outer_T_inner * tree.mesh().corner(face, 0);
        return hull.bounds().contains(p) && hull.contains(p);
    });
}

/// The factor by which a similarity stretches lengths; nothing for other maps.
std::optional<double> similarityOf(const Affine3d& m) {
    const Mat3d square = m.linear().transpose() * m.linear();
    const double s2 = square.trace() / 3;
    if (!(s2 > 0) || !((square - s2 * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-12 * s2)) return std::nullopt;
    return std::sqrt(s2);
}

/// The distance in the world of two trees, A's world pose being a similarity.
void measure(DistanceAnswer& out, const TriangleTree& a, const Affine3d& worldA, double scale, const TriangleTree& b,
             const Affine3d& worldB, std::optional<FacePair> start, double upperBound, QueryWork& work) {
    const Distance found = distanceBetween(a, b, worldA.inverse() * worldB, work,
                                           {.upperBound = upperBound / scale, .tolerance = 0, .start = start});
    out.complete = found.complete;
    out.farther = found.farther || !found.complete;
    out.distance = found.distance * scale;
    out.faces = found.faces;
    out.pointA = worldA * found.onA;
    out.pointB = worldA * found.onB;
}

}  // namespace

void askTouch(PairState& state, const Part& a, const Part& b, bool all, std::size_t most, QueryWork& work) {
    TouchAnswer& known = state.touch;
    if (known.holds(a, b, all)) return;
    const bool hulls = a.shape->hull && b.shape->hull;
    known.faces.clear();
    known.all = all || hulls;
    known.touching = false;
    known.complete = true;
    known.faceCount = 0;
    if (hulls) {
        ConvexWork convex{.limit = 100'000};
        const Touch touch =
            hullsTouching(*a.shape->hull, *b.shape->hull, a.world.inverse() * b.world, convex, &state.hulls);
        work.triangleTests += convex.supports;
        known.complete = touch != Touch::kUnknown;
        known.touching = touch == Touch::kYes;
        known.faceCount = known.touching ? 1 : 0;
    } else if (all) {
        FacePairs found = surfaceFacesTouching({a.shape->tree, a.world}, {b.shape->tree, b.world}, work);
        known.complete = found.complete;
        known.touching = !found.pairs.empty();
        known.faceCount = found.pairs.size();
        found.pairs.resize(std::min(found.pairs.size(), most));
        found.pairs.shrink_to_fit();
        known.faces = std::move(found.pairs);
    } else {
        const TouchedPair found =
            firstSurfacesTouching({a.shape->tree, a.world}, {b.shape->tree, b.world}, state.front, work);
        known.complete = found.touch != Touch::kUnknown;
        known.touching = found.touch == Touch::kYes;
        if (known.touching) known.faces.push_back(found.faces);
        known.faceCount = known.faces.size();
    }
    if (!hulls && !known.touching && known.complete) {
        known.touching = (a.shape->hull && inside(a, b, work)) || (b.shape->hull && inside(b, a, work));
        known.faceCount = known.touching ? 1 : 0;
    }
    // An answer that the work was not enough for is asked again.
    known.versionA = known.complete ? a.poseVersion : 0;
    known.versionB = known.complete ? b.poseVersion : 0;
}

void askDistance(PairState& state, const Part& a, const Part& b, double upperBound, QueryWork& work) {
    DistanceAnswer& known = state.distance;
    if (known.versionA == a.poseVersion && known.versionB == b.poseVersion && known.versionA != 0 &&
        known.upperBound == upperBound)
        return;
    known.upperBound = upperBound;
    const TriangleTree& treeA = a.shape->tree;
    const TriangleTree& treeB = b.shape->tree;
    if (const std::optional<double> scaleA = similarityOf(a.world)) {
        measure(known, treeA, a.world, *scaleA, treeB, b.world, state.nearest, upperBound, work);
    } else if (const std::optional<double> scaleB = similarityOf(b.world)) {
        std::optional<FacePair> start = state.nearest;
        if (start) std::swap(start->a, start->b);
        measure(known, treeB, b.world, *scaleB, treeA, a.world, start, upperBound, work);
        std::swap(known.faces.a, known.faces.b);
        std::swap(known.pointA, known.pointB);
    } else {
        // Neither frame keeps the world's lengths: A's triangles are taken to the world. Rare, and dear.
        TriangleMesh mesh = treeA.mesh();
        std::vector<Vec3d> positions;
        positions.reserve(mesh.vertexCount());
        for (const Vec3d p : mesh.positions()) positions.push_back(a.world * p);
        known.complete = mesh.move(positions).has_value();
        if (known.complete)
            measure(known, TriangleTree(std::move(mesh)), Affine3d::Identity(), 1, treeB, b.world, state.nearest,
                    upperBound, work);
    }
    if (known.complete && !known.farther) state.nearest = known.faces;
    if (known.complete && a.shape->hull && b.shape->hull && known.distance > 0) {
        // One inside the other: no distance between solids.
        ConvexWork convex{.limit = 100'000};
        if (hullsTouching(*a.shape->hull, *b.shape->hull, a.world.inverse() * b.world, convex, &state.hulls) ==
            Touch::kYes) {
            known.distance = 0;
            known.farther = false;
        }
    }
    known.versionA = known.complete ? a.poseVersion : 0;
    known.versionB = known.complete ? b.poseVersion : 0;
}

namespace {

Contact toWorld(const Affine3d& worldA, const Vec3d& point, const Vec3d& normal) {
    const Mat3d world_N_a = worldA.linear().inverse().transpose();
    Contact contact;
    contact.point = worldA * point;
    contact.normal = (world_N_a * normal).stableNormalized();
    return contact;
}

Contact between(const Part& a, const Part& b, const FacePair& faces, Contact contact) {
    contact.faceA = a.shape->hull ? Contact::kNoFace : faces.a;
    contact.faceB = b.shape->hull ? Contact::kNoFace : faces.b;
    return contact;
}

Contact contactInWorld(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB,
                       const FacePair& faces) {
    Triangle triangleA = transformed(worldA, a.shape->tree.mesh().triangle(faces.a));
    Triangle triangleB = transformed(worldB, b.shape->tree.mesh().triangle(faces.b));
    if (worldA.linear().determinant() < 0) std::swap(triangleA[1], triangleA[2]);
    if (worldB.linear().determinant() < 0) std::swap(triangleB[1], triangleB[2]);
    const TriangleContact found = contactOf(triangleA, triangleB);
    Contact contact;
    contact.point = found.point;
    contact.normal = found.normal.stableNormalized();
    return between(a, b, faces, contact);
}

}  // namespace

Contact contactOfFaces(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB,
                       const FacePair& faces) {
    // A part that is flat where they meet (a scale that goes through zero) has no frame to look from.
    if (!invertible(worldA)) return contactInWorld(a, b, worldA, worldB, faces);
    const Affine3d a_T_b = worldA.inverse() * worldB;
    Triangle triangleB = transformed(a_T_b, b.shape->tree.mesh().triangle(faces.b));
    if (a_T_b.linear().determinant() < 0) std::swap(triangleB[1], triangleB[2]);
    const TriangleContact local = contactOf(a.shape->tree.mesh().triangle(faces.a), triangleB);
    return between(a, b, faces, toWorld(worldA, local.point, local.normal));
}

Contact contactOfHulls(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB) {
    ConvexWork work{.limit = 100'000};
    const HullDepth depth = hullDepth(*a.shape->hull, *b.shape->hull, worldA.inverse() * worldB, work);
    Contact contact = toWorld(worldA, 0.5 * (depth.onA + depth.onB), depth.normal);
    contact.faceA = contact.faceB = Contact::kNoFace;
    return contact;
}

}  // namespace tessera
