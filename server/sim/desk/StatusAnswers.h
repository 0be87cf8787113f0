/// How the wall is, for who asks.
#pragma once

#include "server/sim/desk/DeskSurroundings.h"

namespace tessera {

/// All but how many applications are there.
[[nodiscard]] answer::Status statusOf(const DeskSurroundings& around);
[[nodiscard]] std::vector<answer::HostInfo> hostsOf(const ServerSession& session);
[[nodiscard]] answer::Trackers trackersOf(const DeskSurroundings& around);

}  // namespace tessera
