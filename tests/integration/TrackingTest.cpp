/// Trackers before a whole wall: heads follow datagrams, wands point, strangers and garbage disturb nobody.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <thread>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/integration/LiveWall.h"
#include "tests/unit/tracking/TrackerBytes.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

/// Sends datagrams from an address of loopback.
class TrackerSocket {
public:
    explicit TrackerSocket(const char* from = "127.0.0.1") : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        inet_pton(AF_INET, from, &address.sin_addr);
        EXPECT_EQ(bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        socklen_t size = sizeof address;
        getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
    }
    ~TrackerSocket() { close(fd_); }
    TrackerSocket(const TrackerSocket&) = delete;
    void send(std::uint16_t port, const std::string& text) const {
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(port);
        inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
        sendto(fd_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
    [[nodiscard]] std::uint16_t port() const { return port_; }

private:
    int fd_;
    std::uint16_t port_ = 0;
};

constexpr const char* kUpright = "[1 0 0 0 1 0 0 0 1]";

std::string bodyAt(int frame, double x, double y, double z) {
    return fmt::format("fr {}\r\n6d 1 [0 1.000][{:.3f} {:.3f} {:.3f} 0 0 0]{}\r\n", frame, 1000 * x, 1000 * y, 1000 * z,
                       kUpright);
}

/// The 1x1 wall with a tracker, a tracked head and a wand; its host draws nothing.
class TrackedWall : public testing::Test {
protected:
    void start(const std::string& tracker, std::vector<std::string> server, const std::string& protocol = "dtrack") {
        if (port_ == 0) port_ = TrackerSocket().port();
        const std::string speaks = protocol == "vrpn"
                                       ? fmt::format("vrpn {{ url: \"vrpn://127.0.0.1:{}/Tracker0\" }}", port_)
                                       : fmt::format("{} {{ listen: \"127.0.0.1:{}\" }}", protocol, port_);
        std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall");
        const std::string users = "eye_separation_m: 0.065 }";
        text.replace(text.find(users), users.size(), "eye_separation_m: 0.065 head { tracker: \"art\" sensor: 0 } }");
        text += fmt::format(
            "trackers {{ name: \"art\" {} {} }}\nwands {{ name: \"right\" mount {{ tracker: \"art\" flystick: 0 }} "
            "}}\n",
            speaks, tracker);
        wall_ = std::make_unique<LiveWall>(
            LiveWallOptions{.wall = folder_.write("tracked.wall", text), .server = std::move(server)});
        ASSERT_FALSE(wall_->address().empty()) << wall_->server().output();
        wall_->startClient("all", {"--surface", "none"});
        auto connected = Application::connect({.address = wall_->address(), .name = "watcher", .followScene = false});
        ASSERT_TRUE(connected.has_value()) << connected.error().message;
        application_ = std::move(*connected);
        ASSERT_TRUE(application_->onPoses([this](const notice::Poses& poses) { poses_ = poses; }).has_value());
    }
    /// Polls until `done`, at most so long.
    template <typename Done>
    bool until(Done done, std::chrono::milliseconds patience = 20s) {
        const auto deadline = std::chrono::steady_clock::now() + patience;
        while (std::chrono::steady_clock::now() < deadline) {
            if (poses_ && done(*poses_)) return true;
            if (!application_->poll(20ms)) return false;
        }
        return false;
    }
    json ask(std::vector<std::string> words) {
        words.insert(words.begin(), "--json");
        const Outcome outcome = wall_->ctl(words);
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
        return json::parse(outcome.output, nullptr, false);
    }

    TemporaryFolder folder_;
    std::uint16_t port_ = 0;
    std::unique_ptr<LiveWall> wall_;
    std::unique_ptr<Application> application_;
    std::optional<notice::Poses> poses_;
};

TEST_F(TrackedWall, AHeadFollowsItsTrackerAndGoesBackWhenItIsSilent) {
    start("filter { hold_ms: 400 ease_ms: 200 }", {"--rate", "60"});
    ASSERT_TRUE(until([](const notice::Poses& poses) { return poses.heads.size() == 1; }));
    EXPECT_FALSE(poses_->heads[0].tracked);
    EXPECT_EQ(poses_->heads[0].position, Vec3d(0, 1.7, 2.4));
    const TrackerSocket tracker;
    int frame = 0;
    const auto told = [&](double x) { tracker.send(port_, bodyAt(++frame, x, 1.6, 2)); };
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        told(0.4);
        return poses.heads[0].tracked && (poses.heads[0].position - Vec3d(0.4, 1.6, 2)).norm() < 1e-3;
    })) << wall_->logs();
    // By hand it stands where no tracker speaks: not now.
    EXPECT_EQ(wall_->ctl({"view", "--head", "viewer", "-0.5", "1.5", "2.2"}).exitCode, 0);
    const std::uint64_t after = poses_->frame.value + 5;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        told(0.4);
        return poses.frame.value > after;
    }));
    EXPECT_NEAR(poses_->heads[0].position.x(), 0.4, 1e-3);
    // Silence: to where it was put by hand.
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        return !poses.heads[0].tracked && (poses.heads[0].position - Vec3d(-0.5, 1.5, 2.2)).norm() < 1e-9;
    })) << wall_->logs();
    EXPECT_TRUE(wall_->server().waitForText("goes back to where it stands", 5s).has_value()) << wall_->logs();
    application_.reset();
    const json report = wall_->finish();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

