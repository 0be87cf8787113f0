/// A server that is killed, and started again with the same command: nothing that it has granted is lost, and everybody
/// comes back.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <future>
#include <map>
#include <thread>

#include "common/application/Application.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/integration/LiveWall.h"
#include "tests/property/Seeds.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/NumberedNode.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

const std::string kKeptYard = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";

/// A wall of one host that nobody waits for long.
std::string smallWall(const TemporaryFolder& folder) {
    const std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall");
    return folder.write("1x1.wall",
                        text.substr(0, text.find("sync {")) + "sync { lost_after_ms: 4000 start_deadline_ms: 1 }\n");
}

/// One command, as often as it is started. The address is the first server's.
class KeptWall {
public:
    explicit KeptWall(std::vector<std::string> options = {}) : more(std::move(options)), wall_(smallWall(folder)) {}

    [[nodiscard]] bool start() {
        launch();
        address = server->waitForText("listening on ", 20s).value_or("");
        return !address.empty();
    }
    /// Without waiting for what it says.
    void launch() {
        std::vector<std::string> command = {program("tessera-server"),
                                            "--wall",
                                            wall_,
                                            "--listen",
                                            address,
                                            "--size",
                                            "64x36",
                                            "--samples",
                                            "1",
                                            "--rate",
                                            rate,
                                            "--report",
                                            report(),
                                            "--journal",
                                            journal(),
                                            "--allow",
                                            folder.path()};
        if (!scene.empty()) command.insert(command.end(), {"--scene", scene});
        command.insert(command.end(), more.begin(), more.end());
        server = std::make_unique<Process>(folder.path(), "server" + std::to_string(++servers_), command);
    }
    void kill() {
        server->signal(SIGKILL);
        EXPECT_TRUE(server->waitForExit(10s));
    }
    [[nodiscard]] std::unique_ptr<Application> connect(const std::string& name) const {
        auto application = Application::connect({.address = address, .name = name});
        EXPECT_TRUE(application) << application.error().message << server->output();
        return application ? std::move(*application) : nullptr;
    }
    [[nodiscard]] std::string journal() const { return folder.path() + "/journal"; }
    [[nodiscard]] std::string report() const { return folder.path() + "/report.json"; }

    TemporaryFolder folder;
    std::string address = "127.0.0.1:0";
    std::string scene = kKeptYard, rate = "200";
    std::vector<std::string> more;
    std::unique_ptr<Process> server;

private:
    std::string wall_;
    int servers_ = 0;
};

/// What an application was told is done, while a server lived.
struct Granted {
    std::map<std::string, double> nodes;
    Sequence sequence;  ///< of the last
    /// The scene as it followed it, by list.
    std::map<std::uint64_t, StateHash> states;
};

