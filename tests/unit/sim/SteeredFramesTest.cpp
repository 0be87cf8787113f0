/// People steer through a scene that moves: whatever they press, frames go on, and looks beside them find the scene of
/// the newest list.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>

#include "common/cores/Camera.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Manipulator.h"
#include "common/scene/Edits.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SingleEdits.h"
#include "tests/unit/sim/SteeredShow.h"

namespace tessera {
namespace {

using test::SteeredShow;

/// A box that a motion drives for as long as a test takes.
ChangeList drivenScene() {
    test::ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    make.node("load", make.node("cart", kRootNode, place), make.box(Vec3d::Ones()));
    make.node("motion", kRootNode, make.motion(place, {{0, 0, 0, 0}, {20, 2, 0, 0}}));
    return make.builder.take();
}

InputState pressing(InputState before, InputAction action) {
    before.ask(action);
    return before;
}

TEST(SteeredFrames, TheKeyFShowsAllOfASceneThatMoves) {
    for (const InputAction key : {InputAction::kFit, InputAction::kFitAll}) {
        SteeredShow show(test::wallOfOne(), {drivenScene()});
        show.play(5);
        show.steering.received("only", {InputState{}});
        show.steering.received("only", {pressing({}, key)});
        show.play(2);
        EXPECT_EQ(show.looks, 1u);
        show.play(100);
        // It fills the wall as it was when the key went down.
        const Vec3d middle = test::placeOf(show.simulation.scene(), "/cart");
        const Vec3d seen = show.maker.view().world_T_wall().inverse() * middle;
        EXPECT_LT((seen - Vec3d(0, 0.5, 0)).head<2>().norm(), 1) << seen.transpose();
    }
}

TEST(SteeredFrames, TheWayHomeIsFoundWhileTheSceneMoves) {
    SteeredShow show(test::wallOfOne(), {drivenScene()});
    show.play(2);
    ASSERT_TRUE(show.view.set(show.simulation.scene(), {.position = Vec3d(9, 8, 7)}));
    show.play(2);
    // Forgets the first view: all of the scene is looked for again.
    ASSERT_TRUE(show.view.set(show.simulation.scene(), {.reset = true}));
    show.play(2);
    EXPECT_EQ(show.looks, 1u);
    EXPECT_TRUE(show.view.homeKnown());
}

TEST(SteeredFrames, LooksBeforeAnythingIsThereFindAnEmptyScene) {
    SteeredShow show;
    EXPECT_TRUE(show.steering.asked(7, {.input = pressing({}, InputAction::kFitAll)}));
    show.play(3);
    EXPECT_EQ(show.looks, 1u);
}

/// Somebody at windows, game pads, terminals and wands who presses anything, and others who edit the scene.
class Hunter {
public:
    Hunter(SteeredShow& show, Random& random) : show_(show), random_(random) {}

    void press() {
        switch (below(random_, 12)) {
            case 0:
            case 1:
            case 2:
            case 3: {
                InputState& window = windows_[below(random_, windows_.size())];
                window.source = static_cast<std::uint32_t>(&window - windows_.data());
                change(window);
                if (oneIn(random_, 50)) window.source = static_cast<std::uint32_t>(random_());
                return show_.steering.received(oneIn(random_, 40) ? "a stranger" : "only", {window}, at());
            }
            case 4:
            case 5: {
                change(terminal_);
                return ask({.input = terminal_});
            }
            case 6:
                return ask(someWish());
            case 7:
                return show_.steering.add({.move = Vec3d(axis(), axis(), axis()),
                                           .turn = Vec2d(axis(), axis()),
                                           .look = Vec2d(axis(), axis()),
                                           .wheel = axis(),
                                           .actions = {someAction()}},
                                          "wand right");
            case 8: {
                show_.wands = {WandState{.name = "right",
                                         .tracked = !oneIn(random_, 4),
                                         .worldPosition = somePlace(),
                                         .worldOrientation = someTurn(),
                                         .buttons = static_cast<std::uint32_t>(below(random_, 4))}};
                return;
            }
            case 9:
                return setByHand();
            case 10:
                if (oneIn(random_, 2)) show_.steering.hostLeft("only");
                return show_.steering.applicationLeft(7);
            default:
                if (oneIn(random_, 4)) show_.steering.letGoOfHandles();
        }
    }
    [[nodiscard]] std::vector<Edit> edits() {
        std::vector<Edit> all;
        while (oneIn(random_, 3) && all.size() < 3) all.push_back(someEdit());
        return all;
    }
    void letGoOfAll() {
        show_.wands.clear();
        show_.steering.hostLeft("only");
        show_.steering.hostLeft("a stranger");
        show_.steering.applicationLeft(7);
        show_.steering.letGoOfHandles();
    }

private:
    [[nodiscard]] double real() { return static_cast<double>(below(random_, 2001)) / 100 - 10; }
    [[nodiscard]] double axis() { return static_cast<double>(below(random_, 201)) / 100 - 1; }
    /// Near, or as far as numbers go.
    [[nodiscard]] Vec3d somePlace() {
        if (!oneIn(random_, 12)) return {real(), real(), real()};
        constexpr std::array kFar = {1e6, -1e15, 1e100, 1e300, -1.7e308, 1e-300};
        return {kFar[below(random_, kFar.size())], real(), kFar[below(random_, kFar.size())]};
    }
    [[nodiscard]] Quatd someTurn() {
        const Quatd turn(real(), real(), real(), real());
        return turn.norm() > 0 ? turn.normalized() : Quatd::Identity();
    }
    [[nodiscard]] InputAction someAction() { return static_cast<InputAction>(below(random_, kInputActions)); }
    [[nodiscard]] TimePoint at() {
        return oneIn(random_, 3) ? TimePoint{} : show_.now + std::chrono::milliseconds(below(random_, 40));
    }

