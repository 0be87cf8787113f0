#include "server/collision/neighbours/PlainFinders.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tessera {

namespace {

/// Takes out, in passing, the items that the sweep has left behind, and calls `meet` for the others.
template <typename Meet>
void visitOpen(std::vector<std::uint32_t>& open, const std::vector<Box>& boxes, int axis, double sweep, Meet&& meet) {
    std::size_t kept = 0;
    for (const std::uint32_t item : open) {
        if (boxes[item].upper[axis] < sweep) continue;
        open[kept++] = item;
        meet(item);
    }
    open.resize(kept);
}

}  // namespace

void SweepAndPrune::reset(std::span<const Box> boxes, InteractionTable table) {
    boxes_.assign(boxes.begin(), boxes.end());
    table_ = std::move(table);
    order_.resize(boxes_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::uint32_t>(i);
    moved_ = boxes_.size();
    sweeps_ = 0;
    upToDate_ = false;
}

void SweepAndPrune::move(std::uint32_t item, const Box& box) {
    if (boxes_[item].lower == box.lower && boxes_[item].upper == box.upper) return;
    boxes_[item] = box;
    ++moved_;
    upToDate_ = false;
}

void SweepAndPrune::regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair>,
                            const InteractionTable& table) {
    std::vector<Box> boxes = std::move(boxes_);
    boxes.resize(table.groupOf.size());
    InteractionTable own = table;
    for (const std::uint32_t item : items) boxes[item] = {};
    for (std::uint32_t& group : own.groupOf)
        if (group == InteractionTable::kNoGroup) group = 0;  // whatever: its box is empty
    reset(boxes, std::move(own));
}

std::span<const NeighbourPair> SweepAndPrune::pairs() {
    if (!upToDate_) {
        if (sweeps_++ % kSweepsPerAxis == 0) chooseAxis();
        sort();
        sweep();
        upToDate_ = true;
    }
    return pairs_;
}

void SweepAndPrune::chooseAxis() {
    Vec3d sum = Vec3d::Zero(), squares = Vec3d::Zero();
    double n = 0;
    for (const Box& box : boxes_) {
        const Vec3d c = box.center();
        if (box.empty() || !c.allFinite()) continue;
        sum += c;
        squares += c.cwiseProduct(c);
        n += 1;
    }
    if (n == 0) return;
    int axis = 0;
    (squares - sum.cwiseProduct(sum) / n).maxCoeff(&axis);
    if (axis != axis_) moved_ = boxes_.size();
    axis_ = axis;
}

void SweepAndPrune::sort() {
    // Empty boxes (with a NaN, perhaps, that has no place in any order) come last.
    const auto key = [&](std::uint32_t x) {
        return boxes_[x].empty() ? std::numeric_limits<double>::infinity() : boxes_[x].lower[axis_];
    };
    const auto before = [&](std::uint32_t x, std::uint32_t y) {
        const double lx = key(x), ly = key(y);
        return lx != ly ? lx < ly : x < y;
    };
    // Insertion sort is linear while little is out of place, and quadratic when much is.
    if (moved_ > order_.size() / 8) {
        std::sort(order_.begin(), order_.end(), before);
    } else {
        for (std::size_t i = 1; i < order_.size(); ++i) {
            const std::uint32_t item = order_[i];
            std::size_t k = i;
            for (; k > 0 && before(item, order_[k - 1]); --k) order_[k] = order_[k - 1];
            order_[k] = item;
        }
    }
    moved_ = 0;
}

void SweepAndPrune::sweep() {
    pairs_.clear();
    // Passive items (most of a scene: walls, floors) need not be held against each other.
    std::vector<std::uint32_t> openActive, openPassive;
    for (const std::uint32_t item : order_) {
        const Box& box = boxes_[item];
        if (box.empty()) continue;
        const auto meet = [&](std::uint32_t other) {
            if (table_.relevant(item, other) && box.overlaps(boxes_[other]))
                pairs_.push_back({std::min(item, other), std::max(item, other)});
        };
        const double at = box.lower[axis_];
        visitOpen(openActive, boxes_, axis_, at, meet);
        if (table_.activeItem(item)) {
            visitOpen(openPassive, boxes_, axis_, at, meet);
            openActive.push_back(item);
        } else {
            openPassive.push_back(item);
        }
    }
    std::sort(pairs_.begin(), pairs_.end());
}

}  // namespace tessera
