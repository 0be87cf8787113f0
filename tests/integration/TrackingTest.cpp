/// The simulated tracker of tessera-ctl, against the wall that it is meant for. More of trackers: wall/walls.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

/// A port that nobody listened at just now.
std::uint16_t freePort() {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
    close(socket);
    return ntohs(address.sin_port);
}

TEST(TrackedWall, PlayTrackerMovesAHeadByEitherProtocol) {
    TemporaryFolder folder;
    std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall");
    const std::string users = "eye_separation_m: 0.065 }";
    text.replace(text.find(users), users.size(), "eye_separation_m: 0.065 head { tracker: \"art\" sensor: 0 } }");
    for (const std::string protocol : {"dtrack", "osc"}) {
        const std::string address = fmt::format("127.0.0.1:{}", freePort());
        LiveWall wall({.wall = folder.write("tracked.wall", fmt::format("{}trackers {{ name: \"art\" {} {{ listen: "
                                                                        "\"{}\" }} }}\n",
                                                                        text, protocol, address)),
                       .server = {"--rate", "60"}});
        ASSERT_FALSE(wall.address().empty()) << wall.server().output();
        wall.startClient("all", {"--surface", "none"});
        const auto watcher = Application::connect({.address = wall.address(), .name = "watcher", .followScene = false});
        ASSERT_TRUE(watcher.has_value()) << watcher.error().message;
        std::optional<HeadState> head;
        ASSERT_TRUE((*watcher)->onPoses([&](const notice::Poses& poses) { head = poses.heads.at(0); }).has_value());
        Process player(folder.path(), "player",
                       {program("tessera-ctl"), "play-tracker", address, "--seconds", "0", "--protocol", protocol});
        while (!(head && head->tracked && head->poses > 30))
            ASSERT_TRUE((*watcher)->poll(20ms)) << wall.logs() << player.output();
        EXPECT_NEAR((head->position - Vec3d(0, 1.7, 2)).norm(), 0.3, 0.02);
    }
}

}  // namespace
}  // namespace tessera::test
