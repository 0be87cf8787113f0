/// What queries need of one geometry: its faces, and the representations that answer quickly.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Box.h"
#include "server/collision/convex/ConvexHull.h"
#include "server/collision/freeform/FreeformShape.h"
#include "server/collision/query/SurfaceTopology.h"
#include "server/collision/representation/BallCover.h"
#include "server/collision/representation/HeightField.h"
#include "server/collision/representation/PointSet.h"
#include "server/collision/spherical/DistanceLattice.h"
#include "server/collision/spherical/SphericalField.h"
#include "server/collision/spherical_bezier/DeformingSurface.h"
#include "server/collision/spherical_bezier/SphericalBezierBound.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// By what a shape is looked at in queries: a row and a column of PairTable.h.
enum class Representation : std::uint8_t {
    kTriangles,
    kHull,
    kHeightField,
    kPoints,
    kSpherical,
    kDistanceField,
    kFreeform,
    kSphericalBezier
};
inline constexpr std::size_t kRepresentations = 8;

/// What an object asks of the shapes of its geometries.
struct ShapeChoice {
    std::optional<Representation> representation = Representation::kTriangles;  ///< none: what suits the geometry
    std::optional<VolumeKind> volume;  ///< of trees of triangles; none: what suits best (kAutomaticVolume …)
    unsigned level = 0;                ///< above 0: triangles are taken as balls that cover them
    /// Of distance fields, freeform, and what suits the geometry: by how much distances may be wrong, in diagonals of
    /// its box. 0 of what suits: not at all.
    double error = 0;

    auto operator<=>(const ShapeChoice&) const = default;
};

/// A grid of so many faces is taken as a height field where nothing is said: its tree would be 8 MB, it needs 0.4. A
/// smaller one tells distances faster as a tree.
inline constexpr std::size_t kAutomaticFieldFaces = 100'000;
/// Measured: server/collision/pairwise/README.md.
inline constexpr VolumeKind kAutomaticVolume = VolumeKind::kObb, kAutomaticDeformingVolume = VolumeKind::kDop14;

/// 32 patches: 128 let less pass and take more to follow (../spherical_bezier/README.md).
inline constexpr unsigned kSphericalBezierLevels = 1;

/// Read by any number of threads; changed (`move`) by its owner alone, while nobody reads. Trees are made when they are
/// first asked for, by whichever thread asks.
class CollisionShape {
public:
    [[nodiscard]] static std::shared_ptr<CollisionShape> ofTriangles(TriangleMesh mesh, const TreeOptions& trees = {});
    /// The convex hull of a mesh, solid. Null where its points lie in one plane.
    [[nodiscard]] static std::shared_ptr<CollisionShape> ofHull(const TriangleMesh& mesh,
                                                                const TreeOptions& trees = {});

    /// A surface over a regular grid. Says why a mesh is none. kLimit: more faces than `limits` has corners for.
    [[nodiscard]] static Expected<std::shared_ptr<CollisionShape>> ofHeightField(const TriangleMesh& mesh,
                                                                                 const TreeOptions& trees = {},
                                                                                 const TriangleMeshLimits& limits = {});
    /// Solid balls of one radius. As PointSet::make.
    [[nodiscard]] static Expected<std::shared_ptr<CollisionShape>> ofPoints(std::span<const Vec3d> points,
                                                                            double radius,
                                                                            const TreeOptions& trees = {});
    /// A surface as solid balls that cover it (coverOf), of the radius of a level of detail. Answers are
    /// those of points; `mesh` and the trees are those of the surface itself. Leaves the mesh where it is and says why
    /// where there is no such cover.
    [[nodiscard]] static Expected<std::shared_ptr<CollisionShape>> ofCover(TriangleMesh&& mesh, unsigned level,
                                                                           const TreeOptions& trees = {});

    /// A surface that is looked at by directions from within (../spherical); the answers of its triangles.
    [[nodiscard]] static std::shared_ptr<CollisionShape> ofSphericalField(TriangleMesh mesh,
                                                                          const TreeOptions& trees = {});
    /// A surface whose distances are known on a lattice: wrong by `error` diagonals of its box at most, 0.001 to 0.2.
    /// What touches is asked of its triangles. Leaves the mesh where it is and says why where there is no such field.
    [[nodiscard]] static Expected<std::shared_ptr<CollisionShape>> ofDistanceField(TriangleMesh&& mesh, double error,
                                                                                   const TreeOptions& trees = {});

    /// A surface of which spherical Bézier patches tell that it does not touch (../spherical_bezier); what they cannot
    /// tell its triangles do, so answers are theirs. It may deform. Leaves the mesh where it is and says why where it
    /// is not star-shaped.
    [[nodiscard]] static Expected<std::shared_ptr<CollisionShape>> ofSphericalBezier(TriangleMesh&& mesh,
                                                                                     const TreeOptions& trees = {});

