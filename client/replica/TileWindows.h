/// Windows that show this host's tiles on its monitors: a tessera-window for each output, which looks into its tiles'
/// shown images.
///
/// They are processes of their own because what opens windows may load libGL, which must not meet OSMesa, and because a
/// display that goes away is to cost its window alone.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/base/Hash.h"
#include "common/base/Log.h"
#include "common/input/InputState.h"
#include "common/wall/Wall.h"

namespace tessera {

struct TileWindowsOptions {
    std::string program;  ///< tessera-window
    std::string output;   ///< folder of `tiles/`
    bool fullScreen = false;
    std::vector<std::string>
        monitors;  ///< of the first output, the second …; fewer: the wall's, else where the tile lies on its screen
    bool vsync = false;
    std::string logFolder;  ///< of measurements: TILE.log, a line per picture (client/window/TileWindow.h); empty: none
};

/// One thread, the process' main one: a window does not outlive it. What a window lacks, or that it was closed, goes to
/// the log.
///
/// What somebody does at a window comes through a socket that its process is born with, by a thread of its own. One
/// that says what is no state, or more than kMaxStatesPerSecond, is heard no longer; whatever it held is released then,
/// and when it ends.
class TileWindows {
public:
    static constexpr std::size_t kMaxStatesPerSecond = 2000;
    /// Of the window of a tile of this number, among those that `follow` was told of. Called on threads of the windows.
    using OnInput = std::function<void(const InputState&)>;

    /// `onInput` may be empty: windows are shown and not listened to.
    TileWindows(TileWindowsOptions options, Log& log, OnInput onInput = {});
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
    OnInput onInput_;
    Hash128 saidOf_;  ///< the wall whose monitors were looked at last
    std::vector<std::unique_ptr<Window>> windows_;
};

}  // namespace tessera
