/// Pictures of which neighbours draw parts, beside pictures that one renderer draws whole.
#include "client/replica/PartSharing.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <future>
#include <random>
#include <thread>

#include "common/codec/WallCodec.h"
#include "tests/golden/TestScene.h"
#include "tests/support/surface/PooledSurface.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

/// Two hosts, a tile each, of two cells: large enough for parts, and their edges on no grid.
Wall twoTiles() {
    Wall wall;
    wall.name = "two";
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 1.6, 0};
    screen.grid = {.columns = 2, .rows = 1, .tileWidthPx = 610, .tileHeightPx = 300};
    wall.screens = {screen};
    wall.users = {User{.name = "viewer"}};
    for (int column = 0; column < 2; ++column)
        wall.hosts.push_back({.name = column ? "right" : "left",
                              .tiles = {{.screen = "front", .column = column, .row = 0, .user = "viewer"}}});
    wall.samples = 4;
    return wall;
}

Aspect makeScene() {
    test::TestScene scene;
    Material glass;
    glass.baseColor = {0.4f, 0.7f, 1, 0.5f};
    glass.alphaMode = Material::kBlend;
    const ObjectId see = scene.add(glass);
    const ObjectId ball = scene.add(makeSphere(0.3, 24)), pane = scene.add(makeBox({0.5, 0.5, 0.02}), see);
    for (int i = 0; i < 8; ++i) {
        scene.place(ball, {0.4 * i - 1.5, 0.9 + 0.05 * i, -1});
        scene.place(pane, {0.4 * i - 1.4, 1.1, -0.5});
    }
    scene.addPointLight({0, 2, 1}, Vec3f::Ones(), 3);
    return scene.take();
}

View viewOf(FrameNumber frame) {
    View view;
    view.position = {0.01 * static_cast<double>(frame.value), 0.02, 0};
    return view;
}
Hash128 digestOf(FrameNumber frame) {
    return {frame.value + 1, 77};
}

/// What one host draws with, all of one thread.
struct DrawingSide {
    DrawingSide() { scene.update(aspect, nullptr); }

    Wall wall = twoTiles();
    Aspect aspect = makeScene();
    RenderScene scene;
    std::unique_ptr<Surface> surface = test::pooledSurface();
    std::unique_ptr<Renderer> renderer = Renderer::create(*surface, {.samples = 4}).value();

    [[nodiscard]] Picture whole(const Tile& tile, FrameNumber frame) {
        const ScreenCamera camera = tileCamera(wall, tile, viewOf(frame));
        return renderer
            ->draw(aspect, RenderAction(CullerKind::kNone).run(scene, camera, tile.rect, nullptr), camera, tile.rect)
            .value();
    }
    [[nodiscard]] Picture shared(PartSharing& sharing, const Tile& tile, FrameNumber frame, PartCounts& counts) {
        const ScreenCamera camera = tileCamera(wall, tile, viewOf(frame));
        const DrawList list = RenderAction(CullerKind::kFrustum).run(scene, camera, tile.rect, nullptr);
        sharing.begin(frame, digestOf(frame), viewOf(frame));
        auto picture = sharing.draw(
            *renderer, aspect, list, camera, tile, [&] { return renderer->draw(aspect, list, camera, tile.rect); },
            counts);
        sharing.end();
        return picture.value();
    }
};

struct Owner : DrawingSide {
    explicit Owner(SharingOptions options) : sharing(options, board, log) { sharing.useWall(wall, "left"); }

    Log log{"test"};
    Board board = Board::create().value();
    PartSharing sharing;
    Tile tile = tilesOf(wall, "left").front();
};

TEST(PartSharing, PartsCoverTheTileAndMeetOnTheGrid) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::stoul(given)) : 1;
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) +
                 " build/bin/unit_replica --gtest_filter=PartSharing.PartsCover*");
    std::mt19937 random(seed);
    const auto below = [&](int n) { return std::uniform_int_distribution<>(0, n - 1)(random); };
    for (int i = 0; i < 2'000; ++i) {
        const int most = i % 2 ? 200 : 3'000;
        const PixelRect tile{.x = below(4'000), .y = below(3'000), .width = 1 + below(most), .height = 1 + below(most)};
        const std::size_t count = static_cast<std::size_t>(1 + below(16));
        const auto parts = cutIntoParts(tile, count);
        ASSERT_GE(parts.size(), 1u);
        ASSERT_LE(parts.size(), count);
        if (tile.width > 1'100 && tile.height > 1'100) {
            ASSERT_EQ(parts.size(), count);
        }
        std::int64_t pixels = 0;
        for (const PixelRect& part : parts) {
            ASSERT_GT(part.width, 0);
            ASSERT_GT(part.height, 0);
            pixels += std::int64_t{part.width} * part.height;
            const auto onGrid = [](int edge, int from, int length) {
                return edge == from || edge == from + length || edge % 64 == 0;
            };
            for (const int x : {part.x, part.x + part.width}) ASSERT_TRUE(onGrid(x, tile.x, tile.width)) << x;
            for (const int y : {part.y, part.y + part.height}) ASSERT_TRUE(onGrid(y, tile.y, tile.height)) << y;
            ASSERT_GE(part.x, tile.x);
            ASSERT_GE(part.y, tile.y);
            ASSERT_LE(part.x + part.width, tile.x + tile.width);
            ASSERT_LE(part.y + part.height, tile.y + tile.height);
            for (const PixelRect& other : parts) {
                if (&other == &part) continue;
                const bool apart = part.x + part.width <= other.x || other.x + other.width <= part.x ||
                                   part.y + part.height <= other.y || other.y + other.height <= part.y;
                ASSERT_TRUE(apart);
            }
        }
        ASSERT_EQ(pixels, std::int64_t{tile.width} * tile.height);
    }
}

