/// A wall whose master and hosts are machines of their own: networks that this test made, an sshd on each, keys.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "tests/drill/Network.h"
#include "tests/integration/StartedWall.h"
#include "tests/integration/WireTap.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using drill::NetworkNamespace;
using drill::SwitchedNetwork;

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// What the scene says that no byte of TLS, ssh or a program's name does.
constexpr const char* kNamesInTheScene[] = {"carriage", "camera", "drive"};
constexpr char kBeginsTls = 0x16;  // a handshake's record

bool hasAnyName(const HeardStream& stream) {
    return std::ranges::any_of(kNamesInTheScene,
                               [&](const char* name) { return stream.bytes.find(name) != std::string::npos; });
}

/// The master, "west", "east", and a fourth machine that has no part in it.
class WallOfStartedMachines : public StartedWall {
protected:
    static constexpr std::size_t kElsewhere = 2;
    static constexpr auto kAtOnce = 5s;  // a second is promised, on a machine that is not busy

    void SetUp() override {
        if (const std::string why = SshServer::whyNot(); !why.empty()) GTEST_SKIP() << why;
        try {
            network_ = std::make_unique<SwitchedNetwork>(3);
        } catch (const drill::RowSkipped& why) {
            GTEST_SKIP() << why.what();
        }
        for (std::size_t host = 0; host < 2; ++host) {
            sshds_.push_back(std::make_unique<SshServer>(folder_.path(),
                                                         SshPlace{network_->hostAddress(host), &network_->host(host)}));
            ASSERT_TRUE(sshds_.back()->good()) << sshds_.back()->log();
        }
        wall_ = wallOf(machineAt(*sshds_[0], client()), machineAt(*sshds_[1], client()));
    }
    /// tessera-wall --start, on the master.
    [[nodiscard]] std::unique_ptr<Process> start(std::vector<std::string> more) {
        const NetworkNamespace::Inside inside(&network_->server());
        return std::make_unique<Process>(folder_.path(), "wall", command(*sshds_.back(), wall_, std::move(more)));
    }
    [[nodiscard]] Outcome onMaster(std::vector<std::string> words) const {
        const NetworkNamespace::Inside inside(&network_->server());
        return run(folder_.path(), std::move(words), 60s);
    }
    [[nodiscard]] Outcome elsewhere(std::vector<std::string> words) const {
        const NetworkNamespace::Inside inside(&network_->host(kElsewhere));
        return run(folder_.path(), std::move(words), 60s);
    }
    /// The same screen as one tile of one host on this machine, at that frame.
    [[nodiscard]] Picture ofOneHostHere(int frame) {
        const std::string wall = folder_.write("one.wall", R"(
screens { name: "front" lower_left { x: -1.6 y: 0.6 } lower_right { x: 1.6 y: 0.6 } upper_left { x: -1.6 y: 2.4 }
  grid { columns: 1 rows: 1 tile_width_px: 240 tile_height_px: 100 } }
users { name: "viewer" position { y: 1.7 z: 2.4 } }
hosts { name: "all" tiles { screen: "front" user: "viewer" } }
samples: 1
)");
        const Outcome here = run(folder_.path(),
                                 {program("tessera-wall"), "--wall", wall, "--scene", kYard, "--frames",
                                  std::to_string(frame + 1), "--output", folder_.path() + "/here"},
                                 120s);
        EXPECT_EQ(here.exitCode, 0) << here.output;
        return picture(folder_.path() + "/here/wall.png");
    }
    [[nodiscard]] std::string sshdLogs() const { return sshds_[0]->log() + sshds_[1]->log(); }

    std::unique_ptr<SwitchedNetwork> network_;
    std::vector<std::unique_ptr<SshServer>> sshds_;
    std::string wall_;
};

