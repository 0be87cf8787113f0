// Flying, orbiting, going to places: beside closed forms, and whatever anybody does with the keys.
#include <gtest/gtest.h>

#include "server/sim/navigation/Navigator.h"
#include "tests/unit/navigation/Rooms.h"

namespace tessera {
namespace {

constexpr double kTick = 1.0 / 60;

Wall wallOfOne() {
    Wall wall;
    wall.name = "one";
    wall.screens = {{.name = "front",
                     .lowerLeft = Vec3d(-1.6, 0.6, 0),
                     .lowerRight = Vec3d(1.6, 0.6, 0),
                     .upperLeft = Vec3d(-1.6, 2.4, 0)}};
    wall.users = {{.name = "viewer"}};
    wall.hosts = {{.name = "host", .tiles = {{.screen = "front", .user = "viewer"}}}};
    return wall;
}

/// A navigator in a scene of some faces, and the view that it moves.
struct Flight {
    Wall wall = wallOfOne();
    std::vector<Triangle> faces;
    NavigationScene scene;
    Navigator navigator{wall};
    View view, home;
    std::array<std::optional<View>, 9> bookmarks;
    bool letGo = false;

    Flight() {
        static_cast<Surroundings&>(scene) = surroundingsOf(faces);
        scene.bounds = [this]() -> std::optional<Box> {
            Box box;
            for (const Triangle& t : faces)
                for (const Vec3d& corner : t) box.extend(corner);
            return box;
        };
        scene.boundsAt = [](const Ray&) { return Box(); };
        scene.home = [this] { return std::optional(home); };
        scene.bookmark = [this](std::size_t i) { return bookmarks[i]; };
        scene.keepBookmark = [this](std::size_t i, const View& v) { bookmarks[i] = v; };
        view.users = home.users = wall.users;
    }
    Flight(const Flight&) = delete;

