/// Collision shapes by the content of the arrays they were made from: nodes that share a geometry, and geometries of
/// equal content, share one shape.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>

#include "common/drawable/Drawable.h"
#include "common/geometry/Mesh.h"
#include "server/collision/pairwise/CollisionShape.h"

namespace tessera {

/// What collides of points: the octahedra that are seen of them. Nothing where their arrays are absent or malformed.
[[nodiscard]] std::optional<MeshData> octahedraOf(const MeshArrays& points);

/// Larger ones are taken as their triangles: faces of a control mesh, or control points of a NURBS surface. Measured:
/// README.md.
inline constexpr std::size_t kMostFreeformFaces = std::size_t{1} << 17;
/// Whether what deforms is to be a smooth surface, where it has one.
[[nodiscard]] inline bool asksForSmooth(const ShapeChoice& choice) {
    return choice.representation == Representation::kFreeform || (!choice.representation && choice.error > 0);
}
/// The smooth surface that a drawable's triangles are of. Nothing where there is none, or it is too large.
[[nodiscard]] std::optional<FreeformShape> smoothShapeOf(const Drawable& drawable);

/// What is to be made elsewhere, of triangles or points.
struct UnmadeShape {
    MeshArrays arrays;
    std::shared_ptr<const CollisionShape> shape;  ///< to which only its tree is missing; null: none is there
    [[nodiscard]] std::size_t faceCount() const;  ///< about
};

struct MadeShape {
    UnmadeShape of;
    std::shared_ptr<const CollisionShape> shape;  ///< with its tree; null: nothing comes of it
};

/// Not thread-safe; the shapes it hands out may be read by any thread.
class ShapeCache {
public:
    /// Triangles of shapes that nobody uses any more, kept in case they come back (an undo, a switch).
    explicit ShapeCache(std::size_t maxIdleTriangles = 4'000'000) : maxIdleTriangles_(maxIdleTriangles) {}

    /// Made when first asked for. Null where the arrays are absent or malformed or hold no triangle, and for a hull
    /// where the points lie in one plane. Triangles of a level are taken as they are where no balls can cover them.
    /// `drawable`: whose arrays these are, for who wants the smooth surface that they are of.
    [[nodiscard]] std::shared_ptr<const CollisionShape> shape(const MeshArrays& arrays, const ShapeChoice& choice = {},
                                                              const Drawable& drawable = {});
    /// Of triangles or points: whether `shape`, and its tree, cost nothing now.
    [[nodiscard]] bool isMade(const MeshArrays& arrays) const;
    [[nodiscard]] UnmadeShape unmade(const MeshArrays& arrays) const;
    /// On any thread: the shape with its tree; of what makes none, null.
    [[nodiscard]] static std::shared_ptr<const CollisionShape> make(const UnmadeShape& unmade);
    /// And then it is here, unless another one is by now.
    void put(const UnmadeShape& unmade, std::shared_ptr<const CollisionShape> made);
    /// Positions, indices; the radius of points; of a smooth surface what it is made of.
    using Key = std::tuple<BlobId, BlobId, MeshKind, double, ShapeChoice, Hash128>;
    /// Of triangles or points as they are.
    [[nodiscard]] static Key keyOf(const MeshArrays& arrays) {
        return {arrays.positions.id(), arrays.indices.id(), arrays.kind, arrays.pointRadius, {}, {}};
    }
    /// Lets go of it. False: it does not, because somebody holds it beside the cache and the caller.
    [[nodiscard]] bool drop(const Key& key);
    /// One of its own, for a geometry that will deform: triangles, or the smooth surface where that is asked for, or
    /// what suits and an error is allowed.
    [[nodiscard]] static std::shared_ptr<CollisionShape> ownShape(const MeshArrays& arrays, const ShapeChoice& choice,
                                                                  const Drawable& drawable = {});
    /// The box around the vertices of a geometry, around points with their radius, without making its shape. Empty
    /// where the array is absent.
    [[nodiscard]] Box bounds(const MeshArrays& arrays);

    /// Lets go of shapes that only the cache holds, where they exceed the limit.
    void forgetIdle();
    [[nodiscard]] std::size_t size() const { return shapes_.size(); }

private:
    bool forgetIdleShapes();

    std::size_t maxIdleTriangles_;
    std::map<Key, std::shared_ptr<const CollisionShape>> shapes_;
    std::set<Key> uncovered_;  ///< levels that these cannot have
    std::map<std::tuple<BlobId, MeshKind, double>, Box> bounds_;
};

}  // namespace tessera
