/// Words that let in somebody without a key, for some time. Kept as hashes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/tls/KeyFolder.h"
#include "server/tools/keys/KeyVerbs.h"

namespace tessera {

/// Takes the tokens of "NAME", "person/NAME" or "token/NAME" out of the folder, and says so; empty: there were none.
[[nodiscard]] Expected<std::string> revokeTokens(const KeyFolder& folder, const KeyFolder::Writer& writer,
                                                 const std::string& name);
/// Ends all tokens of the folder, and with them the links that its wall's servers have handed out. Where no folder of
/// keys is named: those of this user's walls without keys on this machine, too. Servers that run notice it.
[[nodiscard]] Expected<std::string> revokeLinks(const KeysArguments& arguments);
/// With those that have ended a day ago or longer left out.
[[nodiscard]] Expected<std::vector<KeptToken>> tokensIn(const KeyFolder& folder, DateTime now);

}  // namespace tessera