    void change(InputState& state) {
        for (std::size_t changes = 1 + below(random_, 3); changes > 0; --changes) {
            const auto some = [&] {
                if (oneIn(random_, 20)) return random_();
                return static_cast<std::uint64_t>(static_cast<std::int64_t>(axis() * InputState::kUnit));
            };
            const auto held = [&] {
                const int full = InputState::kFull;
                const std::array<int, 5> kinds = {0, full, -full, -full - 1, static_cast<int>(axis() * full)};
                return static_cast<std::int16_t>(kinds[below(random_, kinds.size())]);
            };
            switch (below(random_, 9)) {
                case 0:
                case 1:
                case 2:
                    state.asked[below(random_, state.asked.size())] += oneIn(random_, 20) ? 4096 : 1;
                    break;
                case 3:
                    (oneIn(random_, 2) ? state.lookRight : state.lookDown) += some();
                    break;
                case 4:
                    (oneIn(random_, 2) ? state.panRight : state.panDown) += some();
                    break;
                case 5:
                    state.wheel += 4 * some();
                    break;
                case 6:
                    state.held = static_cast<std::uint32_t>(oneIn(random_, 8) ? random_() : below(random_, 4));
                    break;
                case 7:
                    state.cursorX = static_cast<std::uint16_t>(random_());
                    state.cursorY = static_cast<std::uint16_t>(random_());
                    break;
                default: {
                    std::int16_t* const axes[] = {&state.right,     &state.up,     &state.back,
                                                  &state.turnRight, &state.turnUp, &state.rollRight};
                    *axes[below(random_, 6)] = held();
                    if (oneIn(random_, 3)) state.release();
                }
            }
        }
    }
    [[nodiscard]] NavigationWish someWish() {
        NavigationWish wish;
        if (oneIn(random_, 2)) wish.mode = static_cast<NavigationMode>(below(random_, kNavigationModeNames.size()));
        wish.deed = static_cast<NavigationWish::Deed>(below(random_, 5));
        if (oneIn(random_, 2)) wish.node = someNode();
        if (NavigationWish::speaksOfBookmark(wish))
            wish.bookmark = 1 + static_cast<std::uint32_t>(below(random_, kBookmarks));
        return wish;
    }
    void ask(const NavigationWish& wish) { (void)show_.steering.asked(7, wish, at()); }
    void setByHand() {
        ViewWish wish;
        if (oneIn(random_, 2)) wish.position = somePlace();
        if (oneIn(random_, 2)) wish.orientation = someTurn();
        if (oneIn(random_, 3)) wish.worldUnitsPerMetre = std::pow(10, real());
        if (oneIn(random_, 3)) wish.reset = true;
        if (oneIn(random_, 5)) {
            wish.user = show_.wall.users.front().name;
            wish.head = Vec3d(0.1 * real(), 1.7 + 0.1 * real(), 2.4 + 0.1 * real());
        }
        (void)show_.view.set(show_.simulation.scene(), wish);
    }

