/// Trackers before a whole wall: heads follow datagrams, wands point, strangers and garbage disturb nobody.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "common/application/Application.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/unit/tracking/TrackerBytes.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using test::append;
using test::bytesOf;

constexpr const char* kUpright = "[1 0 0 0 1 0 0 0 1]";

std::string bodyAt(int frame, double x, double y, double z) {
    return fmt::format("fr {}\r\n6d 1 [0 1.000][{:.3f} {:.3f} {:.3f} 0 0 0]{}\r\n", frame, 1000 * x, 1000 * y, 1000 * z,
                       kUpright);
}

/// The 1x1 wall with a tracker, a tracked head and a wand; its host draws nothing.
class TrackedWall : public testing::Test {
protected:
    static constexpr std::uint16_t kPort = 5000;

    void start(const std::string& tracker, WallOptions options = {}, const std::string& protocol = "dtrack") {
        const std::string speaks = protocol == "vrpn"
                                       ? fmt::format("vrpn {{ url: \"vrpn://127.0.0.1:{}/Tracker0\" }}", kPort)
                                       : fmt::format("{} {{ listen: \"127.0.0.1:{}\" }}", protocol, kPort);
        std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall");
        const std::string users = "eye_separation_m: 0.065 }";
        text.replace(text.find(users), users.size(), "eye_separation_m: 0.065 head { tracker: \"art\" sensor: 0 } }");
        text += fmt::format(
            "trackers {{ name: \"art\" {} {} }}\nwands {{ name: \"right\" mount {{ tracker: \"art\" flystick: 0 }} "
            "}}\n",
            speaks, tracker);
        std::ofstream(folder / "tracked.wall") << text;
        options.scene = kYard;
        options.wall = folder / "tracked.wall";
        options.draws = false;
        wall = std::make_unique<SimulatedWall>(std::move(options));
        auto connected = Application::connect(
            {.address = toString(wall->address()), .name = "watcher", .followScene = false}, wall->platform("watcher"));
        ASSERT_TRUE(connected.has_value()) << connected.error().message;
        application = std::move(*connected);
        ASSERT_TRUE(application->onPoses([this](const notice::Poses& told) { latest = told; }).has_value());
        ASSERT_TRUE(until([](const notice::Poses&) { return true; })) << wall->logs();
    }
    /// A datagram of the tracker; or of `from`, who is somebody else.
    void send(const std::string& text, const std::string& from = "127.0.0.1") {
        wall->world().feeds().send(kPort, text, from);
    }
    /// The wand's datagram, where it stands upright and looks ahead.
    void sendWand(const std::string& buttonsAndAxes) {
        send(fmt::format("fr 1\r\n6df2 1 1 [0 1.000 4 2][0.0 1500.0 0.0]{}[{}]\r\n", kUpright, buttonsAndAxes));
    }
    /// Lets frames go on until `done`, for 20 s of simulated time at most.
    template <typename Done>
    bool until(Done done) {
        const TimePoint end = wall->world().now() + 20s;
        while (wall->world().now() < end) {
            if (latest && done(*latest)) return true;
            if (!application->poll(20ms)) return false;
        }
        return false;
    }
    json ask(std::vector<std::string> words) {
        words.insert(words.begin(), "--json");
        const CommandOutcome outcome = wall->ctl(words);
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
        return json::parse(outcome.output, nullptr, false);
    }

    test::TestFolder folder;
    std::unique_ptr<SimulatedWall> wall;
    std::unique_ptr<Application> application;
    std::optional<notice::Poses> latest;
};

TEST_F(TrackedWall, AHeadFollowsItsTrackerAndGoesBackWhenItIsSilent) {
    start("filter { hold_ms: 400 ease_ms: 200 }");
    ASSERT_EQ(latest->heads.size(), 1u);
    EXPECT_FALSE(latest->heads[0].tracked);
    EXPECT_EQ(latest->heads[0].position, Vec3d(0, 1.7, 2.4));
    int frame = 0;
    const auto told = [&](double x) { send(bodyAt(++frame, x, 1.6, 2)); };
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        told(0.4);
        return poses.heads[0].tracked && (poses.heads[0].position - Vec3d(0.4, 1.6, 2)).norm() < 1e-3;
    })) << wall->logs();
    // By hand it stands where no tracker speaks: not now.
    EXPECT_EQ(wall->ctl({"view", "--head", "viewer", "-0.5", "1.5", "2.2"}).exitCode, 0);
    const std::uint64_t after = latest->frame.value + 5;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        told(0.4);
        return poses.frame.value > after;
    }));
    EXPECT_NEAR(latest->heads[0].position.x(), 0.4, 1e-3);
    // Silence: to where it was put by hand.
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        return !poses.heads[0].tracked && (poses.heads[0].position - Vec3d(-0.5, 1.5, 2.2)).norm() < 1e-9;
    })) << wall->logs();
    EXPECT_NE(wall->logs().find("goes back to where it stands"), std::string::npos) << wall->logs();
    application.reset();
    const json report = wall->finish();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

