/// Wall configurations as protobuf text files (proto/wall.proto) and as bytes for the wire.
#pragma once

#include <string_view>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Errors read `file:line:column: text`; an unknown key names the nearest known one. The result has passed checkWall.
[[nodiscard]] Expected<Wall> parseWall(std::string_view text, std::string_view fileName);
/// Reads a file, at most 1 MiB.
[[nodiscard]] Expected<Wall> loadWall(const std::string& path);

[[nodiscard]] Bytes encodeWall(const Wall& wall);
[[nodiscard]] Expected<Wall> decodeWall(ByteSpan bytes);

}  // namespace tessera
