/// Words that let in somebody without a key, for some time. Kept as hashes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/tls/KeyFolder.h"

namespace tessera {

/// Takes the tokens of "NAME", "person/NAME" or "token/NAME" out of the folder, and says so; empty: there were none.
[[nodiscard]] Expected<std::string> revokeTokens(const KeyFolder& folder, const KeyFolder::Writer& writer,
                                                 const std::string& name);
/// With those that have ended a day ago or longer left out.
[[nodiscard]] Expected<std::vector<KeptToken>> tokensIn(const KeyFolder& folder, DateTime now);

}  // namespace tessera
