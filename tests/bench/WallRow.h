/// Whole walls of real processes: a frame beside the processor time that its tiles took, shared out over all cores.
#pragma once

#include <string>

#include "tests/bench/SceneTable.h"

namespace tessera::bench {

/// Runs tessera-wall (beside `program`) with the engine hall, parts of tiles shared and not, in turns, `rounds` times;
/// of each the round with the median ratio. The default wall of four hosts, and two hosts of which one has three tiles.
void wallRows(SceneTable& table, const std::string& program, int frames, int rounds);
/// The default wall beside that of another build, whose programs lie in the folder `before`: in turns, `rounds` times;
/// processor time of the hosts for a frame.
void wallBeforeRows(SceneTable& table, const std::string& program, const std::string& before, int frames, int rounds);

}  // namespace tessera::bench
