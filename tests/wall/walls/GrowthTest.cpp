/// Rounds that lead a wall back to where it was take no more memory each time: server and hosts alike.
#include <gtest/gtest.h>
#include <malloc.h>

#include <fmt/format.h>

#include <fstream>
#include <functional>
#include <limits>
#include <optional>

#include "tests/support/wall/SimulatedWall.h"
#include "tests/unit/Sanitized.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;

/// Bytes of this process that are in use, of all threads.
double heapBytes() {
    const struct mallinfo2 heap = ::mallinfo2();
    return static_cast<double>(heap.uordblks + heap.hblkhd);
}

constexpr const char* kRoom = R"(
node { name: "cart" transform {} node { name: "load" box { size { x: 0.6 y: 0.6 z: 0.6 } } } }
node { name: "handles" manipulator { target: "/cart" kind: MOVE size: 2 } }
node { name: "camera" transform { translation { z: 4 } } camera {} }
)";

class Growth : public testing::Test {
protected:
    struct Cycle {
        const char* name;
        std::function<void(int round)> once;
        int warmUp = 160;  ///< until all that has a bound has reached it
        int rounds = 240;
    };

    void SetUp() override {
        if (kSanitized) GTEST_SKIP() << "a sanitizer counts memory in its own way";
        std::ofstream(folder_ / "scene.tsct") << kRoom;
        begin(60);
    }
    /// A round takes time: at a lower rate it has fewer frames.
    void begin(double rateHz) {
        wall_.reset();
        wall_.emplace(WallOptions{.scene = folder_ / "scene.tsct",
                                  .wall = "1x1",
                                  .draws = false,
                                  .journal = folder_ / "journal",
                                  .reload = true,
                                  .rateHz = rateHz,
                                  .server = {"--allow", folder_.path()}});
        app().onList = {};
    }
    [[nodiscard]] SimulatedApplication& app() { return wall_->application(); }
    [[nodiscard]] ObjectId node(const std::string& path) { return findNode(app().scene(), path).value_or(ObjectId()); }
    template <typename R>
    void granted(const R& request) {
        const auto told = app().ask(request);
        ASSERT_TRUE(told) << told.error().message << wall_->logs();
    }
    /// Bytes that a round adds, on average. Blocks that are filled and let go of as a whole come to 500 of them.
    void expectNoGrowth(const Cycle& cycle) {
        SCOPED_TRACE(cycle.name);
        constexpr double kMostBytes = 1024;
        int round = 0;
        for (; round < cycle.warmUp; ++round) ASSERT_NO_FATAL_FAILURE(cycle.once(round));
        const double before = heapBytes();
        for (; round < cycle.warmUp + cycle.rounds; ++round) ASSERT_NO_FATAL_FAILURE(cycle.once(round));
        EXPECT_LE((heapBytes() - before) / cycle.rounds, kMostBytes) << "bytes a round";
    }

    test::TestFolder folder_;
    std::optional<SimulatedWall> wall_;
};

TEST_F(Growth, OfWhoComesAndLeavesNothingStays) {
    expectNoGrowth({"an application", [&](int) {
                        (void)wall_->application("guest");
                        wall_->removeApplication("guest");
                        wall_->world().runFor(100ms);
                    }});
    expectNoGrowth({"an application with another name each time", [&](int round) {
                        const std::string name = fmt::format("guest{}", round);
                        (void)wall_->application(name);
                        wall_->removeApplication(name);
                        wall_->world().runFor(100ms);
                    }});
    expectNoGrowth({"a host", [&](int) {
                        wall_->killHost("all");
                        wall_->startHost("all");
                        wall_->world().runFor(500ms);
                    }});
}

