/// Rows of the drawing benchmark that stand in files of their own.
#pragma once

#include <string>

#include "tests/bench/SceneTable.h"

namespace tessera::bench {

/// The scanned mesh on a wall of 2×2 tiles of 400×400, one sample, camera moving: beside ParaView's tile display and
/// beside plain OpenGL that draws the same pixels once. `scan`: a .ply; `programs`: the folder of the benchmark's own.
void bunnyWallRows(SceneTable& table, const std::string& scan, const std::string& programs);
/// Four tiles drawn by one process beside four processes.
void oneProcessRows(SceneTable& table);
/// A million points beside octahedra as triangles, an eighth as round: memory, upload, a frame; fewer that are larger,
/// a frame.
void pointRows(SceneTable& table, int frames);
/// A tile's finished picture to the slot where it will be shown, beside a copy of as many bytes.
void readBackRows(SceneTable& table);

}  // namespace tessera::bench