/// From a pose that comes while frame n is made or drawn: it is in frame n + 1, so it is shown with the next Swap but
/// one at the latest. Counted in frames, slow enough that a busy machine does not lose one.
TEST_F(TrackedWall, APoseIsShownWithinTheFramesInFlightAndOneMore) {
    start("", {"--rate", "20"});
    const TrackerSocket tracker;
    ASSERT_TRUE(until([](const notice::Poses&) { return true; }));
    std::uint64_t worst = 0;
    for (std::uint64_t k = 1; k <= 100; ++k) {
        const std::uint64_t now = poses_->frame.value;
        tracker.send(port_, bodyAt(static_cast<int>(k), 0.001 * static_cast<double>(k), 1.7, 2));
        ASSERT_TRUE(until([&](const notice::Poses& poses) { return poses.heads[0].poses >= k; })) << wall_->logs();
        worst = std::max(worst, poses_->frame.value - now);
    }
    constexpr std::uint64_t kInFlight = 1;
    EXPECT_LE(worst, kInFlight + 1);
}

TEST_F(TrackedWall, AWandPointsPicksAndIsToldOf) {
    start("", {"--rate", "60"});
    EXPECT_EQ(wall_->ctl({"pick", "--wand", "right"}).exitCode, 1);  // nobody has heard of it
    EXPECT_EQ(wall_->ctl({"pick", "--wand", "left"}).exitCode, 3);
    const Outcome usage = wall_->ctl({"pick", "--wand", "right", "3", "4"});
    EXPECT_EQ(usage.exitCode, 2) << usage.output;
    // Straight down at the yard's floor, from where the wall stands.
    const TrackerSocket tracker;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        tracker.send(port_, "fr 1\r\n6df2 1 1 [0 1.000 4 2][0.0 1500.0 0.0][1 0 0 0 0 -1 0 1 0][5 0.05 -0.02]\r\n");
        return poses.wands.size() == 1 && poses.wands[0].tracked;
    })) << wall_->logs();
    const WandState& wand = poses_->wands[0];
    EXPECT_EQ(wand.buttons, 5u);
    EXPECT_EQ(wand.axes, (std::vector<double>{0.05, -0.02}));
    EXPECT_LT((wand.orientation * -Vec3d::UnitZ() - -Vec3d::UnitY()).norm(), 1e-6);
    const json picked = ask({"pick", "--wand", "right"});
    ASSERT_TRUE(picked["hit"].get<bool>()) << picked.dump();
    EXPECT_EQ(picked["path"], "/floor/geometry") << picked.dump();
    const json told = ask({"trackers"});
    EXPECT_EQ(told["trackers"][0]["name"], "art");
    EXPECT_EQ(told["trackers"][0]["sensors"][1]["moves"], "wand right") << told.dump(2);
    const Outcome status = wall_->ctl({"status"});
    EXPECT_NE(status.output.find("tracker art: dtrack"), std::string::npos) << status.output;
    const Outcome table = wall_->ctl({"trackers"});
    EXPECT_NE(table.output.find("flystick 0"), std::string::npos) << table.output;
}

