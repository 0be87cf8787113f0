/// The tokens of a server: made where it starts, made anew where the wall's protection changes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/access/ChosenTokens.h"
#include "common/access/LocalWalls.h"
#include "common/access/WallProtection.h"

namespace tessera {

/// The things that a server's tokens depend on.
struct ServerTokensOptions {
    std::string wall;
    std::string listen;                           ///< as it was said
    std::string group = {};                       ///< whose people may read the tokens; empty: this user alone
    std::string tokenFile = {};                   ///< with an operator's token that a person has chosen; empty: none
    bool insecure = false;                        ///< programs of other machines may do all
    std::string keysFolder = {};                  ///< empty: the wall has no keys
    std::function<std::string()> authority = {};  ///< fingerprint of the keys' authority now; empty: without keys
};

/// Owns the server's place among the walls of this machine (`LocalWallPlace`), and looks at what ends its tokens: keys
/// of another authority, and the mark of `tessera-keys revoke --links`. Not thread-safe.
class ServerTokens {
public:
    /// kUsage: the file holds no token, or one that has ended. kRefused, kLimit: programs of this user would not find
    /// the tokens, and nobody has chosen one; or nothing would keep that the chosen one ends. `warn` is told where a
    /// chosen one is found in its file alone.
    [[nodiscard]] static Expected<ServerTokens> make(ServerTokensOptions options,
                                                     const std::function<void(const std::string&)>& warn);

    [[nodiscard]] const AccessTokens& tokens() const { return tokens_; }
    /// Makes new tokens where the protection is another one than it was. Returns whether it is. An error: it cannot be
    /// told, so the tokens stay; or the new ones cannot be written.
    [[nodiscard]] Expected<bool> look();

    /// Tells this user's programs where the server and its console are.
    [[nodiscard]] Expected<void> tell(const Address& server, const std::optional<Address>& console);
    /// Returns that of the server before; 0: it had no console, or there was none.
    [[nodiscard]] std::uint16_t lastConsolePort() const { return place_ ? place_->lastConsolePort() : 0; }
    /// Returns the file with the tokens; empty: there is none.
    [[nodiscard]] std::string path() const { return place_ ? place_->path() : std::string(); }

private:
    explicit ServerTokens(ServerTokensOptions options)
        : options_(std::move(options)), server_{options_.wall, options_.listen}, chosen_(options_.keysFolder) {}
    [[nodiscard]] Expected<WallProtection> protectionNow() const;
    [[nodiscard]] Expected<bool> endChosen();

    ServerTokensOptions options_;
    NamedServer server_;
    ChosenTokens chosen_;
    bool mustEndChosen_ = false;  ///< a token that ended is not kept as such yet
    std::string marksFolder_;     ///< where the mark of revoked links lies; empty: nowhere
    WallProtection protection_;
    AccessTokens tokens_;
    std::unique_ptr<LocalWallPlace> place_;
};

}  // namespace tessera
