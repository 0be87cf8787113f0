/// A server that is killed, and started again with the same command: nothing that it has granted is lost, and everybody
/// comes back.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <map>
#include <thread>

#include "common/application/Application.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Inline.h"
#include "common/cores/Movie.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/integration/LiveWall.h"
#include "tests/property/Seeds.h"

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

/// A node of this name at this place; every third has an array of its own.
ChangeList newNode(const std::string& name, double x) {
    ChangeListBuilder list;
    const ObjectId node{kFirstPlaceholder}, place{kFirstPlaceholder + 1}, shape{kFirstPlaceholder + 2};
    list.create(node, typeOf<Node>());
    list.create(place, typeOf<Transform>());
    list.set(place, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(x, 0, 0)));
    list.set(node, typeOf<Node>(), fieldId<&Node::name>, name);
    list.set(node, typeOf<Node>(), fieldId<&Node::core>, place);
    list.place(node, kRootNode);
    if (static_cast<int>(x) % 3 == 0) {
        const ObjectId below{kFirstPlaceholder + 3};
        const std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, static_cast<float>(x + 1), 0};
        const std::vector<std::uint32_t> indices{0, 1, 2};
        list.create(shape, typeOf<Geometry>());
        list.set(shape, typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob::of(std::span<const float>(corners)));
        list.set(shape, typeOf<Geometry>(), fieldId<&Geometry::indices>,
                 Blob::of(std::span<const std::uint32_t>(indices)));
        list.create(below, typeOf<Node>());
        list.set(below, typeOf<Node>(), fieldId<&Node::core>, shape);
        list.place(below, node);
    }
    return list.take();
}

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
            std::this_thread::sleep_for(std::chrono::milliseconds(below(random, 60)));
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

        // It edits until the server dies.
        std::thread killer([&, after = std::chrono::milliseconds(20 + below(random, 500))] {
            std::this_thread::sleep_for(after);
            wall.server->signal(SIGKILL);
        });
        while (true) {
            const std::string name = "edit" + std::to_string(++made);
            const auto committed = mover->propose(newNode(name, made));
            if (!committed) break;
            granted.nodes[name] = made;
            granted.sequence = committed->sequence;
        }
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

TEST(Journal, TheViewThatWasSetComesBack) {
    KeptWall wall;
    ASSERT_TRUE(wall.start());
    auto view = [&](std::vector<std::string> words) {
        std::vector<std::string> command = {program("tessera-ctl"), "--server", wall.address, "view"};
        command.insert(command.end(), words.begin(), words.end());
        return run(wall.folder.path(), command, 30s);
    };
    ASSERT_EQ(view({"--position", "1", "2", "3"}).exitCode, 0) << view({"--position", "1", "2", "3"}).output;
    const auto hit = [&] {
        const auto asker = wall.connect("asker");
        return asker->pick(32, 18);
    };
    const auto before = hit();
    wall.kill();
    ASSERT_TRUE(wall.start());
    const auto after = hit();
    ASSERT_TRUE(before && after);
    EXPECT_EQ(after->hit, before->hit);
    EXPECT_EQ(after->node, before->node);
    EXPECT_EQ(after->point, before->point);
}

TEST(Journal, AFullDiskRefusesEditsAndTheWallGoesOn) {
    KeptWall wall;
    ASSERT_TRUE(wall.start());
    wall.kill();
    // All files of this server end at 64 KiB. (A shell counts in blocks of 512 or 1024 bytes.)
    const std::string command = "ulimit -f 64; exec " + program("tessera-server") + " --wall " +
                                smallWall(wall.folder) + " --listen 127.0.0.1:0 --rate 200 " + "--journal " +
                                wall.journal();
    Process little(wall.folder.path(), "little", {"/bin/sh", "-c", command});
    wall.address = little.waitForText("listening on ", 20s).value_or("");
    ASSERT_FALSE(wall.address.empty()) << little.output();
    wall.server = std::make_unique<Process>(std::move(little));
    const auto mover = wall.connect("mover");
    ASSERT_TRUE(mover);
    Expected<answer::Committed> committed = answer::Committed{};
    int made = 0;
    for (; committed && made < 5'000; ++made) committed = mover->propose(newNode("edit" + std::to_string(made), made));
    ASSERT_FALSE(committed) << made;
    EXPECT_NE(committed.error().message.find("cannot be written: File too large"), std::string::npos)
        << committed.error().message;
    const auto refused = mover->propose(newNode("late", 1));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message.find("it is done"), std::string::npos)
        << "it is not: " << refused.error().message;
    const auto loaded = mover->load(kKeptYard);
    ASSERT_FALSE(loaded);
    EXPECT_NE(loaded.error().message.find("cannot be written"), std::string::npos) << loaded.error().message;
    const auto removed = mover->removeNode(findNode(mover->scene(), "/edit1").value());
    ASSERT_FALSE(removed);
    EXPECT_NE(removed.error().message.find("cannot be written"), std::string::npos) << removed.error().message;
    EXPECT_TRUE(findNode(mover->scene(), "/edit1"));
    EXPECT_TRUE(mover->waitForFrame(10s)) << "nobody is stopped by it";
    EXPECT_TRUE(wall.server->waitForText("edits are refused until it can", 1s)) << wall.server->output();
    EXPECT_FALSE(findNode(mover->scene(), "/late"));
}