/// From a pose that comes while frame n is made or drawn: it is in frame n + 1, so it is shown with the next Swap but
/// one at the latest. Counted in frames.
TEST_F(TrackedWall, APoseIsShownWithinTheFramesInFlightAndOneMore) {
    start("", {.rateHz = 20});
    std::uint64_t worst = 0;
    for (std::uint64_t k = 1; k <= 100; ++k) {
        const std::uint64_t now = latest->frame.value;
        send(bodyAt(static_cast<int>(k), 0.001 * static_cast<double>(k), 1.7, 2));
        ASSERT_TRUE(until([&](const notice::Poses& poses) { return poses.heads[0].poses >= k; })) << wall->logs();
        worst = std::max(worst, latest->frame.value - now);
    }
    constexpr std::uint64_t kInFlight = 1;
    EXPECT_LE(worst, kInFlight + 1);
}

TEST_F(TrackedWall, AWandPointsPicksAndIsToldOf) {
    start("");
    EXPECT_EQ(wall->ctl({"pick", "--wand", "right"}).exitCode, 1);  // nobody has heard of it
    EXPECT_EQ(wall->ctl({"pick", "--wand", "left"}).exitCode, 3);
    const CommandOutcome usage = wall->ctl({"pick", "--wand", "right", "3", "4"});
    EXPECT_EQ(usage.exitCode, 2) << usage.output;
    // Straight down at the yard's floor, from where the wall stands.
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        send("fr 1\r\n6df2 1 1 [0 1.000 4 2][0.0 1500.0 0.0][1 0 0 0 0 -1 0 1 0][5 0.05 -0.02]\r\n");
        return poses.wands.size() == 1 && poses.wands[0].tracked;
    })) << wall->logs();
    const WandState& wand = latest->wands[0];
    EXPECT_EQ(wand.buttons, 5u);
    EXPECT_EQ(wand.axes, (std::vector<double>{0.05, -0.02}));
    EXPECT_LT((wand.orientation * -Vec3d::UnitZ() - -Vec3d::UnitY()).norm(), 1e-6);
    const json picked = ask({"pick", "--wand", "right"});
    ASSERT_TRUE(picked["hit"].get<bool>()) << picked.dump();
    EXPECT_EQ(picked["path"], "/floor/geometry") << picked.dump();
    const json told = ask({"trackers"});
    EXPECT_EQ(told["trackers"][0]["name"], "art");
    EXPECT_EQ(told["trackers"][0]["sensors"][1]["moves"], "wand right") << told.dump(2);
    const CommandOutcome status = wall->ctl({"status"});
    EXPECT_NE(status.output.find("tracker art: dtrack"), std::string::npos) << status.output;
    const CommandOutcome table = wall->ctl({"trackers"});
    EXPECT_NE(table.output.find("flystick 0"), std::string::npos) << table.output;
}

TEST_F(TrackedWall, AWandsStickFliesWhereItPoints) {
    start("");
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        sendWand("0 0 0");
        return poses.wands.size() == 1 && poses.wands[0].tracked;
    })) << wall->logs();
    const Vec3d before = latest->wands[0].worldPosition;
    const Quatd turned = latest->wands[0].worldOrientation;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        sendWand("0 0 1.0");
        return (poses.wands[0].worldPosition - before).dot(turned * -Vec3d::UnitZ()) > 0.5;
    })) << wall->logs();
    EXPECT_LT((latest->wands[0].position - Vec3d(0, 1.5, 0)).norm(), 0.01);  // in the wall it is where it was
    const Vec3d way = turned.inverse() * (latest->wands[0].worldPosition - before);
    EXPECT_LT(way.head<2>().norm(), 0.01 * way.norm()) << way.transpose();
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        sendWand("0 1.0 0");
        return (turned.inverse() * poses.wands[0].worldOrientation * -Vec3d::UnitZ()).x() > 0.2;  // to the right
    })) << wall->logs();
}

