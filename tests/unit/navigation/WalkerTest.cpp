// Who walks: never to the other side of a wall; on the ground, up steps, along walls.
#include <gtest/gtest.h>

#include <array>

#include "tests/unit/navigation/Rooms.h"

namespace tessera {
namespace {

constexpr double kFrame = 1.0 / 60;
constexpr double kEyes = 1.7;

/// TESSERA_SEED repeats a run.
unsigned seedOf() {
    const char* given = std::getenv("TESSERA_SEED");
    return given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
}

struct Stroll {
    std::vector<Triangle> faces;
    Surroundings around = surroundingsOf(faces);
    Walker walker{Navigation{}};

    bool stand(const Vec3d& eye, double scale = 1) { return walker.standAt(eye, kEyes, scale, around); }
    void go(const Vec3d& metresPerSecond, int frames) {
        for (int i = 0; i < frames; ++i) (void)walker.step(kFrame * metresPerSecond, kEyes, kFrame, around);
    }
    [[nodiscard]] double feet() const { return walker.eye().y() / walker.scale() - walker.height(); }
};

/// Rooms wall to wall, with boxes and plates in them, turned and scaled; whoever begins in one ends in it, however he
/// runs, ducks and is thrown about.
TEST(Walker, IsNeverOnTheOtherSideOfAWall) {
    const unsigned seed = seedOf();
    SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                    << " build/bin/unit_navigation --gtest_filter=Walker.IsNeverOnTheOtherSideOfAWall");
    std::mt19937 random(seed);
    const auto number = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    int moved = 0;
    for (int house = 0; house < 30; ++house) {
        const double scale = std::pow(10.0, number(-6, 6));
        const Vec3d far = house % 3 == 0 ? Vec3d(scale * 1e4 * Vec3d(number(-1, 1), number(-1, 1), number(-1, 1)))
                                         : Vec3d(Vec3d::Zero());
        const Quatd turn =
            house % 2 == 0 ? Quatd(Eigen::AngleAxisd(number(0, 7), Vec3d::UnitY()))
                           : Quatd(Eigen::AngleAxisd(number(-0.6, 0.6),
                                                     Vec3d(number(-1, 1), number(-1, 1), number(-1, 1)).normalized()));
        const auto placed = [&](const Vec3d& p) { return Vec3d(far + scale * (turn * p)); };
        std::vector<std::vector<Triangle>> rooms;
        std::vector<Vec3d> starts;
        Stroll stroll;
        const double width = number(1.5, 8), height = number(2.2, 4);
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) {
                Box box;
                box.lower = Vec3d(i * width, 0, j * width);
                box.upper = box.lower + Vec3d(width, height, width);
                std::vector<Triangle> room = roomOf(box, 1 + static_cast<int>(random() % 4), random);
                for (Triangle& t : room)
                    for (Vec3d& corner : t) corner = placed(corner);
                starts.push_back(placed(box.lower + Vec3d(0.5 * width, 1.75, 0.5 * width)));
                for (const Triangle& t : room) stroll.faces.push_back(t);
                rooms.push_back(std::move(room));
                // Plates that lean about.
                for (int k = 0; k < 3; ++k) {
                    Triangle t;
                    for (Vec3d& corner : t)
                        corner = placed(box.lower + Vec3d(number(0, width), number(0, 1.2), number(0, width)));
                    stroll.faces.push_back(t);
                }
            }
        for (std::size_t r = 0; r < rooms.size(); ++r) {
            stroll.stand(starts[r], scale);
            // A plate may stand where he does; he is judged from where he stands freely.
            // From many frames a second to the longest that counts, though a navigator makes strides of it.
            const double seconds = std::array{kFrame, 1.0 / 200, 0.25, 0.6}[random() % 4];
            Vec3d wish = Vec3d::Zero();
            for (int frame = 0; frame < 300; ++frame) {
                if (frame % 12 == 0)
                    wish = Vec3d(number(-1, 1), number(-1, 1), number(-1, 1)) * std::pow(10.0, number(-4, 1));
                if (frame % 40 == 0 && number(0, 1) < 0.3) wish *= 1e9;
                const double eyes = number(0, 1) < 0.1 ? number(0.1, 2.2) : kEyes;
                const Vec3d before = stroll.walker.eye();
                const Vec3d eye = stroll.walker.step(wish, eyes, seconds, stroll.around);
                ASSERT_TRUE(eye.allFinite());
                moved += eye != before;
                for (std::size_t other = 0; other < rooms.size(); ++other)
                    ASSERT_NEAR(windingNumber(rooms[other], eye), other == r ? 1 : 0, 0.01)
                        << "house " << house << ", room " << r << " seen from " << other << ", frame " << frame
                        << " of " << seconds << " s, scale " << scale;
            }
        }
    }
    EXPECT_GT(moved, 15'000);
}

TEST(Walker, FallsAsThingsFallAndStandsWhereTheyEnd) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    stroll.stand(Vec3d(0, 20 + kEyes, 0));
    for (int n = 1; n < 100; ++n) {
        stroll.go(Vec3d::Zero(), 1);
        ASSERT_NEAR(stroll.feet(), 20 - 9.81 * kFrame * kFrame * n * (n + 1) / 2, 1e-9) << n;
    }
    stroll.go(Vec3d::Zero(), 200);
    EXPECT_NEAR(stroll.feet(), 0, 2e-4);
    const Vec3d there = stroll.walker.eye();
    stroll.go(Vec3d::Zero(), 100);
    EXPECT_EQ(stroll.walker.eye(), there) << "who stands still stands still";
}

