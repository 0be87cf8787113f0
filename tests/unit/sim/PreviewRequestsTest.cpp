// Small pictures again and again: each who looks is told what is new to it, and hosts are asked while somebody does.
#include "server/sim/desk/PreviewRequests.h"

#include <gtest/gtest.h>

#include "common/codec/ApplicationCodec.h"
#include "server/sim/desk/WallPlans.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

/// Hosts a and b draw a tile each.
Wall wallOfTwo() {
    Wall wall = test::wallOfOne();
    wall.screens[0].grid.columns = 2;
    wall.hosts = {{"a", {{"front", 0, 0, Eye::kCenter, "viewer"}}}, {"b", {{"front", 1, 0, Eye::kCenter, "viewer"}}}};
    return wall;
}

class PreviewRequestsTest : public testing::Test {
protected:
    void ask(ConnectionId who, std::uint64_t after, std::uint32_t shrink = 2) {
        server.take(requests.ask({.connection = who, .request = ++asked}, shrink, after, server.now));
    }
    void sends(const std::string& host, const std::string& tile, std::string_view picture, std::uint64_t number) {
        server.take(requests.imageReceived({host, message::TileImage{.request = number,
                                                                     .frame = frame,
                                                                     .tile = tile,
                                                                     .same = picture.empty(),
                                                                     .picture = textBytes(picture)}},
                                           server.now));
    }
    /// What both show, in answer to the newest question; empty: the same as before.
    void bothSend(std::string_view left, std::string_view right) {
        const std::uint64_t number = questions().back().request;
        sends("a", "front-0-0", left, number);
        sends("b", "front-1-0", right, number);
    }
    [[nodiscard]] std::vector<message::ImageRequest> questions() const { return server.sent<message::ImageRequest>(a); }
    /// The answers of this one so far, the tiles in them as "front-0-0=left".
    [[nodiscard]] std::vector<std::vector<std::string>> told(ConnectionId who) {
        std::vector<std::vector<std::string>> all;
        for (const auto& reply : server.sent<message::Reply>(who)) {
            const auto preview = std::get<answer::Preview>(decodeAnswer(reply.body).value());
            stamp[who] = preview.stamp;
            missing = preview.missing;
            std::vector<std::string> tiles;
            for (const answer::TilePreview& tile : preview.tiles)
                tiles.push_back(tile.tile + "=" + std::string(asText(tile.jpeg)));
            all.push_back(tiles);
        }
        return all;
    }
    void pass(std::chrono::milliseconds time) {
        server.now += time;
        server.take(requests.advance(server.now));
    }

    using Tiles = std::vector<std::string>;
    const Wall wall = wallOfTwo();
    ServerFixture server;
    PreviewRequests requests{wall, server.session};
    ConnectionId a = server.join("a"), b = server.join("b");
    ConnectionId page = server.hello("page", PeerRole::kApplication);
    ConnectionId other = server.hello("other", PeerRole::kApplication);
    FrameNumber frame = server.begin();
    std::map<ConnectionId, std::uint64_t> stamp;
    std::vector<std::string> missing;
    std::uint64_t asked = 0;
};

TEST_F(PreviewRequestsTest, EachAnswerIsWhatHasChangedSinceTheLast) {
    ask(page, 0);
    ASSERT_EQ(questions().size(), 1u);
    EXPECT_FALSE(questions()[0].news) << "hosts know nothing of this size yet";
    bothSend("l1", "r1");
    EXPECT_EQ(told(page).back(), (Tiles{"front-0-0=l1", "front-1-0=r1"}));
    ask(page, stamp[page]);
    EXPECT_EQ(questions().size(), 1u) << "no sooner than the pace";
    pass(66ms);
    ASSERT_EQ(questions().size(), 2u);
    EXPECT_TRUE(questions()[1].news);
    bothSend("", "r2");
    EXPECT_EQ(told(page).back(), Tiles{"front-1-0=r2"});
    ask(page, stamp[page]);
    pass(66ms);
    bothSend("", "");
    EXPECT_EQ(told(page).size(), 2u) << "nothing is new: it waits";
    pass(5s);
    EXPECT_EQ(told(page).back(), Tiles{}) << "and is told that the wall is there";
}

