/// By which of this machine's addresses others reach it.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tessera {

/// The address from which a datagram to `name` would leave; nothing is sent. Nothing where the name is not known here
/// or no way leads there.
[[nodiscard]] std::optional<std::string> addressTowards(const std::string& name);

/// Where a server listens, and what each of those who dial it is told.
struct ServerAddresses {
    std::string listen;             ///< ADDR:PORT
    std::vector<std::string> dial;  ///< for each of `reachedBy`, without the port
};
/// `reachedBy`: for each machine the address of ours that it reaches. One address: the server listens on that alone;
/// several: on all of this machine's.
[[nodiscard]] ServerAddresses chooseAddresses(const std::vector<std::string>& reachedBy);

}  // namespace tessera
