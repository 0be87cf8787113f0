#pragma once

#include <array>
#include <vector>

#include "server/collision/neighbours/SlotOrder.h"

namespace tessera::neighbours {

/// A grid over the lower corners: columns along one axis, cut into short cells, so that a box finds its candidates in a
/// few stretches of slots. Its size follows the boxes and how densely they lie. Boxes may drift some way from their
/// cell before they are put in order again; all searches are widened by how far the farthest has. Outsized boxes and
/// those that leapt are loose: they search the whole grid, and each other.
///
/// Good for boxes of similar size that are spread evenly, and quickly put in order: for frames in which all leap. Right
/// for all.
class GridOrder final : public SlotOrder {
public:
    explicit GridOrder(const SlotKernels& kernels);
    void arrange(const SlotBounds& cur, std::size_t count, Workers* workers, std::vector<std::uint32_t>& from) override;
    [[nodiscard]] double expectedSteps() const override { return expectedSteps_; }
    [[nodiscard]] std::size_t settlingSlots() const override { return view_.looseBegin; }
    [[nodiscard]] const Settlement& limits() const override { return limits_; }
    [[nodiscard]] bool beginFrame(const SlotArrays& slots, std::size_t slotCount, const float drift[3],
                                  std::span<const std::uint32_t> moved, bool all, Workers* workers) override;
    [[nodiscard]] std::size_t units() const override;
    [[nodiscard]] std::size_t unitsPerTask() const override { return 2048; }
    std::size_t sweepAll(std::size_t begin, std::size_t end, PairSink& sink) const override;
    std::size_t sweepSome(std::span<const std::uint32_t> slots, std::size_t begin, std::size_t end,
                          PairSink& sink) const override;
    [[nodiscard]] bool decayed() const override { return decayed_; }
    [[nodiscard]] bool strays(const SlotBounds&, std::size_t) const override { return false; }

private:
    void measure(const SlotBounds& cur, std::size_t count);
    void forecast();

    const SlotKernels& kernels_;
    CellFrame frame_{};
    std::uint32_t nz_ = 1;
    std::array<float, 3> extent_{};  ///< boxes larger than this are loose; in the grid's axes, as all below
    std::array<float, 3> pace_{};    ///< a drift of this size is large
    Settlement limits_{};            ///< in the world's axes
    std::size_t gridSlots_ = 0;
    std::vector<std::uint32_t> cell_, cellOfSource_, start_;
    std::vector<std::uint32_t> looseSlots_;
    GridView view_{};
    double expectedSteps_ = 0;
    bool decayed_ = false;
};

}  // namespace tessera::neighbours
