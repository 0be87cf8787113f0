/// All frames as a video, by an ffmpeg that is installed.
#pragma once

#include <optional>
#include <string>

#include "common/base/Error.h"
#include "common/wall/PictureLayout.h"
#include "deploy/wall/Console.h"
#include "deploy/wall/Signals.h"
#include "deploy/wall/TileImages.h"

namespace tessera {

/// Writes an MP4 of 60 frames per second (frame n is at n / 60 s), from the first to the last frame that any tile has;
/// a tile without an image for a frame keeps its previous one. Written beside `path` and renamed. False when somebody
/// asked for the end meanwhile.
[[nodiscard]] Expected<bool> writeFilm(const std::string& ffmpeg, const std::string& path, const PictureLayout& layout,
                                       const TileImages& images, Signals& signals, Console& console);

}  // namespace tessera
