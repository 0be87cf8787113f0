#include "server/collision/neighbours/TreeOrder.h"

#include <algorithm>
#include <cmath>

#include "server/collision/neighbours/Tasks.h"

namespace tessera::neighbours {

namespace {

constexpr double kTreeDecay = 1.8;      // growth of the leaves at which a new order pays
constexpr std::size_t kPerTask = 1024;  // boxes to halve
constexpr std::size_t kLeavesPerTask = 128;
constexpr std::size_t kFewLeavesOf = 16;  // of leaves: fewer are refitted one by one
constexpr double kHopeless = 4;           // and at which it is due before the sweep

}  // namespace

TreeOrder::TreeOrder(const SlotKernels& kernels) : kernels_(kernels) {}

void TreeOrder::arrange(const SlotBounds& cur, std::size_t count, Workers* workers, std::vector<std::uint32_t>& from) {
    centers_.clear();
    centers_.reserve(count);
    from.clear();
    from.reserve(count);
    std::vector<std::uint32_t> empty;
    for (std::uint32_t s = 0; s < count; ++s) {
        if (cur.empty(s)) {
            empty.push_back(s);
            continue;
        }
        Center center{{}, s};
        for (std::size_t a = 0; a < 3; ++a) center.at[a] = 0.5F * (cur.at(a + 3, s) - cur.at(a, s));
        centers_.push_back(center);
    }
    // Halves, quarters, … side by side, until each part is a task.
    std::vector<std::span<Center>> parts{centers_}, halves;
    while (parts.back().size() > kPerTask) {  // the last is the largest
        halves.resize(2 * parts.size());
        runTasks(workers, parts.size(), [&](std::size_t i) {
            const std::size_t middle = halve(parts[i]);
            halves[2 * i] = parts[i].first(middle);
            halves[2 * i + 1] = parts[i].subspan(middle);
        });
        parts.swap(halves);
    }
    runTasks(workers, parts.size(), [&](std::size_t i) { split(parts[i]); });
    for (const Center& center : centers_) from.push_back(center.slot);
    from.insert(from.end(), empty.begin(), empty.end());

    view_.levels = 0;
    std::size_t nodes = std::max<std::size_t>(1, (count + kBlockSlots - 1) / kBlockSlots);
    while (true) {
        const auto level = static_cast<std::size_t>(view_.levels++);
        view_.nodes[level] = static_cast<std::uint32_t>(nodes);
        boxes_[level].allocate(nodes);
        view_.box[level] = boxes_[level].data();
        if (nodes == 1) break;
        nodes = (nodes + kBlockSlots - 1) / kBlockSlots;
    }
    fullLeaves_ = centers_.size() / kBlockSlots;
    if (empty.empty()) fullLeaves_ = view_.nodes[0];
    freshArea_ = -1;
    decayed_ = false;
}

/// Puts the lower half along the longest side first, and says where the upper one begins: at a multiple of what a node
/// of the next level holds, so that nodes are full.
std::size_t TreeOrder::halve(std::span<Center> centers) {
    if (centers.size() <= kBlockSlots) return centers.size();
    std::size_t unit = kBlockSlots;
    while (unit * kBlockSlots < centers.size()) unit *= kBlockSlots;
    const std::size_t units = (centers.size() + unit - 1) / unit;
    std::array<float, 3> low = centers[0].at, high = low;
    for (const Center& center : centers)
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], center.at[a]);
            high[a] = std::max(high[a], center.at[a]);
        }
    std::size_t axis = 0;
    for (std::size_t a = 1; a < 3; ++a)
        if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
    const std::size_t half = unit * (units / 2);
    std::nth_element(centers.begin(), centers.begin() + static_cast<std::ptrdiff_t>(half), centers.end(),
                     [axis](const Center& x, const Center& y) {
                         return x.at[axis] != y.at[axis] ? x.at[axis] < y.at[axis] : x.slot < y.slot;
                     });
    return half;
}

