#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/neighbours/PairSet.h"
#include "server/collision/neighbours/SlotOrder.h"

namespace tessera::neighbours {

/// Keeps the pairs of the last frame and looks for what has changed: pairs that met then and do not now, or the other
/// way about, are few however many boxes move, so that neither the pairs nor the boxes need sorting in a frame. Boxes
/// keep their places in an order made by a grid or a tree (SlotOrder) until they have drifted too far. Where only some
/// moved, only those search. Where most leapt, everything is found afresh.
class DifferenceFinder final : public NeighbourFinder {
public:
    /// kGrid, kTree, or kAuto: a grid, whose order is made fast, for boxes that come or leap, if they are spread
    /// evenly; a tree, in which searches are fast, for boxes that move on from where they were.
    explicit DifferenceFinder(NeighbourMethod method, Workers* workers = nullptr,
                              const SlotKernels& kernels = slotKernels());
    ~DifferenceFinder() override;

    using NeighbourFinder::move;
    void reset(std::span<const Box> boxes, InteractionTable table) override;
    void move(std::uint32_t item, const Box& box) override;
    void expect(std::size_t items) override { expected_ = items; }
    void regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair> known,
                 const InteractionTable& table) override;
    [[nodiscard]] bool changes(std::vector<NeighbourPair>& begun, std::vector<NeighbourPair>& ended) override;
    [[nodiscard]] std::span<const NeighbourPair> pairs() override;

    [[nodiscard]] std::span<const Box> boxes() const { return boxes_; }
    /// Which order is in use now: kGrid or kTree.
    [[nodiscard]] NeighbourMethod method() const {
        return order_ == tree_.get() ? NeighbourMethod::kTree : NeighbourMethod::kGrid;
    }
    /// How often all have been put in a new order so far.
    [[nodiscard]] std::size_t arrangements() const { return arrangements_; }

private:
    /// What one task found; kept for its memory.
    struct Findings {
        std::vector<SlotPair> found;
        std::vector<PairChange> changes;
        std::vector<std::uint32_t> leavers;
        Settlement settlement{};
    };

    void bringUpToDate();
    void forget(std::uint32_t slot);
    void settleStray(std::uint32_t item);
    void makeSpares(std::size_t count);
    void findAfresh();
    void findOneByOne();
    void findAll();
    void findMoved();
    void convert();
    void convertOne(std::uint32_t item);
    enum class Occasion : std::uint8_t { kAfresh, kOrderDecayed };
    void arrange(Occasion occasion);
    [[nodiscard]] bool arrangementDue() const;
    void allocate();
    [[nodiscard]] std::size_t leapLimit() const { return 256 + settled_ / 64; }
    void spreadAndSettle();
    bool releaseLeavers(std::span<const std::uint32_t> leavers);
    void takeHome();
    [[nodiscard]] bool beginFrame(bool all);
    template <typename Sweep>
    void sweep(std::size_t units, std::size_t perTask, bool some, const Sweep& sweep);
    void judge(Findings& task, std::size_t count, bool some) const;
    [[nodiscard]] bool decide(const SlotPair& pair, std::uint32_t a, std::uint32_t b, bool& begins) const;
    void sweepMoved();
    [[nodiscard]] bool sweepEverybody();
    void applyChanges(std::size_t tasks);
    void keepMoved();
    void clearMoves();
    [[nodiscard]] bool isMoved(std::uint32_t slot) const { return movedBits_[slot / 64] >> slot % 64 & 1U; }

    const SlotKernels& kernels_;
    Workers* const workers_;
    std::unique_ptr<SlotOrder> grid_, tree_;
    SlotOrder* order_ = nullptr;

    std::vector<Box> boxes_;
    InteractionTable table_;
    bool everybody_ = true;           // every pair is relevant
    std::size_t settled_ = 0;         // slots for items that are of interest to anybody, and spare ones
    std::size_t activeItems_ = 0;     // of these
    std::array<double, 3> origin_{};  // of the keys

    std::vector<std::uint32_t> slotOf_;   // per item; none for those that are of interest to nobody
    std::vector<std::uint32_t> itemOf_;   // per slot; none: a spare one
    std::vector<std::uint32_t> spares_;   // slots for what comes, or strays from its neighbours
    std::vector<std::uint32_t> vacated_;  // by strays, in this frame
    std::size_t holes_ = 0;               // slots that were left, amid others: who came there would stretch a leaf
    std::size_t expected_ = 0;
    bool foundAfresh_ = true;         // since changes or pairs were asked for
    std::vector<PairChange> untold_;  // changes since then, where there were several updates
    std::size_t slots_ = 0;           // items with a slot, and new places of what leapt in this frame
    std::vector<float> records_;      // keys by slot, as they come from the boxes
    SlotBounds cur_, prev_;
    std::vector<float> placed_;  // negated lower bounds when the order was made
    std::array<float, 3> drift_{}, lastDrift_{};
    struct Leap {
        std::uint32_t from, to;
    };
    std::vector<Leap> leaps_;

    bool fresh_ = true;  // nothing is known
    bool upToDate_ = false;
    bool prevIsCur_ = false;
    std::vector<std::uint32_t> movedItems_;
    std::vector<bool> itemMoved_;
    std::vector<std::uint32_t> movedSlots_;  // ascending
    std::vector<std::uint64_t> movedBits_;
    std::vector<std::uint32_t> from_;
    std::size_t arrangements_ = 0;
    std::size_t searches_ = 0;  // since all was found afresh

    std::vector<Findings> tasks_;
    PairSet pairs_;
};

}  // namespace tessera::neighbours
