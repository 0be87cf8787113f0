#include "common/codec/FrameCodec.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/codec/Samples.h"

namespace tessera {
namespace {

using namespace test;

TEST(FrameCodec, CarriesTheViewToTheLastBit) {
    const auto decoded = decodeFrame(encodeFrame({someView()}));
    ASSERT_TRUE(decoded) << decoded.error().message;
    const View expected = someView();
    EXPECT_EQ(decoded->view.position, expected.position);
    EXPECT_EQ(decoded->view.orientation.coeffs(), expected.orientation.coeffs());
    EXPECT_EQ(decoded->view.worldUnitsPerMetre, 1000);
    ASSERT_EQ(decoded->view.users.size(), 2u);
    EXPECT_EQ(decoded->view.users[0].name, "Käthe");
    EXPECT_EQ(decoded->view.users[0].position, expected.users[0].position);
    EXPECT_EQ(decoded->view.users[0].orientation.coeffs(), expected.users[0].orientation.coeffs());
    EXPECT_EQ(decoded->view.users[0].eyeSeparationMetres, 0.06);
}

TEST(FrameCodec, CarriesWhatTouchesInNumbersAndNothingWhereNothingDoes) {
    FramePayload payload{someView()};
    const std::size_t bare = encodeFrame(payload).size();
    EXPECT_EQ(decodeFrame(encodeFrame(payload))->collision, FrameCollision());
    payload.collision = {.contacts = 1000, .begun = 2, .ended = 3, .near = 4, .nearest = 0.1};
    const auto decoded = decodeFrame(encodeFrame(payload));
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->collision, payload.collision);
    EXPECT_LT(encodeFrame(payload).size(), bare + 32) << "it goes to every host in every frame";
    for (const double none : {-1.0, double{NAN}, double{INFINITY}}) {
        payload.collision.nearest = none;
        EXPECT_FALSE(decodeFrame(encodeFrame(payload))) << none;
    }
}

TEST(FrameCodec, RefusesViewsThatNobodyCouldDraw) {
    const auto error = [](auto&& spoil) {
        FramePayload payload{someView()};
        spoil(payload.view);
        const auto decoded = decodeFrame(encodeFrame(payload));
        return decoded ? "" : decoded.error().message;
    };
    EXPECT_WORDS(error([](View& v) { v.position.x() = NAN; }));
    EXPECT_WORDS(error([](View& v) { v.orientation.coeffs().setZero(); }));
    EXPECT_WORDS(error([](View& v) { v.worldUnitsPerMetre = 0; }));
    EXPECT_WORDS(error([](View& v) { v.worldUnitsPerMetre = INFINITY; }));
    EXPECT_WORDS(error([](View& v) { v.users[1].position.z() = INFINITY; }));
    EXPECT_WORDS(error([](View& v) { v.users[1].eyeSeparationMetres = NAN; }));
    EXPECT_WORDS(error([](View& v) { v.users[1].name.assign(1000, 'x'); }));
    EXPECT_WORDS(error([](View& v) { v.users.resize(65); }));
}

TEST(FrameCodec, CarriesAStudioAndNothingWhereThereIsNone) {
    FramePayload payload{someView()};
    const std::size_t bare = encodeFrame(payload).size();
    EXPECT_FALSE(decodeFrame(encodeFrame(payload))->view.studio);
    payload.view.studio = Studio{.middle = Vec3d(1, -2.5, 3e9), .reach = 0.1};
    EXPECT_EQ(decodeFrame(encodeFrame(payload))->view.studio, payload.view.studio);
    EXPECT_LE(encodeFrame(payload).size(), bare + 40) << "it goes to every host in every frame";
    for (const double none : {0.0, -1.0, double{NAN}, double{INFINITY}}) {
        payload.view.studio->reach = none;
        EXPECT_FALSE(decodeFrame(encodeFrame(payload))) << none;
    }
    payload.view.studio = Studio{.middle = Vec3d(0, NAN, 0), .reach = 1};
    EXPECT_FALSE(decodeFrame(encodeFrame(payload)));
}

TEST(FrameCodec, CarriesAnExposureAndNothingWhereNobodySaysAny) {
    FramePayload payload{someView()};
    const std::size_t bare = encodeFrame(payload).size();
    for (const Exposure& exposure :
         {Exposure(), Exposure{.wish = {}, .found = -700},
          Exposure{.wish = {.stops = -3.5, .metered = true, .toneMap = ToneMap::kAgx}, .found = 1},
          Exposure{.wish = {.stops = 0.0, .metered = false, .toneMap = ToneMap::kNeutral}, .found = 0}}) {
        payload.view.exposure = exposure;
        EXPECT_EQ(decodeFrame(encodeFrame(payload))->view.exposure, exposure);
        EXPECT_EQ(encodeFrame(payload).size() == bare, exposure == Exposure());
    }
    for (const Exposure& wrong : {Exposure{.wish = {.stops = 41.0, .metered = {}, .toneMap = {}}, .found = 0},
                                  Exposure{.wish = {.stops = double{NAN}, .metered = {}, .toneMap = {}}, .found = 0},
                                  Exposure{.wish = {.stops = {}, .metered = {}, .toneMap = ToneMap{5}}, .found = 0},
                                  Exposure{.wish = {}, .found = 64 * 40 + 1}}) {
        payload.view.exposure = wrong;
        EXPECT_FALSE(decodeFrame(encodeFrame(payload)));
    }
}

TEST(FrameCodec, StatisticsCarryLightWhereItIsMetered) {
    HostStats stats;
    EXPECT_FALSE(decodeStats(encodeStats(stats))->light);
    const std::size_t bare = encodeStats(stats).size();
    stats.light.emplace();
    EXPECT_EQ(decodeStats(encodeStats(stats))->light, stats.light) << "metered, and nothing there";
    for (std::size_t i = 0; i < stats.light->pixels.size(); ++i)
        stats.light->pixels[i] = static_cast<std::uint32_t>(i * i);
    EXPECT_EQ(decodeStats(encodeStats(stats))->light, stats.light);
    EXPECT_LE(encodeStats(stats).size(), bare + 1024);
}

TEST(FrameCodec, CarriesWhatIsShown) {
    for (const Showing showing : {Showing::kScene, Showing::kTestPicture, Showing::kCountedTestPicture})
        EXPECT_EQ(decodeFrame(encodeFrame({.view = someView(), .showing = showing}))->showing, showing);
    EXPECT_FALSE(decodeFrame(encodeFrame({.view = someView(), .showing = static_cast<Showing>(kLastShowing + 1)})));
    EXPECT_EQ(encodeFrame({.view = someView()}).size() + 2,
              encodeFrame({.view = someView(), .showing = Showing::kTestPicture}).size())
        << "a scene costs nothing";
}

TEST(FrameCodec, RefusesEveryTruncation) {
    const Bytes bytes = encodeFrame({someView()});
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decodeFrame(ByteSpan(bytes).first(size))) << size;
}