void TreeOrder::split(std::span<Center> centers) {
    const std::size_t half = halve(centers);
    if (half == centers.size()) return;
    split(centers.first(half));
    split(centers.subspan(half));
}

bool TreeOrder::beginFrame(const SlotArrays& slots, std::size_t, const float*, std::span<const std::uint32_t> moved,
                           bool all, Workers* workers) {
    view_.slots = slots;
    if (all || freshArea_ < 0 || moved.size() > view_.nodes[0] / kFewLeavesOf) {
        const std::size_t leaves = view_.nodes[0], tasks = leaves / kLeavesPerTask + 1;
        runTasks(workers, tasks,
                 [&](std::size_t i) { kernels_.treeLeaves(view_, leaves * i / tasks, leaves * (i + 1) / tasks); });
        kernels_.treeUpper(view_);
        area_ = 0;
        for (std::size_t leaf = 0; leaf < fullLeaves_; ++leaf) area_ += areaOf(leaf);
    } else {
        refit(moved);
    }
    if (freshArea_ < 0) {
        freshArea_ = area_;
        home_.allocate(view_.nodes[0]);
        std::copy(boxes_[0].data(), boxes_[0].data() + keyIndex(0, view_.nodes[0] + kBlockSlots - 1), home_.data());
    }
    decayed_ = area_ > kTreeDecay * freshArea_;
    return area_ <= kHopeless * freshArea_;
}

/// The leaves of these slots (ascending), and what is above them.
void TreeOrder::refit(std::span<const std::uint32_t> moved) {
    changed_.clear();
    for (const std::uint32_t slot : moved) {
        const std::uint32_t leaf = slot / static_cast<std::uint32_t>(kBlockSlots);
        if (!changed_.empty() && changed_.back() == leaf) continue;
        changed_.push_back(leaf);
        if (leaf < fullLeaves_) area_ -= areaOf(leaf);
        kernels_.treeLeaves(view_, leaf, leaf + 1);
        if (leaf < fullLeaves_) area_ += areaOf(leaf);
    }
    for (std::size_t level = 1; level < static_cast<std::size_t>(view_.levels); ++level) {
        std::size_t kept = 0;
        for (const std::uint32_t child : changed_) {
            const std::uint32_t node = child / static_cast<std::uint32_t>(kBlockSlots);
            if (kept > 0 && changed_[kept - 1] == node) continue;
            for (std::size_t k = 0; k < 6; ++k) {
                float outermost = -kNowhere;
                for (std::size_t i = 0; i < kBlockSlots; ++i)
                    outermost = std::max(outermost, boxes_[level - 1].at(k, node * kBlockSlots + i));
                boxes_[level].at(k, node) = outermost;
            }
            changed_[kept++] = node;
        }
        changed_.resize(kept);
    }
}

double TreeOrder::areaOf(std::size_t leaf) const {
    std::array<double, 3> size{};
    for (std::size_t a = 0; a < 3; ++a)
        size[a] = std::max(0.0, double{boxes_[0].at(a + 3, leaf)} + double{boxes_[0].at(a, leaf)});
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

/// Apart from what it was put with.
bool TreeOrder::strays(const SlotBounds& cur, std::size_t slot) const {
    const std::size_t leaf = slot / kBlockSlots;
    if (freshArea_ < 0 || leaf >= fullLeaves_ || cur.empty(slot)) return false;
    for (std::size_t a = 0; a < 3; ++a)
        if (cur.at(a, slot) + home_.at(a + 3, leaf) < 0 || cur.at(a + 3, slot) + home_.at(a, leaf) < 0) return true;
    return false;
}

std::size_t TreeOrder::sweepAll(std::size_t begin, std::size_t end, PairSink& sink) const {
    return kernels_.treeAll(view_, begin, end, sink);
}

std::size_t TreeOrder::sweepSome(std::span<const std::uint32_t> slots, std::size_t begin, std::size_t end,
                                 PairSink& sink) const {
    return kernels_.treeSome(view_, slots.data(), begin, end, sink);
}

}  // namespace tessera::neighbours
