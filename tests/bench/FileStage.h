/// A scene file to draw, for the benchmarks of drawing.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/DrawingStage.h"

namespace tessera::bench {

/// The scene, seen from its first enabled camera, which turns about. Ends the process where it cannot be read.
[[nodiscard]] Stage fileStage(const std::string& name, const std::string& path, const std::vector<std::string>& assets,
                              int frames);

}  // namespace tessera::bench