TEST(FrameCodec, CarriesStatistics) {
    const HostStats stats{
        {{"front-0-1", 0.25, 12.5, 100, 80, 75'730, 7, 3, 900, 0.5, 0.125, 4, 8, 3, 1}, {"floor-0-0"}},
        20,
        1.5,
        0.75,
        5,
        9.5,
        {{ObjectId(17), 501.5}}};
    EXPECT_EQ(decodeStats(encodeStats(stats)).value(), stats);
    EXPECT_EQ(decodeStats(encodeStats({})).value(), HostStats());
}

TEST(FrameCodec, RefusesStatisticsThatWouldSpoilAReport) {
    for (const double none : {-1.0, double{NAN}, double{INFINITY}}) {
        for (double TileStats::*time : {&TileStats::cullMs, &TileStats::drawMs, &TileStats::handOverMs,
                                        &TileStats::cullQueuedMs, &TileStats::drawQueuedMs}) {
            HostStats stats{{{"t"}}};
            stats.tiles[0].*time = none;
            EXPECT_FALSE(decodeStats(encodeStats(stats))) << none;
        }
        for (double HostStats::*time :
             {&HostStats::workMs, &HostStats::applyMs, &HostStats::applyQueuedMs, &HostStats::helpMs}) {
            HostStats stats;
            stats.*time = none;
            EXPECT_FALSE(decodeStats(encodeStats(stats))) << none;
        }
    }
    EXPECT_FALSE(decodeStats(encodeStats({{{std::string(300, 't')}}})));
    EXPECT_FALSE(decodeStats(encodeStats({std::vector<TileStats>(2000)})));
    HostStats tooMany;
    tooMany.heldUp.resize(2000);
    EXPECT_FALSE(decodeStats(encodeStats(tooMany)));
    EXPECT_FALSE(decodeStats({}));
}

}  // namespace
}  // namespace tessera
