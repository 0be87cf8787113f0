/// A server that is killed, and started again on the same journal: what was granted, seen, set, loaded and played is as
/// it was; a full disk refuses edits, and the wall goes on.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "common/application/Application.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Inline.h"
#include "common/cores/Movie.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/sim/journal/FileSystem.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"
#include "tests/unit/NumberedNode.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;
using test::newNode;

/// A disk on which only so many bytes more have room.
class LittleDisk final : public FileSystem {
public:
    std::optional<std::uint64_t> room;  ///< none: without bound

    [[nodiscard]] int append(int file, ByteSpan first, ByteSpan second) override {
        const std::uint64_t bytes = first.size() + second.size();
        if (room && bytes > *room) return ENOSPC;
        if (room) *room -= bytes;
        return FileSystem::append(file, first, second);
    }
};

/// One command line with a journal, as often as it is started, of a wall that waits for no host.
class KeptWall {
public:
    KeptWall() {
        const std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/1x1.wall");
        options.wall = folder.write(
            "1x1.wall", text.substr(0, text.find("sync {")) + "sync { lost_after_ms: 4000 start_deadline_ms: 1 }\n");
        options.scene = kYard;
        options.hosts = false;
        options.journal = journal();
        options.rateHz = 200;
        options.server = {"--allow", folder.path()};
    }

    /// Connected programs come back by themselves, where no `renew` lies between.
    void start() {
        if (wall)
            wall->startServer();
        else
            wall.emplace(options);
    }
    void kill() { wall->killServer(); }
    /// The next start is one of another command line: nobody may be connected.
    void renew() { wall.reset(); }
    [[nodiscard]] std::unique_ptr<Application> connect(const std::string& name) {
        auto application =
            Application::connect({.address = toString(wall->address()), .name = name}, wall->platform(name));
        EXPECT_TRUE(application) << application.error().message << wall->logs();
        return application ? std::move(*application) : nullptr;
    }
    [[nodiscard]] std::string journal() const { return folder.path() + "/journal"; }
    [[nodiscard]] std::string logs() const { return wall->logs(); }

    test::TestFolder folder;
    WallOptions options;
    std::optional<SimulatedWall> wall;
};

TEST(JournalWall, TheViewThatWasSetComesBack) {
    KeptWall kept;
    kept.start();
    const CommandOutcome viewed = kept.wall->ctl({"view", "--position", "1", "2", "3"});
    ASSERT_EQ(viewed.exitCode, 0) << viewed.output;
    const auto hit = [&] { return kept.connect("asker")->pick(32, 18); };
    const auto before = hit();
    kept.kill();
    kept.start();
    const auto after = hit();
    ASSERT_TRUE(before && after);
    EXPECT_EQ(after->hit, before->hit);
    EXPECT_EQ(after->node, before->node);
    EXPECT_EQ(after->point, before->point);
}

TEST(JournalWall, AFullDiskRefusesEditsAndTheWallGoesOn) {
    const auto disk = std::make_shared<LittleDisk>();
    KeptWall kept;
    kept.options.journalFiles = disk;
    kept.start();
    disk->room = 64 << 10;
    const auto mover = kept.connect("mover");
    ASSERT_TRUE(mover);
    Expected<answer::Committed> committed = answer::Committed{};
    int made = 0;
    for (; committed && made < 5'000; ++made) committed = mover->propose(newNode("edit" + std::to_string(made), made));
    ASSERT_FALSE(committed) << made;
    EXPECT_WORDS(committed.error().message);
    const auto refused = mover->propose(newNode("late", 1));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message.find("it is done"), std::string::npos)
        << "it is not: " << refused.error().message;
    const auto loaded = mover->load(kYard);
    ASSERT_FALSE(loaded);
    EXPECT_WORDS(loaded.error().message);
    const auto removed = mover->removeNode(findNode(mover->scene(), "/edit1").value());
    ASSERT_FALSE(removed);
    EXPECT_WORDS(removed.error().message);
    EXPECT_TRUE(findNode(mover->scene(), "/edit1"));
    EXPECT_TRUE(mover->waitForFrame(10s)) << "nobody is stopped by it";
    EXPECT_NE(kept.logs().find("edits are refused until it can"), std::string::npos) << kept.logs();
    EXPECT_FALSE(findNode(mover->scene(), "/late"));
}

