#include "client/render/BoxTree.h"

#include <algorithm>
#include <numeric>

namespace tessera {

namespace {

constexpr std::uint32_t kItemsPerLeaf = 4;
/// Rebuilt when the summed half surfaces of its boxes have grown by this factor.
constexpr double kWornOut = 1.5;

double halfSurface(const Box& box) {
    if (box.empty()) return 0;
    const Vec3d s = box.size();
    return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

}  // namespace

void BoxTree::build(std::span<const Box> boxes) {
    nodes_.clear();
    items_.resize(boxes.size());
    std::iota(items_.begin(), items_.end(), 0u);
    leafOf_.assign(boxes.size(), 0);
    movedSinceCheck_ = 0;
    if (!boxes.empty()) {
        nodes_.reserve(boxes.size());
        buildBelow(boxes, 0, static_cast<std::uint32_t>(boxes.size()), 0);
    }
    builtCost_ = cost();
}

std::uint32_t BoxTree::buildBelow(std::span<const Box> boxes, std::uint32_t first, std::uint32_t count,
                                  std::uint32_t parent) {
    const auto self = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({.first = first, .count = count, .parent = parent});
    Box box;
    Box centers;
    for (std::uint32_t i = first; i < first + count; ++i) {
        const Box& item = boxes[items_[i]];
        if (item.empty()) continue;
        box.extend(item);
        centers.extend(item.center());
    }
    if (count <= kItemsPerLeaf) {
        for (std::uint32_t i = first; i < first + count; ++i) leafOf_[items_[i]] = self;
    } else {
        // Halved at the median of the longest axis: depth stays logarithmic whatever the scene looks like.
        int axis = 0;
        if (!centers.empty()) centers.size().maxCoeff(&axis);
        const auto key = [&](std::uint32_t item) {
            return boxes[item].empty() ? -std::numeric_limits<double>::infinity() : boxes[item].center()[axis];
        };
        const std::uint32_t half = count / 2;
        const auto begin = items_.begin() + first;
        std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
            const double ka = key(a);
            const double kb = key(b);
            return ka < kb || (ka == kb && a < b);
        });
        buildBelow(boxes, first, half, self);
        const std::uint32_t second = buildBelow(boxes, first + half, count - half, self);
        nodes_[self].second = second;
    }
    nodes_[self].box = box;
    return self;
}

void BoxTree::refit(std::span<const Box> boxes, std::span<const std::uint32_t> moved) {
    movedSinceCheck_ += moved.size();
    if (movedSinceCheck_ >= boxes.size()) {
        movedSinceCheck_ = 0;
        refitAll(boxes);
        if (cost() > kWornOut * builtCost_) build(boxes);
        return;
    }
    for (const std::uint32_t item : moved) {
        std::size_t node = leafOf_[item];
        for (;;) {
            refitNode(boxes, node);
            if (node == 0) break;
            node = nodes_[node].parent;
        }
    }
}

void BoxTree::refitNode(std::span<const Box> boxes, std::size_t index) {
    Node& node = nodes_[index];
    Box box;
    if (node.second == 0) {
        for (const std::uint32_t item : itemsOf(node)) box.extend(boxes[item]);
    } else {
        box = nodes_[index + 1].box;
        box.extend(nodes_[node.second].box);
    }
    node.box = box;
}

void BoxTree::refitAll(std::span<const Box> boxes) {
    for (std::size_t i = nodes_.size(); i-- > 0;) refitNode(boxes, i);
}

double BoxTree::cost() const {
    double sum = 0;
    for (const Node& node : nodes_) sum += halfSurface(node.box);
    return sum;
}

}  // namespace tessera
