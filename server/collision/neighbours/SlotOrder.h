/// In which order boxes are kept, and how candidates are found in it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/neighbours/SlotBounds.h"

namespace tessera {
class Workers;
}

namespace tessera::neighbours {

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

}  // namespace tessera::neighbours
