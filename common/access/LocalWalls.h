/// Walls whose servers run on this machine: what a server leaves for the programs of its own user, and they read by
/// themselves.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/net/Transport.h"

namespace tessera {

/// A server that runs now.
struct LocalWall {
    std::string wall;                ///< its name
    Address server;                  ///< where hosts and applications dial in
    std::optional<Address> console;  ///< none: it has none
    std::string token;               ///< that the console asks for
};

/// `$XDG_RUNTIME_DIR/tessera`, else `/run/user/UID/tessera`, else `tessera-UID` in the folder for temporary files. Made
/// where it is missing, for this user alone. kRefused: it is somebody else's, or others may look into it; kFailed: it
/// cannot be made.
[[nodiscard]] Expected<std::string> runFolder();

/// Those of this user, in the order of their names. What servers have left that no longer run does not count.
[[nodiscard]] Expected<std::vector<LocalWall>> localWalls();
/// The only one. kNotFound: none runs, kUsage: several do; the message says which, and how to name one.
[[nodiscard]] Expected<LocalWall> onlyLocalWall();

/// The server that is meant: the address that is said, else that of TESSERA_SERVER, else the only one of this user's on
/// this machine.
[[nodiscard]] Expected<Address> serverMeant(const std::string& said);

/// A server's own place among them: a file of mode 0600, locked as long as it runs.
///
/// A server of the same wall that starts later takes the place that an earlier one has left, with its token: whoever
/// has the link has it still. Where several run at once each has a place of its own.
class LocalWallPlace {
public:
    [[nodiscard]] static Expected<std::unique_ptr<LocalWallPlace>> take(const std::string& wall);
    ~LocalWallPlace();
    LocalWallPlace(const LocalWallPlace&) = delete;
    LocalWallPlace& operator=(const LocalWallPlace&) = delete;

    /// As the server before had it, or a fresh one: 256 bits that nobody guesses.
    [[nodiscard]] const std::string& token() const { return token_; }
    /// Of the server before; 0: it had no console, or there was none.
    [[nodiscard]] std::uint16_t lastConsolePort() const { return lastPort_; }
    /// From now on others find it.
    [[nodiscard]] Expected<void> tell(const Address& server, const std::optional<Address>& console) {
        return write(server, console);
    }

private:
    LocalWallPlace() = default;
    [[nodiscard]] Expected<void> write(const std::optional<Address>& server, const std::optional<Address>& console);

    std::string path_, wall_, token_;
    std::uint16_t lastPort_ = 0;
    int file_ = -1;
};

}  // namespace tessera