TEST_F(PreviewRequestsTest, WhoLookAtOneSizeShareAQuestionAndNobodyWaitsForTheSlowest) {
    ask(page, 0);
    ask(other, 0);
    EXPECT_EQ(questions().size(), 1u);
    bothSend("l1", "r1");
    EXPECT_EQ(told(page).size() + told(other).size(), 2u);
    for (int i = 2; i < 5; ++i) {  // the other one reads no more
        ask(page, stamp[page]);
        pass(66ms);
        bothSend("l" + std::to_string(i), "");
    }
    EXPECT_EQ(told(page).size(), 4u);
    EXPECT_EQ(told(other).size(), 1u);
    ask(other, stamp[other]);
    EXPECT_EQ(told(other).back(), Tiles{"front-0-0=l4"}) << "the newest, at once";
}

TEST_F(PreviewRequestsTest, WhileNobodyLooksNobodyIsAsked) {
    ask(page, 0);
    bothSend("l", "r");
    const std::size_t before = questions().size();
    for (int i = 0; i < 100; ++i) pass(100ms);
    EXPECT_EQ(questions().size(), before);
    EXPECT_EQ(requests.nextDeadline(), TimePoint::max()) << "what was kept is forgotten";
    ask(page, stamp[page]);
    EXPECT_FALSE(questions().back().news) << "all is to come anew";
}

TEST_F(PreviewRequestsTest, ASlowTileKeepsTheOthersFromNobodyAndIsTakenWhenItComes) {
    ask(page, 0);
    const std::uint64_t first = questions().back().request;
    sends("a", "front-0-0", "l1", first);
    EXPECT_TRUE(told(page).empty());
    pass(250ms);
    EXPECT_EQ(told(page).back(), Tiles{"front-0-0=l1"});
    ask(page, stamp[page]);
    sends("b", "front-1-0", "r1", first);
    bothSend("", "");
    EXPECT_EQ(told(page).back(), Tiles{"front-1-0=r1"});
}

TEST_F(PreviewRequestsTest, TheSameBytesAreNoNews) {
    ask(page, 0);
    bothSend("l", "sky");
    ASSERT_EQ(told(page).size(), 1u);
    ask(page, stamp[page]);
    pass(66ms);
    bothSend("l2", "sky");
    EXPECT_EQ(told(page).back(), Tiles{"front-0-0=l2"});
}

TEST_F(PreviewRequestsTest, OfATileItsOwnHostSaysWhatItShowsAndWhatIsHugeIsLeftOut) {
    ask(page, 0);
    const std::uint64_t number = questions().back().request;
    sends("b", "front-0-0", "a lie", number);
    sends("b", "front-1-0", std::string(PreviewRequests::kMostBytes + 1, 'x'), number);
    sends("a", "front-0-0", "l", number);
    EXPECT_EQ(told(page).back(), Tiles{"front-0-0=l"});
}

