#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/collision/neighbours/SlotKernels.h"

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

}  // namespace tessera::neighbours
