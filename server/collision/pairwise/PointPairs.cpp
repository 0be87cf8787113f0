#include "server/collision/pairwise/PointPairs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/FoundFaces.h"
#include "server/collision/pairwise/WorldFaces.h"
#include "server/collision/representation/BallPairs.h"
#include "server/collision/representation/PointSetQueries.h"

namespace tessera::point_pairs {
namespace {

/// Asks with the bodies that the two are looked at as.
template <Hulls kHulls, typename Ask>
auto ofBodies(const CollisionShape& a, const CollisionShape& b, const Ask& ask) {
    const auto asOther = [&](const CollisionShape& shape, const auto& then) {
        if (shape.heightField() != nullptr) return then(*shape.heightField());
        if constexpr (kHulls == Hulls::kSolids)
            if (shape.hull() != nullptr) return then(*shape.hull());
        return then(shape.tree());
    };
    if (a.points() != nullptr && b.points() != nullptr) return ask(*a.points(), *b.points());
    if (a.points() != nullptr) return asOther(b, [&](const auto& body) { return ask(*a.points(), body); });
    return asOther(a, [&](const auto& body) { return ask(body, *b.points()); });
}

/// A hull's one face, which is 0 in what knows no other, is all of it.
FacePair named(const CollisionShape& a, const CollisionShape& b, FacePair faces) {
    if (a.hull() != nullptr) faces.a = kWhole;
    if (b.hull() != nullptr) faces.b = kWhole;
    return faces;
}

/// A cover's centres, or the triangles of a surface: those two by their trees.
const TriangleTree* treeBesideCover(const CollisionShape& shape) {
    if (shape.isCover()) return &shape.centreTree();
    const bool isSurface = shape.representation() == Representation::kTriangles ||
                           shape.representation() == Representation::kSphericalBezier;
    return isSurface ? &shape.tree(kAutomaticVolume) : nullptr;
}

std::optional<Distance> distanceByTrees(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                        QueryWork& work, const DistanceOptions& options) {
    if (!(a.isCover() || b.isCover()) || !(a.faceRadius() + b.faceRadius() > 0)) return std::nullopt;
    const TriangleTree *treeA = treeBesideCover(a), *treeB = treeBesideCover(b);
    if (treeA == nullptr || treeB == nullptr) return std::nullopt;
    const BallRadii radii{a.faceRadius(), faceRadiusIn(b, a_T_b)};
    DistanceOptions bare = options;
    bare.upperBound += radii.sum();
    return distanceOfBalls(distanceBetween(*treeA, *treeB, a_T_b, work, bare), radii, options);
}

PairDepth turned(PairDepth depth) {
    depth.normal = -depth.normal;
    return depth;
}

}  // namespace

template <Hulls kHulls>
PairTouch Methods<kHulls>::touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                 const PairEffort& effort) {
    const TouchedPair found = ofBodies<kHulls>(
        a, b, [&](const auto& bodyA, const auto& bodyB) { return firstTouching(bodyA, bodyB, a_T_b, effort.work); });
    PairTouch out = foundTouch(found);
    if constexpr (kHulls == Hulls::kSolids)
        for (FacePair& faces : out.faces) faces = named(a, b, faces);
    return out;
}

template <Hulls kHulls>
PairTouch Methods<kHulls>::contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                    std::size_t most, const PairEffort& effort) {
    FacePairs found = ofBodies<kHulls>(
        a, b, [&](const auto& bodyA, const auto& bodyB) { return allTouching(bodyA, bodyB, a_T_b, effort.work); });
    PairTouch out = foundContacts(std::move(found), most);
    if constexpr (kHulls == Hulls::kSolids)
        for (FacePair& faces : out.faces) faces = named(a, b, faces);
    return out;
}

template <Hulls kHulls>
Distance Methods<kHulls>::distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                   QueryWork& work, const DistanceOptions& options) {
    if (const std::optional<Distance> found = distanceByTrees(a, b, a_T_b, work, options)) return *found;
    Distance out = ofBodies<kHulls>(a, b, [&](const auto& bodyA, const auto& bodyB) {
        return distanceBetween(bodyA, bodyB, a_T_b, work, options);
    });
    if constexpr (kHulls == Hulls::kSolids) out.faces = named(a, b, out.faces);
    return out;
}

