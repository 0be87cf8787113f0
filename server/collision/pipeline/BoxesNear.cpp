#include "server/collision/pipeline/BoxesNear.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace tessera {

BoxesNear::BoxesNear(std::vector<Item> items) {
    if (items.empty()) return;
    std::ranges::sort(items, {}, [](const Item& item) { return std::tuple(item.company, item.item); });
    nodes_.reserve(2 * items.size());
    for (const Item& item : items) nodes_.push_back({.box = item.box, .company = item.company, .item = item.item});
    std::vector<std::uint32_t> tops, members;
    for (std::uint32_t begin = 0, end = 0; begin < items.size(); begin = end) {
        for (end = begin + 1;
             end < items.size() && items[begin].company != kAlone && items[end].company == items[begin].company;)
            ++end;
        members.clear();
        for (std::uint32_t i = begin; i < end; ++i) members.push_back(i);
        tops.push_back(join(members, items[begin].company));
    }
    root_ = join(tops, tops.size() == 1 ? nodes_[tops.front()].company : kAlone);
}

/// One tree of several: halves along the axis on which their middles lie farthest apart.
std::uint32_t BoxesNear::join(std::span<std::uint32_t> roots, std::uint32_t company) {
    if (roots.size() == 1) return roots.front();
    const auto middle = [&](std::uint32_t root, Eigen::Index axis) {
        const double at = nodes_[root].box.center()[axis];
        return std::isfinite(at) ? at : 0.0;
    };
    Box box, middles;
    for (const std::uint32_t root : roots) {
        box.extend(nodes_[root].box);
        middles.extend(Vec3d(middle(root, 0), middle(root, 1), middle(root, 2)));
    }
    Eigen::Index axis = 0;
    middles.size().maxCoeff(&axis);
    const auto half = static_cast<std::ptrdiff_t>(roots.size() / 2);
    std::nth_element(roots.begin(), roots.begin() + half, roots.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(middle(a, axis), a) < std::pair(middle(b, axis), b);
    });
    const std::uint32_t left = join(roots.first(static_cast<std::size_t>(half)), company);
    const std::uint32_t right = join(roots.subspan(static_cast<std::size_t>(half)), company);
    nodes_.push_back({.box = box, .company = company, .left = left, .right = right});
    return static_cast<std::uint32_t>(nodes_.size() - 1);
}

void BoxesNear::find(const Box& box, std::uint32_t company, std::vector<std::uint32_t>& near) {
    near.clear();
    if (nodes_.empty()) return;
    open_.assign(1, root_);
    while (!open_.empty()) {
        const Node& node = nodes_[open_.back()];
        open_.pop_back();
        if (company != kAlone && node.company == company) continue;
        ++looks_;
        if (!node.box.overlaps(box)) continue;
        if (node.left == node.right) {
            near.push_back(node.item);
            continue;
        }
        open_.push_back(node.left);
        open_.push_back(node.right);
    }
    std::ranges::sort(near);
}

}  // namespace tessera
