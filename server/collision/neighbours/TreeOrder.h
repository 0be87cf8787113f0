#pragma once

#include <array>
#include <vector>

#include "server/collision/neighbours/SlotOrder.h"

namespace tessera::neighbours {

/// A tree of boxes, sixteen to a node, without pointers: slots are put in the order of a balanced k-d tree (halved along
/// the longest side of their centres), sixteen following ones are a leaf, sixteen leaves a node, and so on. Refitted each
/// frame, put in order again when the leaves have grown.
///
/// Good for clusters and mixed sizes; two to four times slower than a grid where a grid is good.
class TreeOrder final : public SlotOrder {
public:
    TreeOrder();
    void arrange(const float* const cur[6], std::size_t count, std::vector<std::uint32_t>& from) override;
    [[nodiscard]] double expectedSteps() const override { return 30; }
    [[nodiscard]] std::size_t settlingSlots() const override { return 0; }
    [[nodiscard]] const Settlement& limits() const override { return limits_; }
    void beginFrame(const SlotArrays& slots, std::size_t slotCount, const float drift[3], std::span<const std::uint32_t> moved,
                    bool all) override;
    [[nodiscard]] std::size_t units() const override { return view_.nodes[0]; }
    [[nodiscard]] std::size_t unitsPerTask() const override { return 128; }
    std::size_t sweepAll(std::size_t begin, std::size_t end, PairSink& sink) const override;
    std::size_t sweepSome(std::span<const std::uint32_t> slots, std::size_t begin, std::size_t end,
                          PairSink& sink) const override;
    [[nodiscard]] bool decayed() const override { return decayed_; }

private:
    struct Center {
        std::array<float, 3> at;
        std::uint32_t slot;
    };

    void split(std::span<Center> centers);
    [[nodiscard]] double leafArea() const;

    const SlotKernels& kernels_;
    Settlement limits_{};
    std::vector<Center> centers_;
    std::array<std::array<std::vector<float>, 6>, TreeView::kMaxLevels> boxes_;
    TreeView view_{};
    double freshArea_ = -1;  ///< of the leaves when they were new; negative: not known yet
    bool decayed_ = false;
};

}  // namespace tessera::neighbours
