/// Divides the few triangles of one lowest node into its leaves.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/collision/tree/DivisionItem.h"
#include "server/collision/tree/KernelTypes.h"

namespace tessera {

inline constexpr std::size_t kNodeFaces = std::size_t{kernel::kWidth} * kernel::kLeafFaces;

struct LeafDivision {
    std::array<std::uint8_t, kNodeFaces> order;        ///< places in `items`, leaf by leaf
    std::array<std::uint8_t, kernel::kWidth> counts;   ///< triangles of each leaf
    std::size_t leaves = 0;
};

/// As few leaves as they can be, for at most kNodeFaces triangles: cuts are tried between whole leaves.
[[nodiscard]] LeafDivision divideIntoLeaves(std::span<const DivisionItem> items, SplitRule rule);

}  // namespace tessera
