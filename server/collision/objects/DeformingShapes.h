/// The shapes of deforming geometries: as they are, and as the scene has them now.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/scene/Cores.h"
#include "server/collision/objects/ShapeCache.h"

namespace tessera {

/// One shape for each Geometry core that deforms, whatever number of parts show it.
class DeformingShapes {
public:
    /// The shape of a geometry; null where its arrays are malformed. New positions for the same triangles become an end
    /// to settle, and the shape stays as it is until then; anything else new is a new shape. `jump`: new positions are
    /// that too.
    [[nodiscard]] std::shared_ptr<const CollisionShape> follow(ObjectId core, const MeshArrays& arrays, bool jump);
    /// Where the vertices are about to be; null where they stay.
    [[nodiscard]] const std::vector<Vec3d>* endOf(ObjectId core) const;
    /// Moves all shapes to their ends.
    void settle();
    /// Lets go of every geometry but these (ascending).
    void keepOnly(std::span<const ObjectId> cores);

private:
    struct Own {
        std::shared_ptr<CollisionShape> shape;
        BlobId positions, indices;  // that the shape was made of, or last settled at
        BlobId endPositions;
        std::optional<std::vector<Vec3d>> end;
    };
    std::map<ObjectId, Own> shapes_;
};

}  // namespace tessera
