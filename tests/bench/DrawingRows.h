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
/// The city under lights with shadows beside the same without: one thing of 12,000 moves, 200 do, a head before two
/// screens does.
void shadowRows(SceneTable& table, int frames);
/// From the scene to GL, by a GL that does nothing, while the camera alone moves: 12,096 items and four times as many;
/// uploads after a material of 10,000 users has changed.
void itemRows(SceneTable& table);
/// 100,000 arrows beside one Geometry of their triangles: what travels, memory, upload, a frame of four tiles.
void glyphRows(SceneTable& table, int frames);
/// A tile's finished picture to the slot where it will be shown, beside a copy of as many bytes.
void readBackRows(SceneTable& table);
/// The default wall of four hosts as it is drawn first on a machine: its worst frame beside its median one, of `rounds`
/// runs the one with the median ratio.
void firstMinuteRows(SceneTable& table, int rounds);

}  // namespace tessera::bench
