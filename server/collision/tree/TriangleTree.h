/// The hierarchy of the pairwise stage: bounding volumes over a mesh, in wide nodes that vector units test at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/base/Error.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

/// What bounds the triangles below a node. Oriented boxes fit surfaces best; k-DOPs are cheaper to test and to refit.
enum class VolumeKind : std::uint8_t { kSphere, kAabb, kObb, kDop6, kDop14, kDop18, kDop26 };
inline constexpr std::size_t kVolumeKinds = 7;

/// How a set of triangles is divided in two; a node is three or four such divisions deep.
enum class SplitRule : std::uint8_t {
    kSurfaceArea,        ///< binned surface-area heuristic (the default)
    kLongestSideMedian,  ///< half of the triangles to each side
    kLongestSideMean,    ///< at the mean of their centres
    kMinimumVolume,      ///< least sum of volume · count over the bins
};

struct TreeOptions {
    VolumeKind volume = VolumeKind::kObb;
    SplitRule split = SplitRule::kSurfaceArea;
    /// Support profiles beside k-DOPs of 14, 18 and 26 directions, for queries with Realignment::kTable. Five to ten
    /// times the memory, a hundred times the time of a build.
    bool profiles = false;
};

struct TreeStorage;

/// Any number of threads may query it at once, none while it is refitted or rebuilt. The same mesh is
/// divided in the same way on every processor; spheres and oriented boxes may differ in their last digits between
/// instruction sets, and with them the counters of queries. What meets, and how far apart bodies are, is the same
/// with every volume, split and processor.
class TriangleTree {
public:
    explicit TriangleTree(TriangleMesh mesh, const TreeOptions& options = {});
    /// Of a mesh that others may know, too: another tree, say. One of them refits it; the others follow (`refitted`).
    explicit TriangleTree(std::shared_ptr<TriangleMesh> mesh, const TreeOptions& options = {});
    ~TriangleTree();
    TriangleTree(TriangleTree&&) noexcept;
    TriangleTree& operator=(TriangleTree&&) noexcept;

    [[nodiscard]] const TriangleMesh& mesh() const;
    [[nodiscard]] const TreeOptions& options() const;

    /// Follows a deformation: one new position per vertex of the mesh, the same triangles. The division stays, the
    /// volumes are fitted again. kBadInput as TriangleMesh::make; the tree is unchanged then.
    Expected<void> refit(std::span<const Vec3d> positions);
    /// The mesh has been moved already.
    void refitted();
    /// Of it `count` vertices from `first` on: costs what is above these (of oriented boxes and spheres all that is
    /// below that, of k-DOPs nothing more), unless the tree's coordinates fit no more or an eighth of all has moved;
    /// the first time a pass over all.
    void refitted(std::size_t first, std::size_t count);
    /// How much looser the volumes have become since the last build: their surfaces over the whole's, 1 at once after
    /// it. Above kRebuildAbove queries are dearer by an eighth to a quarter (measured, README.md), and a rebuild pays.
    [[nodiscard]] double decay() const;
    static constexpr double kRebuildAbove = 1.6;
    /// Divides the mesh, as it is now, anew.
    void rebuild();

    /// All that it holds: mesh, nodes, leaves.
    [[nodiscard]] std::size_t memoryBytes() const;
    /// Nodes on the longest way down.
    [[nodiscard]] std::size_t depth() const;

    /// For the queries of this library.
    [[nodiscard]] const TreeStorage& storage() const { return *storage_; }

private:
    std::unique_ptr<TreeStorage> storage_;
};

}  // namespace tessera