/// Straight down at an arrow that points to the right; the first button takes hold of it.
TEST_F(TrackedWall, AWandsFirstButtonDragsAHandle) {
    start("");
    ASSERT_EQ(
        wall->ctl({"view", "--position", "0", "50", "0", "--orientation", "1", "0", "0", "0", "--scale", "1"}).exitCode,
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
    ASSERT_TRUE(application->propose(list.take()));
    const auto wandAt = [&](double xMm, unsigned buttons) {
        send(
            fmt::format("fr 1\r\n6df2 1 1 [0 1.000 4 2][{} 1500.0 0.0][1 0 0 0 0 -1 0 1 0][{} 0 0]\r\n", xMm, buttons));
    };
    const auto field = [&](const char* node, const char* name) { return wall->ctl({"get", node, name}).output; };
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        wandAt(0, 0);
        return poses.wands.size() == 1 && poses.wands[0].tracked && std::abs(poses.wands[0].position.x()) < 1e-3;
    })) << wall->logs();
    EXPECT_EQ(field("/arrows", "held"), "0\n");
    ASSERT_TRUE(until([&](const notice::Poses&) {
        wandAt(0, 1);
        return field("/arrows", "held") != "0\n";
    })) << wall->logs();
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        wandAt(250, 1);
        return std::abs(poses.wands[0].position.x() - 0.25) < 1e-3;
    })) << wall->logs();
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
    start("");
    std::optional<Vec3d> from;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        sendWand("1 0 1.0");
        if (!poses.wands[0].tracked) return false;
        if (!from) from = poses.wands[0].worldPosition;
        return (poses.wands[0].worldPosition - *from).norm() > 0.5;
    })) << wall->logs();
    // It stays tracked for three seconds, and its stick does not.
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        return poses.wands[0].tracked && poses.wands[0].buttons == 0 &&
               poses.wands[0].axes == std::vector<double>{0, 0};
    })) << wall->logs();
    const std::uint64_t rest = latest->frame.value + 150;  // 2.5 s: e^(-2.5 / 0.15) of a speed is none
    ASSERT_TRUE(until([&](const notice::Poses& poses) { return poses.frame.value > rest; }));
    const Vec3d there = latest->wands[0].worldPosition;
    ASSERT_TRUE(until([&](const notice::Poses& poses) { return poses.frame.value > rest + 30; }));
    EXPECT_EQ(latest->wands[0].worldPosition, there);
}

TEST_F(TrackedWall, AThousandDatagramsAFrameOfAStrangerAndGarbageDisturbNobody) {
    start("allow_from: \"127.0.0.1\"");
    const std::uint64_t first = latest->frame.value;
    std::string garbage(600, '\xff');
    int k = 0;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        for (int i = 0; i < 1000; ++i) send(bodyAt(i, 5, 5, 5), "127.0.0.2");
        send(garbage);
        send("6d 99999999 [0 1.0]\n");
        send(bodyAt(++k, 0.25, 1.6, 2));
        return poses.frame.value > first + 60 && poses.heads[0].tracked;
    })) << wall->logs();
    EXPECT_NEAR(latest->heads[0].position.x(), 0.25, 1e-3);
    const json told = ask({"trackers"})["trackers"][0];
    EXPECT_GT(told["strangers"], 1000) << told.dump(2);
    EXPECT_GT(told["malformed"], 0) << told.dump(2);
    // Said once, however much came.
    const std::string said = wall->logs();
    EXPECT_NE(said.find("allow_from does not name"), std::string::npos) << said;
    EXPECT_EQ(said.find("allow_from does not name"), said.rfind("allow_from does not name")) << said;
    application.reset();
    const json report = wall->finish();
    ASSERT_FALSE(report.is_null()) << wall->logs();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
}

/// Words of trackers are no part of what makes the scene: the same recording makes the same frames without them.
TEST_F(TrackedWall, ItsRecordingReplaysWithoutTheTracker) {
    const std::string file = folder / "tracked.rec";
    start("", {.record = file, .frames = 120});
    int k = 0;
    ASSERT_TRUE(until([&](const notice::Poses& poses) {
        ++k;
        send(bodyAt(k, 0.3 * std::sin(0.05 * k), 1.7, 2));
        return poses.heads[0].poses > 20 && poses.frame.value > 60;
    })) << wall->logs();
    application.reset();
    ASSERT_FALSE(wall->finish().is_null()) << wall->logs();
    const CommandOutcome replayed = runHere([&] { return runReplay({file}); });
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
}

/// A vrpn_server, played: the first hangs before its cookie's end and is gone, the second tells of poses.
TEST_F(TrackedWall, AVrpnServerThatComesBackMovesAHead) {
    start("", {}, "vrpn");
    MemoryFeeds& feeds = wall->world().feeds();
    const auto begin = [&](const Bytes& greeting) {
        feeds.serve(kPort, true);
        return until([&](const notice::Poses&) { return !feeds.heard(kPort).empty(); }) && feeds.say(kPort, greeting);
    };
    ASSERT_TRUE(begin(bytesOf("vrpn: ver."))) << wall->logs();
    feeds.serve(kPort, false);
    Bytes greeting = test::vrpnCookie();
    append(greeting, test::vrpnName(4, -1, "Tracker0"));
    append(greeting, test::vrpnName(2, -2, "vrpn_Tracker Pos_Quat"));
    ASSERT_TRUE(begin(greeting)) << wall->logs();
    EXPECT_TRUE(until([&](const notice::Poses& poses) {
        EXPECT_TRUE(feeds.say(kPort, test::vrpnPose(4, 2, 0, {.position = {0.3, 1.5, 2.1}})));
        return poses.heads[0].tracked && (poses.heads[0].position - Vec3d(0.3, 1.5, 2.1)).norm() < 1e-3;
    })) << wall->logs();
    EXPECT_NE(wall->logs().find("it is dialled again until it is there"), std::string::npos) << wall->logs();
}

}  // namespace
}  // namespace tessera::simulation