/// Lists are sent before they are written: the disk is full, so that others see one that is never written, and the
/// server is killed.
TEST(JournalWall, WhatOthersHaveSeenNeverStandsForSomethingElseThoughItWasNotWritten) {
    const auto disk = std::make_shared<LittleDisk>();
    KeptWall kept;
    kept.options.journalFiles = disk;
    std::map<ObjectId, std::string> seen;  // of nodes
    Sequence last;
    for (int server = 0; server < 3; ++server) {
        disk->room.reset();
        kept.start();
        disk->room = 32 << 10;
        const auto mover = kept.connect("mover");
        ASSERT_TRUE(mover);
        for (const auto& [id, name] : seen)
            if (const Node* node = mover->scene().get<Node>(id)) {
                EXPECT_EQ(node->name, name) << "#" << id.value;
            }
        const std::map<ObjectId, std::string> before = seen;
        const Sequence lastBefore = last;
        mover->onChanges([&](const ChangeList& list, Sequence sequence) {
            last = std::max(last, sequence);
            for (const Creation& creation : list.creations)
                if (const Node* node = mover->scene().get<Node>(creation.id); node && !node->name.empty())
                    seen[creation.id] = node->name;
        });
        Expected<answer::Committed> committed = answer::Committed{};
        for (int made = 0; committed && made < 5'000; ++made) {
            committed = mover->propose(newNode(fmt::format("s{}n{}", server, made), made));
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
        kept.kill();
    }
}

/// Killed before anything was in it: there is no scene to go on from, and the numbers that were taken count all the
/// same.
TEST(JournalWall, OneThatWasKilledWhileItWasEmptyIsJoinedAgain) {
    KeptWall kept;
    kept.options.scene.clear();
    kept.start();
    ASSERT_TRUE(kept.connect("mover"));
    kept.kill();
    kept.start();
    const auto mover = kept.connect("mover");
    ASSERT_TRUE(mover);
    const auto committed = mover->propose(newNode("first", 1));
    ASSERT_TRUE(committed) << committed.error().message;
    EXPECT_TRUE(findNode(mover->scene(), "/first"));
}

/// Its ids begin far on then, and lists name what an Inline is to hold by them.
TEST(JournalWall, AFirstStartThatEndsBeforeItsSceneIsThereSpoilsNoLaterOne) {
    KeptWall kept;
    (void)kept.folder.write("part.tsct", "node { name: \"part\" transform {} }\n");
    kept.options.scene =
        kept.folder.write("whole.tsct",
                          "node { name: \"first\" transform {} }\nnode { name: \"inline\" inline { file: \"part.tsct\" "
                          "load: AT_ONCE } }\n");
    kept.start();
    ASSERT_TRUE(std::filesystem::exists(kept.journal() + "/last"));
    kept.kill();
    kept.start();
    const auto mover = kept.connect("mover");
    ASSERT_TRUE(mover) << kept.logs();
    for (int i = 0; i < 1000 && !findNode(mover->scene(), "/inline/part"); ++i)
        ASSERT_TRUE(mover->poll(10ms)) << kept.logs();
    EXPECT_TRUE(findNode(mover->scene(), "/inline/part")) << kept.logs();
}

/// Parts come one in a frame, 50 ms apart: the kill is between two of them.
TEST(JournalWall, ALoadThatIsHalfThereWhenTheServerIsKilledIsTakenAway) {
    KeptWall kept;
    kept.options.scene = kept.folder.write("still.tsct", "node { name: \"still\" transform {} }\n");
    kept.options.rateHz = 20;
    const std::string forest = kept.folder.write(
        "forest.tsct",
        "node { name: \"forest\" transform {} node { transform {} repeat { count: 200 step { y: 2 } }\n"
        "  node { transform {} repeat { count: 200 step { x: 2 } } node { box { size { x: 1 y: 1 z: 1 } } } } } }\n");
    kept.start();
    std::size_t objects = 0;
    StateHash before;
    {
        const std::unique_ptr<Application> watcher = kept.connect("watcher");
        ASSERT_TRUE(watcher);
        ASSERT_TRUE(watcher->propose(newNode("mine", 1)));
        objects = watcher->scene().objectCount();
        before = watcher->scene().stateHash();
        SimulatedApplication& loader = kept.wall->application("loader");
        const std::uint64_t asked = loader.say(request::LoadFile{.path = forest, .parent = kRootNode});
        for (int i = 0; i < 6'000 && watcher->scene().objectCount() == objects; ++i) ASSERT_TRUE(watcher->poll(10ms));
        ASSERT_EQ(loader.answer(asked), nullptr) << "it is all there";
        kept.kill();
        ASSERT_GT(watcher->scene().objectCount(), objects) << "nothing came";
        ASSERT_FALSE(findNode(watcher->scene(), "/forest"));
    }
    kept.start();
    const std::unique_ptr<Application> after = kept.connect("after");
    ASSERT_TRUE(after);
    for (int i = 0; i < 6'000 && after->scene().objectCount() != objects; ++i) ASSERT_TRUE(after->poll(10ms));
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
TEST(JournalWall, AFilmGoesOnWhereItWasAndOneThatStoodShowsItsPicture) {
    KeptWall kept;
    kept.options.scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/1b-movie.tsct";
    kept.options.rateHz = 60;
    std::unique_ptr<Application> watcher;
    ObjectId core;
    const auto movie = [&] { return *watcher->scene().get<Movie>(core); };
    const auto pixels = [&] { return watcher->scene().get<Image>(movie().image)->pixels.id(); };
    const auto restart = [&] {
        watcher.reset();
        kept.start();
        watcher = kept.connect("watcher");
        ASSERT_TRUE(watcher);
        const Expected<ObjectId> node = findNode(watcher->scene(), "/film");
        ASSERT_TRUE(node) << node.error().message;
        core = watcher->scene().get<Node>(*node)->core;
    };
    const auto until = [&](const auto& there) {
        for (int i = 0; i < 3'000 && !there(); ++i) ASSERT_TRUE(watcher->poll(20ms));
        ASSERT_TRUE(there()) << movie().time << movie().problem << kept.logs();
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
    kept.wall->world().runFor(100ms);  // until it is written, too
    kept.kill();

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
    kept.kill();

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
TEST(JournalWall, WhatItsSceneNamesIsReadThoughTheNextCommandSaysNothingOfTheScene) {
    const test::TestFolder elsewhere;
    const std::string house =
        elsewhere.write("house.tsct", R"(node { name: "walls" box { size { x: 1 y: 1 z: 1 } } })");
    KeptWall kept;
    kept.options.server.insert(kept.options.server.end(), {"--up", "z"});
    kept.options.scene =
        elsewhere.write("scene.tsct", R"(node { name: "house" inline { file: "house.tsct" load: BY_HAND } })");
    kept.start();
    ASSERT_TRUE(kept.connect("somebody"));
    kept.kill();
    kept.renew();
    kept.options.scene.clear();
    kept.options.server = {"--allow", kept.folder.path()};
    kept.start();
    const std::unique_ptr<Application> somebody = kept.connect("somebody");
    ASSERT_TRUE(somebody);
    const Aspect& scene = somebody->scene();
    const Expected<ObjectId> node = findNode(scene, "/scene/house");
    ASSERT_TRUE(node) << node.error().message;
    const ObjectId core = scene.get<Node>(*node)->core;
    ASSERT_EQ(scene.get<Inline>(core)->file, house);
    ChangeListBuilder want;
    want.set(core, typeOf<Inline>(), fieldId<&Inline::wanted>, true);
    ASSERT_TRUE(somebody->propose(want.take()));
    const auto state = [&] { return scene.get<Inline>(core)->state; };
    for (int i = 0; i < 1'000 && state() != LoadWords::kThere && state() != LoadWords::kFailed; ++i)
        ASSERT_TRUE(somebody->poll(20ms));
    EXPECT_EQ(state(), LoadWords::kThere) << scene.get<Inline>(core)->problem;
}

TEST(JournalWall, ASecondServerAndAnotherSceneAreRefusedInWords) {
    KeptWall kept;
    kept.start();
    ASSERT_TRUE(kept.connect("anybody"));
    const auto refusal = [&](const std::string& scene) -> std::string {
        WallOptions options = kept.options;
        options.scene = scene;
        try {
            const SimulatedWall other(options);
        } catch (const Violation& why) {
            return why.what();
        }
        return "";
    };
    EXPECT_NE(refusal(kYard).find(fmt::format("in use by tessera-server, pid {}", getpid())), std::string::npos)
        << refusal(kYard);
    kept.kill();
    const std::string another = refusal(std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/collisions.tsct");
    EXPECT_NE(another.find("began with --scene " + kYard), std::string::npos) << another;
}

}  // namespace
}  // namespace tessera::simulation