TEST_F(WallOfStartedMachines, ShowsWhatOneHostHereShowsAndNobodyOnTheWireReadsIt) {
    WireTap tap(network_->server());
    const auto wall = start({"--frames", "3"});
    EXPECT_EQ(wall->waitForExit(120s), 0) << wall->output() << sshdLogs();
    const std::string said = wall->output();
    EXPECT_HAS(said, "the server listens on " + network_->serverAddress());
    EXPECT_HAS(said, "0 faults");
    EXPECT_TRUE(allGone(0ms));
    const std::size_t at = said.find("240x100, frame ");
    ASSERT_NE(at, std::string::npos) << said;
    const Picture shown = picture(folder_.path() + "/out/wall.png");
    EXPECT_EQ(shown.widthPx, 240);
    EXPECT_TRUE(ofOneHostHere(std::stoi(said.substr(at + 15))) == shown);

    std::size_t sealed = 0;
    for (const HeardStream& stream : tap.end()) {
        const std::string who = stream.from + " to " + stream.to;
        const bool ssh = stream.bytes.starts_with("SSH-");
        EXPECT_TRUE(ssh || stream.bytes.front() == kBeginsTls) << who;
        sealed += stream.dialled && !ssh && stream.to.starts_with(network_->serverAddress() + ":") ? 1 : 0;
        EXPECT_FALSE(hasAnyName(stream)) << who;
        EXPECT_EQ(stream.bytes.find("PRIVATE KEY"), std::string::npos) << who;
    }
    EXPECT_GE(sealed, 2u) << "each host has a link";
}

/// So that the silence of the wire above says something.
TEST_F(WallOfStartedMachines, IsReadOnTheWireWhereNobodyWantsKeys) {
    WireTap tap(network_->server());
    const auto wall = start({"--frames", "3", "--insecure"});
    EXPECT_EQ(wall->waitForExit(120s), 0) << wall->output() << sshdLogs();
    const std::vector<HeardStream> heard = tap.end();
    EXPECT_GE(std::ranges::count_if(heard, hasAnyName), 2) << "each host is told the scene";
}

TEST_F(WallOfStartedMachines, LosesTheHostWhoseKeyIsRevokedAndGoesOn) {
    const std::string keys = folder_.path() + "/keys";
    const auto made = [&](std::vector<std::string> words) {
        words.insert(words.begin(), {program("tessera-keys"), "--keys", keys});
        const Outcome outcome = run(folder_.path(), words, 20s);
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
    };
    made({"init", "--wall", wall_});
    made({"host", "west"});
    made({"host", "east"});
    const auto wall = start({"--keys", keys});
    const auto listening = wall->waitForText("listening on ", 60s);
    ASSERT_TRUE(listening) << wall->output() << sshdLogs();
    const auto status = [&] {
        const Outcome outcome = onMaster({program("tessera-ctl"), "--server", *listening, "--json", "status"});
        return nlohmann::json::parse(outcome.output, nullptr, false);
    };
    /// Waits until that many hosts show frames, `frames` more than now.
    const auto showing = [&](std::size_t hosts, int frames) {
        const auto until = std::chrono::steady_clock::now() + 30s;
        std::optional<std::int64_t> from;
        while (std::chrono::steady_clock::now() < until) {
            const nlohmann::json now = status();
            if (now.is_discarded()) continue;
            const auto live =
                std::ranges::count_if(now["hosts"], [](const auto& host) { return host["state"] == "live"; });
            if (live != static_cast<std::ptrdiff_t>(hosts)) continue;
            const auto frame = now["frame"].get<std::int64_t>();
            if (!from) from = frame;
            if (frame >= *from + frames) return true;
        }
        return false;
    };
    ASSERT_TRUE(showing(2, 10)) << status().dump(1) << wall->output();

    const Outcome stranger =
        elsewhere({program("tessera-client"), "--server", *listening, "--host", "west", "--surface", "none"});
    EXPECT_EQ(stranger.exitCode, 4) << stranger.output;
    EXPECT_HAS(stranger.output, "tessera-keys host west");
    EXPECT_TRUE(showing(2, 10)) << "nobody minds: " << wall->output();

    const auto since = std::chrono::steady_clock::now();
    made({"revoke", "west"});
    ASSERT_TRUE(wall->waitForText("has been revoked", 20s)) << wall->output();
    const auto after = std::chrono::steady_clock::now() - since;
    EXPECT_LT(after, kAtOnce);
    RecordProperty("ms_until_closed", std::to_string(after / 1ms));
    EXPECT_TRUE(showing(1, 60)) << status().dump(1) << wall->output();
    EXPECT_HAS(wall->output(), "client of host west ended with exit code 4");
    wall->signal(SIGINT);
    EXPECT_EQ(wall->waitForExit(60s), 0) << wall->output();
    EXPECT_TRUE(allGone(0ms)) << wall->output();
}

}  // namespace
}  // namespace tessera::test