TEST(Journal, NothingGrantedIsLostThoughTheServerIsKilledAtAnyMoment) {
    const char* only = std::getenv("TESSERA_SEED");
    Random random(only ? std::strtoull(only, nullptr, 10) : 20);
    KeptWall wall;
    Granted granted;
    int made = 0;
    Epoch epoch;
    FrameNumber frame;
    std::unique_ptr<Process> host;
    std::unique_ptr<Application> follower;  // of all servers
    std::map<std::uint64_t, StateHash> followed;
    int back = 0;
    for (int server = 0; server < 8; ++server) {
        // One that is killed while it starts changes nothing.
        if (below(random, 2) == 0) {
            wall.launch();
            aMoment(random, 60ms);
            wall.kill();
        }
        ASSERT_TRUE(wall.start()) << wall.server->output();
        if (!host)
            host = std::make_unique<Process>(
                wall.folder.path(), "host",
                std::vector<std::string>{program("tessera-client"), "--server", wall.address, "--host", "all",
                                         "--output", wall.folder.path() + "/out"});
        const std::unique_ptr<Application> mover = wall.connect("mover");
        ASSERT_TRUE(mover);
        // All is there, and the state is that of its list.
        for (const auto& [name, x] : granted.nodes) {
            const Expected<ObjectId> node = findNode(mover->scene(), "/" + name);
            ASSERT_TRUE(node) << name << " was granted and is lost: " << node.error().message << wall.server->output();
            EXPECT_EQ(mover->scene().coreOf<Transform>(*mover->scene().get<Node>(*node))->translation.x(), x);
        }
        EXPECT_GE(mover->sequence(), granted.sequence);
        if (const auto known = granted.states.find(mover->sequence().value); known != granted.states.end()) {
            EXPECT_EQ(mover->scene().stateHash(), known->second);
        }
        if (!follower) {
            follower = wall.connect("follower");
            ASSERT_TRUE(follower);
            follower->onBack([&] { ++back; });
            follower->onChanges([&](const ChangeList&, Sequence sequence) {
                followed[sequence.value] = follower->scene().stateHash();
            });
            followed[follower->sequence().value] = follower->scene().stateHash();
        }
        while (back < server || !followed.contains(mover->sequence().value)) {
            const bool behind = back < server || follower->sequence() < mover->sequence();
            const auto polled = (behind ? follower : mover)->poll(20s);
            ASSERT_TRUE(polled) << polled.error().message;
            ASSERT_TRUE(*polled) << "it does not come back" << wall.server->output();
        }
        EXPECT_EQ(followed[mover->sequence().value], mover->scene().stateHash());
        followed.clear();
        const auto status = mover->status();
        ASSERT_TRUE(status) << status.error().message;
        EXPECT_GT(status->epoch, epoch);
        EXPECT_GE(status->frame, frame);
        EXPECT_GE(status->undoDepth, std::min<std::size_t>(granted.nodes.size(), 256));
        epoch = status->epoch;
        if (server > 0) {
            EXPECT_TRUE(wall.server->waitForText("goes on with frame", 5s)) << wall.server->output();
        }
        granted.states.clear();
        mover->onChanges(
            [&](const ChangeList&, Sequence sequence) { granted.states[sequence.value] = mover->scene().stateHash(); });

        // It edits until the server dies: at any instant of the edit that follows a drawn number of them.
        std::promise<void> edited;
        std::thread killer([&, own = Random(random()), ready = edited.get_future()]() mutable {
            ready.wait();
            aMoment(own, 12ms);
            wall.server->signal(SIGKILL);
        });
        std::size_t editsLeft = 1 + below(random, 100);
        while (true) {
            const std::string name = "edit" + std::to_string(++made);
            const auto committed = mover->propose(newNode(name, made));
            if (!committed) break;
            granted.nodes[name] = made;
            granted.sequence = committed->sequence;
            if (editsLeft > 0 && --editsLeft == 0) edited.set_value();
        }
        if (editsLeft > 0) edited.set_value();
        killer.join();
        frame = status->frame;
        ASSERT_EQ(wall.server->waitForExit(10s), 128 + SIGKILL);
    }
    EXPECT_GT(granted.nodes.size(), 10u) << "or nothing was tried";

    // An undo of an edit before the kill; and the host has come back by itself.
    ASSERT_TRUE(wall.start());
    const std::unique_ptr<Application> last = wall.connect("last");
    ASSERT_TRUE(last);
    const auto before = last->status();
    ASSERT_TRUE(last->undo());
    const auto after = last->status();
    ASSERT_TRUE(before && after);
    EXPECT_LT(after->nodes, before->nodes);
    EXPECT_EQ(after->undoDepth + 1, before->undoDepth);
    const auto deadline = std::chrono::steady_clock::now() + 20s;
    bool shown = false;
    while (!shown && std::chrono::steady_clock::now() < deadline) {
        const auto now = last->waitForFrame(5s);
        ASSERT_TRUE(now) << now.error().message;
        shown = std::ranges::count(now->shown, "all") > 0;
    }
    EXPECT_TRUE(shown) << host->output();
    wall.server->signal(SIGTERM);
    EXPECT_EQ(wall.server->waitForExit(20s), 0) << wall.server->output();
    EXPECT_EQ(host->waitForExit(20s), 0) << host->output();
    const json report = json::parse(readText(wall.report()));
    EXPECT_EQ(report["journal"]["trouble"], "") << report["journal"].dump();
    EXPECT_GT(report["journal"]["bytes"], 0);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

}  // namespace
}  // namespace tessera::test
