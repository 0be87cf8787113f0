/// A binary tree of axis-aligned boxes over a mesh: the hierarchy of the pairwise stage.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/math/Box.h"
#include "common/math/Ray.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

/// Owns its mesh. Immutable once built, so any number of threads may query it. Built by binned surface-area heuristic;
/// the same mesh gives the same tree.
class AabbTree {
public:
    static constexpr std::uint32_t kMaxLeafFaces = 4;

    /// Nodes in depth-first order: the left child follows its parent. `count` faces from `first` in faceOrder() for a
    /// leaf; count 0: an inner node whose right child is `first`.
    struct Node {
        Box box;
        std::uint32_t first = 0;
        std::uint32_t count = 0;
        [[nodiscard]] bool leaf() const { return count != 0; }
    };

    explicit AabbTree(TriangleMesh mesh);

    [[nodiscard]] const TriangleMesh& mesh() const { return mesh_; }
    /// Empty for an empty mesh; else the root is the first.
    [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
    [[nodiscard]] std::span<const std::uint32_t> faceOrder() const { return order_; }
    [[nodiscard]] std::size_t depth() const { return depth_; }

    struct RayHit {
        std::uint32_t face = 0;
        double t = 0;  ///< in lengths of the ray's direction
    };
    /// The nearest triangle that the ray meets, seen from either side, within t <= maxT. Of equal t the lowest face.
    [[nodiscard]] std::optional<RayHit> castRay(const Ray& ray, double maxT) const;
    /// Faces whose own boxes overlap `box`, ascending. A point is a box of no size.
    [[nodiscard]] std::vector<std::uint32_t> facesNear(const Box& box) const;

private:
    struct Builder;

    TriangleMesh mesh_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
    std::size_t depth_ = 0;
};

/// Does the ray come into the box at some 0 <= t <= maxT? Errs on the side of yes by a few units in the last place.
[[nodiscard]] bool meetsBox(const Box& box, const Ray& ray, double maxT);

}  // namespace tessera
