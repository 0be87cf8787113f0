#include "server/collision/pairwise/PairContact.h"

#include <algorithm>
#include <utility>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/PointPairs.h"
#include "server/collision/pairwise/WorldFaces.h"

namespace tessera {

Vec2d placeOn(const Triangle& t, const Vec3d& point) {
    const Vec3d p = point - t[0], e = t[1] - t[0], f = t[2] - t[0];
    const double ee = e.squaredNorm(), ff = f.squaredNorm(), ss = (f - e).squaredNorm();
    const bool firstIsLonger = ee >= ff;
    const Vec3d &longer = firstIsLonger ? e : f, &shorter = firstIsLonger ? f : e;
    // Square to the longer of the two sides: needles keep their digits.
    const Vec3d across =
        std::max(ee, ff) > 0 ? Vec3d(shorter - shorter.dot(longer) / std::max(ee, ff) * longer) : Vec3d::Zero();
    if (constexpr double kThin = 1e-24; across.squaredNorm() > kThin * shorter.squaredNorm()) {
        const double s = std::clamp(p.dot(across) / across.squaredNorm(), 0.0, 1.0);
        const double l = std::clamp((p - s * shorter).dot(longer) / longer.squaredNorm(), 0.0, 1 - s);
        return firstIsLonger ? Vec2d(l, s) : Vec2d(s, l);
    }
    // Without area it is its longest side.
    const double longest = std::max({ee, ff, ss});
    const auto along = [&](const Vec3d& from, const Vec3d& side) {
        return longest > 0 ? std::clamp((p - from).dot(side) / longest, 0.0, 1.0) : 0.0;
    };
    if (ee == longest) return {along(Vec3d::Zero(), e), 0};
    if (ff == longest) return {0, along(Vec3d::Zero(), f)};
    const double s = along(e, f - e);
    return {1 - s, s};
}

namespace {

/// A triangle in the frame of its shape.
struct PlacedTriangle {
    const Triangle& corners;
    const Affine3d& world;
};

PairContact contactOfTriangles(const PlacedTriangle& a, const PlacedTriangle& b, const FacePair& faces) {
    PairContact out;
    out.faces = faces;
    if (invertible(a.world)) {
        const Affine3d a_T_world = a.world.inverse();
        const Affine3d a_T_b = a_T_world * b.world;
        Triangle triangleB = transformed(a_T_b, b.corners);
        if (a_T_b.linear().determinant() < 0) std::swap(triangleB[1], triangleB[2]);
        const TriangleContact local = contactOf(a.corners, triangleB);
        out.point = a.world * local.point;
        out.normal = (a_T_world.linear().transpose() * local.normal).stableNormalized();
    } else {
        // Flat where they meet (a scale that goes through zero), it has no frame to look from.
        const TriangleContact found = contactOf(placedFace(a.world, a.corners), placedFace(b.world, b.corners));
        out.point = found.point;
        out.normal = found.normal.stableNormalized();
    }
    out.uvA = placeOn(transformed(a.world, a.corners), out.point);
    out.uvB = placeOn(transformed(b.world, b.corners), out.point);
    return out;
}

}  // namespace

PairContact contactOfFaces(const PlacedShape& a, const PlacedShape& b, const FacePair& faces) {
    if (a.shape.points() != nullptr || b.shape.points() != nullptr) return point_pairs::contact(a, b, faces);
    return contactOfTriangles({a.shape.triangle(faces.a), a.world}, {b.shape.triangle(faces.b), b.world}, faces);
}

PairContact contactWithItself(const PlacedShape& shape, const FacePair& faces) {
    const TriangleMesh& mesh = shape.shape.mesh();
    return contactOfTriangles({mesh.triangle(faces.a), shape.world}, {mesh.triangle(faces.b), shape.world}, faces);
}

std::uint32_t drawnFace(const PlacedShape& of, std::uint32_t face, const Vec3d& towards) {
    if (of.shape.isCover()) return of.shape.coveredFace(face);
    return of.shape.points() == nullptr || face == kWhole ? face : point_pairs::octahedronAt(of, face, towards).face;
}

PairContact contactOfHulls(const PlacedShape& a, const PlacedShape& b) {
    QueryWork work;
    const PairDepth found = depthOf(a, b, work);
    return {.faces = {kWhole, kWhole}, .point = found.point, .normal = found.normal, .depth = found.depth};
}

}  // namespace tessera
