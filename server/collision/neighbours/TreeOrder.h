#pragma once

#include <array>
#include <vector>

#include "server/collision/neighbours/SlotOrder.h"

namespace tessera::neighbours {

/// A tree of boxes, sixteen to a node, without pointers: slots are put in the order of a balanced k-d tree (halved
/// along the longest side of their centres), sixteen following ones are a leaf, sixteen leaves a node, and so on.
/// Refitted each frame, put in order again when the leaves have grown.
///
/// Good for all; only its order takes longer to make than a grid's.
class TreeOrder final : public SlotOrder {
public:
    explicit TreeOrder(const SlotKernels& kernels);
    void arrange(const SlotBounds& cur, std::size_t count, Workers* workers, std::vector<std::uint32_t>& from) override;
    [[nodiscard]] double expectedSteps() const override { return 20; }
    [[nodiscard]] std::size_t settlingSlots() const override { return 0; }
    [[nodiscard]] const Settlement& limits() const override { return limits_; }
    [[nodiscard]] bool beginFrame(const SlotArrays& slots, std::size_t slotCount, const float drift[3],
                                  std::span<const std::uint32_t> moved, bool all, Workers* workers) override;
    [[nodiscard]] std::size_t units() const override { return view_.nodes[0]; }
    [[nodiscard]] std::size_t unitsPerTask() const override { return 32; }
    std::size_t sweepAll(std::size_t begin, std::size_t end, PairSink& sink) const override;
    std::size_t sweepSome(std::span<const std::uint32_t> slots, std::size_t begin, std::size_t end,
                          PairSink& sink) const override;
    [[nodiscard]] bool decayed() const override { return decayed_; }
    [[nodiscard]] bool strays(const SlotBounds& cur, std::size_t slot) const override;

private:
    struct Center {
        std::array<float, 3> at;
        std::uint32_t slot;
    };

    [[nodiscard]] static std::size_t halve(std::span<Center> centers);
    static void split(std::span<Center> centers);
    void refit(std::span<const std::uint32_t> moved);
    [[nodiscard]] double areaOf(std::size_t leaf) const;

    const SlotKernels& kernels_;
    Settlement limits_{};
    std::vector<Center> centers_;
    std::array<SlotBounds, TreeView::kMaxLevels> boxes_;
    std::vector<std::uint32_t> changed_;  ///< nodes, while refitting
    TreeView view_{};
    SlotBounds home_;  ///< the leaves when they were new
    /// Leaves that were full when they were new; what has been put in the others since does not belong together, which
    /// is no reason for a new order.
    std::size_t fullLeaves_ = 0;
    double area_ = 0;        ///< of those
    double freshArea_ = -1;  ///< when they were new; negative: not known yet
    bool decayed_ = false;
};

}  // namespace tessera::neighbours