/// Lists are sent before they are written: the disk is full, so that others see one that is never written, and the
/// server is killed.
TEST(Journal, WhatOthersHaveSeenNeverStandsForSomethingElseThoughItWasNotWritten) {
    KeptWall wall;
    std::map<ObjectId, std::string> seen;  // of nodes
    Sequence last;
    const auto follow = [&](Application& application) {
        application.onChanges([&](const ChangeList& list, Sequence sequence) {
            last = std::max(last, sequence);
            for (const Creation& creation : list.creations)
                if (const Node* node = application.scene().get<Node>(creation.id); node && !node->name.empty())
                    seen[creation.id] = node->name;
        });
    };
    const std::string command = "ulimit -f 64; exec " + program("tessera-server") + " --wall " +
                                smallWall(wall.folder) + " --scene " + wall.scene +
                                " --listen 127.0.0.1:0 --rate 200 --journal " + wall.journal();
    for (int server = 0; server < 3; ++server) {
        wall.server = std::make_unique<Process>(wall.folder.path(), "little" + std::to_string(server),
                                                std::vector<std::string>{"/bin/sh", "-c", command});
        wall.address = wall.server->waitForText("listening on ", 20s).value_or("");
        ASSERT_FALSE(wall.address.empty()) << wall.server->output();
        const auto mover = wall.connect("mover");
        ASSERT_TRUE(mover);
        for (const auto& [id, name] : seen)
            if (const Node* node = mover->scene().get<Node>(id)) {
                EXPECT_EQ(node->name, name) << "#" << id.value;
            }
        const std::map<ObjectId, std::string> before = seen;
        const Sequence lastBefore = last;
        follow(*mover);
        Expected<answer::Committed> committed = answer::Committed{};
        for (int made = 0; committed && made < 5'000; ++made) {
            const std::string name = "s" + std::to_string(server) + "n" + std::to_string(made);
            committed = mover->propose(newNode(name, made));
            if (committed) {
                EXPECT_GT(committed->sequence, lastBefore) << "another list had this number";
            }
        }
        ASSERT_FALSE(committed) << "the disk was never full";
        while (const auto polled = mover->poll(100ms))  // the list that is not written
            if (!*polled) break;
        std::size_t fresh = 0;
        for (const auto& [id, name] : seen) {
            const auto known = before.find(id);
            EXPECT_TRUE(known == before.end() || known->second == name)
                << "#" << id.value << " was " << (known == before.end() ? "" : known->second);
            fresh += known == before.end() ? 1 : 0;
        }
        EXPECT_GT(fresh, 1u);
        wall.kill();
    }
}

/// Killed before anything was in it: there is no scene to go on from, and the numbers that were taken count all the
/// same.
TEST(Journal, AWallThatWasKilledWhileItWasEmptyIsJoinedAgain) {
    KeptWall wall;
    for (int server = 0; server < 2; ++server) {
        wall.server = std::make_unique<Process>(
            wall.folder.path(), "empty" + std::to_string(server),
            std::vector<std::string>{program("tessera-server"), "--wall", smallWall(wall.folder), "--listen",
                                     "127.0.0.1:0", "--rate", "200", "--journal", wall.journal()});
        wall.address = wall.server->waitForText("listening on ", 20s).value_or("");
        ASSERT_FALSE(wall.address.empty()) << wall.server->output();
        const auto mover = wall.connect("mover");
        ASSERT_TRUE(mover);
        if (server == 0) {
            wall.kill();
            continue;
        }
        const auto committed = mover->propose(newNode("first", 1));
        ASSERT_TRUE(committed) << committed.error().message;
        EXPECT_TRUE(findNode(mover->scene(), "/first"));
    }
}