    bool step(const NavigationInput& input = {}, double seconds = kTick) {
        const Navigator::Step done = navigator.step(view, input, scene, seconds);
        letGo = letGo || done.home;
        if (!done.view) return false;
        const std::vector<User> users = view.users;
        view = *done.view;
        view.users = users;
        return true;
    }
    void steps(int frames, const NavigationInput& input = {}) {
        for (int i = 0; i < frames; ++i) step(input);
    }
    [[nodiscard]] Vec3d eye() const { return view.world_T_wall() * view.users.front().position; }
};

NavigationInput moving(const Vec3d& move) {
    NavigationInput input;
    input.move = move;
    return input;
}
NavigationInput asking(InputAction action) {
    NavigationInput input;
    input.actions = {action};
    return input;
}

TEST(Navigator, FliesAsFarAsItsSpeedSaysInAWorldOfAnyScale) {
    for (const double scale : {1e-6, 1.0, 1000.0, 1e6}) {
        Flight flight;
        flight.view.worldUnitsPerMetre = scale;
        const Vec3d from = flight.eye();
        flight.steps(120, moving(Vec3d(0, 0, -1)));
        // dv/dt = (speed - v) / tau from rest, over 2 s.
        const double speed = flight.wall.navigation.speed, tau = Navigator::kTau;
        const double way = speed * (2 - tau * (1 - std::exp(-2 / tau)));
        EXPECT_NEAR((flight.eye() - from).z() / scale, -way, 1e-9) << scale;
        flight.steps(600);
        EXPECT_NEAR((flight.eye() - from).z() / scale, -(way + speed * (1 - std::exp(-2 / tau)) * tau), 2e-5)
            << "it comes to rest";
        EXPECT_FALSE(flight.step()) << "and rests";
        EXPECT_EQ(flight.view.worldUnitsPerMetre, scale);
    }
}

TEST(Navigator, LongFramesAndShortOnesLeadToTheSamePlace) {
    Flight coarse, fine;
    for (int i = 0; i < 10; ++i) coarse.step(moving(Vec3d(1, 0.5, -1)), 0.1);
    for (int i = 0; i < 1000; ++i) fine.step(moving(Vec3d(1, 0.5, -1)), 0.001);
    EXPECT_LT((coarse.eye() - fine.eye()).norm(), 1e-9);
    NavigationInput turn;
    turn.turn = Vec2d(1, 0.3);
    Flight coarseTurn, fineTurn;
    for (int i = 0; i < 10; ++i) coarseTurn.step(turn, 0.1);
    for (int i = 0; i < 1000; ++i) fineTurn.step(turn, 0.001);
    EXPECT_LT(coarseTurn.view.orientation.angularDistance(fineTurn.view.orientation), 1e-9);
}

TEST(Navigator, ADragTurnsTheHeadAndLeavesItWhereItIs) {
    Flight flight;
    flight.view.position = Vec3d(5, 6, 7);
    const Vec3d eye = flight.eye();
    NavigationInput look;
    look.look = Vec2d(0.5, 0);
    flight.step(look);
    EXPECT_LT((flight.eye() - eye).norm(), 1e-12);
    const Vec3d ahead = flight.view.orientation * -Vec3d::UnitZ();
    EXPECT_NEAR(std::atan2(ahead.x(), -ahead.z()), 0.5 * Navigator::kLookRadians, 1e-12) << "to the right";
    look.look = Vec2d(0, 1);
    flight.step(look);
    EXPECT_LT((flight.view.orientation * -Vec3d::UnitZ()).y(), -0.5) << "down";
    for (int i = 0; i < 20; ++i) flight.step(look);
    EXPECT_NEAR(headingOf(flight.view.orientation).pitch, -Navigator::kSteepestLook, 1e-9) << "and not over";
    EXPECT_NEAR(headingOf(flight.view.orientation).roll, 0, 1e-9);
}

TEST(Navigator, TheWheelChangesThePaceAndShiftTheSpeed) {
    const auto farIn = [](double wheel, bool faster) {
        Flight flight;
        NavigationInput input;
        input.wheel = wheel;
        flight.step(input);
        input = moving(Vec3d(1, 0, 0));
        input.faster = faster;
        const Vec3d from = flight.eye();
        flight.steps(60, input);
        return (flight.eye() - from).x();
    };
    const double once = farIn(0, false);
    EXPECT_NEAR(farIn(2, false), once * 1.25 * 1.25, 1e-9);
    EXPECT_NEAR(farIn(-1, false), once / 1.25, 1e-9);
    EXPECT_NEAR(farIn(0, true), once * Navigation().fasterFactor, 1e-9);
}

TEST(Navigator, OrbitsKeepTheDistanceAndTheWheelNears) {
    Flight flight;
    addBox(flight.faces, Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    flight.view.position = Vec3d(0.5, -1, 7);
    flight.step(asking(InputAction::kOrbit));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(-1, 1);
    const double distance = flight.eye().norm();  // the scene's middle is the origin
    for (int i = 0; i < 3000; ++i) {
        NavigationInput drag;
        drag.look = Vec2d(any(random), any(random)) * 0.2;
        drag.turn = Vec2d(any(random), any(random));
        flight.step(drag);
        ASSERT_NEAR(flight.eye().norm(), distance, 1e-9) << i;
    }
    flight.steps(200);
    NavigationInput wheel;
    wheel.wheel = 3;
    flight.step(wheel);
    flight.steps(200);
    EXPECT_NEAR(flight.eye().norm(), distance * std::pow(Navigator::kNearStep, 3), 1e-9);
    for (int i = 0; i < 40; ++i) flight.step(wheel);
    flight.steps(300);
    EXPECT_NEAR(flight.eye().norm(), Navigator::kNearest, 1e-9) << "and no nearer";
}

TEST(Navigator, OrbitsAroundWhatIsGrabbed) {
    Flight flight;
    addBox(flight.faces, Vec3d(2, 1, -3), Vec3d(3, 2, -2));
    flight.step(asking(InputAction::kOrbit));
    NavigationInput grab = asking(InputAction::kGrab);
    grab.pointing = Ray{Vec3d(0, 1.7, 2.4), Vec3d(2.5, -0.2, -4.4)};
    flight.step(grab);
    const Vec3d there = Vec3d(0, 1.7, 2.4) + Vec3d(2.5, -0.2, -4.4);
    const double distance = (flight.eye() - there).norm();
    NavigationInput drag;
    drag.look = Vec2d(0.4, 0.1);
    for (int i = 0; i < 20; ++i) flight.step(drag);
    EXPECT_NEAR((flight.eye() - there).norm(), distance, 1e-9);
    EXPECT_GT((flight.eye() - Vec3d(0, 1.7, 2.4)).norm(), 0.5);
}

TEST(Navigator, ADragThatShiftsTakesTheSceneAlongWithTheHand) {
    Flight flight;
    addBox(flight.faces, Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    flight.view.position = Vec3d(0, -1.7, 2.6);
    flight.step(asking(InputAction::kOrbit));
    const Vec3d from = flight.eye();  // five metres from the middle
    ASSERT_NEAR(from.norm(), 5, 1e-12);
    NavigationInput drag;
    drag.pan = Vec2d(0.1, 0.2);
    flight.step(drag);
    EXPECT_LT((flight.eye() - from - Vec3d(-0.5, 1, 0)).norm(), 1e-9)
        << "a tenth of the distance to the right, a fifth down";
    // What is turned around has gone along.
    const Vec3d centre(-0.5, 1, 0);
    drag = {};
    drag.look = Vec2d(0.3, 0);
    for (int i = 0; i < 10; ++i) {
        flight.step(drag);
        ASSERT_NEAR((flight.eye() - centre).norm(), 5, 1e-9);
    }
}

TEST(Navigator, RollsWhereItIsAskedToAndIsLevelAgain) {
    Flight flight;
    NavigationInput roll;
    roll.roll = 1;
    flight.steps(30, roll);
    EXPECT_LT(headingOf(flight.view.orientation).roll, -0.2) << "to the right";
    EXPECT_NEAR(headingOf(flight.view.orientation).yaw, 0, 1e-9);
    flight.steps(60);
    EXPECT_LT(headingOf(flight.view.orientation).roll, -0.2) << "and stays so";
    flight.step(asking(InputAction::kLevel));
    flight.steps(120);
    EXPECT_NEAR(headingOf(flight.view.orientation).roll, 0, 1e-9);
    EXPECT_FALSE(flight.step());
}

TEST(Navigator, GoesHomeAlongAnEasedWayAndIsThere) {
    Flight flight;
    flight.home.position = Vec3d(10, 20, -30);
    flight.home.orientation = Quatd(Eigen::AngleAxisd(1, Vec3d::UnitY()));
    flight.home.worldUnitsPerMetre = 50;
    flight.steps(30, moving(Vec3d(1, 0, 0)));
    flight.step(asking(InputAction::kHome));
    // Of s = t³ (10 - 15 t + 6 t²) nothing is more than 10 / sqrt(3) in the second derivative.
    const double farAway = (flight.home.world_T_wall() * flight.home.users.front().position - flight.eye()).norm();
    const double most = 1.01 * 10 / std::sqrt(3.0) * farAway * kTick * kTick / (Navigator::kEased * Navigator::kEased);
    double fastest = 0, before = 0;
    Vec3d last = flight.eye();
    for (int i = 0; i < 71; ++i) {
        flight.step();
        const double way = (flight.eye() - last).norm();
        EXPECT_LT(std::abs(way - before), most) << "without a jerk";
        before = way;
        fastest = std::max(fastest, way);
        last = flight.eye();
    }
    EXPECT_EQ(flight.view.position, flight.home.position);
    EXPECT_EQ(flight.view.orientation.coeffs(), flight.home.orientation.coeffs());
    EXPECT_EQ(flight.view.worldUnitsPerMetre, 50);
    EXPECT_TRUE(flight.letGo);
    EXPECT_LT(before, fastest / 10);
    EXPECT_FALSE(flight.step());
    // Whoever steers meanwhile has the wheel.
    flight.steps(30, moving(Vec3d(1, 0, 0)));
    flight.step(asking(InputAction::kHome));
    flight.steps(20);
    flight.steps(20, moving(Vec3d(0, 1, 0)));
    flight.steps(200);
    EXPECT_NE(flight.view.position, flight.home.position);
}

// Where all of the scene is seen may have to be found first: the wall is not home where it happens to stand.
TEST(Navigator, GoesHomeOnceItIsKnownWhereThatIs) {
    Flight flight;
    flight.steps(30, moving(Vec3d(1, 0, 0)));
    flight.steps(200);
    flight.home.position = Vec3d(10, 20, -30);
    bool known = false;
    int asked = 0;
    flight.scene.homeKnown = [&] { return known; };
    flight.scene.home = [&] {
        ++asked;
        return std::optional(known ? flight.home : flight.view);
    };
    const View before = flight.view;
    flight.step(asking(InputAction::kHome));
    flight.steps(300);
    EXPECT_EQ(flight.view.position, before.position);
    EXPECT_FALSE(flight.letGo) << "it is not there";
    EXPECT_FALSE(flight.navigator.idle());
    EXPECT_GT(asked, 0);
    known = true;
    flight.steps(100);
    EXPECT_EQ(flight.view.position, flight.home.position);
    EXPECT_TRUE(flight.letGo);
    EXPECT_TRUE(flight.navigator.idle());
    // Who steers meanwhile, or goes elsewhere, has thought better of it.
    for (const bool steers : {true, false}) {
        known = false;
        flight.step(asking(InputAction::kHome));
        EXPECT_FALSE(flight.navigator.idle());
        View elsewhere = flight.view;
        elsewhere.position.x() += 7;
        steers ? flight.steps(5, moving(Vec3d(0, 1, 0))) : flight.navigator.goTo(elsewhere);
        flight.steps(300);
        known = true;
        const Vec3d there = flight.view.position;
        flight.steps(300);
        EXPECT_EQ(flight.view.position, there);
        EXPECT_TRUE(flight.navigator.idle());
    }
}

TEST(Navigator, AFitFillsTheScreen) {
    Flight flight;
    addBox(flight.faces, Vec3d(100, 200, 300), Vec3d(101, 202, 303));
    flight.view.orientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitY()));
    flight.step(asking(InputAction::kFitAll));
    flight.steps(80);
    EXPECT_NEAR(flight.view.orientation.angularDistance(Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitY()))), 0, 1e-9)
        << "it does not turn";
    // In the wall's frame: the sphere's middle in the middle of the screen, its radius that of a default camera.
    const Vec3d middle = flight.view.world_T_wall().inverse() * Vec3d(100.5, 201, 301.5);
    EXPECT_LT((middle - Vec3d(0, 1.5, 0)).norm(), 1e-9);
    Box box;
    box.extend(Vec3d(100, 200, 300));
    box.extend(Vec3d(101, 202, 303));
    EXPECT_NEAR(flight.view.worldUnitsPerMetre, defaultView(flight.wall, box).worldUnitsPerMetre, 1e-12);
    flight.faces.clear();
    flight.step(asking(InputAction::kFitAll));
    EXPECT_FALSE(flight.step()) << "nothing to be fitted";
}

