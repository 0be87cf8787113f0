/// A server and its render hosts as real processes on loopback.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/integration/Process.h"

namespace tessera::test {

/// A small scene of these tests, and models of a package of Debian (assimp-testmodels).
inline const std::string kYard = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";
inline constexpr const char* kModels = "/usr/share/assimp/models";
inline bool engineIsMissing() {
    return !std::filesystem::exists(std::string(kModels) + "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb");
}

/// The shipped 2x2 wall with another sync line.
[[nodiscard]] std::string wallWithSync(const TemporaryFolder& folder, const std::string& sync);

struct LiveWallOptions {
    std::string wall = {};  ///< empty: the 2x2 wall as it ships
    std::string scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";
    std::string size = "160x90";
    std::vector<std::string> server;  ///< more options of tessera-server
};

/// The words of tessera-server for such a wall; its report is written into the folder.
[[nodiscard]] std::vector<std::string> serverWords(const LiveWallOptions& options, const std::string& folder);
/// Null: there is none.
[[nodiscard]] nlohmann::json reportIn(const std::string& folder);
/// That lets programs in, as this user's find it.
[[nodiscard]] std::string tokenAt(const std::string& address);
/// Number of the frame that a tile shows, from its shared image in an output folder; -1 before the first.
[[nodiscard]] std::int64_t shownFrameIn(const std::string& output, const std::string& tile);

class LiveWall {
public:
    /// Starts the server and waits until it listens. `address` is empty when it did not.
    explicit LiveWall(const LiveWallOptions& options);

    [[nodiscard]] const std::string& address() const { return address_; }
    [[nodiscard]] Process& server() { return *server_; }
    [[nodiscard]] std::string token() const { return tokenAt(address_); }
    /// A file with it, for those who come in another way.
    [[nodiscard]] std::string tokenFile() const { return folder_.write("token", token() + "\n"); }
    /// Starts (or restarts) a render host.
    Process& startClient(const std::string& host, std::vector<std::string> more = {});
    [[nodiscard]] Process& client(const std::string& host) { return *clients_.at(host); }
    [[nodiscard]] std::int64_t shownFrame(const std::string& tile) const { return shownFrameIn(output(), tile); }
    /// Waits until that tile shows `frame` or a later one.
    [[nodiscard]] bool waitForFrame(const std::string& tile, std::int64_t frame,
                                    std::chrono::milliseconds timeout) const;
    /// tessera-ctl with this wall's address.
    [[nodiscard]] Outcome ctl(std::vector<std::string> words) const;
    /// Asks the server to stop, waits for everybody, returns the report. Exit codes are checked by the caller.
    [[nodiscard]] nlohmann::json finish();
    /// Waits for the server's own end (--frames) and returns the report.
    [[nodiscard]] nlohmann::json waitForEnd(std::chrono::milliseconds timeout);

    [[nodiscard]] const std::string& folder() const { return folder_.path(); }
    [[nodiscard]] std::string output() const { return folder_.path() + "/out"; }
    /// Everything all processes have said, for failure messages.
    [[nodiscard]] std::string logs() const;

private:
    TemporaryFolder folder_;
    std::string address_;
    std::unique_ptr<Process> server_;
    std::map<std::string, std::unique_ptr<Process>> clients_;
};

/// The four hosts of the shipped 2x2 wall.
inline const std::vector<std::string> kFourHosts = {"lower-left", "lower-right", "upper-left", "upper-right"};
/// The name of the tile of one of them.
[[nodiscard]] std::string tileOf(const std::string& host);

}  // namespace tessera::test