/// Its ids begin far on then, and lists name what an Inline is to hold by them.
TEST(Journal, AFirstStartThatEndsBeforeItsSceneIsThereSpoilsNoLaterOne) {
    KeptWall wall;
    (void)wall.folder.write("part.tsct", "node { name: \"part\" transform {} }\n");
    wall.scene = wall.folder.write("whole.tsct",
                                   "node { name: \"first\" transform {} }\nnode { name: \"inline\" inline { file: "
                                   "\"part.tsct\" load: AT_ONCE } }\n");
    wall.launch();
    for (int i = 0; i < 2000 && !std::filesystem::exists(wall.journal() + "/last"); ++i)
        std::this_thread::sleep_for(1ms);
    wall.kill();
    ASSERT_TRUE(wall.start()) << wall.server->output();
    const auto mover = wall.connect("mover");
    ASSERT_TRUE(mover) << wall.server->output();
    for (int i = 0; i < 1000 && !findNode(mover->scene(), "/inline/part"); ++i)
        ASSERT_TRUE(mover->poll(10ms)) << wall.server->output();
    EXPECT_TRUE(findNode(mover->scene(), "/inline/part")) << wall.server->output();
}

/// Parts come one in a frame, 50 ms apart: the kill is between two of them.
TEST(Journal, ALoadThatIsHalfThereWhenTheServerIsKilledIsTakenAway) {
    KeptWall wall;
    wall.scene = wall.folder.write("still.tsct", "node { name: \"still\" transform {} }\n");
    wall.rate = "20";
    const std::string forest = wall.folder.write(
        "forest.tsct",
        "node { name: \"forest\" transform {} node { transform {} repeat { count: 200 step { y: 2 } }\n"
        "  node { transform {} repeat { count: 200 step { x: 2 } } node { box { size { x: 1 y: 1 z: 1 } } } } } }\n");
    ASSERT_TRUE(wall.start()) << wall.server->output();
    const std::unique_ptr<Application> watcher = wall.connect("watcher");
    ASSERT_TRUE(watcher);
    ASSERT_TRUE(watcher->propose(newNode("mine", 1)));
    const std::size_t objects = watcher->scene().objectCount();
    const StateHash before = watcher->scene().stateHash();
    std::thread loader([&, application = wall.connect("loader")] { EXPECT_FALSE(application->load(forest)); });
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (watcher->scene().objectCount() == objects && std::chrono::steady_clock::now() < deadline)
        if (!watcher->poll(10ms)) break;
    wall.kill();
    loader.join();
    ASSERT_GT(watcher->scene().objectCount(), objects) << "nothing came";
    ASSERT_FALSE(findNode(watcher->scene(), "/forest"));

    ASSERT_TRUE(wall.start()) << wall.server->output();
    const std::unique_ptr<Application> after = wall.connect("after");
    ASSERT_TRUE(after);
    while (after->scene().objectCount() != objects && std::chrono::steady_clock::now() < deadline)
        ASSERT_TRUE(after->poll(10ms));
    EXPECT_EQ(after->scene().stateHash(), before);
    const auto status = after->status();
    ASSERT_TRUE(status) << status.error().message;
    EXPECT_EQ(status->undoDepth, 1u);
    EXPECT_EQ(status->redoDepth, 0u);
    const auto undone = after->undo();
    ASSERT_TRUE(undone) << undone.error().message;
    EXPECT_FALSE(findNode(after->scene(), "/mine"));
    const auto loaded = after->load(forest);
    EXPECT_TRUE(loaded) << loaded.error().message;
}

