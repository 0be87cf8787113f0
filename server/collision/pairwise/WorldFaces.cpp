#include "server/collision/pairwise/WorldFaces.h"

#include <algorithm>
#include <utility>

#include "server/collision/representation/BallPairs.h"

namespace tessera {

namespace {

bool isPoint(const Triangle& t) {
    return t[0] == t[1] && t[1] == t[2];
}

}  // namespace

NearestPoints WorldFaces::bare() const {
    if (!(margin() > 0)) return nearestPoints(a, b);
    NearestPoints near{a[0], b[0], 0};
    if (isPoint(a))
        near.onB = nearestOnTriangle(b, a[0]);
    else
        near.onA = nearestOnTriangle(a, b[0]);
    near.distance = (near.onB - near.onA).norm();
    return near;
}

double WorldFaces::extent() const {
    double out = margin();
    for (const Triangle* t : {&a, &b})
        for (const Vec3d& p : *t) out = std::max(out, p.cwiseAbs().maxCoeff());
    return out;
}

double WorldFaces::centresApart() const {
    return bare().distance;
}

bool WorldFaces::meet() const {
    return margin() > 0 ? bare().distance <= BallRadii{radiusA, radiusB}.reach() : trianglesIntersect(a, b);
}

NearestPoints WorldFaces::nearest() const {
    NearestPoints near = bare();
    if (margin() > 0 && near.distance > 0) {
        const Vec3d n = (near.onB - near.onA) / near.distance;
        near.onA += radiusA * n;
        near.onB -= radiusB * n;
    }
    near.distance = meet() ? 0 : std::max(0.0, near.distance - margin());
    return near;
}

WorldFaces::Meeting WorldFaces::meeting() const {
    // Nearer than that rounding would choose the direction.
    const double rounding = 1e-12 * extent();
    if (margin() > 0) {
        Vec3d along = isPoint(b) ? outside(a) : Vec3d(-outside(b));
        if (along.isZero(0)) along = Vec3d::UnitX();
        const BallContact found = contactOfBalls({}, bare(), {radiusA, radiusB}, along, rounding);
        return {found.point, found.normal};
    }
    const NearestPoints near = nearest();
    if (near.distance > rounding) return {0.5 * (near.onA + near.onB), (near.onB - near.onA) / near.distance};
    const TriangleContact contact = contactOf(a, b);
    return {contact.point, contact.normal};
}

Triangle placedFace(const Affine3d& world, const Triangle& face) {
    Triangle out = transformed(world, face);
    if (world.linear().determinant() < 0) std::swap(out[1], out[2]);
    return out;
}

double faceRadiusIn(const CollisionShape& shape, const Affine3d& world) {
    return shape.faceRadius() > 0 ? shape.faceRadius() * largestStretch(world.linear()) : 0;
}

WorldFaces worldFaces(const PlacedShape& a, const PlacedShape& b, const FacePair& faces) {
    return {placedFace(a.world, a.shape.triangle(faces.a)), placedFace(b.world, b.shape.triangle(faces.b)),
            faceRadiusIn(a.shape, a.world), faceRadiusIn(b.shape, b.world)};
}

}  // namespace tessera
