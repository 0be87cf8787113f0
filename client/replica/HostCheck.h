/// What this machine lacks for a client with these options: `tessera-client --check`, which `tessera-wall --start` asks
/// each machine before anything is started.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/replica/HostProgram.h"

namespace tessera {

/// Of `options` the surface, the device, and what windows need. Nothing is left open.
struct HostCheck {
    std::vector<std::string> facts;  ///< "WORD rest": cores, surface, pixels (a hash of the test picture), monitor
    std::vector<std::string> lacks;  ///< in words; empty: a client would start
};
[[nodiscard]] HostCheck checkHost(const HostOptions& options);
/// A display, and the monitors that the options name. A host without them would draw what nobody sees, and be taken for
/// a sound one.
[[nodiscard]] Expected<void> checkWindows(const TileWindowsOptions& windows);

}  // namespace tessera
