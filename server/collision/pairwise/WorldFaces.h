/// Two faces of two shapes as they stand in the world: triangles, or balls around points.
#pragma once

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/pairwise/PairTable.h"

namespace tessera {

struct WorldFaces {
    Triangle a, b;  ///< corners run counter-clockwise seen from outside; of a ball three times its centre
    double radiusA = 0, radiusB = 0;  ///< of balls

    [[nodiscard]] double margin() const { return radiusA + radiusB; }
    [[nodiscard]] bool meet() const;
    /// How far B would have to go along a unit direction to leave A behind; below 0: it has left it by so much.
    [[nodiscard]] double wayOut(const Vec3d& direction) const { return tessera::wayOut(a, b, direction) + margin(); }
    /// On the faces, on the balls; the distance of those that meet is 0.
    [[nodiscard]] NearestPoints nearest() const;
    /// Of centres instead of balls.
    [[nodiscard]] double centresApart() const;
    struct Meeting {
        Vec3d point;   ///< between the two
        Vec3d normal;  ///< of unit length, from A to B
    };
    /// Between the nearest points, where these are clearly apart; else as contactOf, and of balls between the centres.
    [[nodiscard]] Meeting meeting() const;
    /// As contactOf, also of faces that are apart; of balls as meeting.
    [[nodiscard]] Vec3d contactNormal() const { return margin() > 0 ? meeting().normal : contactOf(a, b).normal; }

private:
    [[nodiscard]] NearestPoints bare() const;
    [[nodiscard]] double extent() const;
};

[[nodiscard]] WorldFaces worldFaces(const PlacedShape& a, const PlacedShape& b, const FacePair& faces);

/// Counter-clockwise seen from outside, mirrored or not.
[[nodiscard]] Triangle placedFace(const Affine3d& world, const Triangle& face);
/// Of the balls of a shape, in the world; of those that are stretched, of the balls around them.
[[nodiscard]] double faceRadiusIn(const CollisionShape& shape, const Affine3d& world);

}  // namespace tessera
