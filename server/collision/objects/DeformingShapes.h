/// The shapes of deforming geometries: as they are, and as the scene has them now.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/cores/ShippedTypes.h"
#include "server/collision/objects/ShapeCache.h"

namespace tessera {

/// One shape for each drawable core that deforms and what is asked of its shape, whatever number of parts show it.
class DeformingShapes {
public:
    struct Key {
        ObjectId core;
        ShapeChoice choice;
        auto operator<=>(const Key&) const = default;
    };
    /// The shape of a geometry; null where its arrays are malformed. New positions for the same triangles (or as many
    /// points) become an end to settle, and the shape stays as it is until then; anything else new is a new shape.
    /// `jump`: new positions are that too. Where the array tells what has changed since (Blob::origins), no other
    /// vertex is looked at.
    /// `drawable`: whose arrays these are. Smooth surfaces follow their control points, to settle with the triangles;
    /// NURBS are made anew.
    [[nodiscard]] std::shared_ptr<const CollisionShape> follow(const Key& key, const MeshArrays& arrays, bool jump,
                                                               const Drawable& drawable = {});
    /// Where vertices are about to be: those from `first` on, the others stay.
    struct End {
        std::uint32_t first = 0;
        std::vector<Vec3d> positions;
    };
    /// Null where all stay.
    [[nodiscard]] const End* endOf(const Key& key) const;
    /// Moves all shapes to their ends.
    void settle();
    /// Lets go of all but these (ascending).
    void keepOnly(std::span<const Key> keys);

private:
    struct Own {
        std::shared_ptr<CollisionShape> shape;
        BlobId positions, indices;  // that the shape was made of, or last settled at
        MeshKind kind = MeshKind::kTriangles;
        double pointRadius = 0;
        BlobId endPositions;
        std::optional<End> end;
        /// Where a smooth surface is asked for: what it is made of; and its control points (or all of it) where they
        /// are about to be.
        std::optional<DerivedSource> source;
        struct SmoothEnd {
            DerivedSource source;
            std::size_t first = 0;
            std::vector<Vec3d> points;
            std::optional<FreeformShape> surface;  ///< instead of points
        };
        std::optional<SmoothEnd> smoothEnd;
    };
    [[nodiscard]] static std::optional<Own::SmoothEnd> smoothEndOf(const Own& own, const Drawable& drawable);

    std::map<Key, Own> shapes_;
};

}  // namespace tessera
