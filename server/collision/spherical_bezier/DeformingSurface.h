/// A body all of whose vertices may move in every frame, bounded so that a frame costs little more than reading them.
///
/// The triangles are divided once, into groups of at most 64 that are neighbours in the first shape. What follows a
/// deformation is one box per group, and one per sixteen groups: nothing is divided again, nothing is refitted above.
/// Whatever a query needs more exactly, it makes of the few groups that it looks into (DeformingTouch.h). The groups
/// keep being right in any shape; they are tight where neighbours stay neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/base/Error.h"
#include "common/math/Box.h"

namespace tessera {

class TriangleMesh;
struct DeformingStorage;

/// One thread moves it, while nobody asks; any number of threads may ask.
class DeformingSurface {
public:
    /// Of a mesh as it is now; a copy. An empty one meets nothing.
    explicit DeformingSurface(const TriangleMesh& mesh);
    ~DeformingSurface();
    DeformingSurface(DeformingSurface&&) noexcept;
    DeformingSurface& operator=(DeformingSurface&&) noexcept;

    /// Takes new positions, one per vertex of the mesh, in its units. kBadInput, and nothing is changed, for another
    /// number of them and for coordinates that TriangleMesh::make would refuse.
    Expected<void> move(std::span<const Vec3d> positions);
    /// The same for the vertices from `first` on. Costs these, the groups that they are in, and a pass over the boxes
    /// of sixteen groups; a pass over all where the shape outgrows the coordinates of its boxes.
    Expected<void> move(std::size_t first, std::span<const Vec3d> positions);

    [[nodiscard]] std::size_t faceCount() const;
    [[nodiscard]] std::size_t vertexCount() const;
    /// Holds every triangle; larger than the least such box by at most some 1e-6 of its size.
    [[nodiscard]] Box bounds() const;
    [[nodiscard]] std::size_t memoryBytes() const;

    /// For the queries of this library.
    [[nodiscard]] const DeformingStorage& storage() const { return *storage_; }

private:
    std::unique_ptr<DeformingStorage> storage_;
};

}  // namespace tessera
