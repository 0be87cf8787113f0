/// Who listens on a port of this machine.
#pragma once

#include <cstdint>
#include <string>

namespace tessera {

/// "tessera-server (pid 123)"; "a process of user 1000" where the system does not say which; empty where nobody is
/// found. Looks through /proc: for messages, not for decisions.
[[nodiscard]] std::string holderOfPort(std::uint16_t port);

}  // namespace tessera