TEST(Walker, GoesAsFarAsItIsToldOnTheLevel) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    stroll.stand(Vec3d(0, kEyes, 0));
    stroll.go(Vec3d(1.4, 0, -0.7), 600);
    EXPECT_NEAR(stroll.walker.eye().x(), 14, 1e-9);
    EXPECT_NEAR(stroll.walker.eye().z(), -7, 1e-9);
    EXPECT_NEAR(stroll.feet(), 0, 2e-4);
}

TEST(Walker, GoesUpStepsAndNotUpBlocks) {
    for (const double rise : {0.05, 0.2, 0.35, 0.45, 0.8}) {
        Stroll stroll;
        addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
        addBox(stroll.faces, Vec3d(-5, -0.5, -30), Vec3d(5, rise, -3));
        stroll.stand(Vec3d(0, kEyes, 0));
        stroll.go(Vec3d(0, 0, -1.4), 300);
        if (rise <= 0.4) {
            EXPECT_NEAR(stroll.walker.eye().z(), -7, 1e-6) << rise;
            EXPECT_NEAR(stroll.feet(), rise, 2e-4);
        } else {
            EXPECT_NEAR(stroll.walker.eye().z(), -3 + 0.25, 0.26) << rise << ": at the block";
            EXPECT_LT(stroll.feet(), 0.05);
        }
    }
}

TEST(Walker, StairsGoUpAndDown) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    for (int i = 0; i < 20; ++i)
        addBox(stroll.faces, Vec3d(-2, -0.5, -3 - 0.28 * (i + 1)), Vec3d(2, 0.17 * (i + 1), -3 - 0.28 * i));
    stroll.stand(Vec3d(0, kEyes, 0));
    stroll.go(Vec3d(0, 0, -1.4), 60 * 6);
    EXPECT_NEAR(stroll.walker.eye().z(), -8.4, 1e-6);
    EXPECT_NEAR(stroll.feet(), 0.17 * 20, 2e-4);
    stroll.go(Vec3d(0, 0, 1.4), 60 * 6);
    EXPECT_NEAR(stroll.walker.eye().z(), 0, 1e-6);
    EXPECT_NEAR(stroll.feet(), 0, 2e-4);
}

TEST(Walker, SlopesToAPoint) {
    for (const double degrees : {10.0, 30.0, 45.0, 60.0, 75.0}) {
        const double angle = degrees * std::numbers::pi / 180;
        Stroll stroll;
        addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
        const Vec3d along(0, std::sin(angle), -std::cos(angle));
        stroll.faces.push_back({Vec3d(-20, 0, -2), Vec3d(20, 0, -2), Vec3d(Vec3d(0, 0, -2) + 60 * along)});
        stroll.stand(Vec3d(0, kEyes, 0));
        stroll.go(Vec3d(0, 0, -1.4), 240);
        if (degrees < 50) {
            EXPECT_NEAR(stroll.walker.eye().z(), -5.6, 1e-6) << degrees;
            EXPECT_NEAR(stroll.feet(), std::tan(angle) * 3.6, 0.15) << degrees;
        } else {
            EXPECT_LT(stroll.feet(), 0.5) << degrees << ": too steep";
        }
    }
}

TEST(Walker, SlidesAlongAWall) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    addBox(stroll.faces, Vec3d(-50, -1, -4), Vec3d(50, 5, -3));
    stroll.stand(Vec3d(0, kEyes, 0));
    stroll.go(Vec3d(1, 0, -1), 60 * 10);
    EXPECT_NEAR(stroll.walker.eye().z(), -2.75, 1e-4);
    EXPECT_NEAR(stroll.walker.eye().x(), 10, 1e-3);
}

