/// Rows of the screen benchmark that have a file of their own.
#pragma once

#include <string>

#include "tests/bench/SceneTable.h"

namespace tessera::bench {

/// From a tracker's datagram to the Swap of the first frame that knows of it: the engine hall on four tiles, 60 frames
/// a second at most, `count` datagrams at random instants. `drawn`: by OSMesa; else hosts draw nothing, and what is
/// left is ours.
void poseRows(SceneTable& table, const std::string& folder, int count, bool drawn);

}  // namespace tessera::bench
