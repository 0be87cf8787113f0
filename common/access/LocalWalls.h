/// Walls whose servers run on this machine: what a server leaves for the programs of its own user, and they read by
/// themselves.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/AccessToken.h"
#include "common/net/Transport.h"

namespace tessera {

/// A server that runs now.
struct LocalWall {
    std::string wall;                ///< its name
    Address server;                  ///< where hosts and applications dial in
    std::optional<Address> console;  ///< none: it has none
    AccessTokens tokens;
    std::string authority =
        {};  ///< SHA-256 of its authority's certificate, which https links carry; empty: it has none
};

/// `$XDG_RUNTIME_DIR/tessera`, else `/run/user/UID/tessera`, else `tessera-UID` in the folder for temporary files. Made
/// where it is missing, for this user alone. kRefused: it is somebody else's, or others may look into it;
/// kFailed: it cannot be made.
[[nodiscard]] Expected<std::string> runFolder();

/// Those of this user, in the order of their names; then those of the system's service (/run/tessera), where this user
/// may read them: a member of its group. What servers have left that no longer run does not count.
[[nodiscard]] Expected<std::vector<LocalWall>> localWalls();
/// The only one. kNotFound: none runs, kUsage: several do; the message says which, and how to name one.
[[nodiscard]] Expected<LocalWall> onlyLocalWall();

/// A server that is meant, and who has named it.
struct ServerMeant {
    Address address;
    std::string namedBy;  ///< "TESSERA_SERVER", a file's path; empty: whoever asks, or it is the only one here
};
/// The address that is said, else that of TESSERA_SERVER, else that in this user's file (`serverFile`), else the only
/// one of this user's on this machine. kUsage: a file that is there and names none is no reason to look further.
[[nodiscard]] Expected<ServerMeant> serverMeant(const std::string& said);
/// `$XDG_CONFIG_HOME/tessera/server`, else `~/.config/tessera/server`: a line ADDR:PORT, and lines that begin with #.
/// Empty: this user has no home.
[[nodiscard]] std::string serverFile();

/// The word in a file: its first line, or in what a server has left for its own user that of an operator. kUsage: it
/// cannot be read, or there is none in it.
[[nodiscard]] Expected<std::string> readToken(const std::string& file);
/// What lets a program of this user in at a server: the word in `tokenFile`, else that of TESSERA_TOKEN, else the one
/// in the file that TESSERA_TOKEN_FILE names, else that of the server of this user that listens at that very address.
/// Nothing: it goes without one. `peer`: the other end of a connection, as a number: at what a name stands for somebody
/// else may listen.
[[nodiscard]] Expected<std::string> accessTo(const Address& peer, const std::string& tokenFile = {});
/// The same of each connection that will be made ("ADDR:PORT"). What is wrong with a file is said now; later there is
/// then no word. None leaves this machine but where the connections are `sealed`: others could read it.
[[nodiscard]] Expected<std::function<std::string(const std::string& peer)>> accessLater(const std::string& tokenFile,
                                                                                        bool sealed);

/// Where this user's walls may be: `runFolder` first. A session has one that a task without a session (cron, ssh) has
/// not, so both are looked into, and where TMPDIR says that earlier versions were. An XDG_RUNTIME_DIR elsewhere names
/// the only folder.
[[nodiscard]] Expected<std::vector<std::string>> runFolders();
/// Ends the links and tokens that this user's walls without keys have handed out in these folders, those too that are
/// not running now (`WallProtection`), and the tokens that people chose for them. Returns the ones that run.
[[nodiscard]] Expected<std::vector<LocalWall>> endLocalLinks();
/// Forgets the tokens of this user's walls that are not running now: of those with keys of that authority; empty: of
/// those without keys. The mark ends them as well, where it is not lost.
[[nodiscard]] Expected<void> forgetStoppedWalls(const std::string& authority);

/// A server's wishes for its place among the walls of this machine.
struct LocalWallWish {
    std::string wall;
    std::string listen;           ///< as it was said
    std::string group = {};       ///< people who may read the file; empty: this user alone
    std::string protection = {};  ///< `WallProtection::text`
    std::string given = {};       ///< an operator's token that a person has chosen (--token-file); empty: none
};

/// A server's own place among them: a file of mode 0600, locked as long as it runs.
///
/// A server of the same wall that starts later takes the place that an earlier one has left. Under the same protection
/// it takes the tokens, too, so links hold. Where several run at once each has a place of its own.
class LocalWallPlace {
public:
    /// A place that one of the same wall has left who listened alike is taken over. kLimit: all places are taken.
    /// kNotFound: there is no such group; kRefused: this user is not in it, or its people cannot reach the file.
    [[nodiscard]] static Expected<std::unique_ptr<LocalWallPlace>> take(const LocalWallWish& wish);
    ~LocalWallPlace();
    LocalWallPlace(const LocalWallPlace&) = delete;
    LocalWallPlace& operator=(const LocalWallPlace&) = delete;

    [[nodiscard]] const AccessTokens& tokens() const { return tokens_; }
    /// Makes new tokens for another protection, and tells them. On an error they are new all the same.
    [[nodiscard]] Expected<void> renewFor(const std::string& protection);
    [[nodiscard]] const std::string& path() const { return path_; }
    /// Of the server before; 0: it had no console, or there was none.
    [[nodiscard]] std::uint16_t lastConsolePort() const { return lastPort_; }
    /// Its console speaks https, by the keys of that authority. Told with the rest.
    void setAuthority(const std::string& fingerprint) { authority_ = fingerprint; }
    /// From now on others find it.
    [[nodiscard]] Expected<void> tell(const Address& server, const std::optional<Address>& console);

private:
    LocalWallPlace() = default;
    void takeTokens(const std::map<std::string, std::string>& before, const LocalWallWish& wish);
    [[nodiscard]] Expected<void> write() const;

    std::string path_, wall_, mark_, listen_, authority_, protection_;
    AccessTokens tokens_;
    std::string chosen_;  ///< the operator's token, where a person chose it; empty: nobody did
    std::optional<Address> server_, console_;
    std::uint16_t lastPort_ = 0;
    int file_ = -1;
};

}  // namespace tessera