TEST(PartSharing, ADividedPictureIsTheWholeOneWhoeverDrawsItsParts) {
    Owner owner({.mode = ShareMode::kAlways, .cores = 2});
    std::promise<std::string> place;
    std::future<std::string> found = place.get_future();
    std::atomic<std::uint64_t> at = 0;
    std::atomic<bool> over = false;
    std::thread helping([&] {
        DrawingSide helper;
        Log log("helper");
        Board board = Board::create().value();
        PartSharing sharing({.mode = ShareMode::kAlways, .cores = 2}, board, log);
        sharing.useWall(helper.wall, "right");
        sharing.meet("left " + owner.board.place() + "\n");
        place.set_value(board.place());
        for (std::uint64_t frame = 0; !over; frame = at) {
            sharing.begin(FrameNumber(frame), digestOf(FrameNumber(frame)), viewOf(FrameNumber(frame)));
            sharing.end();
            while (!over && at == frame)
                if (!sharing.help(*helper.renderer, helper.aspect, helper.scene, [] { return false; }))
                    std::this_thread::yield();
        }
    });
    owner.sharing.meet("right " + found.get() + "\nnobody 1/2\nright\n\nright x y\n");
    std::uint64_t helped = 0, twice = 0;
    for (; at < 12; ++at) {
        PartCounts counts;
        const Picture shared = owner.shared(owner.sharing, owner.tile, FrameNumber(at), counts);
        ASSERT_TRUE(shared == owner.whole(owner.tile, FrameNumber(at))) << "frame " << at;
        EXPECT_GE(counts.parts, 16u);
        helped += counts.helped;
        twice += counts.twice;
    }
    over = true;
    helping.join();
    EXPECT_GT(helped, 12u) << twice;
}

/// Takes parts and does with them what `how` says, as fast as it can.
void playNeighbour(const std::string& ownersPlace, Board& board, const std::atomic<bool>& over,
                   const std::function<void(NeighbourBoard&, const Posting&, std::size_t)>& how) {
    NeighbourBoard owners = NeighbourBoard::open(ownersPlace).value();
    while (!over) {
        const auto posting = owners.look();
        const auto part = posting ? owners.takeLast(*posting, 1) : std::nullopt;
        if (part) how(owners, *posting, *part);
        std::this_thread::yield();
    }
    (void)board;
}

TEST(PartSharing, ANeighbourThatHangsLiesOrGivesBackCostsNoPicture) {
    Owner owner({.mode = ShareMode::kAlways, .cores = 2});
    Board board = Board::create().value();
    owner.sharing.meet("right " + board.place() + "\n");
    const std::vector<std::pair<std::string, std::function<void(NeighbourBoard&, const Posting&, std::size_t)>>> plays =
        {{"never comes back", [](NeighbourBoard&, const Posting&, std::size_t) {}},
         {"claims what it has not drawn", [](NeighbourBoard& owners, const Posting& posting,
                                             std::size_t part) { (void)owners.done(posting, part, 1, 3); }},
         {"claims it for somebody who is not there",
          [](NeighbourBoard& owners, const Posting& posting, std::size_t part) {
              (void)owners.done(posting, part, 1234, 3);
          }},
         {"gives it back",
          [](NeighbourBoard& owners, const Posting& posting, std::size_t part) { owners.giveUp(posting, part, 1); }}};
    for (const auto& [name, how] : plays) {
        std::atomic<bool> over = false;
        const auto& play = how;
        std::thread neighbour(
            [&board, &over, &play, place = owner.board.place()] { playNeighbour(place, board, over, play); });
        for (const FrameNumber frame : {0_frame, 1_frame, 2_frame}) {
            PartCounts counts;
            EXPECT_TRUE(owner.shared(owner.sharing, owner.tile, frame, counts) == owner.whole(owner.tile, frame))
                << name;
            EXPECT_EQ(counts.helped, 0u) << name;
        }
        over = true;
        neighbour.join();
    }
}

