/// Wall configurations as protobuf text files (proto/wall.proto) and as bytes for the wire; where shipped ones lie.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Files above this size are refused.
inline constexpr std::size_t kMaxWallBytes = std::size_t{1} << 20;
/// On the wire, with the meshes and blend pictures of its outputs.
inline constexpr std::size_t kMaxWallWireBytes = std::size_t{64} << 20;

/// Errors read `file:line:column: text`; an unknown key names the nearest known one. The result has passed checkWall. A
/// wall without a name gets that of its file, without folder and extension. Outputs that name files are refused.
[[nodiscard]] Expected<Wall> parseWall(std::string_view text, std::string_view fileName);
/// Reads a file, at most 1 MiB, and those that its outputs name: they lie in its folder or below. Blend pictures of a
/// screen that let through more than one projector's light are refused (`findBlendExcess`).
[[nodiscard]] Expected<Wall> loadWall(const std::string& path);

/// A wall file's text. The files that outputs name are to be written by the caller. kBadInput: a name, or another text
/// of the wall, is not UTF-8, and hosts could not be told it.
[[nodiscard]] Expected<std::string> wallText(const Wall& wall);

[[nodiscard]] Bytes encodeWall(const Wall& wall);
/// Never crashes whatever the bytes are; the result has passed checkWall.
[[nodiscard]] Expected<Wall> decodeWall(ByteSpan bytes);

/// A name without a slash is first looked for as NAME.wall in `folders`, then as a file here; anything else is a path.
/// kNotFound names the shipped walls.
[[nodiscard]] Expected<std::string> resolveWallPath(const std::string& nameOrPath,
                                                    std::span<const std::string> folders);
/// resolveWallPath in the folders of a program (`shippedFolders`).
[[nodiscard]] Expected<std::string> findWall(const std::string& nameOrPath, const std::string& executablePath);

}  // namespace tessera
