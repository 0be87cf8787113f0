/// A binary tree of boxes over the boxes of a scene's items: what lets a culler leave out many items with one test.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Box.h"

namespace tessera {

/// Follows items that come, go and move at O(log n) each, amortised; a box in it is always the very union of what lies
/// below. Items are named by their index in the span of boxes; those with an empty box are not in the tree.
///
/// Kept good by rebuilding parts: a subtree is built anew, halved at medians, once one of its halves has outgrown the
/// other (so the depth stays logarithmic whatever comes in whatever order), and once as many items have changed below
/// it as it has and its boxes have grown much since it was built (a scapegoat tree; Galperin and Rivest 1993). Of one
/// of more than kLarge items that is lopsided, or has grown, only the top is built anew, above some hundred subtrees
/// that stay what they are: so nothing that comes or goes costs a frame what all costs. Where boxes have grown, because
/// items wander, all is.
class BoxTree {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    static constexpr std::uint32_t kItemsPerLeaf = 4;
    static constexpr std::uint32_t kLarge = 8'192;

    struct Node {
        Box box;
        std::uint32_t count = 0;  ///< of items below
        bool leaf = true;
        std::array<std::uint32_t, kItemsPerLeaf> below{};  ///< a leaf: `count` items; else two nodes

        [[nodiscard]] std::span<const std::uint32_t> items() const { return std::span(below).first(count); }
    };

    /// From nothing, for all items.
    void build(std::span<const Box> boxes);
    /// The boxes of these items have changed; empty ones came, or go. An item may be named more than once.
    void follow(std::span<const Box> boxes, std::span<const std::uint32_t> changed);

    [[nodiscard]] bool empty() const { return nodes_.empty(); }
    /// Nodes are numbered below this.
    [[nodiscard]] std::size_t slots() const { return nodes_.size(); }
    static constexpr std::uint32_t kRoot = 0;
    [[nodiscard]] const Node& node(std::uint32_t index) const { return nodes_[index]; }
    [[nodiscard]] Box bounds() const { return empty() ? Box() : nodes_[kRoot].box; }
    /// Nodes that were looked at by changes so far: what tests of cost count.
    [[nodiscard]] std::uint64_t work() const { return work_; }

private:
    /// What only changes look at.
    struct Care {
        std::uint32_t parent = kNone;
        std::uint32_t changes = 0;  ///< of items below since it was built or looked at
        std::uint32_t builtCount = 0;
        double builtCost = 0;  ///< costOf, when it was built
    };

    [[nodiscard]] std::uint32_t addNode(std::uint32_t parent);
    void freeNode(std::uint32_t index);
    double buildAt(std::uint32_t index, std::span<const Box> boxes, std::span<std::uint32_t> items);
    double buildAbove(std::uint32_t index, std::span<std::uint32_t> pieces);
    void rebuild(std::uint32_t index, std::span<const Box> boxes);
    void rebuildTop(std::uint32_t index, std::span<const Box> boxes);
    void refitAbove(std::uint32_t index, std::span<const Box> boxes);
    void collect(std::uint32_t index, std::vector<std::uint32_t>& items, std::vector<std::uint32_t>& nodes) const;
    void insert(std::uint32_t item, std::span<const Box> boxes);
    void remove(std::uint32_t item, std::span<const Box> boxes);
    void move(std::uint32_t item, std::span<const Box> boxes);
    void refitAll(std::uint32_t index, std::span<const Box> boxes);
    [[nodiscard]] Box boxOf(const Node& node, std::span<const Box> boxes) const;
    /// Summed half surfaces of the boxes at and below it; of a large one, of those that hold more than a small share of
    /// its items.
    [[nodiscard]] double costOf(std::uint32_t index) const;
    /// What has to be built anew along a way up: the highest, and what lies below a top that has to be.
    struct Worn {
        std::uint32_t whole = kNone, top = kNone;
    };
    void look(std::uint32_t index, Worn& worn);
    void mend(const Worn& worn, std::span<const Box> boxes);

    std::vector<Node> nodes_;  ///< parents before children where built at once; the root is the first
    std::vector<Care> care_;
    std::vector<std::uint32_t> free_;
    std::vector<std::uint32_t> leafOf_;  ///< by item, or kNone
    mutable std::uint64_t work_ = 0;
    /// Items built anew and boxes looked at in one `follow`; what is above goes on in the next. Many subtrees wear out
    /// together where many items go.
    mutable std::uint64_t spent_ = 0;
    std::uint64_t mayBeSpent_ = 0;
};

}  // namespace tessera
