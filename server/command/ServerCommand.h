/// The command line of tessera-server.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/base/Log.h"
#include "server/sim/FrameLoop.h"

namespace tessera {

/// As they were said; what was not said has the value that stands here.
struct ServerArguments {
    std::string wall = "1x1";
    std::vector<std::string> scenes;
    std::vector<double> at;
    double fit = 0, pointRadius = 0;
    std::string up;
    Placing placing;
    std::string listen = "127.0.0.1:0";
    std::string console = "127.0.0.1:0";
    bool noConsole = false;
    std::string tokenFile, group, keys;
    std::vector<std::string> assets, allowed, panels;
    std::string uploads;
    std::uint64_t uploadsMib = 0;  ///< 0: as UploadLimits has it
    std::uint64_t frames = 0;
    double rate = -1;
    std::string size;
    int samples = 0;
    double budget = -1;
    std::string camera;
    std::string exposure, toneMap;
    std::string report;
    std::string record;
    std::string journal, audit;
    unsigned threads = 1;
    bool noInput = false, noNotices = false, reload = false;
    bool progress = false, quiet = false;
    bool testPicture = false, plain = false;
    bool allowUnconfined = false;
    std::size_t importMemoryMib = 0;
    bool insecure = false;
};

/// Reads main's arguments. Returns an exit code where there is nothing to serve: a fault or a help text has been
/// printed.
[[nodiscard]] std::optional<int> parseServerCommand(int argc, const char* const* argv, ServerArguments& arguments);

/// The options of a server's loop; not who comes in, nor by which ways. `executable`: beside which shipped files lie.
/// Errors: a wall or a scene that is not there or makes no sense, an address that is none.
[[nodiscard]] Expected<ServerOptions> serverOptionsOf(const ServerArguments& arguments, const std::string& executable,
                                                      Log& log);

}  // namespace tessera
