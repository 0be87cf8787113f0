/// A wall of real processes, and a person before it: what tessera-ctl is told, what is seen.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/image/Picture.h"
#include "common/math/Types.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {

struct AskedWallOptions {
    std::string wall = "2x2";  ///< a shipped wall: 1x1 or 2x2
    std::string scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/collisions.tsct";
    std::string size = "320x180";
    std::vector<std::string> server;  ///< more options of tessera-server
};

/// Its patience is one that a loaded machine does not try. What goes wrong is a failure of the test.
class AskedWall {
public:
    /// The server alone: no frame is made before there is a host.
    explicit AskedWall(const AskedWallOptions& options);

    /// Starts all hosts. False where no frame comes.
    [[nodiscard]] bool start();
    [[nodiscard]] LiveWall& wall() { return wall_; }
    [[nodiscard]] std::string folder() const { return wall_.folder(); }
    [[nodiscard]] std::string logs() const { return wall_.logs(); }

    /// Runs a verb with --json and parses what it says.
    [[nodiscard]] nlohmann::json ask(std::vector<std::string> words) const;
    /// Runs a verb of whose answer only matters that it was done.
    void tell(const std::vector<std::string>& words) const { (void)ask(words); }

    struct Moved {
        bool stopped = false;
        Vec3d place = Vec3d::Zero();  ///< where the node is then
    };
    [[nodiscard]] Moved move(const std::string& node, const std::vector<std::string>& words) const;
    [[nodiscard]] Vec3d placeOf(const std::string& node) const;
    [[nodiscard]] nlohmann::json contacts() const { return ask({"contacts"})["contacts"]; }

    /// Until everything that the present contacts lead to is on the wall.
    void settle() const;
    /// Until the scene's hash has been the same for 40 frames: nothing moves, free bodies sleep. Returns the hash.
    [[nodiscard]] std::string waitForRest() const;
    /// As the wall is once it has settled.
    [[nodiscard]] Picture picture(const std::string& name) const;
    /// Ends it; the report, which has no faults.
    [[nodiscard]] nlohmann::json finish();

private:
    std::vector<std::string> hosts_;
    LiveWall wall_;
};

/// Pixels of equally large pictures whose colours differ.
[[nodiscard]] std::size_t pixelsThatDiffer(const Picture& a, const Picture& b);
/// Whether one of the two objects of a contact, event or distance is `a` or below it, and the other `b`.
[[nodiscard]] bool between(const nlohmann::json& entry, const std::string& a, const std::string& b);

}  // namespace tessera::test