/// Steps of undo have a bound: until it is reached they take memory.
TEST_F(Growth, OfEditsThatLeadBackNothingStays) {
    const auto move = [&](double by) {
        request::MoveNode move;
        move.node = node("/cart");
        move.move.translation = Vec3d(by, 0, 0);
        move.move.relative = true;
        return move;
    };
    expectNoGrowth({"a move and its way back",
                    [&](int) {
                        granted(move(0.25));
                        granted(move(-0.25));
                    },
                    200});
    expectNoGrowth({"undo and redo", [&](int) {
                        granted(request::UndoStep{});
                        granted(request::RedoStep{});
                    }});
    expectNoGrowth({"a clone that is removed",
                    [&](int) {
                        request::CloneNode clone;
                        clone.wish.node = node("/cart");
                        const auto told = app().ask(clone);
                        ASSERT_TRUE(told) << told.error().message;
                        granted(request::RemoveNode{.node = told->ids.front().second});
                    },
                    200});
    expectNoGrowth(
        {"what is refused", [&](int) { EXPECT_FALSE(app().ask(request::RemoveNode{.node = ObjectId{999'999}})); }});
}

TEST_F(Growth, OfFilesThatComeAndGoNothingStays) {
    begin(15);
    expectNoGrowth({"the scene's file, with other nodes each time",
                    [&](int round) {
                        const std::string path = fmt::format("/round{}", round);
                        std::ofstream(folder_ / "scene.tsct")
                            << kRoom
                            << fmt::format(
                                   "node {{ name: \"round{}\" transform {{}} node {{ transform {{}} repeat {{ "
                                   "count: 40 }} }} }}\n",
                                   round);
                        ASSERT_TRUE(wall_->world().runUntil([&] { return bool(node(path)); }, 20s)) << wall_->logs();
                    },
                    40, 60});
}

TEST_F(Growth, OfQuestionsNothingStays) {
    expectNoGrowth({"news that is wanted and not", [&](int) {
                        granted(request::SubscribeNews{.wanted = {.frames = true}});
                        wall_->world().runFor(100ms);
                        granted(request::SubscribeNews{});
                    }});
    expectNoGrowth({"states and picks", [&](int) {
                        granted(request::GetStatus{});
                        granted(request::GetPeople{});
                        (void)app().ask(request::PickAt{});
                    }});
    expectNoGrowth({"a hand at a handle", [&](int) {
                        (void)app().ask(request::GrabHandle{});
                        (void)app().ask(request::ReleaseHandle{});
                    }});
    expectNoGrowth({"keys at a window", [&](int) {
                        InputState keys;
                        keys.right = InputState::kFull;
                        wall_->host("all").input(keys);
                        wall_->world().runFor(100ms);
                        wall_->host("all").input({});
                        wall_->world().runFor(100ms);
                    }});
    expectNoGrowth({"frames", [&](int) { wall_->world().runFor(200ms); }});
}

class MoreGrowth : public Growth {};

/// Somebody removes what the file said, and then the file says it no more either: such objects wait to come back, and
/// 1,000 of them at most.
TEST_F(MoreGrowth, OfWhatAFileAndPeopleRemoveNothingStays) {
    expectNoGrowth({"the scene's file, with other nodes each time",
                    [&](int round) {
                        const std::string path = fmt::format("/round{}", round);
                        std::ofstream(folder_ / "scene.tsct")
                            << kRoom
                            << fmt::format(
                                   "node {{ name: \"round{}\" transform {{}} node {{ transform {{}} repeat {{ "
                                   "count: 40 }} }} }}\n",
                                   round);
                        ASSERT_TRUE(wall_->world().runUntil([&] { return bool(node(path)); }, 20s)) << wall_->logs();
                        granted(request::RemoveNode{.node = node(path)});
                    },
                    270,  // steps of undo
                    60});
}

/// Some 1,000 files are known that people may bring back.
TEST_F(MoreGrowth, OfLoadsThatAreRemovedNothingStays) {
    std::ofstream(folder_ / "part.tsct") << "node { name: \"part\" box { size { x: 1 y: 1 z: 1 } } }\n";
    expectNoGrowth({"a file that is loaded and removed",
                    [&](int) {
                        const auto told = app().ask(request::LoadFile{.path = folder_ / "part.tsct", .parent = {}});
                        ASSERT_TRUE(told) << told.error().message << wall_->logs();
                        granted(request::RemoveNode{.node = told->node});
                    },
                    1'200});
    expectNoGrowth({"a file that is refused", [&](int) {
                        EXPECT_FALSE(app().ask(request::LoadFile{.path = folder_ / "none.tsct", .parent = kRootNode}));
                    }});
}

}  // namespace
}  // namespace tessera::simulation
