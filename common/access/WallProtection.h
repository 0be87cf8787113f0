/// How a wall is protected from strangers, and which links it has handed out since its tokens were revoked.
#pragma once

#include <optional>
#include <string>

#include "common/base/Error.h"

namespace tessera {

/// Tokens of a server serve under one protection alone: under another one it makes new ones.
struct WallProtection {
    std::string authority = {};  ///< SHA-256 of the certificate of its keys' authority; empty: it has no keys
    bool insecure = false;       ///< programs of other machines may do all
    std::string mark = {};       ///< `readLinksMark`; empty: nobody has revoked its links

    /// Returns one line; two protections are the same where their lines are.
    [[nodiscard]] std::string text() const;
    /// Returns whether tokens of the protection with this line serve under this one, too. A restart of the machine
    /// removes the mark of walls without keys, which ends no token.
    [[nodiscard]] bool continues(const std::string& before) const;
    /// Returns whether a line is that of a wall with keys; and of this authority.
    [[nodiscard]] static bool hasKeys(const std::string& text);
    [[nodiscard]] static bool isOf(const std::string& text, const std::string& authority);
};

/// Returns the mark in the file "links" of a folder of keys, or of a user's run folder; nothing: there is no such file.
/// kRefused: others may write it; kBadInput: it holds no mark; kFailed: it cannot be read.
[[nodiscard]] Expected<std::optional<std::string>> readLinksMark(const std::string& folder);

/// Writes another mark. Servers that look there make new tokens, whether they run now or start later.
[[nodiscard]] Expected<void> renewLinksMark(const std::string& folder);

}  // namespace tessera
