/// Tokens that people chose for their servers: what each serves for, and which have ended.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/access/WallProtection.h"
#include "common/base/Error.h"
#include "common/tls/KeyFolder.h"

namespace tessera {

/// Returns `$XDG_STATE_HOME/tessera`, else `~/.local/state/tessera`. Empty: this user has no home.
[[nodiscard]] std::string stateFolder();

/// A server that people can name again: the name of its wall, and where it listens, as it was said.
struct NamedServer {
    std::string wall, listen;
};

/// The hashes of tokens that people chose (--token-file), in folders that outlive a restart of the machine.
///
/// A token serves under the protection that it was first used for, for all walls of this user. The file "chosen-tokens"
/// lies in the user's state folder, and among the wall's keys. A token has ended where either file says so. Only this
/// user may read them. Immutable: every call reads the files.
class ChosenTokens {
public:
    static constexpr std::size_t kMostLines = 10'000;  ///< of a file: more are refused, so none is forgotten

    /// `keysFolder`: empty where the wall has no keys.
    explicit ChosenTokens(const std::string& keysFolder);

    /// kUsage: the token has ended. Other codes: nobody can tell, or its use could not be kept.
    [[nodiscard]] Expected<void> use(const std::string& token, const NamedServer& server,
                                     const WallProtection& protection) const;
    /// Ends the tokens that this server used under another protection. Where none is kept nothing is written.
    [[nodiscard]] Expected<void> endOthers(const NamedServer& server, const WallProtection& protection) const;

    /// Ends all tokens in a folder of keys.
    [[nodiscard]] static Expected<void> endIn(const KeyFolder& keys, const KeyFolder::Writer& writer);
    /// Ends all that this user's walls without keys used.
    [[nodiscard]] static Expected<void> endWithoutKeys();

private:
    std::vector<KeyFolder> folders_;
    bool hasState_ = false;
};

}  // namespace tessera
