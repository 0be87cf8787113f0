#include "client/render/BoxTree.h"

#include <algorithm>

#include "common/cores/Node.h"

namespace tessera {

namespace {

/// A subtree is built anew when its summed half surfaces have grown by this factor.
constexpr double kWornOut = 1.5;
/// A half may hold this share of the items of both.
constexpr double kLargestShare = 0.8;
/// Subtrees up to this size may be as lopsided as they like.
constexpr std::uint32_t kSmall = 4 * BoxTree::kItemsPerLeaf;
/// Beyond this share of all items, changes are not taken one by one.
constexpr std::size_t kMany = 4;

double halfSurface(const Box& box) {
    if (box.empty()) return 0;
    const Vec3d s = box.size();
    return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

bool same(const Box& a, const Box& b) {
    return a.lower == b.lower && a.upper == b.upper;
}

}  // namespace

void BoxTree::build(std::span<const Box> boxes) {
    nodes_.clear();
    care_.clear();
    free_.clear();
    leafOf_.assign(boxes.size(), kNone);
    std::vector<std::uint32_t> items;
    items.reserve(boxes.size());
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
        if (!boxes[i].empty()) items.push_back(i);
    if (items.empty()) return;
    nodes_.reserve(items.size());
    care_.reserve(items.size());
    buildAt(addNode(kNone), boxes, items);
}

std::uint32_t BoxTree::addNode(std::uint32_t parent) {
    std::uint32_t index = 0;
    if (free_.empty()) {
        index = static_cast<std::uint32_t>(nodes_.size());
        nodes_.emplace_back();
        care_.emplace_back();
    } else {
        index = free_.back();
        free_.pop_back();
    }
    care_[index].parent = parent;
    return index;
}

void BoxTree::freeNode(std::uint32_t index) {
    nodes_[index] = {};
    care_[index] = {};
    free_.push_back(index);
}

/// Returns the summed half surfaces.
double BoxTree::buildAt(std::uint32_t index, std::span<const Box> boxes, std::span<std::uint32_t> items) {
    ++work_;
    const auto count = static_cast<std::uint32_t>(items.size());
    Node node{.count = count};
    Box centers;
    for (const std::uint32_t item : items) {
        if (boxes[item].empty()) continue;  // about to go
        node.box.extend(boxes[item]);
        centers.extend(boxes[item].center());
    }
    double cost = halfSurface(node.box);
    if (count <= kItemsPerLeaf) {
        for (std::uint32_t i = 0; i < count; ++i) {
            node.below[i] = items[i];
            leafOf_[items[i]] = index;
        }
    } else {
        // Halved at the median of the longest axis: depth stays logarithmic whatever the scene looks like.
        int axis = 0;
        if (!centers.empty()) centers.size().maxCoeff(&axis);
        const auto key = [&](std::uint32_t item) {
            return boxes[item].empty() ? -std::numeric_limits<double>::infinity() : boxes[item].center()[axis];
        };
        const std::uint32_t half = count / 2;
        std::nth_element(items.begin(), items.begin() + half, items.end(), [&](std::uint32_t a, std::uint32_t b) {
            const double ka = key(a);
            const double kb = key(b);
            return ka < kb || (ka == kb && a < b);
        });
        node.leaf = false;
        node.below[0] = addNode(index);
        cost += buildAt(node.below[0], boxes, items.first(half));
        node.below[1] = addNode(index);
        cost += buildAt(node.below[1], boxes, items.subspan(half));
    }
    nodes_[index] = node;
    care_[index].changes = 0;
    care_[index].builtCount = count;
    care_[index].builtCost = cost;
    return cost;
}

void BoxTree::collect(std::uint32_t index, std::vector<std::uint32_t>& items, std::vector<std::uint32_t>& nodes) const {
    std::vector<std::uint32_t> open{index};
    while (!open.empty()) {
        const std::uint32_t at = open.back();
        open.pop_back();
        ++work_;
        const Node& node = nodes_[at];
        if (at != index) nodes.push_back(at);
        if (node.leaf)
            items.insert(items.end(), node.items().begin(), node.items().end());
        else
            open.insert(open.end(), node.below.begin(), node.below.begin() + 2);
    }
}

void BoxTree::rebuild(std::uint32_t index, std::span<const Box> boxes) {
    std::vector<std::uint32_t> items, nodes;
    items.reserve(nodes_[index].count);
    collect(index, items, nodes);
    // The lowest are taken again first.
    std::sort(nodes.begin(), nodes.end(), std::greater<>());
    for (const std::uint32_t node : nodes) freeNode(node);
    buildAt(index, boxes, items);
    refitAbove(index, boxes);
}

/// What was built may hold items that have moved since their ancestors' boxes were made.
void BoxTree::refitAbove(std::uint32_t index, std::span<const Box> boxes) {
    for (std::uint32_t up = care_[index].parent; up != kNone; up = care_[up].parent) {
        ++work_;
        const Box box = boxOf(nodes_[up], boxes);
        if (same(box, nodes_[up].box)) return;
        nodes_[up].box = box;
    }
}

Box BoxTree::boxOf(const Node& node, std::span<const Box> boxes) const {
    Box box;
    if (node.leaf) {
        for (const std::uint32_t item : node.items()) box.extend(boxes[item]);
    } else {
        box = nodes_[node.below[0]].box;
        box.extend(nodes_[node.below[1]].box);
    }
    return box;
}

double BoxTree::costOf(std::uint32_t index) const {
    double cost = 0;
    std::vector<std::uint32_t> open{index};
    while (!open.empty()) {
        const Node& node = nodes_[open.back()];
        open.pop_back();
        ++work_;
        cost += halfSurface(node.box);
        if (!node.leaf) open.insert(open.end(), node.below.begin(), node.below.begin() + 2);
    }
    return cost;
}

bool BoxTree::needsRebuild(std::uint32_t index) {
    const Node& node = nodes_[index];
    if (node.leaf) return false;
    if (node.count <= kItemsPerLeaf / 2) return true;  // a leaf would do
    const std::uint32_t larger = std::max(nodes_[node.below[0]].count, nodes_[node.below[1]].count);
    if (node.count > kSmall && larger > kLargestShare * node.count) return true;
    Care& care = care_[index];
    if (care.changes <= 2 * node.count) return false;
    // Looked at so seldom that it costs each change a constant per level.
    care.changes = 0;
    return node.count > 2 * care.builtCount || costOf(index) > kWornOut * care.builtCost;
}

void BoxTree::insert(std::uint32_t item, std::span<const Box> boxes) {
    const Box& box = boxes[item];
    if (nodes_.empty()) {
        buildAt(addNode(kNone), boxes, std::span(&item, 1));
        return;
    }
    std::uint32_t worn = kNone;
    std::uint32_t at = kRoot;
    for (;;) {
        ++work_;
        Node& node = nodes_[at];
        ++node.count;
        node.box.extend(box);
        ++care_[at].changes;
        if (node.leaf) break;
        const auto growth = [&](std::uint32_t child) {
            Box grown = nodes_[child].box;
            const double before = halfSurface(grown);
            grown.extend(box);
            return halfSurface(grown) - before;
        };
        const double first = growth(node.below[0]);
        const double second = growth(node.below[1]);
        const bool toSecond =
            second < first || (second == first && nodes_[node.below[1]].count < nodes_[node.below[0]].count);
        at = node.below[toSecond ? 1 : 0];
    }
    Node& leaf = nodes_[at];
    if (leaf.count <= kItemsPerLeaf) {
        leaf.below[leaf.count - 1] = item;
        leafOf_[item] = at;
    } else {
        std::array<std::uint32_t, kItemsPerLeaf + 1> items{};
        std::copy(leaf.below.begin(), leaf.below.end(), items.begin());
        items.back() = item;
        buildAt(at, boxes, items);
        refitAbove(at, boxes);
    }
    for (std::uint32_t up = care_[at].parent; up != kNone; up = care_[up].parent) {
        ++work_;
        if (needsRebuild(up)) worn = up;
    }
    if (worn != kNone) rebuild(worn, boxes);
}

void BoxTree::remove(std::uint32_t item, std::span<const Box> boxes) {
    std::uint32_t at = leafOf_[item];
    leafOf_[item] = kNone;
    Node& leaf = nodes_[at];
    const auto end = leaf.below.begin() + leaf.count;
    std::copy(std::find(leaf.below.begin(), end, item) + 1, end, std::find(leaf.below.begin(), end, item));
    --leaf.count;
    if (leaf.count > 0) {
        leaf.box = boxOf(leaf, boxes);
    } else {
        const std::uint32_t parent = care_[at].parent;
        if (parent == kNone) {
            nodes_.clear();
            care_.clear();
            free_.clear();
            return;
        }
        // The other half takes their parent's place.
        const Node& above = nodes_[parent];
        const std::uint32_t other = above.below[above.below[0] == at ? 1 : 0];
        const Care kept{care_[parent].parent, care_[other].changes, care_[other].builtCount, care_[other].builtCost};
        nodes_[parent] = nodes_[other];
        care_[parent] = kept;
        const Node& moved = nodes_[parent];
        if (moved.leaf) {
            for (const std::uint32_t stays : moved.items()) leafOf_[stays] = parent;
        } else {
            for (const std::uint32_t child : {moved.below[0], moved.below[1]}) care_[child].parent = parent;
        }
        freeNode(other);
        freeNode(at);
        at = parent;
    }
    std::uint32_t worn = kNone;
    for (std::uint32_t up = care_[at].parent; up != kNone; up = care_[up].parent) {
        ++work_;
        Node& node = nodes_[up];
        --node.count;
        node.box = boxOf(node, boxes);
        ++care_[up].changes;
        if (needsRebuild(up)) worn = up;
    }
    if (worn != kNone) rebuild(worn, boxes);
}

void BoxTree::move(std::uint32_t item, std::span<const Box> boxes) {
    // What leaves its leaf at a leap would only blow it up.
    if (!nodes_[leafOf_[item]].box.overlaps(boxes[item])) {
        remove(item, boxes);
        insert(item, boxes);
        return;
    }
    std::uint32_t worn = kNone;
    for (std::uint32_t up = leafOf_[item]; up != kNone; up = care_[up].parent) {
        ++work_;
        Node& node = nodes_[up];
        const Box box = boxOf(node, boxes);
        if (same(box, node.box)) break;
        node.box = box;
        ++care_[up].changes;
        if (needsRebuild(up)) worn = up;
    }
    if (worn != kNone) rebuild(worn, boxes);
}

/// Returns the summed half surfaces.
double BoxTree::refitAll(std::uint32_t index, std::span<const Box> boxes) {
    ++work_;
    double cost = 0;
    if (!nodes_[index].leaf) {
        cost += refitAll(nodes_[index].below[0], boxes);
        cost += refitAll(nodes_[index].below[1], boxes);
    }
    Node& node = nodes_[index];
    node.box = boxOf(node, boxes);
    return cost + halfSurface(node.box);
}

void BoxTree::follow(std::span<const Box> boxes, std::span<const std::uint32_t> changed) {
    leafOf_.resize(std::max(leafOf_.size(), boxes.size()), kNone);
    const std::size_t before = nodes_.empty() ? 0 : nodes_[kRoot].count;
    std::size_t comeOrGo = 0, moved = 0;
    for (const std::uint32_t item : changed) {
        const bool was = leafOf_[item] != kNone;
        const bool is = !boxes[item].empty();
        comeOrGo += was != is ? 1 : 0;
        moved += was && is ? 1 : 0;
    }
    if (comeOrGo > kItemsPerLeaf && kMany * comeOrGo > before) return build(boxes);
    for (const std::uint32_t item : changed)
        if (leafOf_[item] != kNone && boxes[item].empty()) remove(item, boxes);
    const bool all = moved > kItemsPerLeaf && kMany * moved > before;
    if (all) {
        const double cost = refitAll(kRoot, boxes);
        care_[kRoot].changes = 0;
        if (cost > kWornOut * care_[kRoot].builtCost) return build(boxes);
    }
    for (const std::uint32_t item : changed) {
        if (boxes[item].empty()) continue;
        if (leafOf_[item] == kNone)
            insert(item, boxes);
        else if (!all)
            move(item, boxes);
    }
}

}  // namespace tessera
