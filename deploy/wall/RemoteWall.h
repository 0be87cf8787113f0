/// The hosts of a wall that run on machines of their own: from the wall file to how they are started.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/wall/Wall.h"
#include "deploy/wall/Console.h"
#include "deploy/wall/Signals.h"
#include "deploy/wall/WallKeys.h"
#include "deploy/wall/WallRun.h"

namespace tessera {

struct RemoteOptions {
    std::string ssh = "ssh";          ///< a path, or a name in PATH
    std::string listen;               ///< ADDR:PORT as a person said; empty: chosen here
    std::vector<std::string> client;  ///< arguments of every client; what a machine's own say counts more
    bool startAnyway = false;
    const WallKeys* keys = nullptr;  ///< whose hosts are brought theirs; null: none
};

struct RemoteWall {
    std::map<std::string, RemoteClient> clients;  ///< by host
    std::string listen;                           ///< for the server
};

/// Asks each machine that the wall names what it lacks, and says on the console what that is. Nothing where somebody
/// asked for the end meanwhile. Fails where a machine lacks something and `startAnyway` is not set, where nothing is
/// left, and where nobody knows by which address a machine reaches the server.
[[nodiscard]] Expected<std::optional<RemoteWall>> prepareMachines(const Wall& wall, const RemoteOptions& options,
                                                                  Signals& signals, Console& console);

/// `own`, and behind it those of `all` whose option is not among them. An option begins with "--"; what follows up to
/// the next one belongs to it.
[[nodiscard]] std::vector<std::string> mergedArguments(const std::vector<std::string>& own,
                                                       const std::vector<std::string>& all);

/// What a machine is asked about: a client's `arguments`, and behind the monitors of their --window those that the wall
/// names for further outputs of the host, which the client itself takes from the wall. Without --window nothing is
/// added. At most 64 monitors are asked about, and none whose name begins with '-'.
[[nodiscard]] std::vector<std::string> withMonitorsOf(const Wall& wall, const std::string& host,
                                                      std::vector<std::string> arguments);

}  // namespace tessera