    /// A smooth surface that is looked at as itself (../freeform), to `error` diagonals of the box of its triangles:
    /// with these, `drawn`, points and grids are compared, free bodies fall, and they are the faces that answers name.
    [[nodiscard]] static std::shared_ptr<CollisionShape> ofFreeform(FreeformShape surface, TriangleMesh drawn,
                                                                    double error, const TreeOptions& trees = {});

    [[nodiscard]] Representation representation() const { return representation_; }
    /// What answers name: faces. Of a hull its own, so that all queries about surfaces work on it; of points the
    /// points, of a cover the balls.
    [[nodiscard]] std::size_t faceCount() const {
        return points_ ? points_->size() : field_ ? field_->faceCount() : mesh_->faceCount();
    }
    /// Of a point three times its place.
    [[nodiscard]] Triangle triangle(std::uint32_t face) const {
        if (points_) return {points_->point(face), points_->point(face), points_->point(face)};
        return field_ ? field_->triangle(face) : mesh_->triangle(face);
    }
    /// All that is no farther from a face belongs to it: the radius of points, 0 of surfaces.
    [[nodiscard]] double faceRadius() const { return points_ ? points_->radius() : 0; }
    /// Of a cover: no part of a ball is farther from the surface, in its frame. 0 of all else, which is what it is.
    [[nodiscard]] double coverError() const { return isCover() ? 2 * points_->radius() : 0; }
    [[nodiscard]] bool isCover() const { return points_ && !coveredFaces_.empty(); }
    /// Of a ball of a cover: a face of the mesh that has a point in it.
    [[nodiscard]] std::uint32_t coveredFace(std::uint32_t ball) const { return coveredFaces_[ball]; }
    /// Around all faces.
    [[nodiscard]] const Box& bounds() const {
        return points_ ? points_->bounds() : field_ ? field_->bounds() : smooth_ ? smoothBounds_ : mesh_->bounds();
    }
    /// All of it as triangles: what every representation can fall back to. Of a height field its faces; of points
    /// octahedra whose corners lie on the balls, eight faces each, by octant (those with -X count 1, with -Y 2, with
    /// -Z 4 more); of a cover the surface that it covers. Made when first asked for.
    [[nodiscard]] const TriangleMesh& mesh() const;
    /// Solid: what is inside it touches it too. Null for a surface.
    [[nodiscard]] const ConvexHull* hull() const { return hull_ ? &*hull_ : nullptr; }

    /// Null for all else.
    [[nodiscard]] const HeightField* heightField() const { return field_ ? &*field_ : nullptr; }
    [[nodiscard]] const PointSet* points() const { return points_ ? &*points_ : nullptr; }
    [[nodiscard]] const SphericalField* sphericalField() const { return spherical_ ? &*spherical_ : nullptr; }
    [[nodiscard]] const DistanceLattice* distanceField() const { return lattice_ ? &*lattice_ : nullptr; }
    [[nodiscard]] const FreeformShape* smoothSurface() const { return smooth_.get(); }
    /// As the triangles are now: after a move it follows when it is asked for.
    [[nodiscard]] const SphericalBezierBound* sphericalBezier() const;

    /// As queries of smooth bodies take it: a smooth surface itself, a hull as a solid, all else as its triangles. Made
    /// when first asked for.
    [[nodiscard]] const FreeformShape& freeform() const;
    /// Of a smooth surface: what is told to touch is no farther apart, and distances are no more wrong, in its frame. 0
    /// of all else.
    [[nodiscard]] double freeformTolerance() const {
        return smooth_ ? freeformError_ * mesh_->bounds().size().norm() : 0;
    }

    /// Of the triangles, as they are now. `volume()` is the kind that was asked for.
    [[nodiscard]] const TriangleTree& tree() const { return tree(options_.volume); }
    [[nodiscard]] const TriangleTree& tree(VolumeKind kind) const;
    /// Whether `tree()` has been asked for, by any thread, and is there: of what never moves it costs nothing then.
    [[nodiscard]] bool hasTree() const { return trees_[static_cast<std::size_t>(options_.volume)].made; }
    [[nodiscard]] VolumeKind volume() const { return options_.volume; }
    /// Of a cover: the centres of its balls as triangles without size, by the balls' numbers. Its boxes fit a surface
    /// as those of a PointSet do not: nearest balls are found with a tenth of the work. Made when first asked for.
    [[nodiscard]] const TriangleTree& centreTree() const;
    /// Which faces share edges, and whether they enclose a volume. Made when first asked for; after a move it is first
    /// looked whether it still holds (a pass over all vertices). Stays where it is until the next move.
    [[nodiscard]] const SurfaceTopology& topology() const;
    /// Groups of triangles that follow moves at a fraction of what trees cost (../spherical_bezier); what touches is
    /// the same. A shape whose vertices move again and again chooses them itself: after as many moved vertices as
    /// kMovesBeforeGroups times all. From then on its trees are brought up to date when they are asked for; where they
    /// are asked for in kMovesWithTrees moves on end it is trees alone again, for good. What never moves has groups,
    /// too, made when first asked for.
    [[nodiscard]] const DeformingSurface& groups() const;
    [[nodiscard]] bool followsByGroups() const { return deformingGroups_ != nullptr; }
    [[nodiscard]] bool hasGroups() const { return deformingGroups_ != nullptr || (!deforms_ && movedVertices_ == 0); }
    static constexpr std::size_t kMovesBeforeGroups = 8, kMovesWithTrees = 4;

