/// The parts of the scene benchmark.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/SceneTable.h"

namespace tessera::bench {

struct SceneOptions {
    std::string program;                                  ///< this program, to be started as one of two sides
    std::uint64_t many = 1'000'000;                       ///< nodes of what is measured by the million
    std::string only;                                     ///< of the kinds of edits, those with this in their name
    std::vector<std::uint64_t> walls = {1'000, 100'000};  ///< nodes of the scenes that idle walls show
    bool quick = false;  ///< few repetitions: to see whether it runs, not to claim anything
};

/// Beside OpenSceneGraph: build, traverse, change, memory.
void treeRows(SceneTable& table, const SceneOptions& options);
/// Alone: snapshot, codec, hash, undo; bytes per object.
void aloneRows(SceneTable& table, const SceneOptions& options);
/// One changed object in a scene of 100,000 beside one of 1,000.
void editRows(SceneTable& table, const SceneOptions& options);
/// Frames without any change.
void idleRows(SceneTable& table, const SceneOptions& options);
/// A wall of processes without any change.
void wallRows(SceneTable& table, const SceneOptions& options);

}  // namespace tessera::bench