TEST_F(TrackedWall, AWandsStickFliesWhereItPoints) {
    start("", {"--rate", "60"});
    const TrackerSocket tracker;
    const auto stick = [&](const char* axes) {
        tracker.send(port_,
                     fmt::format("fr 1\r\n6df2 1 1 [0 1.000 4 2][0.0 1500.0 0.0][1 0 0 0 1 0 0 0 1][0 {}]\r\n", axes));
    };
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        stick("0 0");
        return poses.wands.size() == 1 && poses.wands[0].tracked;
    })) << wall_->logs();
    const Vec3d before = poses_->wands[0].worldPosition;
    const Quatd turned = poses_->wands[0].worldOrientation;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        stick("0 1.0");
        return (poses.wands[0].worldPosition - before).dot(turned * -Vec3d::UnitZ()) > 0.5;
    })) << wall_->logs();
    EXPECT_LT((poses_->wands[0].position - Vec3d(0, 1.5, 0)).norm(), 0.01);  // in the wall it is where it was
    const Vec3d way = turned.inverse() * (poses_->wands[0].worldPosition - before);
    EXPECT_LT(way.head<2>().norm(), 0.01 * way.norm()) << way.transpose();
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        stick("1.0 0");
        return (turned.inverse() * poses.wands[0].worldOrientation * -Vec3d::UnitZ()).x() > 0.2;  // to the right
    })) << wall_->logs();
}

/// Straight down at an arrow that points to the right; the first button takes hold of it.
TEST_F(TrackedWall, AWandsFirstButtonDragsAHandle) {
    start("", {"--rate", "60"});
    ASSERT_EQ(wall_->ctl({"view", "--position", "0", "50", "0", "--orientation", "1", "0", "0", "0", "--scale", "1"})
                  .exitCode,
              0);
    ChangeListBuilder list;
    const ObjectId place{kFirstPlaceholder}, cart{kFirstPlaceholder + 1}, handles{kFirstPlaceholder + 2},
        bearer{kFirstPlaceholder + 3};
    list.create(place, typeOf<Transform>());
    list.create(cart, typeOf<Node>());
    list.create(handles, typeOf<Manipulator>());
    list.create(bearer, typeOf<Node>());
    setField<&Transform::translation>(list, place, Vec3d(-0.4, 50, 0));
    setField<&Node::core>(list, cart, place);
    setField<&Node::name>(list, cart, std::string("cart"));
    setField<&Manipulator::target>(list, handles, cart);
    setField<&Manipulator::size>(list, handles, 1.0);
    setField<&Node::core>(list, bearer, handles);
    setField<&Node::name>(list, bearer, std::string("arrows"));
    list.place(cart, kRootNode);
    list.place(bearer, kRootNode);
    ASSERT_TRUE(application_->propose(list.take()));
    const TrackerSocket tracker;
    const auto wandAt = [&](double xMm, unsigned buttons) {
        tracker.send(port_, fmt::format("fr 1\r\n6df2 1 1 [0 1.000 4 2][{} 1500.0 0.0][1 0 0 0 0 -1 0 1 0][{} 0 0]\r\n",
                                        xMm, buttons));
    };
    const auto field = [&](const char* node, const char* name) { return wall_->ctl({"get", node, name}).output; };
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        wandAt(0, 0);
        return poses.wands.size() == 1 && poses.wands[0].tracked && std::abs(poses.wands[0].position.x()) < 1e-3;
    })) << wall_->logs();
    EXPECT_EQ(field("/arrows", "held"), "0\n");
    ASSERT_TRUE(until([&](const notice::Poses&) {
        wandAt(0, 1);
        return field("/arrows", "held") != "0\n";
    })) << wall_->logs();
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        wandAt(250, 1);
        return std::abs(poses.wands[0].position.x() - 0.25) < 1e-3;
    })) << wall_->logs();
    double x = 0, y = 0, z = 1;
    EXPECT_TRUE(until([&](const notice::Poses&) {
        wandAt(250, 1);
        return std::sscanf(field("/cart", "translation").c_str(), "%lf %lf %lf", &x, &y, &z) == 3 &&
               std::abs(x - -0.15) < 0.01;
    })) << field("/cart", "translation");
    EXPECT_EQ(y, 50);
    EXPECT_EQ(z, 0);
    // A tracker that falls silent holds nothing.
    EXPECT_TRUE(until([&](const notice::Poses&) { return field("/arrows", "held") == "0\n"; }));
    EXPECT_EQ(ask({"status"})["undo_depth"], 2) << "what was made, and one drag";
}

