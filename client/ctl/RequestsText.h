/// All requests that applications may say, as their descriptions have it: `tessera-ctl requests`.
#pragma once

#include <string>

namespace tessera {

/// A request per line; for people.
[[nodiscard]] std::string requestsText();

}  // namespace tessera
