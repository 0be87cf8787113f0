/// One server and one client per host, from the first process to the last.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "deploy/wall/Child.h"
#include "deploy/wall/Console.h"
#include "deploy/wall/Signals.h"

namespace tessera {

/// How a host's client is started that does not run here.
struct RemoteClient {
    std::string destination;  ///< for people: ssh's name of the machine
    /// `port`: the server's. The child's input is fed a sign of life.
    std::function<ChildCommand(const std::string& port)> command;
    bool lacking = false;  ///< it was found unable before: it is only tried with `restart`, as one that has died
};

struct WallRunOptions {
    std::string serverProgram, clientProgram;
    std::vector<std::string> serverArguments;  ///< complete
    std::vector<std::string> clientArguments;  ///< beside --server and --host
    std::vector<std::pair<std::string, std::string>> clientEnvironment;
    std::vector<std::string> hosts;
    std::map<std::string, RemoteClient> remote;  ///< by host; the others' clients are started here
    bool restart = false;
    std::uint64_t endAfterFrames = 0;  ///< the server is told to end then; 0: it ends by itself
    /// Run before a server that listens is told to end; with its address. Empty: nothing is.
    std::function<ChildCommand(const std::string& address)> beforeEnd = {};

    std::chrono::milliseconds startDeadline{
        300'000};  ///< from the server's start to its "listening on": it imports scenes first
    std::chrono::milliseconds finishDeadline{
        10'000};  ///< from the server's end to the clients'; and of a server told to end
    std::chrono::milliseconds leaveDeadline{2'000};  ///< from the server's end to the clients', where a person ended it
    std::chrono::milliseconds killAfter{2'000};      ///< from SIGTERM to SIGKILL
    std::chrono::milliseconds beforeEndDeadline{20'000};
    /// Doubled each time that the client dies again before it has run for `soundAfter`, up to the longest.
    std::chrono::milliseconds restartDelay{250}, longestRestartDelay{30'000}, soundAfter{60'000};
    int mostRestarts = 20;  ///< in a row, per host
    int mostLinesPerSecond =
        200;  ///< of a client elsewhere, that are passed on; a long one counts as those that it fills
    std::chrono::milliseconds leaveGrace{
        3'000};  ///< from a client's good end to the server's, after which it has left too early
};

struct WallRunResult {
    ChildEnd server;
    bool interrupted = false;             ///< somebody asked for the end
    bool deserted = false;                ///< every client had ended before the server
    int desertedCode = 0;                 ///< exit code of a client that gave up by itself; else 1
    std::map<std::string, int> restarts;  ///< by host
};

/// Lines of clients elsewhere begin with their host's name where the client has not said it, and a flood of them is
/// cut.
///
/// Starts the server, waits for its "listening on ADDR" line, starts the clients, passes on what everybody says, turns
/// "progress DONE TOTAL" lines into progress, restarts clients if wanted, ends what is left. Every wait has a deadline.
/// Fails only when something could not be started; how it went otherwise is in the result.
[[nodiscard]] Expected<WallRunResult> runWall(const WallRunOptions& options, Signals& signals, Console& console);

}  // namespace tessera