TEST_F(TrackedWall, AStickWhoseTrackerFallsSilentIsLetGo) {
    start("", {"--rate", "60"});
    const TrackerSocket tracker;
    const auto stick = [&] {
        tracker.send(port_, "fr 1\r\n6df2 1 1 [0 1.000 4 2][0.0 1500.0 0.0][1 0 0 0 1 0 0 0 1][1 0 1.0]\r\n");
    };
    std::optional<Vec3d> from;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        stick();
        if (!poses.wands[0].tracked) return false;
        if (!from) from = poses.wands[0].worldPosition;
        return (poses.wands[0].worldPosition - *from).norm() > 0.5;
    })) << wall_->logs();
    // It stays tracked for three seconds, and its stick does not.
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        return poses.wands[0].tracked && poses.wands[0].buttons == 0 &&
               poses.wands[0].axes == std::vector<double>{0, 0};
    })) << wall_->logs();
    const std::uint64_t rest = poses_->frame.value + 150;  // 2.5 s: e^(-2.5 / 0.15) of a speed is none
    ASSERT_TRUE(until([&](const notice::Poses& poses) { return poses.frame.value > rest; }));
    const Vec3d there = poses_->wands[0].worldPosition;
    ASSERT_TRUE(until([&](const notice::Poses& poses) { return poses.frame.value > rest + 30; }));
    EXPECT_EQ(poses_->wands[0].worldPosition, there);
}

TEST_F(TrackedWall, AThousandDatagramsAFrameOfAStrangerAndGarbageDisturbNobody) {
    start("allow_from: \"127.0.0.1\"", {"--rate", "60"});
    const TrackerSocket tracker, stranger("127.0.0.2");
    ASSERT_TRUE(until([](const notice::Poses&) { return true; }));
    const std::uint64_t first = poses_->frame.value;
    std::string garbage(600, '\xff');
    int k = 0;
    ASSERT_TRUE(until(
        [&](const notice::Poses& poses) {
            for (int i = 0; i < 1000; ++i) stranger.send(port_, bodyAt(i, 5, 5, 5));
            tracker.send(port_, garbage);
            tracker.send(port_, "6d 99999999 [0 1.0]\n");
            tracker.send(port_, bodyAt(++k, 0.25, 1.6, 2));
            return poses.frame.value > first + 60 && poses.heads[0].tracked;
        },
        60s))
        << wall_->logs();
    EXPECT_NEAR(poses_->heads[0].position.x(), 0.25, 1e-3);
    const json told = ask({"trackers"})["trackers"][0];
    EXPECT_GT(told["strangers"], 1000) << told.dump(2);
    EXPECT_GT(told["malformed"], 0) << told.dump(2);
    // Said once, however much came.
    const std::string said = wall_->server().output();
    EXPECT_NE(said.find("allow_from does not name"), std::string::npos) << said;
    EXPECT_EQ(said.find("allow_from does not name"), said.rfind("allow_from does not name")) << said;
    application_.reset();
    const json report = wall_->finish();
    ASSERT_FALSE(report.is_null()) << wall_->logs();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

/// What trackers say is no part of what makes the scene: the same recording makes the same frames without them.
TEST_F(TrackedWall, ItsRecordingReplaysWithoutTheTracker) {
    const std::string file = folder_.path() + "/tracked.rec";
    start("", {"--rate", "60", "--frames", "120", "--record", file});
    const TrackerSocket tracker;
    int k = 0;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        ++k;
        tracker.send(port_, bodyAt(k, 0.3 * std::sin(0.05 * k), 1.7, 2));
        return poses.heads[0].poses > 20 && poses.frame.value > 60;
    })) << wall_->logs();
    application_.reset();
    ASSERT_FALSE(wall_->waitForEnd(30s).is_null()) << wall_->logs();
    const Outcome replayed = run(folder_.path(), {program("tessera-replay"), file}, 60s);
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
}

