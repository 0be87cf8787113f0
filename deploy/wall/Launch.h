/// A whole wall, on this machine or started from it: what tessera-wall does.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "deploy/wall/Console.h"
#include "deploy/wall/Signals.h"
#include "deploy/wall/WallRun.h"

namespace tessera {

struct LaunchOptions {
    std::string wall = "2x2";
    std::vector<std::string> scenes;
    // Of the server: how each scene stands; empty: as its file says.
    std::string up, fit, pointRadius;
    std::vector<std::string> variants;
    std::vector<std::string> at;
    std::uint64_t frames = 120;    ///< 0: until it is stopped
    std::string size;              ///< empty: the wall's own
    int samples = 0;               ///< 0: the wall's own
    std::string budget;            ///< the server's --budget; empty: the wall's own
    std::string camera;            ///< empty: the scene's, else the default one
    std::string culler;            ///< empty: the clients' default
    std::string surface;           ///< of the clients; empty: their default
    std::string windowLog;         ///< folder of the windows' measurements; empty: none
    bool window = false;           ///< of the clients, on this machine's monitors
    int device = -1;               ///< of the clients' surface; below 0: their default
    int anisotropy = 0;            ///< of the clients; 0: their default
    int glMemoryMib = 0;           ///< of each client; 0: their default
    std::string share;             ///< of the clients; empty: their default
    std::string record;            ///< the server's recording; empty: none
    std::string journal;           ///< the server's; empty: none
    std::string uploads;           ///< where files lie that pages bring it; empty: as it has it
    std::uint64_t uploadsMib = 0;  ///< 0: as it has it
    std::string audit;             ///< where it writes who changes what; empty: nowhere
    unsigned threads = 0;          ///< of the server's collision pipeline; 0: its default
    std::string output = "out";
    std::vector<std::string> assets;
    bool keepFrames = false;
    bool outputs = false;  ///< outputs/TILE.png: what projectors get
    bool restart = false;
    bool start = false;        ///< hosts whose wall file names a machine are started there, by ssh
    bool startAnyway = false;  ///< without those whose machine lacks something
    std::string listen;        ///< of the server; empty: chosen
    std::string keys;          ///< folder of the wall's; empty: hosts elsewhere get some for this run
    bool insecure = false;     ///< nobody needs any
    std::string ssh = "ssh";
    bool testPicture = false;       ///< instead of the scene
    bool plain = false;             ///< of the server: no studio
    std::string exposure, toneMap;  ///< of the server
    bool noInput = false;           ///< of the server: nobody flies
    bool noNotices = false;         ///< and the wall says nothing of bad programs
    bool reload = false;            ///< and takes files in again that have changed
    bool allowUnconfined = false;
    std::size_t importMemoryMib = 0;  ///< of the server; 0: as it has it
    bool verbose = false;             ///< servers and clients say what goes as it should, too
    std::string executable;           ///< our own path: the other programs lie beside it
};

/// Runs the wall and leaves wall.png, wall-bezels.png (wall-right.png, wall-right-bezels.png for the right eye), tiles,
/// report.json and, with keepFrames and an ffmpeg, wall.mp4, with outputs a picture of each, in the output folder.
/// Returns the exit code: 0 when the frames were shown, faults or not; the server's where that failed. Says on the
/// console what went wrong.
[[nodiscard]] int launch(const LaunchOptions& options, Signals& signals, Console& console);

}  // namespace tessera
