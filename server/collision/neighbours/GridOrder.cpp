#include "server/collision/neighbours/GridOrder.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tessera::neighbours {

namespace {

constexpr std::size_t kSampleSize = 1024;
constexpr double kTail = 0.02;           // of the sample, on either side, that may lie far out
constexpr double kOutsized = 1.0 / 256;  // of the sample, that may be much larger than the others
constexpr double kPerStretch = 9;        // candidates that a box should find in one column
constexpr double kPerCell = 1.0;
constexpr float kDecay = 0.2F;  // drift, in extents, at which a new order pays

struct Sample {
    std::vector<float> lower, extent;
};

}  // namespace

GridOrder::GridOrder(const SlotKernels& kernels) : kernels_(kernels) {}

/// Chooses the size of the cells from a sample. Quantiles, not extremes: one box far away or of great size must not
/// spoil the grid for the others.
void GridOrder::measure(const SlotBounds& cur, std::size_t count) {
    std::size_t present = 0;
    for (std::size_t s = 0; s < count; ++s) present += !cur.empty(s);
    const std::size_t stride = std::max<std::size_t>(1, present / kSampleSize);
    std::array<Sample, 3> sample;
    std::size_t k = 0;
    for (std::size_t s = 0; s < count; ++s) {
        if (cur.empty(s) || k++ % stride != 0) continue;
        for (std::size_t a = 0; a < 3; ++a) {
            sample[a].lower.push_back(-cur.at(a, s));
            sample[a].extent.push_back(cur.at(a + 3, s) + cur.at(a, s));
        }
    }
    frame_ = CellFrame{.axis = {0, 1, 2}};
    frame_.ny = nz_ = 1;
    extent_ = pace_ = {};
    if (present == 0) return;

    const std::size_t n = sample[0].lower.size();
    const auto tail = static_cast<std::size_t>(kTail * static_cast<double>(n));
    const auto outsized = static_cast<std::size_t>(std::ceil(kOutsized * static_cast<double>(n)));
    std::array<double, 3> origin{}, range{}, extent{};
    for (std::size_t a = 0; a < 3; ++a) {
        std::vector<float>& lower = sample[a].lower;
        std::sort(lower.begin(), lower.end());
        const double low = lower[tail], high = lower[n - 1 - tail];
        range[a] = (high - low) * static_cast<double>(n) / static_cast<double>(n - 2 * tail);
        origin[a] = 0.5 * (low + high - range[a]);
        std::vector<float>& sizes = sample[a].extent;
        const auto nth = sizes.end() - static_cast<std::ptrdiff_t>(std::min(n, outsized));
        std::nth_element(sizes.begin(), nth, sizes.end());
        extent[a] = 1.25 * double{*nth};
    }
    double volume = 1;
    for (std::size_t a = 0; a < 3; ++a) volume *= std::max({range[a], extent[a], 1e-30});
    const double spacing = std::cbrt(volume / static_cast<double>(present));
    std::array<double, 3> unit{};
    for (std::size_t a = 0; a < 3; ++a) unit[a] = std::max({extent[a], 0.25 * spacing, 1e-6 * range[a], 1e-30});
    std::array<int, 3> axes{0, 1, 2};
    std::sort(axes.begin(), axes.end(), [&](int x, int y) {
        const auto length = [&](int a) {
            return range[static_cast<std::size_t>(a)] / unit[static_cast<std::size_t>(a)];
        };
        return length(x) != length(y) ? length(x) > length(y) : x < y;
    });
    const auto along = [&](const std::array<double, 3>& values, std::size_t axis) {
        return values[static_cast<std::size_t>(axes[axis])];
    };
    const double density = static_cast<double>(present) / volume;
    double factor = std::max(1.0, std::sqrt(kPerStretch / (density * unit[0] * unit[1] * unit[2])));
    std::array<double, 3> dims{};
    const auto columns = [&] {
        for (std::size_t a = 1; a < 3; ++a)
            dims[a] = std::max(1.0, std::ceil(along(range, a) / (factor * along(unit, a))));
        return dims[1] * dims[2];
    };
    const double most = static_cast<double>(present) + 64;
    while (columns() > most) factor *= 1.5;
    const double perColumn = static_cast<double>(present) / (dims[1] * dims[2]) / kPerCell;
    while (frame_.xBits < 20 && std::exp2(frame_.xBits + 0.5) < perColumn) ++frame_.xBits;
    dims[0] = std::exp2(frame_.xBits);
    frame_.ny = static_cast<std::uint32_t>(dims[1]);
    nz_ = static_cast<std::uint32_t>(dims[2]);
    for (std::size_t a = 0; a < 3; ++a) {
        frame_.axis[a] = axes[a];
        const double wide = std::max(along(range, a), 1e-30);
        frame_.origin[a] = static_cast<float>(along(origin, a));
        frame_.scale[a] = static_cast<float>(std::min(dims[a] / wide, 1e30));
        frame_.last[a] = static_cast<float>(dims[a] - 1);
        extent_[a] = static_cast<float>(along(extent, a));
        pace_[a] = static_cast<float>(along(unit, a));
    }
}

