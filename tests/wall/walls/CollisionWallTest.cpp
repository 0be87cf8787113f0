/// A person pushes an engine through the hall, on a wall: it stops where it touches, everybody is
/// told, and the picture shows it.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

// From deploy/scenes/engine-hall.tsct, along x: the trolley's buffers reach 0.95 + 0.04 ahead of it; the braces of the
// crates in its way begin at 3.1 - 0.528 - 0.02.
constexpr double kTrolleyAtTheCrates = (3.1 - 0.528 - 0.02) - (0.95 + 0.04);
// How far from the obstacle a motion may end: 1e-4 sizes of the moving geometry, none of which is 3 m large.
constexpr double kTrolleyTolerance = 3e-4;

/// The hall on a wall, its crane stopped and the onlooker's walk not followed, so that pictures change by the trolley
/// alone.
class Hall : public AskedWall {
public:
    explicit Hall(const std::string& wallName)
        : AskedWall({.wall = wallName,
                     .scene = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/engine-hall.tsct",
                     .server = {"--assets", kModels}}) {
        tell({"move", "/hall/crane", "0.1", "0", "0"});
        tell({"view", "--position", "-7.5", "0.5", "2.2", "--look-at", "2", "0", "-0.2"});
    }
    [[nodiscard]] Moved moveTrolley(const std::string& x, const std::string& z) {
        return move("/hall/trolley", {x, "0", z});
    }
    [[nodiscard]] Moved pushTrolley(const std::string& x) { return move("/hall/trolley", {x, "0", "0", "--by"}); }
};

TEST(CollisionWall, APushedEngineStopsWhereItTouchesAndTheWallShowsIt) {
    if (engineIsMissing()) GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    Hall::Moved pushed;
    Picture touching;
    {
        Hall hall("2x2");
        const Picture before = hall.settledPicture();
        ASSERT_EQ(before.widthPx, 320);
        EXPECT_TRUE(hall.contacts().empty());

        pushed = hall.pushTrolley("12");
        EXPECT_TRUE(pushed.stopped);
        EXPECT_LE(pushed.place.x(), kTrolleyAtTheCrates + 1e-7) << "not into the crates";
        EXPECT_GE(pushed.place.x(), kTrolleyAtTheCrates - kTrolleyTolerance) << "up to the crates";
        EXPECT_EQ(pushed.place.z(), 0.15);
        const json contacts = hall.contacts();
        ASSERT_FALSE(contacts.empty());
        for (const json& contact : contacts) {
            EXPECT_TRUE(between(contact, "/hall/trolley/cart/buffer", "/hall/crates/stack/crate")) << contact.dump(2);
            EXPECT_NEAR(contact["point"][0].get<double>(), 3.1 - 0.528 - 0.02, 2 * kTrolleyTolerance)
                << contact.dump(2);
        }
        touching = hall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(before, touching), 320u * 180u / 50) << "the trolley is elsewhere";

        // Who pushes on gets no further.
        for (int push = 0; push < 3; ++push) {
            const Hall::Moved again = hall.pushTrolley("0.4");
            EXPECT_TRUE(again.stopped);
            EXPECT_LE(again.place.x(), kTrolleyAtTheCrates + 1e-7);
            EXPECT_GE(again.place.x(), pushed.place.x() - 1e-9);
        }
        // Away again it is free, and the picture is as it was.
        const Hall::Moved back = hall.moveTrolley("-4.6", "0.15");
        EXPECT_FALSE(back.stopped);
        EXPECT_EQ(back.place.x(), -4.6);
        EXPECT_TRUE(hall.contacts().empty());
        EXPECT_EQ(pixelsThatDiffer(before, hall.settledPicture()), 0u);
        // The same push leads to the same place.
        const Hall::Moved same = hall.pushTrolley("12");
        EXPECT_EQ(same.place.x(), pushed.place.x());
        EXPECT_EQ(pixelsThatDiffer(touching, hall.settledPicture()), 0u);

        const json report = hall.finish();
        ASSERT_FALSE(report.is_null());
        EXPECT_GE(report["collision"]["contacts"].get<int>(), 2) << "it began to touch twice";
        const json& last = report["collision"]["contact_list"];
        ASSERT_FALSE(last.empty());
        EXPECT_TRUE(between(last[0], "/hall/trolley/cart/buffer", "/hall/crates/stack/crate")) << last[0].dump(2);
    }
    // One big picture of the same state, from a wall of one tile that was pushed in the same way.
    Hall hall("1x1");
    EXPECT_EQ(hall.pushTrolley("12").place.x(), pushed.place.x());
    EXPECT_EQ(pixelsThatDiffer(touching, hall.settledPicture()), 0u);
}

TEST(CollisionWall, PushedAsideItsEngineStopsAtTheNextEngine) {
    if (engineIsMissing()) GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    Hall hall("2x2");
    EXPECT_FALSE(hall.moveTrolley("-7", "0.15").stopped);
    const Hall::Moved pushed = hall.moveTrolley("-7", "3");
    EXPECT_TRUE(pushed.stopped);
    // The row's engine is 2.6 m long and stands at z = 4.1, with a few centimetres of screws.
    EXPECT_GT(pushed.place.z(), 1.4);
    EXPECT_LT(pushed.place.z(), 1.6);
    const json contacts = hall.contacts();
    ASSERT_FALSE(contacts.empty());
    for (const json& contact : contacts)
        EXPECT_TRUE(between(contact, "/hall/trolley/cart/turn/engine", "/hall/right row/machine[0]/turn/engine"))
            << contact.dump(2);
    const Hall::Moved back = hall.moveTrolley("-7", "0.15");
    EXPECT_FALSE(back.stopped);
    EXPECT_TRUE(hall.contacts().empty());
}

}  // namespace
}  // namespace tessera::simulation