TEST(Walker, WithNothingBelowStandsOnTheHeightItHas) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-5, -1, -5), Vec3d(5, 0, 5));
    stroll.stand(Vec3d(0, kEyes, 0));
    stroll.go(Vec3d(0, 0, -2), 60 * 10);
    EXPECT_NEAR(stroll.walker.eye().z(), -20, 1e-9);
    EXPECT_GT(stroll.feet(), -1.5);
}

/// A lift: what moves under the feet takes along who stands on it; a wall that comes pushes, and one in which somebody
/// is lets him out.
TEST(Walker, WhatMovesTakesItAlongAndWhoIsStuckGetsOut) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-5, -1, -5), Vec3d(5, 0, 5));
    stroll.stand(Vec3d(0, kEyes, 0));
    for (int i = 0; i < 120; ++i) {
        for (Triangle& t : stroll.faces)
            for (Vec3d& corner : t) corner.y() += 1.0 / 60;
        stroll.go(Vec3d::Zero(), 1);
    }
    EXPECT_NEAR(stroll.feet(), 2, 0.05);
    // A thick block from the side pushes as fast as one gets out.
    Stroll pushed;
    addBox(pushed.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    addBox(pushed.faces, Vec3d(-3, 0.1, -2), Vec3d(-2, 4, 2));
    pushed.stand(Vec3d(0, kEyes, 0));
    for (int i = 0; i < 240; ++i) {
        for (std::size_t k = 12; k < pushed.faces.size(); ++k)
            for (Vec3d& corner : pushed.faces[k]) corner.x() += 1.0 / 60;
        pushed.go(Vec3d::Zero(), 1);
    }
    EXPECT_NEAR(pushed.walker.eye().x(), 2 + 0.25, 0.02);
    Stroll stuck;
    addBox(stuck.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    stuck.faces.push_back({Vec3d(-3, 1, -3), Vec3d(3, 1, -3), Vec3d(0, 1, 3)});  // a plate through his middle
    stuck.stand(Vec3d(0, kEyes, 0));
    stuck.go(Vec3d(0, 0, -3), 60 * 4);
    EXPECT_LT(stuck.walker.eye().z(), -8);
}

TEST(Walker, DucksAndFitsUnderWhatIsLow) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-50, -1, -50), Vec3d(50, 0, 50));
    addBox(stroll.faces, Vec3d(-5, 1.5, -6), Vec3d(5, 3, -2));  // a beam
    stroll.stand(Vec3d(0, kEyes, 0));
    stroll.go(Vec3d(0, 0, -1.4), 300);
    EXPECT_GT(stroll.walker.eye().z(), -2) << "he is too tall";
    for (int i = 0; i < 150; ++i) (void)stroll.walker.step(kFrame * Vec3d(0, 0, -1.4), 1.0, kFrame, stroll.around);
    EXPECT_LT(stroll.walker.eye().z(), -2.5) << "and not with his head down";
    stroll.go(Vec3d::Zero(), 60);
    EXPECT_NEAR(stroll.walker.height(), 1.25, 2e-3) << "under the beam there is no more room";
    stroll.go(Vec3d(0, 0, -1.4), 400);
    EXPECT_LT(stroll.walker.eye().z(), -6);
    EXPECT_NEAR(stroll.walker.height(), kEyes, 1e-9);
}

TEST(Walker, SameCallsSamePlaces) {
    std::mt19937 random(7);
    Box box;
    box.extend(Vec3d(-4, 0, -4));
    box.extend(Vec3d(4, 3, 4));
    Stroll one, two;
    one.faces = two.faces = roomOf(box, 4, random);
    one.stand(Vec3d(0, 1.8, 0));
    two.stand(Vec3d(0, 1.8, 0));
    for (int i = 0; i < 500; ++i) {
        const Vec3d way(std::sin(0.1 * i) * 9, 0, std::cos(0.07 * i) * 9);
        one.go(way, 1);
        two.go(way, 1);
        ASSERT_EQ(one.walker.eye(), two.walker.eye());
    }
}

TEST(Walker, WhereNobodySeesWhatIsThereNobodyWalks) {
    Stroll stroll;
    addBox(stroll.faces, Vec3d(-5, -1, -5), Vec3d(5, 0, 5));
    stroll.stand(Vec3d(0, kEyes, 0));
    stroll.around.facesIn = [](const Box&, std::vector<Triangle>&) { return false; };
    stroll.go(Vec3d(1, 0, 0), 10);
    EXPECT_EQ(stroll.walker.eye(), Vec3d(0, kEyes, 0));
    stroll.stand(Vec3d(1e15, kEyes, 0));
    stroll.go(Vec3d(1, 0, 0), 10);
    EXPECT_EQ(stroll.walker.eye(), Vec3d(1e15, kEyes, 0)) << "a metre is less than numbers can tell there";
}

}  // namespace
}  // namespace tessera
