#include "common/rays/PickTree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera {

bool meetsBox(const Box& box, const Ray& ray, double maxT) {
    if (box.empty()) return false;
    double first = 0, last = maxT;
    for (int i = 0; i < 3; ++i) {
        const double slack = 1e-12 * (std::abs(box.lower[i]) + std::abs(box.upper[i]) + std::abs(ray.origin[i]));
        const double lower = box.lower[i] - slack - ray.origin[i], upper = box.upper[i] + slack - ray.origin[i];
        if (ray.direction[i] == 0) {
            if (lower > 0 || upper < 0) return false;
            continue;
        }
        const double t = lower / ray.direction[i], u = upper / ray.direction[i];
        first = std::max(first, std::min(t, u));
        last = std::min(last, std::max(t, u));
    }
    return first <= last * (1 + 1e-12);
}

bool isFlattened(const Affine3d& map) {
    const double largest = map.linear().cwiseAbs().maxCoeff();
    return !(std::abs(map.linear().determinant()) > 1e-12 * largest * largest * largest);
}

namespace {

double halfArea(const Box& box) {
    const Vec3d size = box.size();
    return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

Box around(Box a, const Box& b) {
    a.extend(b);
    return a;
}

}  // namespace

std::uint32_t PickTree::make() {
    if (free_.empty()) {
        nodes_.emplace_back();
        return static_cast<std::uint32_t>(nodes_.size() - 1);
    }
    const std::uint32_t node = free_.back();
    free_.pop_back();
    nodes_[node] = {};
    return node;
}

void PickTree::build(std::vector<Item> items) {
    nodes_.clear();
    free_.clear();
    leafOf_.clear();
    nodes_.reserve(2 * items.size());
    root_ = items.empty() ? kNone : build(std::span(items));
}

/// Halves along the longest side of the middles.
std::uint32_t PickTree::build(std::span<Item> items) {
    const std::uint32_t number = make();
    if (items.size() == 1) {
        nodes_[number].box = items[0].box;
        nodes_[number].item = items[0].item;
        if (leafOf_.size() <= items[0].item) leafOf_.resize(std::size_t{items[0].item} + 1, kNone);
        leafOf_[items[0].item] = number;
        return number;
    }
    Box middles;
    for (const Item& item : items) middles.extend(item.box.center());
    int axis = 0;
    middles.size().maxCoeff(&axis);
    const auto half = static_cast<std::ptrdiff_t>(items.size() / 2);
    std::nth_element(items.begin(), items.begin() + half, items.end(), [axis](const Item& a, const Item& b) {
        return std::pair(a.box.lower[axis] + a.box.upper[axis], a.item) <
               std::pair(b.box.lower[axis] + b.box.upper[axis], b.item);
    });
    const std::uint32_t left = build(items.first(static_cast<std::size_t>(half)));
    const std::uint32_t right = build(items.subspan(static_cast<std::size_t>(half)));
    nodes_[number].left = left;
    nodes_[number].right = right;
    nodes_[left].parent = nodes_[right].parent = number;
    fit(number);
    return number;
}

void PickTree::put(std::uint32_t item, const Box& box) {
    take(item);
    if (leafOf_.size() <= item) leafOf_.resize(std::size_t{item} + 1, kNone);
    const std::uint32_t leaf = make();
    nodes_[leaf].box = box;
    nodes_[leaf].item = item;
    leafOf_[item] = leaf;
    if (root_ == kNone) {
        root_ = leaf;
        return;
    }
    // Down to where the least surface is added.
    std::uint32_t at = root_;
    while (nodes_[at].left != kNone) {
        const auto growth = [&](std::uint32_t child) {
            return halfArea(around(nodes_[child].box, box)) - halfArea(nodes_[child].box);
        };
        at = growth(nodes_[at].left) <= growth(nodes_[at].right) ? nodes_[at].left : nodes_[at].right;
    }
    const std::uint32_t parent = nodes_[at].parent, joint = make();
    nodes_[joint].left = at;
    nodes_[joint].right = leaf;
    replace(parent, at, joint);
    nodes_[at].parent = nodes_[leaf].parent = joint;
    refit(joint);
}

void PickTree::take(std::uint32_t item) {
    if (item >= leafOf_.size() || leafOf_[item] == kNone) return;
    const std::uint32_t leaf = std::exchange(leafOf_[item], kNone);
    const std::uint32_t joint = nodes_[leaf].parent;
    free_.push_back(leaf);
    if (joint == kNone) {
        root_ = kNone;
        return;
    }
    const std::uint32_t sibling = nodes_[joint].left == leaf ? nodes_[joint].right : nodes_[joint].left;
    const std::uint32_t parent = nodes_[joint].parent;
    replace(parent, joint, sibling);
    free_.push_back(joint);
    refit(parent);
}

void PickTree::replace(std::uint32_t parent, std::uint32_t child, std::uint32_t by) {
    nodes_[by].parent = parent;
    if (parent == kNone)
        root_ = by;
    else
        (nodes_[parent].left == child ? nodes_[parent].left : nodes_[parent].right) = by;
}

void PickTree::fit(std::uint32_t number) {
    Node& node = nodes_[number];
    node.box = around(nodes_[node.left].box, nodes_[node.right].box);
    node.height = 1 + std::max(nodes_[node.left].height, nodes_[node.right].height);
}

/// From a joint up.
void PickTree::refit(std::uint32_t node) {
    for (; node != kNone; node = nodes_[node].parent) {
        fit(node);
        node = balance(node);
    }
}

std::uint32_t PickTree::balance(std::uint32_t node) {
    const auto lean = [&](std::uint32_t n) {
        return nodes_[n].left == kNone ? 0 : nodes_[nodes_[n].left].height - nodes_[nodes_[n].right].height;
    };
    if (lean(node) > 1) {
        if (lean(nodes_[node].left) < 0) (void)rotate(nodes_[node].left, true);
        return rotate(node, false);
    }
    if (lean(node) < -1) {
        if (lean(nodes_[node].right) > 0) (void)rotate(nodes_[node].right, false);
        return rotate(node, true);
    }
    return node;
}

/// Its right child (`left`: it sinks to the left), or its left one, takes its place. Returns that one.
std::uint32_t PickTree::rotate(std::uint32_t node, bool left) {
    const std::uint32_t up = left ? nodes_[node].right : nodes_[node].left;
    const std::uint32_t across = left ? nodes_[up].left : nodes_[up].right;
    replace(nodes_[node].parent, node, up);
    (left ? nodes_[up].left : nodes_[up].right) = node;
    (left ? nodes_[node].right : nodes_[node].left) = across;
    nodes_[node].parent = up;
    nodes_[across].parent = node;
    fit(node);
    fit(up);
    return up;
}

}  // namespace tessera
