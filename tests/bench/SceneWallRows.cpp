#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/SceneRows.h"
#include "tests/bench/WallReading.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

constexpr double kFramesPerSecond = 60;
constexpr double kShareOfCore = 5;  // percent, all processes together

/// Boxes in a block, half of the nodes Transforms and half of them Geometry; nothing moves.
std::string stillScene(std::uint64_t nodes) {
    // Rows of rows of rows: 10 nodes with 10 below, each of those with as many pairs as make up the number.
    const std::uint64_t row = std::max<std::uint64_t>(1, nodes / 200);
    return fmt::format(
        "node {{ name: \"sun\" transform {{ rotation {{ axis {{ x: 1 }} angle_deg: -50 }} }}\n"
        "  node {{ directional_light {{}} }} }}\n"
        "node {{ transform {{}} repeat {{ count: 10 step {{ y: 2 }} }}\n"
        "  node {{ transform {{}} repeat {{ count: 10 step {{ z: -2 }} }}\n"
        "    node {{ transform {{}} repeat {{ count: {} step {{ x: 2 }} }}\n"
        "      node {{ box {{ size {{ x: 1 y: 1 z: 1 }} }} }} }} }} }}\n",
        row);
}

void wallRow(SceneTable& table, std::uint64_t nodes, bool quick) {
    const test::TemporaryFolder folder;
    test::LiveWallOptions options;
    options.scene = folder.write("still.tsct", stillScene(nodes));
    options.size.clear();  // the wall's own: what is written, sent or copied for each frame counts
    options.server = {"--rate", "60"};
    test::LiveWall wall(options);
    if (wall.address().empty()) {
        table.complain("the server of an idle wall did not listen:\n" + wall.logs());
        return;
    }
    for (const std::string& host : test::kFourHosts) wall.startClient(host);
    for (const std::string& host : test::kFourHosts)
        if (!wall.waitForFrame(test::tileOf(host), 2, 120s)) {
            table.complain(fmt::format("{} of an idle wall shows nothing:\n{}", host, wall.logs()));
            return;
        }
    std::this_thread::sleep_for(quick ? 1s : 3s);
    const WallReading before = readWall(wall, test::kFourHosts, fourTiles());
    std::this_thread::sleep_for(quick ? 2s : 10s);
    const WallReading after = readWall(wall, test::kFourHosts, fourTiles());
    (void)wall.finish();

    const double seconds = std::chrono::duration<double>(after.at - before.at).count();
    const double frames = static_cast<double>(after.frame - before.frame);
    // Where fewer frames were shown than wanted: what the wanted ones would take, so that a busy machine flatters
    // nobody.
    const double wanted = frames > 0 ? std::max(1.0, kFramesPerSecond * seconds / frames) : 1;
    const double server = 100 * wanted * (after.server - before.server) / seconds;
    const double clients = 100 * wanted * (after.clients - before.clients) / seconds;
    const std::string what = fmt::format("{} nodes", nodes);
    table.add({.operation = what + ": time of a frame",
               .peer = "60 frames a second",
               .ours = {frames > 0 ? 1e3 * seconds / frames : 1e3 * seconds, 0, 1},
               .theirs = {1e3 / kFramesPerSecond, 0, 1},
               .unit = "ms",
               .atMost = 1.02,
               .remark = frames > 0 ? fmt::format("{:.1f} frames a second", frames / seconds) : "no frame at all"});
    table.add({.operation = what + ": processor time of all processes",
               .peer = "5 % of one core",
               .ours = {server + clients, 0, 1},
               .theirs = {kShareOfCore, 0, 1},
               .unit = "%",
               .atMost = 1,
               .remark = fmt::format("server {:.1f} %, four clients {:.1f} %{}", server, clients,
                                     wanted > 1.02 ? "; at 60 frames a second" : "")});
}

}  // namespace

void wallRows(SceneTable& table, const SceneOptions& options) {
    table.begin("an idle wall: server and four clients, 2x2 tiles of 960x540, --rate 60");
    for (const char* name : {"tessera-server", "tessera-client", "tessera-import"})
        if (!std::filesystem::exists(test::program(name))) {
            table.skip(fmt::format("{} is not built: the idle wall", name));
            return;
        }
    for (const std::uint64_t nodes : options.walls) wallRow(table, nodes, options.quick);
}

}  // namespace tessera::bench
