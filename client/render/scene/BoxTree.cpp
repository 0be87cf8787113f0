#include "client/render/scene/BoxTree.h"

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
/// A new top has so many subtrees below it, or a few times as many.
constexpr std::uint32_t kPieces = 256;

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
    care_[index].builtCost = count > kLarge ? costOf(index) : cost;
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
    spent_ += nodes_[index].count;
    std::vector<std::uint32_t> items, nodes;
    items.reserve(nodes_[index].count);
    collect(index, items, nodes);
    // The lowest are taken again first.
    std::sort(nodes.begin(), nodes.end(), std::greater<>());
    for (const std::uint32_t node : nodes) freeNode(node);
    buildAt(index, boxes, items);
    refitAbove(index, boxes);
}

/// A hierarchy above subtrees, as `buildAt` makes one above items: their numbers stay. Returns the summed half
/// surfaces.
double BoxTree::buildAbove(std::uint32_t index, std::span<std::uint32_t> pieces) {
    ++work_;
    Node node{.count = 0, .leaf = false};
    Box centers;
    for (const std::uint32_t piece : pieces) {
        const Node& below = nodes_[piece];
        node.count += below.count;
        node.box.extend(below.box);
        if (!below.box.empty()) centers.extend(below.box.center());
    }
    int axis = 0;
    if (!centers.empty()) centers.size().maxCoeff(&axis);
    std::sort(pieces.begin(), pieces.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto key = [&](std::uint32_t piece) {
            const Box& box = nodes_[piece].box;
            return box.empty() ? -std::numeric_limits<double>::infinity() : box.center()[axis];
        };
        const double ka = key(a), kb = key(b);
        return ka < kb || (ka == kb && a < b);
    });
    // As near to the median of the items as pieces allow.
    std::size_t half = 1;
    for (std::uint32_t count = nodes_[pieces[0]].count; half + 1 < pieces.size(); ++half) {
        const std::uint32_t next = nodes_[pieces[half]].count;
        if (2 * count + next > node.count) break;
        count += next;
    }
    double cost = halfSurface(node.box);
    const std::array<std::span<std::uint32_t>, 2> halves{pieces.first(half), pieces.subspan(half)};
    for (std::size_t side = 0; side < 2; ++side) {
        if (halves[side].size() == 1) {
            node.below[side] = halves[side].front();
            care_[node.below[side]].parent = index;
            cost += care_[node.below[side]].builtCost;
        } else {
            node.below[side] = addNode(index);
            cost += buildAbove(node.below[side], halves[side]);
        }
    }
    nodes_[index] = node;
    care_[index].changes = 0;
    care_[index].builtCount = node.count;
    care_[index].builtCost = node.count > kLarge ? costOf(index) : cost;
    return cost;
}

void BoxTree::rebuildTop(std::uint32_t index, std::span<const Box> boxes) {
    const std::uint32_t largest = nodes_[index].count / kPieces;
    std::vector<std::uint32_t> open{index}, pieces, nodes;
    while (!open.empty()) {
        const std::uint32_t at = open.back();
        open.pop_back();
        ++work_;
        if (nodes_[at].count <= largest) {
            pieces.push_back(at);
            continue;
        }
        if (at != index) nodes.push_back(at);
        open.insert(open.end(), nodes_[at].below.begin(), nodes_[at].below.begin() + 2);
    }
    std::sort(nodes.begin(), nodes.end(), std::greater<>());
    for (const std::uint32_t node : nodes) freeNode(node);
    spent_ += 4 * pieces.size();
    buildAbove(index, pieces);
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
    const std::uint32_t least = nodes_[index].count > kLarge ? nodes_[index].count / kPieces : 0;
    double cost = 0;
    std::vector<std::uint32_t> open{index};
    while (!open.empty()) {
        const Node& node = nodes_[open.back()];
        open.pop_back();
        if (node.count < least) continue;
        ++work_;
        ++spent_;
        cost += halfSurface(node.box);
        if (!node.leaf) open.insert(open.end(), node.below.begin(), node.below.begin() + 2);
    }
    return cost;
}

void BoxTree::look(std::uint32_t index, Worn& worn) {
    const Node& node = nodes_[index];
    if (node.leaf) return;
    Care& care = care_[index];
    const auto anew = [&](bool whole) {
        if (whole)
            worn = {.whole = index, .top = kNone};
        else
            worn.top = index;
    };
    if (node.count <= kItemsPerLeaf / 2) return anew(true);    // a leaf would do
    if (spent_ >= mayBeSpent_ && node.count > kSmall) return;  // the next change below it looks again
    const std::uint32_t larger = std::max(nodes_[node.below[0]].count, nodes_[node.below[1]].count);
    // Pieces below a new top are of unlike sizes, and only some changes make that worse.
    if (node.count > kSmall && larger > kLargestShare * node.count && care.changes > node.count / 16)
        return anew(node.count <= kLarge);
    if (care.changes <= 2 * node.count) return;
    // Looked at so seldom that it costs each change a constant per level.
    care.changes = 0;
    if (node.count > 2 * care.builtCount) return anew(node.count <= kLarge);
    // More items have more boxes, none of which need be worn.
    const double more = std::max(1.0, static_cast<double>(node.count) / care.builtCount);
    if (costOf(index) > kWornOut * more * care.builtCost) anew(true);
}

void BoxTree::mend(const Worn& worn, std::span<const Box> boxes) {
    if (worn.whole != kNone) rebuild(worn.whole, boxes);
    if (worn.top != kNone) rebuildTop(worn.top, boxes);
}

void BoxTree::insert(std::uint32_t item, std::span<const Box> boxes) {
    const Box& box = boxes[item];
    if (nodes_.empty()) {
        buildAt(addNode(kNone), boxes, std::span(&item, 1));
        return;
    }
    Worn worn;
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
        look(up, worn);
    }
    mend(worn, boxes);
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
    Worn worn;
    for (std::uint32_t up = care_[at].parent; up != kNone; up = care_[up].parent) {
        ++work_;
        Node& node = nodes_[up];
        --node.count;
        node.box = boxOf(node, boxes);
        ++care_[up].changes;
        look(up, worn);
    }
    mend(worn, boxes);
}

void BoxTree::move(std::uint32_t item, std::span<const Box> boxes) {
    // What leaves its leaf at a leap would only blow it up.
    if (!nodes_[leafOf_[item]].box.overlaps(boxes[item])) {
        remove(item, boxes);
        insert(item, boxes);
        return;
    }
    Worn worn;
    for (std::uint32_t up = leafOf_[item]; up != kNone; up = care_[up].parent) {
        ++work_;
        Node& node = nodes_[up];
        const Box box = boxOf(node, boxes);
        if (same(box, node.box)) break;
        node.box = box;
        ++care_[up].changes;
        look(up, worn);
    }
    mend(worn, boxes);
}

void BoxTree::refitAll(std::uint32_t index, std::span<const Box> boxes) {
    ++work_;
    Node& node = nodes_[index];
    if (!node.leaf)
        for (const std::uint32_t child : {node.below[0], node.below[1]}) refitAll(child, boxes);
    node.box = boxOf(node, boxes);
}

void BoxTree::follow(std::span<const Box> boxes, std::span<const std::uint32_t> changed) {
    spent_ = 0;
    mayBeSpent_ = 2 * kLarge + 8 * changed.size();
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
        refitAll(kRoot, boxes);
        care_[kRoot].changes = 0;
        if (costOf(kRoot) > kWornOut * care_[kRoot].builtCost) return build(boxes);
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
