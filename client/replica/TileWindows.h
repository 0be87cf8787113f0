/// Windows that show this host's tiles on its monitors: a tessera-window each, which looks into the tile's shown image.
///
/// They are processes of their own because what opens windows may load libGL, which must not meet OSMesa, and because a display
/// that goes away is to cost its window alone.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/base/Log.h"
#include "common/wall/Wall.h"

namespace tessera {

struct TileWindowsOptions {
    std::string program;     ///< tessera-window
    std::string output;      ///< folder of `tiles/`
    bool fullScreen = false;
    std::vector<std::string> monitors;  ///< of the first tile, the second …; fewer: plain windows, where the tile lies on its screen
    bool vsync = false;
    std::string logFolder;  ///< of measurements: TILE.log, a line per picture (client/window/TileWindow.h); empty: none
};

/// One thread, the process' main one: a window does not outlive it. What a window lacks, or that it was closed, goes to the log.
class TileWindows {
public:
    TileWindows(TileWindowsOptions options, Log& log);
    ~TileWindows();
    TileWindows(const TileWindows&) = delete;
    TileWindows& operator=(const TileWindows&) = delete;

    /// Opens those of these tiles that have none, closes those of others.
    void follow(const Wall& wall, const std::vector<Tile>& tiles);

private:
    /// One process, and a thread that waits for its end and says why it has none any more.
    class Window;

    TileWindowsOptions options_;
    Log& log_;
    std::vector<std::unique_ptr<Window>> windows_;
};

}  // namespace tessera
