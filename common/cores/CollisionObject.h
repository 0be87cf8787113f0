/// What takes part in collisions.
#pragma once

#include "common/cores/CollisionWords.h"
#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// What takes part in collisions as one object: `node` and all below it, but for what belongs to an object further
/// down. server/collision/README.md tells what becomes of it.
struct CollisionObject : CollisionWords {
    static constexpr ObjectType kType{14};
    ObjectId node;  ///< none: the core means nothing
    /// Static: expected to stay; moved all the same, it jumps. Rigid: its motions are followed from frame to frame.
    /// Deforming: the arrays of its geometries may change in every frame.
    std::int64_t kind = kRigid;
    std::int64_t division =
        kWhole;  ///< a group: each child of the node, or each geometry below it, is an object by itself
    /// The surface as it is drawn; the convex hull of each geometry, which is solid; the same surface by its heights
    /// over a grid; or the balls around points. Spherical: the same surface, what touches it looked up by directions.
    /// Distance field: the same surface, but its distances are approximate, wrong by `error` at most, and quick. Auto:
    /// balls for points, heights for a large grid, a distance field where an `error` is allowed, else the surface.
    /// Freeform: the smooth surface itself that a SubdivisionSurface or a NurbsSurface stands for, in place of the
    /// triangles that are drawn of it: what it touches, where, and how far it is away, to `error`; motions stop at it,
    /// too. By the triangles go all the same: what touches already as a motion begins, free bodies, times of mode
    /// dynamic, rollbacks, and what meets points or a height field. Auto takes it of what deforms where an `error` is
    /// allowed. Spherical Bézier: the same surface, of which patches over directions from within tell quickly that
    /// something is apart; answers are the surface's. It may deform, and has to be star-shaped as it comes. Where a
    /// geometry is not what is asked for, or deforms and is neither freeform nor spherical Bézier, it is taken as the
    /// surface that is drawn, and the report names it.
    std::int64_t shape = kTriangles;
    std::int64_t layers = 1;  ///< bits for the masks of interests; 0: takes part in nothing
    /// Above 0, for rigid objects that are whole and whose node is a Transform of its own: a free body, which gravity,
    /// impulses and its velocities move. 0: moved by motions and hands alone, and by no impulse.
    double mass = 0;
    double restitution = 0.2;        ///< 0 to 1; of two bodies the greater counts
    double friction = 0.5;           ///< Coulomb's; of two bodies the geometric mean counts
    Vec3d velocity = Vec3d::Zero();  ///< of a free body's centre of mass
    Vec3d spin = Vec3d::Zero();      ///< of a free body; world axes
    /// What bounds the triangles in the trees of its geometries: how long answers take. No yes or no and no distance
    /// depends on it; where a motion stops does, within the tolerance. Free bodies take oriented boxes.
    std::int64_t volume = kAuto;
    /// How near to it a motion is stopped, and how deep two may lie in each other and still slide, in units of the
    /// world. Of two objects the smaller one counts. 0: a ten-thousandth of what moves.
    double tolerance = 0;
    /// Above 0: a surface of triangles is looked at as solid balls that cover it, of the radius (diagonal of the
    /// geometry's own bounding box) / 2^(level + 1). What touches the surface touches the balls; what is farther from
    /// it than two radii touches none. Hulls, points, what deforms and free bodies stay as they are.
    std::int64_t level = 0;
    /// By how much distances from it may be wrong, in percent of the diagonal of each geometry's own bounding box: of
    /// distance fields (0: 1 percent) and of what chooses its shape itself (0: not at all). Below 0.1 there is no such
    /// field, and of most shapes below 0.3: too many places to keep. What touches, and where motions stop, is exact all
    /// the same. Of freeform (0: 0.01 percent) also how far apart may be what is told to touch; what meets is never
    /// told apart.
    double error = 0;

    static constexpr double kFastest = 1e6;
    static constexpr double kLargestError = 20;
    static constexpr std::int64_t kFinestLevel = 12;
};
template <>
inline constexpr auto kSaid<CollisionObject> = []<typename T>(Describing<T>) {
    return describe("CollisionObject", field<&T::node>(1, "node").to(typeOf<Node>()).affects(Effect::kRules),
                    field<&T::kind>(2, "kind")
                        .oneOf({{CollisionObject::kStatic, "static"},
                                {CollisionObject::kRigid, "rigid"},
                                {CollisionObject::kDeforming, "deforming"}})
                        .affects(Effect::kRules),
                    field<&T::division>(3, "division")
                        .oneOf({{CollisionObject::kWhole, "whole"},
                                {CollisionObject::kEachChild, "each-child"},
                                {CollisionObject::kEachGeometry, "each-geometry"}})
                        .affects(Effect::kRules),
                    field<&T::shape>(4, "shape")
                        .oneOf({{CollisionObject::kTriangles, "triangles"},
                                {CollisionObject::kHull, "hull"},
                                {CollisionObject::kHeightField, "heightfield"},
                                {CollisionObject::kPoints, "points"},
                                {CollisionObject::kAutoShape, "auto"},
                                {CollisionObject::kSpherical, "spherical"},
                                {CollisionObject::kDistanceField, "distance-field"},
                                {CollisionObject::kFreeform, "freeform"},
                                {CollisionObject::kSphericalBezier, "spherical-bezier"}})
                        .affects(Effect::kRules),
                    field<&T::layers>(5, "layers").affects(Effect::kRules),
                    field<&T::mass>(6, "mass").between(0, 1e12).affects(Effect::kTerms),
                    field<&T::restitution>(7, "restitution").between(0, 1).affects(Effect::kTerms),
                    field<&T::friction>(8, "friction").between(0, 1e3).affects(Effect::kTerms),
                    field<&T::velocity>(9, "velocity")
                        .unit(Unit::kWorldPerSecond)
                        .between(-CollisionObject::kFastest, CollisionObject::kFastest)
                        .affects(Effect::kTerms),
                    field<&T::spin>(10, "spin")
                        .unit(Unit::kRadianPerSecond)
                        .between(-CollisionObject::kFastest, CollisionObject::kFastest)
                        .affects(Effect::kTerms),
                    field<&T::volume>(11, "volume")
                        .oneOf({{CollisionObject::kAuto, "auto"},
                                {CollisionObject::kSphere, "sphere"},
                                {CollisionObject::kAabb, "aabb"},
                                {CollisionObject::kObb, "obb"},
                                {CollisionObject::kDop6, "6-dop"},
                                {CollisionObject::kDop14, "14-dop"},
                                {CollisionObject::kDop18, "18-dop"},
                                {CollisionObject::kDop26, "26-dop"}})
                        .affects(Effect::kRules),
                    field<&T::tolerance>(12, "tolerance").between(0, 1e12).affects(Effect::kTerms),
                    field<&T::level>(13, "level").between(0, CollisionObject::kFinestLevel).affects(Effect::kRules),
                    field<&T::error>(14, "error").between(0, CollisionObject::kLargestError).affects(Effect::kRules));
};

}  // namespace tessera