TEST_F(PreviewRequestsTest, AStampOfAnEarlierServerMeansAll) {
    ask(page, 0);
    bothSend("l", "r");
    ask(other, 4'711);
    EXPECT_EQ(told(other).back().size(), 2u) << "at once: nothing is under way";
}

TEST_F(PreviewRequestsTest, NoMoreSizesThanAFewAreMadeAtATime) {
    for (const std::uint32_t shrink : {1u, 2u, 8u, 16u, 64u, 4u}) ask(page, 0, shrink);
    std::set<std::uint32_t> sizes;
    for (const auto& question : questions()) sizes.insert(question.shrink);
    EXPECT_EQ(sizes, (std::set<std::uint32_t>{1, 2, 8}));
    EXPECT_EQ(requests.openCount(page), 6u);
    requests.applicationLeft(page);
    EXPECT_EQ(requests.openCount(page), 0u);
}

TEST_F(PreviewRequestsTest, TilesOfHostsThatAreNotThereAreNamed) {
    server.drop(b);
    ask(page, 0);
    sends("a", "front-0-0", "l", questions().back().request);
    EXPECT_EQ(told(page).back(), Tiles{"front-0-0=l"});
    EXPECT_EQ(missing, std::vector<std::string>{"front-1-0"});
}

TEST(WallPlans, TilesLieWhereTheyAreOnTheirScreens) {
    Wall wall = wallOfTwo();
    Screen& screen = wall.screens[0];
    screen.grid.rows = 2;
    screen.grid.bezelXPx = 40;
    screen.grid.bezelYPx = 20;
    wall.hosts[1].tiles[0].row = 1;
    const answer::WallPlan plan = planOf(wall, nullptr);
    EXPECT_FALSE(plan.position || plan.orientation || plan.worldUnitsPerMetre);
    ASSERT_EQ(plan.tiles.size(), 2u);
    const answer::TilePlan &lower = plan.tiles[0], &upper = plan.tiles[1];
    EXPECT_EQ(lower.x, 0u);
    EXPECT_EQ(lower.y, lower.height + 20);
    EXPECT_EQ(upper.x, lower.width + 40);
    EXPECT_EQ(upper.y, 0u);
    EXPECT_EQ(plan.screens[0].mosaicWidth, lower.width + upper.width);
    EXPECT_EQ(plan.screens[0].mosaicHeight, lower.height + upper.height);
    EXPECT_EQ((std::array{lower.mosaicX, lower.mosaicY, upper.mosaicX, upper.mosaicY}),
              (std::array{0u, lower.height, lower.width, 0u}));
    EXPECT_TRUE(lower.lowerLeft.isApprox(screen.lowerLeft));
    const Vec3d upperRight = upper.lowerRight + (upper.upperLeft - upper.lowerLeft);
    EXPECT_TRUE(upperRight.isApprox(screen.lowerRight + (screen.upperLeft - screen.lowerLeft)));
}

TEST(WallPlans, RaysMadeOfAPlanAreThoseOfPicks) {
    Wall wall = wallOfTwo();
    wall.hosts[0].tiles[0].eye = Eye::kLeft;
    View view;
    view.position = Vec3d(3, -4, 5);
    view.orientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized()));
    view.worldUnitsPerMetre = 2.5;
    view.users = wall.users;
    view.users[0].position += Vec3d(0.3, -0.2, 0.4);  // where a tracker sees the head
    const answer::WallPlan plan = planOf(wall, &view);
    ASSERT_TRUE(plan.position && plan.orientation && plan.worldUnitsPerMetre);
    View told;
    told.position = *plan.position;
    told.orientation = *plan.orientation;
    told.worldUnitsPerMetre = *plan.worldUnitsPerMetre;
    const std::vector<Tile> tiles = layoutTiles(wall);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const answer::TilePlan& tile = plan.tiles[i];
        const Expected<Ray> ray = pickRay(wall, view, tiles[i].mosaicRect.x + 5, 7);
        ASSERT_TRUE(ray);
        const Vec3d onScreen = tile.upperLeft + 5.5 / tile.width * (tile.lowerRight - tile.lowerLeft) +
                               7.5 / tile.height * (tile.lowerLeft - tile.upperLeft);
        const Vec3d eye = told.world_T_wall() * tile.seenFrom;
        EXPECT_TRUE(eye.isApprox(ray->origin, 1e-12));
        EXPECT_TRUE((told.world_T_wall() * onScreen - eye).normalized().isApprox(ray->direction, 1e-12));
    }
    EXPECT_FALSE(plan.tiles[0].seenFrom.isApprox(plan.tiles[1].seenFrom)) << "one is drawn for the left eye";
}

}  // namespace
}  // namespace tessera
