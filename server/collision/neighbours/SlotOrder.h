/// In which order boxes are kept, and how candidates are found in it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/neighbours/SlotKernels.h"

namespace tessera {
class Workers;
}

namespace tessera::neighbours {

/// The keys of boxes by slot, laid out as the kernels want them: in blocks of sixteen, on boundaries of cache lines.
/// Slots that nobody has set are empty.
class SlotBounds {
public:
    void allocate(std::size_t slots) {
        const std::size_t size = (slots + kSlotPadding) / kBlockSlots * kBlockFloats + kBlockFloats;
        memory_.assign(size + kBlockSlots, -kNowhere);
        std::size_t space = memory_.size() * sizeof(float);
        void* start = memory_.data();
        data_ = static_cast<float*>(std::align(kBlockSlots * sizeof(float), size * sizeof(float), start, space));
    }
    [[nodiscard]] float* data() { return data_; }
    [[nodiscard]] const float* data() const { return data_; }
    [[nodiscard]] float& at(std::size_t bound, std::size_t slot) { return data_[keyIndex(bound, slot)]; }
    [[nodiscard]] float at(std::size_t bound, std::size_t slot) const { return data_[keyIndex(bound, slot)]; }
    [[nodiscard]] bool empty(std::size_t slot) const { return !(at(0, slot) + at(3, slot) >= 0); }
    void clear(std::size_t slot) {
        for (std::size_t k = 0; k < 6; ++k) at(k, slot) = -kNowhere;
    }
    void copy(const SlotBounds& from, std::size_t fromSlot, std::size_t slot) {
        for (std::size_t k = 0; k < 6; ++k) at(k, slot) = from.at(k, fromSlot);
    }

private:
    std::vector<float> memory_;
    float* data_ = nullptr;
};

/// A way to lay out boxes in slots so that a box finds those that may meet it. What slots and keys are: SlotKernels.h.
class SlotOrder {
public:
    virtual ~SlotOrder() = default;

    /// Chooses an order of `count` slots: from[i] is the slot that becomes slot i. Drift begins anew.
    virtual void arrange(const SlotBounds& cur, std::size_t count, Workers* workers,
                         std::vector<std::uint32_t>& from) = 0;
    /// A forecast of the vectors of candidates per box, for what has just been arranged.
    [[nodiscard]] virtual double expectedSteps() const = 0;

    /// Slots below this one must settle (SlotKernels::settle); others may go anywhere.
    [[nodiscard]] virtual std::size_t settlingSlots() const = 0;
    [[nodiscard]] virtual const Settlement& limits() const = 0;

    /// Before the sweeps of a frame. `slotCount` grows by what has leapt; `drift` is that of the slots that stay;
    /// `moved`, ascending, are the only slots that may have moved; `all`: any. False if so much has moved so far that
    /// all had better be found afresh, in a new order.
    [[nodiscard]] virtual bool beginFrame(const SlotArrays& slots, std::size_t slotCount, const float drift[3],
                                          std::span<const std::uint32_t> moved, bool all, Workers* workers) = 0;

    /// The work of a sweep over all: units from 0 on, which may be cut into parts anywhere. As the kernels of that
    /// name.
    [[nodiscard]] virtual std::size_t units() const = 0;
    [[nodiscard]] virtual std::size_t unitsPerTask() const = 0;
    virtual std::size_t sweepAll(std::size_t begin, std::size_t end, PairSink& sink) const = 0;
    virtual std::size_t sweepSome(std::span<const std::uint32_t> slots, std::size_t begin, std::size_t end,
                                  PairSink& sink) const = 0;

    /// After the sweeps: a new order would pay.
    [[nodiscard]] virtual bool decayed() const = 0;
    /// Whether a slot has moved to where its neighbours in the order are not.
    [[nodiscard]] virtual bool strays(const SlotBounds& cur, std::size_t slot) const = 0;
};

/// About where most boxes are. Keys are finest around the origin, so it should lie there; one box far away must not
/// draw it to itself.
[[nodiscard]] inline std::array<double, 3> middle(std::span<const Box> boxes) {
    constexpr std::size_t kSample = 256;
    std::array<std::vector<double>, 3> sample;
    for (std::size_t i = 0; i < boxes.size(); i += boxes.size() / kSample + 1) {
        const Vec3d center = boxes[i].center();
        if (boxes[i].empty() || !center.allFinite()) continue;
        for (std::size_t a = 0; a < 3; ++a) sample[a].push_back(center[static_cast<int>(a)]);
    }
    std::array<double, 3> origin{};
    if (sample[0].empty()) return origin;
    const auto half = static_cast<std::ptrdiff_t>(sample[0].size() / 2);
    for (std::size_t a = 0; a < 3; ++a) {
        std::nth_element(sample[a].begin(), sample[a].begin() + half, sample[a].end());
        origin[a] = sample[a][static_cast<std::size_t>(half)];
    }
    return origin;
}

}  // namespace tessera::neighbours
