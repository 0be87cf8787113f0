/// tessera-keys: makes, renews and revokes the keys of a wall.
#pragma once

#include <string>
#include <vector>

namespace tessera {

/// The whole program, given the words behind its name; returns its exit code. Writes to stdout and stderr.
[[nodiscard]] int runKeys(const std::vector<std::string>& words);

}  // namespace tessera
