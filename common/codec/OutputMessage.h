/// Outputs of proto/wall.proto as values and back. Inside of the codec only.
#pragma once

#include <functional>
#include <string>

#include "common/base/Error.h"
#include "common/wall/Output.h"
#include "proto/wall.pb.h"

namespace tessera {

/// What a file that a wall names holds, by its name in the wall; at most so many bytes.
using WallFiles = std::function<Expected<Bytes>(const std::string& name, std::size_t atMost)>;

/// Form only: `findOutputFault` looks at the result. Files that the message names and does not hold come from `files`;
/// without any, naming one is an error. `tileWidthPx`, `tileHeightPx`: of the tile; meshes are measured in the shape of
/// their output.
[[nodiscard]] Expected<TileOutput> outputOf(const proto::Wall::Output& message, int tileWidthPx, int tileHeightPx,
                                            const WallFiles& files);
void putOutput(const TileOutput& output, proto::Wall::Output& message);

}  // namespace tessera
