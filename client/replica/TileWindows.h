/// Windows that show this host's tiles on its monitors: a tessera-window each, which looks into the tile's shown image.
///
/// They are processes of their own because what opens windows may load libGL, which must not meet OSMesa, and because a display
/// that goes away is to cost its window alone.
#pragma once

#include <sys/types.h>

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
};

/// One thread: the process' main one. A window does not outlive it.
class TileWindows {
public:
    TileWindows(TileWindowsOptions options, Log& log);
    ~TileWindows();
    TileWindows(const TileWindows&) = delete;
    TileWindows& operator=(const TileWindows&) = delete;

    /// Opens those of these tiles that have none, closes those of others.
    void follow(const Wall& wall, const std::vector<Tile>& tiles);
    /// Says which were closed or could not be opened; a few hundred nanoseconds each.
    void look();

private:
    struct Window {
        std::string tile;
        std::vector<std::string> arguments;
        pid_t process = 0;  ///< 0: it has ended
    };
    [[nodiscard]] Expected<pid_t> start(const std::vector<std::string>& arguments) const;
    void end(Window& window);

    TileWindowsOptions options_;
    Log& log_;
    std::vector<Window> windows_;
};

}  // namespace tessera
