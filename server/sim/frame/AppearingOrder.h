/// Which nodes of a load are seen first, and how many more with each list.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/change/ChangeList.h"

namespace tessera {

/// Of placements that put each new node behind its siblings (kFirstPlaceholder + i, i below `count`, once at most):
/// those that wait until all else is there, by their place among all, list by list. With each list at most `atOnce`
/// nodes (one at least) get into the scene, in document order: so whatever is seen already has nothing before it that
/// is not, but for what was there before. A subtree that fits into a list comes with its top; of a larger one the top
/// comes alone, and what is below it follows. At least one list; none of them is empty, but for that of a load which
/// places nothing in the scene. Cost: proportional to the placements and `count`.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> appearingOrder(const std::vector<Placement>& placements,
                                                                     std::uint64_t count, std::size_t atOnce);

}  // namespace tessera
