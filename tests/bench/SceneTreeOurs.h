/// The tree of SceneTree.h in Tessera: a Node with a Transform of its own at each place.
#pragma once

#include <cstdint>
#include <span>

#include "common/change/ChangeList.h"
#include "tests/bench/SceneTree.h"

namespace tessera::bench {

/// For an empty scene; ids from 2, two at each place.
[[nodiscard]] ChangeList treeList(std::span<const TreePlace> places);

/// Ends the program where a list of the benchmark's own was refused.
void must(bool done);

/// This process as one side: see SceneSide.h.
int serveOurTree(std::uint64_t places);

}  // namespace tessera::bench