    [[nodiscard]] const Aspect& scene() const { return show_.simulation.scene(); }
    [[nodiscard]] ObjectId someNode() {
        std::vector<ObjectId> nodes;
        for (const ObjectId id : scene().ids())
            if (scene().get<Node>(id)) nodes.push_back(id);
        return oneIn(random_, 20) ? ObjectId(random_()) : nodes[below(random_, nodes.size())];
    }
    [[nodiscard]] Edit someEdit() {
        const std::size_t kind = below(random_, 12);
        if (kind < 2) return {.list = {}, .kind = kind == 0 ? Edit::Kind::kUndo : Edit::Kind::kRedo};
        if (kind < 4) return {.list = removalList(scene(), someNode()).value_or(ChangeList())};
        if (kind == 4) {  // all of it
            const Node& root = *scene().get<Node>(kRootNode);
            return {.list = removalOf(scene(), std::vector<ObjectId>(root.children.begin(), root.children.end()))};
        }
        if (kind == 5) {
            const NodeMove move{.translation = somePlace(), .relative = true};
            return {.list = {}, .move = move, .node = someNode()};
        }
        return {.list = someThing()};
    }
    [[nodiscard]] ChangeList someThing() {
        test::ListMaker make;
        const ObjectId place = make.transform(somePlace());
        const ObjectId carrier = make.node("", kRootNode, place);
        switch (below(random_, 6)) {
            case 0: {
                const ObjectId camera = make.create<Camera>();
                setField<&Camera::enabled>(make.builder, camera, oneIn(random_, 3));
                make.node("", carrier, camera);
                break;
            }
            case 1: {  // falls
                make.node("", carrier, make.box(Vec3d::Ones()));
                const ObjectId body = make.create<CollisionObject>();
                setField<&CollisionObject::node>(make.builder, body, carrier);
                setField<&CollisionObject::mass>(make.builder, body, 1.0);
                make.node("", kRootNode, body);
                break;
            }
            case 2: {
                make.node("", carrier, make.box(Vec3d::Ones()));
                const ObjectId handles = make.create<Manipulator>();
                setField<&Manipulator::target>(make.builder, handles, carrier);
                setField<&Manipulator::kind>(make.builder, handles, static_cast<std::int64_t>(below(random_, 8)));
                make.node("", kRootNode, handles);
                break;
            }
            case 3:
                make.node("", carrier, make.sheet(oneIn(random_, 4) ? 40 : 2));
                break;
            default:
                make.node("", carrier, make.box(oneIn(random_, 6) ? Vec3d(1e30, 1, 1e-30) : Vec3d(5, 0.1, 5)));
                make.node("", kRootNode, make.motion(place, {{0, real(), real(), 0}, {1, real(), real(), real()}}));
        }
        return make.builder.take();
    }

    SteeredShow& show_;
    Random& random_;
    std::array<InputState, 3> windows_{};
    InputState terminal_;
};

/// Frames of one seed; TESSERA_RUNS says how many seeds.
constexpr int kFramesEach = 60;

TEST(SteeredFrames, AnyKeysInAnySceneThatMovesLeaveAViewAndTheFramesGoOn) {
    const char* const runs = std::getenv("TESSERA_RUNS");
    std::uint64_t frames = 0, changed = 0, looks = 0;
    forSeeds(runs ? std::strtoull(runs, nullptr, 10) : 30, [&](Random& random) {
        std::vector<ChangeList> scene;
        if (oneIn(random, 2)) scene.push_back(test::craneScene());
        if (oneIn(random, 3)) scene.push_back(drivenScene());
        SteeredShow show(oneIn(random, 2) ? test::wallOfOne() : test::wallOfUsers(2), std::move(scene));
        Hunter hunter(show, random);
        for (int i = 0; i < kFramesEach; ++i) {
            while (!oneIn(random, 3)) hunter.press();
            show.frameLength = std::chrono::milliseconds(below(random, 40));
            changed += show.frame(hunter.edits()).commit.list ? 1 : 0;
            ++frames;
            ASSERT_TRUE(checkStand(show.maker.view())) << checkStand(show.maker.view()).error().message;
            for (const User& user : show.maker.view().users) ASSERT_TRUE(user.position.allFinite());
            if (oneIn(random, 3)) show.work();
        }
        hunter.letGoOfAll();
        show.frameLength = std::chrono::milliseconds(20);
        show.play(2);
        (void)show.steering.asked(8, {.mode = NavigationMode::kFly, .deed = NavigationWish::Deed::kHome});
        show.play(150);
        if (show.view.home(show.simulation.scene())) {
            EXPECT_FALSE(show.view.state().byHand) << "whoever goes home arrives";
        }
        looks += show.looks;
    });
    RecordProperty("looks", static_cast<int>(looks));
    EXPECT_TRUE(looks > 0 || std::getenv("TESSERA_SEED"));
    EXPECT_TRUE(2 * changed > frames || std::getenv("TESSERA_SEED")) << changed << " of " << frames << " frames moved";
}

}  // namespace
}  // namespace tessera