TEST(PartSharing, DividesWhereTimeLiesIdleAndStopsWhereNobodyHelps) {
    Owner owner({.mode = ShareMode::kAuto, .cores = 2, .worthwhile = 1ms});
    Board board = Board::create().value();
    owner.sharing.meet("right " + board.place() + "\n");
    const auto partsOf = [&](FrameNumber frame) {
        PartCounts counts;
        EXPECT_TRUE(owner.shared(owner.sharing, owner.tile, frame, counts) == owner.whole(owner.tile, frame));
        return counts.parts;
    };
    std::uint64_t frame = 0;
    for (; frame < 6; ++frame) EXPECT_EQ(partsOf(FrameNumber(frame)), 0u) << "the neighbour is not ready either";
    const auto partsBesideIdle = [&] {
        board.ready(++frame, clockNow());
        return partsOf(FrameNumber(frame));
    };
    EXPECT_EQ(partsBesideIdle(), 0u) << "nobody knew";
    EXPECT_GT(partsBesideIdle(), 1u);
    for (int divided = 1; partsBesideIdle() > 0; ++divided) ASSERT_LT(divided, 9) << "nobody helps";
    for (int i = 0; i < 6; ++i) EXPECT_EQ(partsBesideIdle(), 0u) << "not again at once";
    int pause = 0;
    while (partsBesideIdle() == 0) ASSERT_LT(++pause, 20) << "but some time";
}

/// At Swap everybody has drawn: what a neighbour still draws for it is for nobody, and its own next frame waits.
TEST(PartSharing, APartIsLeftAtAnyPointAndGivenBackWhenItsHelperIsWantedElsewhere) {
    Owner helper({.mode = ShareMode::kAlways, .cores = 2});
    Board board = Board::create().value();
    const Tile other = tilesOf(helper.wall, "right").front();
    const std::vector<PixelRect> parts{other.rect};
    helper.sharing.meet("right " + board.place() + "\n");
    helper.sharing.begin(5_frame, digestOf(5_frame), viewOf(5_frame));
    helper.sharing.end();
    int leftAt = 0;
    for (bool done = false; !done; ++leftAt) {
        ASSERT_LT(leftAt, 1'000);
        board.post(digestOf(5_frame), 1, parts);
        int asked = 0;
        done = helper.sharing.help(*helper.renderer, helper.aspect, helper.scene, [&] { return asked++ >= leftAt; });
        if (done) break;
        EXPECT_EQ(asked, leftAt + 1) << "it goes on";
        EXPECT_FALSE(board.doneElsewhere(0));
        ASSERT_TRUE(board.take(0)) << "its owner cannot have it back";
        board.withdraw();
    }
    EXPECT_GT(leftAt, 6) << "asked too seldom";
    Picture drawn = Picture::filled(other.rect.width, other.rect.height, 0, 0, 0);
    const NeighbourBoard seen = NeighbourBoard::open(helper.board.place()).value();
    const auto done = board.doneElsewhere(0);
    ASSERT_TRUE(done);
    ASSERT_TRUE(
        seen.copy(done->slot, Board::stamp(static_cast<std::uint32_t>(leftAt) + 1, 1, 0), parts[0], other.rect, drawn));
    EXPECT_TRUE(drawn == helper.whole(other, 5_frame)) << "what was left before shows";
}

TEST(PartSharing, HelpsOnlyWithTheSameFrameAndAProcessorToSpare) {
    Owner helper({.mode = ShareMode::kAuto, .cores = 2});
    Board board = Board::create().value();
    const Tile other = tilesOf(helper.wall, "right").front();
    const auto parts = cutIntoParts(other.rect, 4);
    helper.sharing.meet("right " + board.place() + "\n");
    const auto helps = [&] {
        return helper.sharing.help(*helper.renderer, helper.aspect, helper.scene, [] { return false; });
    };
    board.is(Activity::kDrawing);
    board.post(digestOf(5_frame), 1, parts);
    EXPECT_FALSE(helps()) << "it has not drawn yet itself";
    helper.sharing.begin(4_frame, digestOf(4_frame), viewOf(4_frame));
    helper.sharing.end();
    EXPECT_FALSE(helps()) << "another frame";
    helper.sharing.begin(5_frame, digestOf(5_frame), viewOf(5_frame));
    helper.sharing.end();
    EXPECT_TRUE(helps());
    const auto done = board.doneElsewhere(3);
    ASSERT_TRUE(done);
    Picture whole = Picture::filled(other.rect.width, other.rect.height, 0, 0, 0);
    const NeighbourBoard seen = NeighbourBoard::open(helper.board.place()).value();
    ASSERT_TRUE(seen.copy(done->slot, Board::stamp(1, 1, 3), parts[3], other.rect, whole));
    helper.sharing.forget();
    EXPECT_FALSE(helps()) << "its replica has gone on";

    // Two on a processor, and no more.
    Owner busy({.mode = ShareMode::kAuto, .cores = 1, .threadsEach = 2});
    busy.sharing.meet("right " + board.place() + "\n");
    busy.sharing.begin(5_frame, digestOf(5_frame), viewOf(5_frame));
    busy.sharing.end();
    EXPECT_FALSE(busy.sharing.help(*busy.renderer, busy.aspect, busy.scene, [] { return false; }))
        << "the owner has the only processor";
    board.post(digestOf(5_frame), 1, std::vector{PixelRect{.x = 0, .y = 0, .width = 64, .height = 64}});
    helper.sharing.begin(5_frame, digestOf(5_frame), viewOf(5_frame));
    helper.sharing.end();
    EXPECT_FALSE(helps()) << "outside the tile";
}

}  // namespace
}  // namespace tessera