/// The simulated tracker of tessera-ctl, against the wall it is meant for.
TEST_F(TrackedWall, PlayTrackerMovesAHead) {
    start("", {"--rate", "60"});
    Process player(folder_.path(), "player",
                   {program("tessera-ctl"), "play-tracker", fmt::format("127.0.0.1:{}", port_), "--seconds", "0"});
    ASSERT_TRUE(until([](const notice::Poses& poses) { return poses.heads[0].tracked && poses.heads[0].poses > 30; }))
        << wall_->logs() << player.output();
    EXPECT_NEAR((poses_->heads[0].position - Vec3d(0, 1.7, 2)).norm(), 0.3, 0.02);
}

TEST_F(TrackedWall, OscMovesAHead) {
    start("", {"--rate", "60"}, "osc");
    Process player(folder_.path(), "player",
                   {program("tessera-ctl"), "play-tracker", fmt::format("127.0.0.1:{}", port_), "--seconds", "0",
                    "--protocol", "osc"});
    ASSERT_TRUE(until([](const notice::Poses& poses) { return poses.heads[0].tracked && poses.heads[0].poses > 30; }))
        << wall_->logs() << player.output();
    EXPECT_NEAR((poses_->heads[0].position - Vec3d(0, 1.7, 2)).norm(), 0.3, 0.02);
}

/// A vrpn_server, played: the first hangs before its cookie's end and is gone, the second tells of poses.
TEST_F(TrackedWall, AVrpnServerThatComesBackMovesAHead) {
    const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(listen(listener, 4), 0);
    socklen_t size = sizeof address;
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    start("", {"--rate", "60"}, "vrpn");
    const auto say = [](int connection, const Bytes& bytes) {
        return send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
    };
    const int first = accept(listener, nullptr, nullptr);
    EXPECT_TRUE(say(first, bytesOf("vrpn: ver.")));
    close(first);
    const int second = accept(listener, nullptr, nullptr);
    Bytes greeting = vrpnCookie();
    append(greeting, vrpnName(4, -1, "Tracker0"));
    append(greeting, vrpnName(2, -2, "vrpn_Tracker Pos_Quat"));
    EXPECT_TRUE(say(second, greeting));
    EXPECT_TRUE(until([&](const notice::Poses& poses) {
        EXPECT_TRUE(say(second, vrpnPose(4, 2, 0, {.position = {0.3, 1.5, 2.1}})));
        return poses.heads[0].tracked && (poses.heads[0].position - Vec3d(0.3, 1.5, 2.1)).norm() < 1e-3;
    })) << wall_->logs();
    close(second);
    close(listener);
    EXPECT_TRUE(wall_->server().waitForText("it is dialled again until it is there", 5s).has_value()) << wall_->logs();
}

}  // namespace
}  // namespace tessera::test