template <Hulls kHulls>
Impact Methods<kHulls>::firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                                     const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options) {
    Impact out = ofBodies<kHulls>(a, b, [&](const auto& bodyA, const auto& bodyB) {
        return timeOfImpact(bodyA, motionA, bodyB, motionB, work, options);
    });
    if constexpr (kHulls == Hulls::kSolids) out.faces = named(a, b, out.faces);
    return out;
}

template <Hulls kHulls>
PairDepth Methods<kHulls>::depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    if (a.shape.points() == nullptr) return turned(depth(b, a, work));
    // In the frame of points.
    PairDepth out;
    if (!invertible(a.world)) return out;
    const Affine3d a_T_world = a.world.inverse(), a_T_b = a_T_world * b.world;
    const BallDepth found = ofBodies<kHulls>(a.shape, b.shape, [&](const auto& bodyA, const auto& bodyB) {
        return depthBetween(bodyA, bodyB, a_T_b, work);
    });
    if (!found.known) {
        if (found.complete) out.depth = 0;  // one of them is empty
        return out;
    }
    const Vec3d form = a_T_world.linear().transpose() * found.deepest.normal;
    const double unit = form.stableNorm();
    if (!(unit > 0)) return out;
    out.normal = form / unit;
    out.point = a.world * found.deepest.point;
    out.depth = found.touching ? std::max(0.0, found.deepest.depth) / unit : 0;
    return out;
}

template struct Methods<Hulls::kSurfaces>;
template struct Methods<Hulls::kSolids>;

namespace {

/// A is the points, B a hull.
PairContact contactInHull(const PlacedShape& a, const PlacedShape& b, std::uint32_t point) {
    PairContact out;
    const std::array<Vec3d, 1> place{a.shape.triangle(point)[0]};
    const auto ball = CollisionShape::ofPoints(place, a.shape.faceRadius());
    if (!ball) return out;
    QueryWork work;
    const PairDepth found = Methods<Hulls::kSolids>::depth({**ball, a.world}, b, work);
    out.point = found.point;
    out.normal = found.normal;
    out.depth = found.depth;
    return out;
}

}  // namespace

PairContact contact(const PlacedShape& a, const PlacedShape& b, const FacePair& faces) {
    PairContact out;
    if (faces.b == kWhole) {
        out = contactInHull(a, b, faces.a);
    } else if (faces.a == kWhole) {
        out = contactInHull(b, a, faces.b);
        out.normal = -out.normal;
    } else {
        const WorldFaces placed = worldFaces(a, b, faces);
        const WorldFaces::Meeting meeting = placed.meeting();
        out.point = meeting.point;
        out.normal = meeting.normal;
        out.depth = std::max(0.0, placed.margin() - placed.centresApart());
    }
    const auto place = [&](const PlacedShape& of, std::uint32_t& face, const Vec3d& towards) -> Vec2d {
        if (face == kWhole) return Vec2d::Zero();
        if (of.shape.isCover()) face = of.shape.coveredFace(face);
        if (of.shape.isCover()) {
            const Triangle triangle = transformed(of.world, of.shape.mesh().triangle(face));
            return placeOn(triangle, nearestOnTriangle(triangle, out.point));  // the point is beside the surface
        }
        if (of.shape.points() == nullptr) return placeOn(transformed(of.world, of.shape.triangle(face)), out.point);
        const OnOctahedron at = octahedronAt(of, face, towards);
        face = at.face;
        return at.uv;
    };
    out.faces = faces;
    out.uvA = place(a, out.faces.a, out.normal);
    out.uvB = place(b, out.faces.b, -out.normal);
    return out;
}

OnOctahedron octahedronAt(const PlacedShape& points, std::uint32_t point, const Vec3d& direction) {
    // A direction between points is no linear form: it comes back as differences of points do.
    Vec3d own = invertible(points.world) ? Vec3d(points.world.linear().inverse() * direction) : Vec3d::UnitX();
    const double sum = own.cwiseAbs().sum();
    if (!(sum > 0) || !std::isfinite(sum)) own = Vec3d::UnitX();
    const Vec3d weight = own.cwiseAbs() / own.cwiseAbs().sum();
    const unsigned octant = (own.x() < 0 ? 1U : 0U) | (own.y() < 0 ? 2U : 0U) | (own.z() < 0 ? 4U : 0U);
    // Mirrored octants are turned around (CollisionShape.cpp).
    const bool mirrored = std::popcount(octant) % 2 == 1;
    return {8 * point + octant, mirrored ? Vec2d(weight.z(), weight.y()) : Vec2d(weight.y(), weight.z())};
}

}  // namespace tessera::point_pairs
