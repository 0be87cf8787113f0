/// The machine that a host's client is started on, where that is not the server's: what `tessera-wall --start` needs to
/// know.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tessera {

/// Nothing here is trusted to be harmless: each text is handed to ssh or quoted for the shell behind it.
struct Machine {
    std::string ssh;                         ///< as ssh takes it: [USER@]ADDRESS, or a name of its configuration
    int port = 0;                            ///< of sshd; 0: ssh's own choice
    std::string command = "tessera-client";  ///< a path there, or a name that its PATH finds
    std::string display;                     ///< DISPLAY of its windows, e.g. ":0"; empty: what that account has
    std::vector<std::pair<std::string, std::string>> environment;  ///< more variables
    std::vector<std::string> arguments;                            ///< more of the client's
    bool operator==(const Machine&) const = default;
};

/// What is wrong with it, in words that go on behind "the machine of host …"; nothing: all is well. Refused: what ssh
/// would take for an option, control characters, names of variables that no shell knows, options that the launcher
/// gives itself
/// (--server, --host, --while-input), and more than 64 arguments or variables, or 4096 bytes of one.
[[nodiscard]] std::optional<std::string> findMachineFault(const Machine& machine);

}  // namespace tessera
