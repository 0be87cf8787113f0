/// What a TriangleTree holds; for the queries of this library, not for their users.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/collision/tree/KernelTypes.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// A vertex in a tree's own coordinates, x y z and a 0.
struct alignas(16) OwnPosition {
    float xyz0[4];
};

/// What a refit of some vertices needs to know: made when it is first asked for, about 30 bytes per vertex and 50 per
/// node.
struct RefitIndex {
    std::vector<std::uint32_t> leafStart, leaves;  ///< of each vertex the leaves that its triangles are in
    std::vector<std::uint32_t> nodeOfLeaf, parent;
    std::vector<kernel::FitNode> nodes;
};

struct TreeStorage {
    struct alignas(64) VolumeRow {
        float lane[kernel::kWidth];
    };
    struct alignas(16) LeafRow {
        float lane[kernel::kLeafFaces];
    };
    struct alignas(16) ByteRow {
        std::uint8_t lane[kernel::kWidth];
    };
    static constexpr std::uint32_t kNoFace = 0xffffffffu;

    std::shared_ptr<TriangleMesh> mesh;  ///< one mesh may have trees of several kinds
    TreeOptions options;
    /// The tree's own coordinates are (x - centre) · unit, small numbers near 0 whatever the model's are.
    Vec3d centre = Vec3d::Zero();
    double unit = 1;    ///< a power of two: `radius` is at most 1
    double radius = 0;  ///< no vertex of a triangle is farther from the centre, in own coordinates
    bool thin = false;  ///< many volumes are plates along the directions of k-DOPs; they look fat from elsewhere
    std::size_t depth = 0;
    double cost = 0;       ///< how many volumes a query is expected to meet: all their surfaces over the whole's
    double builtCost = 0;  ///< after the last build
    double surfaces = 0;   ///< of all volumes, in own coordinates
    std::optional<RefitIndex> refits;
    /// Node 0 has one child, the whole. Empty for an empty mesh.
    std::vector<kernel::ChildRef> children;
    std::vector<std::uint32_t>
        leafFaces;  ///< kLeafFaces per leaf, kNoFace where there are fewer; their corners repeat the first's
    std::vector<VolumeRow> volumes;
    std::vector<LeafRow> corners;
    /// Support profiles, where the options ask for them: centre x y z and step per node, and its entries
    /// (ProfileFit.h).
    std::vector<VolumeRow> profileRows;
    std::vector<ByteRow> profileTables;

    [[nodiscard]] bool empty() const { return children.empty(); }
    [[nodiscard]] std::size_t nodeCount() const { return children.size() / kernel::kWidth; }
    [[nodiscard]] std::size_t leafCount() const { return leafFaces.size() / kernel::kLeafFaces; }
    [[nodiscard]] kernel::TreeView view() const {
        return {volumes.empty() ? nullptr : volumes.data()->lane,
                children.data(),
                corners.empty() ? nullptr : corners.data()->lane,
                leafFaces.data(),
                profileRows.empty() ? nullptr : profileRows.data()->lane,
                profileTables.empty() ? nullptr : profileTables.data()->lane};
    }
};

/// Every vertex of the mesh, rounded to float: each coordinate by half a unit in its last place.
[[nodiscard]] std::vector<OwnPosition> ownPositions(const TreeStorage& tree);

/// For TreeStorage::thin, after the volumes are fitted.
[[nodiscard]] bool hasManyPlates(const TreeStorage& tree);

[[nodiscard]] kernel::Shape shapeOf(VolumeKind kind);
[[nodiscard]] unsigned rowsOf(VolumeKind kind);

}  // namespace tessera