TEST(Navigator, BookmarksAreKeptAndFound) {
    Flight flight;
    flight.view.position = Vec3d(1, 2, 3);
    NavigationInput keep;
    keep.actions = {static_cast<InputAction>(static_cast<int>(InputAction::kKeep1) + 4)};
    flight.step(keep);
    flight.steps(200, moving(Vec3d(1, 1, 1)));
    NavigationInput back;
    back.actions = {static_cast<InputAction>(static_cast<int>(InputAction::kGoTo1) + 4)};
    flight.step(back);
    flight.steps(80);
    EXPECT_EQ(flight.view.position, Vec3d(1, 2, 3));
    back.actions = {static_cast<InputAction>(static_cast<int>(InputAction::kGoTo1) + 5)};
    EXPECT_FALSE(flight.step(back)) << "nobody has kept that one";
}

TEST(Navigator, WalksAtTheHeightOfItsUser) {
    Flight flight;
    addBox(flight.faces, Vec3d(-500, -10, -500), Vec3d(500, 0, 500));
    flight.view.worldUnitsPerMetre = 10;
    flight.view.position = Vec3d(0, 30, 0);
    flight.step(asking(InputAction::kWalk));
    flight.steps(300);
    EXPECT_NEAR(flight.eye().y(), 17, 0.01) << "1.7 m, at ten units each";
    EXPECT_FALSE(flight.step()) << "who stands, stands";
    const Vec3d from = flight.eye();
    flight.steps(60, moving(Vec3d(0, 0, -1)));
    EXPECT_NEAR(flight.eye().y(), 17, 0.01);
    EXPECT_LT(flight.eye().z(), from.z() - 15);
    // A wall in the scene stops who steps aside in the room.
    flight.steps(200);
    addBox(flight.faces, Vec3d(flight.eye().x() + 5, -10, -500), Vec3d(flight.eye().x() + 6, 100, 500));
    const double wall = flight.eye().x() + 5;
    for (int i = 0; i < 60; ++i) {
        flight.view.users.front().position.x() += 0.02;
        flight.step();
    }
    EXPECT_LT(flight.eye().x(), wall - 2);
    EXPECT_GT(flight.eye().x(), wall - 3);
    EXPECT_NEAR(flight.eye().y(), 17, 0.01);
}