void GridOrder::arrange(const SlotBounds& cur, std::size_t count, Workers*, std::vector<std::uint32_t>& from) {
    measure(cur, count);
    const std::uint32_t cells = (frame_.ny * nz_) << frame_.xBits;
    const std::uint32_t empty = cells, loose = cells + 1;  // two more places in the order, behind all cells
    cellOfSource_.resize(count);
    kernels_.cells(frame_, cur.data(), count, cellOfSource_.data());
    start_.assign(cells + 3, 0);
    std::array<float, 3> largest{};
    for (std::size_t s = 0; s < count; ++s) {
        std::array<float, 3> size{};
        bool fits = true;
        for (std::size_t a = 0; a < 3; ++a) {
            const auto axis = static_cast<std::size_t>(frame_.axis[a]);
            size[a] = cur.at(axis + 3, s) + cur.at(axis, s);
            fits = fits && size[a] <= extent_[a];
        }
        if (cur.empty(s)) {
            cellOfSource_[s] = empty;
        } else if (!fits) {
            cellOfSource_[s] = loose;
        } else {
            for (std::size_t a = 0; a < 3; ++a) largest[a] = std::max(largest[a], size[a]);
        }
        ++start_[cellOfSource_[s] + 1];
    }
    for (std::size_t c = 0; c + 1 < start_.size(); ++c) start_[c + 1] += start_[c];
    from.resize(count);
    cell_.resize(count + kSlotPadding);
    for (std::size_t s = 0; s < count; ++s) {
        const std::uint32_t slot = start_[cellOfSource_[s]]++;
        from[slot] = static_cast<std::uint32_t>(s);
        cell_[slot] = cellOfSource_[s];
    }
    // Each number is the end of its cell now: the beginning of the next.
    std::copy_backward(start_.begin(), start_.end() - 1, start_.end());
    start_[0] = 0;
    gridSlots_ = start_[empty];
    view_.frame = frame_;
    view_.cell = cell_.data();
    view_.start = start_.data();
    view_.looseBegin = start_[loose];
    view_.looseEnd = static_cast<std::uint32_t>(count);
    for (std::size_t a = 0; a < 3; ++a) {
        const auto world = static_cast<std::size_t>(frame_.axis[a]);
        extent_[a] = std::max(1.0625F * largest[a], 1e-30F);
        limits_.maxExtent[world] = extent_[a];
        limits_.maxDrift[world] = pace_[a];
    }
    decayed_ = false;
    forecast();
}

/// What the boxes of a cell find in the stretches of four columns as full as their own.
void GridOrder::forecast() {
    const std::size_t nx = std::size_t{1} << frame_.xBits;
    const auto span = static_cast<std::size_t>(std::min(extent_[0] * frame_.scale[0], frame_.last[0])) + 1;
    double steps = 0;
    for (std::size_t row = 0; row + nx <= std::size_t{frame_.ny} * nz_ * nx; row += nx)
        for (std::size_t x = 0; x < nx; ++x) {
            const double here = start_[row + x + 1] - start_[row + x];
            const double found = start_[row + std::min(x + span, nx - 1) + 1] - start_[row + x];
            steps += here * (1 + found / 16);
        }
    const double outside = static_cast<double>(view_.looseEnd - view_.looseBegin);
    steps = 4 * steps + outside * (outside + static_cast<double>(gridSlots_)) / 16;
    expectedSteps_ = steps / std::max(1.0, outside + static_cast<double>(gridSlots_));
}

bool GridOrder::beginFrame(const SlotArrays& slots, std::size_t slotCount, const float drift[3],
                           std::span<const std::uint32_t>, bool, Workers*) {
    view_.slots = slots;
    for (std::size_t a = 0; a < 3; ++a) {
        const auto world = static_cast<std::size_t>(frame_.axis[a]);
        // Rounded up for the rounding in what they were computed from.
        view_.drift[a] = drift[world] * 1.00001F;
        view_.reach[a] = (extent_[a] + drift[world]) * 1.00001F;
        decayed_ = decayed_ || drift[world] > kDecay * pace_[a];
    }
    view_.looseEnd = static_cast<std::uint32_t>(slotCount);
    looseSlots_.resize(slotCount - view_.looseBegin);
    std::iota(looseSlots_.begin(), looseSlots_.end(), view_.looseBegin);
    return true;
}

std::size_t GridOrder::units() const {
    return gridSlots_ + looseSlots_.size();
}

std::size_t GridOrder::sweepAll(std::size_t begin, std::size_t end, PairSink& sink) const {
    if (begin < gridSlots_) {
        const std::size_t last = std::min(end, gridSlots_);
        const std::size_t next = kernels_.gridAll(view_, begin, last, sink);
        if (next < last || last == end) return next;
        begin = next;
    }
    return gridSlots_ + kernels_.gridSome(view_, looseSlots_.data(), begin - gridSlots_, end - gridSlots_, false, sink);
}

std::size_t GridOrder::sweepSome(std::span<const std::uint32_t> slots, std::size_t begin, std::size_t end,
                                 PairSink& sink) const {
    return kernels_.gridSome(view_, slots.data(), begin, end, true, sink);
}

}  // namespace tessera::neighbours
