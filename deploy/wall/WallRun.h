/// One server and one client per host, from the first process to the last.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "deploy/wall/Child.h"
#include "deploy/wall/Console.h"
#include "deploy/wall/Signals.h"

namespace tessera {

struct WallRunOptions {
    std::string serverProgram, clientProgram;
    std::vector<std::string> serverArguments;  ///< complete
    std::vector<std::string> clientArguments;  ///< beside --server and --host
    std::vector<std::pair<std::string, std::string>> clientEnvironment;
    std::vector<std::string> hosts;
    bool restart = false;

    std::chrono::milliseconds startDeadline{
        300'000};  ///< from the server's start to its "listening on": it imports scenes first
    std::chrono::milliseconds finishDeadline{
        10'000};                                 ///< from the server's end to the clients'; and of a server told to end
    std::chrono::milliseconds killAfter{2'000};  ///< from SIGTERM to SIGKILL
    std::chrono::milliseconds restartDelay{250};
    int mostRestarts = 20;  ///< per host
};

struct WallRunResult {
    ChildEnd server;
    bool interrupted = false;             ///< somebody asked for the end
    bool deserted = false;                ///< every client had ended before the server
    int desertedCode = 0;                 ///< exit code of a client that gave up by itself; else 1
    std::map<std::string, int> restarts;  ///< by host
};

/// Starts the server, waits for its "listening on ADDR" line, starts the clients, passes on what everybody says, turns
/// "progress DONE TOTAL" lines into progress, restarts clients if wanted, ends what is left. Every wait has a deadline.
/// Fails only when something could not be started; how it went otherwise is in the result.
[[nodiscard]] Expected<WallRunResult> runWall(const WallRunOptions& options, Signals& signals, Console& console);

}  // namespace tessera
