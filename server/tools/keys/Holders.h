/// Hosts, people and the server, as people call them.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/tls/KeyFolder.h"

namespace tessera {

/// "server", "host", "person"
[[nodiscard]] std::string_view wordFor(Identity::Kind kind);
/// A person with another role is the same person.
[[nodiscard]] bool isSameHolder(const Identity& a, const Identity& b);
/// Names become those of files, and stand in lists. kUsage: it cannot be one.
[[nodiscard]] Expected<void> checkHolderName(const std::string& name);
/// The last key of each holder.
[[nodiscard]] std::vector<IssuedKey> newestOf(std::span<const IssuedKey> issued);
/// The last key of whom "server", "host/NAME", "person/NAME" or NAME alone means. kUsage: a host and a person are
/// called so. kNotFound: nobody is; names the nearest.
[[nodiscard]] Expected<IssuedKey> findHolder(std::span<const IssuedKey> issued, const std::string& name);

}  // namespace tessera