/// Movies and the images that they write into: who plays goes on, who stands shows what it showed.
TEST(Journal, AFilmGoesOnWhereItWasAndOneThatStoodShowsItsPicture) {
    KeptWall wall;
    wall.scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/1b-movie.tsct";
    wall.rate = "60";
    std::unique_ptr<Application> watcher;
    ObjectId core;
    const auto movie = [&] { return *watcher->scene().get<Movie>(core); };
    const auto pixels = [&] { return watcher->scene().get<Image>(movie().image)->pixels.id(); };
    const auto restart = [&] {
        ASSERT_TRUE(wall.start()) << wall.server->output();
        watcher = wall.connect("watcher");
        ASSERT_TRUE(watcher);
        const Expected<ObjectId> node = findNode(watcher->scene(), "/film");
        ASSERT_TRUE(node) << node.error().message;
        core = watcher->scene().get<Node>(*node)->core;
    };
    const auto until = [&](const auto& there) {
        const auto deadline = std::chrono::steady_clock::now() + 60s;
        while (!there() && std::chrono::steady_clock::now() < deadline) ASSERT_TRUE(watcher->poll(100ms));
        ASSERT_TRUE(there()) << movie().time << movie().problem << wall.server->output();
    };
    const auto setMovie = [&](FieldId field, FieldValue value) {
        ChangeListBuilder list;
        list.set(core, typeOf<Movie>(), field, value);
        const auto committed = watcher->propose(list.take());
        ASSERT_TRUE(committed) << committed.error().message;
    };
    ASSERT_NO_FATAL_FAILURE(restart());
    ASSERT_NO_FATAL_FAILURE(until([&] { return movie().time > 0.1; }));
    const double seen = movie().time;
    wall.kill();

    ASSERT_NO_FATAL_FAILURE(restart());
    EXPECT_GE(movie().time, seen) << "what everybody was told is kept";
    EXPECT_EQ(movie().problem, "");
    const double after = movie().time;
    ASSERT_NO_FATAL_FAILURE(until([&] { return movie().time > after + 0.1; }));
    EXPECT_EQ(movie().problem, "");
    ASSERT_NO_FATAL_FAILURE(setMovie(fieldId<&Movie::playing>, toValue(false)));
    const auto settle = [&] {
        for (int i = 0; i < 60; ++i) ASSERT_TRUE(watcher->waitForFrame(10s));
    };
    ASSERT_NO_FATAL_FAILURE(settle());
    const auto playing = pixels();
    const double sought = movie().time + 0.5;
    ASSERT_NO_FATAL_FAILURE(setMovie(fieldId<&Movie::time>, toValue(sought)));
    ASSERT_NO_FATAL_FAILURE(until([&] { return pixels() != playing; }));
    ASSERT_NO_FATAL_FAILURE(settle());
    const auto stood = pixels();
    wall.kill();

    ASSERT_NO_FATAL_FAILURE(restart());
    EXPECT_EQ(movie().time, sought);
    EXPECT_FALSE(movie().playing);
    EXPECT_EQ(pixels(), stood);
    // Its child is new and shows the same picture of this time; the steps of before lead back.
    ASSERT_NO_FATAL_FAILURE(settle());
    EXPECT_EQ(pixels(), stood);
    const auto undone = watcher->undo();
    ASSERT_TRUE(undone) << undone.error().message;
    ASSERT_NO_FATAL_FAILURE(until([&] { return movie().time != sought; }));
    ASSERT_NO_FATAL_FAILURE(until([&] { return pixels() != stood; }));
    EXPECT_EQ(movie().problem, "");
}

/// Nobody may read that folder, but for the files that the scene names.
TEST(Journal, WhatItsSceneNamesIsReadThoughTheNextCommandSaysNothingOfTheScene) {
    const TemporaryFolder elsewhere;
    const std::string house =
        elsewhere.write("house.tsct", R"(node { name: "walls" box { size { x: 1 y: 1 z: 1 } } })");
    KeptWall wall({"--up", "z"});
    wall.scene = elsewhere.write("scene.tsct", R"(node { name: "house" inline { file: "house.tsct" load: BY_HAND } })");
    ASSERT_TRUE(wall.start()) << wall.server->output();
    ASSERT_TRUE(wall.connect("somebody"));
    wall.kill();
    wall.scene.clear();
    wall.more.clear();
    ASSERT_TRUE(wall.start()) << wall.server->output();
    const std::unique_ptr<Application> somebody = wall.connect("somebody");
    ASSERT_TRUE(somebody);
    const Aspect& scene = somebody->scene();
    const Expected<ObjectId> node = findNode(scene, "/scene/house");
    ASSERT_TRUE(node) << node.error().message;
    const ObjectId core = scene.get<Node>(*node)->core;
    ASSERT_EQ(scene.get<Inline>(core)->file, house);
    ChangeListBuilder want;
    want.set(core, typeOf<Inline>(), fieldId<&Inline::wanted>, true);
    ASSERT_TRUE(somebody->propose(want.take()));
    const auto deadline = std::chrono::steady_clock::now() + 20s;
    const auto state = [&] { return scene.get<Inline>(core)->state; };
    while (state() != LoadWords::kThere && state() != LoadWords::kFailed && std::chrono::steady_clock::now() < deadline)
        ASSERT_TRUE(somebody->poll(1s));
    EXPECT_EQ(state(), LoadWords::kThere) << scene.get<Inline>(core)->problem;
}

TEST(Journal, ASecondServerAndAnotherSceneAreRefusedInWords) {
    KeptWall wall;
    ASSERT_TRUE(wall.start());
    ASSERT_TRUE(wall.connect("anybody"));
    const auto other = [&](const std::string& scene) {
        return run(wall.folder.path(),
                   {program("tessera-server"), "--scene", scene, "--journal", wall.journal(), "--frames", "1"}, 20s);
    };
    const Outcome second = other(kKeptYard);
    EXPECT_EQ(second.exitCode, 1) << second.output;
    EXPECT_NE(second.output.find("in use by tessera-server, pid " + std::to_string(wall.server->pid())),
              std::string::npos)
        << second.output;
    wall.kill();
    const Outcome another = other(std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/collisions.tsct");
    EXPECT_EQ(another.exitCode, 2) << another.output;
    EXPECT_NE(another.output.find("began with --scene " + kKeptYard), std::string::npos) << another.output;
}

}  // namespace
}  // namespace tessera::test
