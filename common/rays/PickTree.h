/// Boxes in a tree that is changed box by box, and what rays ask of boxes. Rays, boxes and maps in the same
/// coordinates; any thread.
#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "common/math/Box.h"
#include "common/math/Ray.h"

namespace tessera {

/// Does the ray come into the box at some 0 <= t <= maxT? Errs on the side of yes; an empty box is met by none.
[[nodiscard]] bool meetsBox(const Box& box, const Ray& ray, double maxT);
/// Turned and scaled by 0 a shape is flat but for what rounding left, which says nothing about where it is.
[[nodiscard]] bool isFlattened(const Affine3d& map);

/// A binary tree of boxes, kept balanced by rotations as an AVL tree is, so that putting, taking and the way to a leaf
/// cost O(log n). Items are small numbers. Boxes are finite and not empty. Not thread-safe.
class PickTree {
public:
    struct Item {
        std::uint32_t item = 0;
        Box box;
    };
    /// Everything anew.
    void build(std::vector<Item> items);
    /// Puts an item, or moves it.
    void put(std::uint32_t item, const Box& box);
    void take(std::uint32_t item);

    /// Visits the items whose boxes, and whose parents' boxes, are wanted: visit(item) for all where wanted(box) holds.
    /// Of two halves the one for which nearness(box) is less comes first.
    template <typename Wanted, typename Nearness, typename Visit>
    void forItems(const Wanted& wanted, const Nearness& nearness, const Visit& visit) const {
        if (root_ == kNone) return;
        std::vector<std::uint32_t> open{root_};
        while (!open.empty()) {
            const Node& node = nodes_[open.back()];
            open.pop_back();
            if (!wanted(node.box)) continue;
            if (node.left == kNone) {
                visit(node.item);
                continue;
            }
            const bool leftFirst = nearness(nodes_[node.left].box) <= nearness(nodes_[node.right].box);
            open.push_back(leftFirst ? node.right : node.left);
            open.push_back(leftFirst ? node.left : node.right);
        }
    }

    /// Visits items in the order of how near their boxes are. distance(box) is never more than that of any box within
    /// it. visit(item) says beyond which distance nothing is of interest from there on.
    template <typename Distance, typename Visit>
    void forNearest(double within, const Distance& distance, const Visit& visit) const {
        if (root_ == kNone) return;
        using Open = std::pair<double, std::uint32_t>;
        std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
        const auto add = [&](std::uint32_t number) {
            if (const double from = distance(nodes_[number].box); from <= within) open.emplace(from, number);
        };
        for (add(root_); !open.empty() && open.top().first <= within;) {
            const Node& node = nodes_[open.top().second];
            open.pop();
            if (node.left == kNone) {
                within = visit(node.item);
                continue;
            }
            add(node.left);
            add(node.right);
        }
    }

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    struct Node {
        Box box;
        std::uint32_t parent = kNone, left = kNone, right = kNone;
        std::uint32_t item = 0;  ///< of a leaf
        std::int32_t height = 0;
    };
    [[nodiscard]] std::uint32_t make();
    [[nodiscard]] std::uint32_t build(std::span<Item> items);
    void replace(std::uint32_t parent, std::uint32_t child, std::uint32_t by);
    void refit(std::uint32_t node);
    void fit(std::uint32_t node);
    [[nodiscard]] std::uint32_t balance(std::uint32_t node);
    [[nodiscard]] std::uint32_t rotate(std::uint32_t node, bool left);

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> free_;
    std::vector<std::uint32_t> leafOf_;  // per item
    std::uint32_t root_ = kNone;
};

}  // namespace tessera
