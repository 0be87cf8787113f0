/// Collision trees by the content of the arrays they were made from: nodes that share a geometry, and geometries of
/// equal content, share one tree.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <utility>

#include "common/scene/Cores.h"
#include "server/collision/mesh/AabbTree.h"

namespace tessera {

/// Not thread-safe; the trees it hands out may be read by any thread.
class ShapeCache {
public:
    /// Triangles of trees that nobody uses any more, kept in case they come back (an undo, a switch).
    explicit ShapeCache(std::size_t maxIdleTriangles = 4'000'000) : maxIdleTriangles_(maxIdleTriangles) {}

    /// The tree of a geometry, built when first asked for. Null where the arrays are absent or malformed or hold no
    /// triangle.
    [[nodiscard]] std::shared_ptr<const AabbTree> shape(const Geometry& geometry);
    /// The box around the vertices of a geometry, without building its tree. Empty where the array is absent.
    [[nodiscard]] Box bounds(const Geometry& geometry);

    /// Lets go of trees that only the cache holds, where they exceed the limit.
    void forgetIdle();
    [[nodiscard]] std::size_t size() const { return shapes_.size(); }

private:
    using Key = std::pair<BlobId, BlobId>;  // positions, indices
    std::size_t maxIdleTriangles_;
    std::map<Key, std::shared_ptr<const AabbTree>> shapes_;
    std::map<BlobId, Box> bounds_;
};

}  // namespace tessera
