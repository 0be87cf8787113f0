/// A wall in this process, and a person before it: what tessera-ctl is told, what is seen.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/image/Picture.h"
#include "common/math/Types.h"
#include "tests/support/wall/SimulatedWall.h"

namespace tessera::simulation {

struct AskedWallOptions {
    std::string wall = "2x2";
    std::string scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/collisions.tsct";
    int widthPx = 320, heightPx = 180;
    std::vector<std::string> server = {};  ///< more words of tessera-server
    std::string journal = {}, record = {};
    bool starts = true;  ///< false: there is no host, and so no frame, until `start`
    std::uint64_t seed = 1;
};

/// One sample per pixel. A command that fails is a failure of the test.
class AskedWall : public SimulatedWall {
public:
    explicit AskedWall(const AskedWallOptions& options);
    /// Starts all hosts, and waits for a frame.
    void start();

    /// Runs a verb with --json and parses what it says.
    nlohmann::json ask(std::vector<std::string> words);
    /// Runs a verb of whose answer only matters that it was done.
    void tell(const std::vector<std::string>& words) { (void)ask(words); }
    /// Runs a verb that is refused. Returns its words.
    std::string refused(const std::vector<std::string>& words);

    struct Moved {
        bool stopped = false;
        Vec3d place = Vec3d::Zero();  ///< where the node is then
    };
    Moved move(const std::string& node, const std::vector<std::string>& words);
    [[nodiscard]] Vec3d placeOf(const std::string& node);
    [[nodiscard]] nlohmann::json contacts() { return ask({"contacts"})["contacts"]; }

    /// Until all tiles show this frame, or a later one. False: within a minute they did not.
    [[nodiscard]] bool waitForFrame(std::uint64_t frame);
    /// Until everything that the present contacts lead to is on the wall.
    void settle();
    /// Until the scene's hash has been the same for 40 frames: nothing moves, free bodies sleep. Returns the hash.
    [[nodiscard]] std::string waitForRest();
    /// As the wall is once it has settled.
    [[nodiscard]] Picture settledPicture();
    /// Ends it; the report, which has no faults.
    nlohmann::json finish();
};

/// A small scene of tests, and models of a package of Debian (assimp-testmodels).
inline const std::string kYard = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";
inline constexpr const char* kModels = "/usr/share/assimp/models";
inline bool engineIsMissing() {
    return !std::filesystem::exists(std::filesystem::path(kModels) /
                                    "glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb");
}

/// Runs what a program's main calls. Returns what it prints, and its exit code.
[[nodiscard]] CommandOutcome runHere(const std::function<int()>& program);
/// Empty where there is none.
[[nodiscard]] std::string readText(const std::string& path);

/// Pixels of equally large pictures whose colours differ.
[[nodiscard]] std::size_t pixelsThatDiffer(const Picture& a, const Picture& b);
/// Whether one of the two objects of a contact, event or distance is `a` or below it, and the other `b`.
[[nodiscard]] bool between(const nlohmann::json& entry, const std::string& a, const std::string& b);

}  // namespace tessera::simulation