    /// Its vertices have moved, or may move from frame to frame.
    [[nodiscard]] bool deforms() const { return deforms_; }
    void setDeforms() { deforms_ = true; }

    /// The box in the world, which holds every vertex as rounding puts it there. However a hull is turned, its box is
    /// no larger than that of the ball around it.
    [[nodiscard]] Box boxIn(const Affine3d& world) const;

    /// The same seen from another frame; null where its numbers leave the range of exact answers, or it becomes flat.
    /// Of balls that are stretched the balls around them.
    [[nodiscard]] std::shared_ptr<const CollisionShape> placed(const Affine3d& map) const;

    /// New positions, one per vertex; the faces stay. Triangles, smooth surfaces and spherical patches only. kBadInput
    /// as TriangleMesh::make; nothing changes then. Trees follow, and are divided anew where they have become loose.
    Expected<void> move(std::span<const Vec3d> positions);
    /// The same of the vertices from `first` on; costs what is above them in trees of k-DOPs.
    Expected<void> move(std::size_t first, std::span<const Vec3d> positions);

    /// The smooth surface that its triangles are of now: its control points from `first` on, or another one. Whoever
    /// moves it moves the triangles, too. As FreeformShape::move; nothing changes where it is refused.
    Expected<void> moveControlPoints(std::size_t first, std::span<const Vec3d> positions);
    void setSmoothSurface(FreeformShape surface);

    /// With all trees made so far.
    [[nodiscard]] std::size_t memoryBytes() const;

private:
    struct LazyTree {
        /// Another one when the tree is no longer up to date.
        std::unique_ptr<std::once_flag> current = std::make_unique<std::once_flag>();
        std::unique_ptr<TriangleTree> tree;
        std::atomic<bool> made = false;
        std::size_t movedFirst = 0, movedEnd = 0;  ///< vertices that it does not know of yet
    };
    static void follow(TriangleTree& tree, std::size_t first, std::size_t count);
    void moveGroups(std::size_t first, std::span<const Vec3d> positions);
    void followSmooth();
    void checkDeforms() const;

    CollisionShape(Representation representation, std::shared_ptr<TriangleMesh> mesh, const TreeOptions& trees)
        : representation_(representation), options_(trees), mesh_(std::move(mesh)) {}
    void setBall();

    Representation representation_;
    TreeOptions options_;
    bool deforms_ = false;
    mutable std::once_flag meshMade_;
    mutable std::shared_ptr<TriangleMesh> mesh_;
    std::optional<ConvexHull> hull_;
    std::optional<HeightField> field_;
    std::optional<PointSet> points_;
    std::vector<std::uint32_t> coveredFaces_;  // of a cover: one for each ball
    Vec3d ballCentre_ = Vec3d::Zero();         // of a hull
    double ballRadius_ = 0;
    mutable std::array<LazyTree, kVolumeKinds> trees_;
    mutable LazyTree centreTree_;
    std::unique_ptr<DeformingSurface> deformingGroups_;
    std::size_t movedVertices_ = 0, movesWithTrees_ = 0;
    mutable std::once_flag groupsMade_;
    mutable std::unique_ptr<DeformingSurface> restingGroups_;  // of what never moves
    // Of trees_ that of oriented boxes, which they need.
    std::optional<SphericalField> spherical_;
    std::optional<DistanceLattice> lattice_;
    mutable std::unique_ptr<SphericalBezierBound> bezier_;
    /// Another flag when it is behind, by these vertices.
    std::unique_ptr<std::once_flag> bezierCurrent_ = std::make_unique<std::once_flag>();
    mutable std::size_t bezierMovedFirst_ = 0, bezierMovedEnd_ = 0;
    std::unique_ptr<FreeformShape> smooth_;
    double freeformError_ = 0;
    Box smoothBounds_;  // of the smooth surface and of its triangles
    /// Of what is none: another flag after each move.
    mutable std::unique_ptr<std::once_flag> asFreeformCurrent_ = std::make_unique<std::once_flag>();
    mutable std::unique_ptr<FreeformShape> asFreeform_;
    /// Another one after each move: then it is looked again whether the topology holds.
    std::unique_ptr<std::once_flag> topologyLookedAt_ = std::make_unique<std::once_flag>();
    mutable std::unique_ptr<SurfaceTopology> topology_;
};

/// The kind of volume in which two shapes are compared: of kinds that differ that of the one that deforms (which is
/// refitted in each frame), else that of the one with more faces; the other makes a tree of that kind, once.
[[nodiscard]] VolumeKind commonVolume(const CollisionShape& a, const CollisionShape& b);

}  // namespace tessera