/// Whatever anybody does with keys, mice and wands, in any mode: a view that can be, without a NaN; and twice the same.
/// Stairs and slopes are gone up, and walls stood before, in frames of any length.
TEST(Navigator, StairsAndWallsAreTheSameInLongFrames) {
    for (const double seconds : {1.0 / 200, kTick, 0.1, 0.25, 0.5, 0.6}) {
        Flight flight;
        addBox(flight.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
        for (int i = 0; i < 20; ++i)
            addBox(flight.faces, Vec3d(-2, -0.5, -3 - 0.28 * (i + 1)), Vec3d(2, 0.17 * (i + 1), -3 - 0.28 * i));
        addBox(flight.faces, Vec3d(-2, -0.5, -16), Vec3d(2, 0.17 * 20, -8.6));
        addBox(flight.faces, Vec3d(-2, 0, -16), Vec3d(2, 9, -15));
        flight.view.position = Vec3d(0, 0, -flight.view.users.front().position.z());
        flight.step(asking(InputAction::kWalk), seconds);
        for (double passed = 0; passed < 14; passed += seconds) flight.step(moving(Vec3d(0, 0, -1)), seconds);
        EXPECT_NEAR(flight.eye().z(), -15 + 0.25, 1e-3) << seconds;
        EXPECT_NEAR(flight.eye().y(), 0.17 * 20 + flight.view.users.front().position.y(), 1e-3) << seconds;
    }
}

TEST(Navigator, WhateverIsDoneTheViewIsOne) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    SCOPED_TRACE(
        testing::Message() << "TESSERA_SEED=" << seed
                           << " build/bin/unit_navigation --gtest_filter=Navigator.WhateverIsDoneTheViewIsOne");
    const double inf = std::numeric_limits<double>::infinity();
    for (unsigned round = 0; round < 30; ++round) {
        std::mt19937 random(seed + round);
        const auto number = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
        std::array<Flight, 2> flights;
        Box box;
        box.extend(Vec3d(-6, 0, -6));
        box.extend(Vec3d(6, 4, 6));
        flights[0].faces = flights[1].faces = roomOf(box, 3, random);
        for (int i = 0; i < 10; ++i)
            flights[0].faces.push_back({Vec3d(number(-6, 6), number(0, 3), number(-6, 6)),
                                        Vec3d(number(-6, 6), number(0, 3), number(-6, 6)),
                                        Vec3d(number(-6, 6), number(0, 3), number(-6, 6))});
        flights[1].faces = flights[0].faces;
        for (int frame = 0; frame < 600; ++frame) {
            NavigationInput input;
            const double size = number(0, 1) < 0.02 ? std::pow(10.0, number(-300, 300)) : number(0, 1) < 0.5 ? 1 : 0;
            input.move = size * Vec3d(number(-2, 2), number(-2, 2), number(-2, 2));
            input.turn = size * Vec2d(number(-2, 2), number(-2, 2));
            if (number(0, 1) < 0.1) input.roll = number(-2, 2);
            if (number(0, 1) < 0.3) input.look = Vec2d(number(-16, 16), number(-16, 16));
            if (number(0, 1) < 0.3) input.pan = Vec2d(number(-16, 16), number(-16, 16));
            if (number(0, 1) < 0.2) input.wheel = number(-16, 16);
            input.faster = number(0, 1) < 0.5;
            if (number(0, 1) < 0.1) input.actions.push_back(static_cast<InputAction>(random() % kInputActions));
            if (number(0, 1) < 0.5) input.pointing = Ray{Vec3d(0, 1.7, 2.4), Vec3d(number(-1, 1), number(-1, 1), -1)};
            if (number(0, 1) < 0.002) input.move.x() = number(0, 1) < 0.5 ? inf : std::nan("");
            if (number(0, 1) < 0.01)
                for (Flight& flight : flights) flight.view.users.front().position.x() = frame % 7 * 0.1;
            if (number(0, 1) < 0.005) {
                const Vec3d place = std::pow(10.0, number(-3, 14)) * Vec3d(number(-1, 1), number(-1, 1), number(-1, 1));
                for (Flight& flight : flights) {
                    flight.view.position = place;
                    flight.view.worldUnitsPerMetre = 1;
                    flight.navigator.placed();
                }
            }
            for (Flight& flight : flights) (void)flight.step(input);
            ASSERT_TRUE(checkStand(flights[0].view))
                << "round " << round << ", frame " << frame << ": " << checkStand(flights[0].view).error().message;
            ASSERT_NEAR(flights[0].view.orientation.norm(), 1, 1e-12);
            ASSERT_EQ(flights[0].view.position, flights[1].view.position);
            ASSERT_EQ(flights[0].view.orientation.coeffs(), flights[1].view.orientation.coeffs());
            ASSERT_EQ(flights[0].view.worldUnitsPerMetre, flights[1].view.worldUnitsPerMetre);
        }
    }
}

TEST(Navigator, HeadingsAreOrientations) {
    std::mt19937 random(9);
    std::uniform_real_distribution<double> any(-1, 1);
    for (int i = 0; i < 20'000; ++i) {
        const Quatd q = Quatd(any(random), any(random), any(random), any(random)).normalized();
        ASSERT_LT(orientationOf(headingOf(q)).angularDistance(q), 1e-7);
    }
    for (const double pitch : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
        const Quatd q = orientationOf({.yaw = 0.8, .pitch = pitch});
        EXPECT_LT(orientationOf(headingOf(q)).angularDistance(q), 1e-6) << "straight up, straight down";
    }
}

}  // namespace
}  // namespace tessera
