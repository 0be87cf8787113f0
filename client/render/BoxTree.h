/// A binary tree of boxes over the boxes of a scene's items: what lets a culler leave out many items with one test.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Box.h"

namespace tessera {

/// Built when items come and go, refitted when they move. Items are named by their index in the span of boxes.
class BoxTree {
public:
    struct Node {
        Box box;
        std::uint32_t first = 0;  ///< the items below are itemsOf(node), a slice of one permutation
        std::uint32_t count = 0;
        std::uint32_t parent = 0;
        std::uint32_t second = 0;  ///< index of the second child; the first stands right behind its parent. 0: a leaf
    };

    /// Empty boxes are allowed and lie in the tree as such.
    void build(std::span<const Box> boxes);
    /// The boxes of `moved` (indices of items) have changed. Builds anew once motion has made the tree much worse.
    void refit(std::span<const Box> boxes, std::span<const std::uint32_t> moved);

    /// Parents before children; empty for no items. Node 0 is the root.
    [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
    [[nodiscard]] std::span<const std::uint32_t> itemsOf(const Node& node) const {
        return std::span(items_).subspan(node.first, node.count);
    }
    [[nodiscard]] Box bounds() const { return nodes_.empty() ? Box() : nodes_.front().box; }

private:
    std::uint32_t buildBelow(std::span<const Box> boxes, std::uint32_t first, std::uint32_t count,
                             std::uint32_t parent);
    void refitNode(std::span<const Box> boxes, std::size_t index);
    void refitAll(std::span<const Box> boxes);
    [[nodiscard]] double cost() const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> items_;
    std::vector<std::uint32_t> leafOf_;
    double builtCost_ = 0;
    std::size_t movedSinceCheck_ = 0;
};

}  // namespace tessera
