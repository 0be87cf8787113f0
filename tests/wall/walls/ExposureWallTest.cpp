/// A model of physical light on walls: metered once for all tiles, the same as on one big tile; it
/// settles, follows, and comes to rest.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

const std::string kSunlit = std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/sunlit.glb";

/// What the wall has found once it stays at that; nothing: nothing is metered.
std::optional<double> foundAtRest(AskedWall& wall) {
    json last;
    for (int look = 0; look < 400; ++look) {
        wall.settle();
        const json now = wall.ask({"exposure"});
        if (!last.is_null() && now == last)
            return now.contains("metered_stops") ? std::optional(now["metered_stops"].get<double>()) : std::nullopt;
        last = now;
    }
    ADD_FAILURE() << "the exposure never comes to rest";
    return std::nullopt;
}

double meanOf(const Picture& picture) {
    double sum = 0;
    for (const std::uint8_t v : picture.rgb) sum += v;
    return sum / static_cast<double>(picture.rgb.size());
}

/// The share of pixels that are white, or nearly so.
double whiteOf(const Picture& picture) {
    std::size_t white = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3)
        white += std::min({picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]}) >= 250;
    return 3.0 * static_cast<double>(white) / static_cast<double>(picture.rgb.size());
}

TEST(ExposureWall, PhysicalLightIsMeteredOnceForAllTilesAndFollowed) {
    struct Seen {
        std::vector<std::optional<double>> found;
        std::vector<Picture> pictures;
    };
    std::map<std::string, Seen> seen;
    for (const char* const name : {"1x1", "2x2"}) {
        AskedWall wall({.wall = name, .scene = kSunlit});
        Seen& now = seen[name];
        const auto look = [&] {
            now.found.push_back(foundAtRest(wall));
            now.pictures.push_back(wall.settledPicture());
        };
        look();
        wall.tell({"set", "/sunlit/sun/light 0", "intensity", "2500"});
        look();
        wall.tell({"exposure", "--tone-map", "agx"});
        look();
        wall.tell({"exposure", "off", "--tone-map", "clamp"});
        look();
        wall.tell({"exposure", "scene"});
        look();
        const json report = wall.finish();
        ASSERT_FALSE(report.is_null()) << wall.logs();
        EXPECT_EQ(report["exposure"]["metered"], true);
        EXPECT_NE(wall.logs().find("as strong as real ones"), std::string::npos) << wall.logs();
    }
    const Seen &one = seen["1x1"], &four = seen["2x2"];
    EXPECT_EQ(four.found, one.found) << "sums of whole numbers";
    for (std::size_t i = 0; i < one.pictures.size(); ++i)
        EXPECT_EQ(pixelsThatDiffer(four.pictures[i], one.pictures[i]), 0u) << i;
    // Of 80,000 lx; then of a thirty-second of that, to where it stays for less than a quarter of a stop.
    ASSERT_TRUE(one.found[0] && one.found[1]);
    EXPECT_LT(*one.found[0], -12);
    EXPECT_GT(*one.found[0], -19);
    EXPECT_NEAR(*one.found[1] - *one.found[0], 5, 0.6);
    EXPECT_EQ(one.found[2], one.found[1]) << "a tone map changes nothing of it";
    EXPECT_FALSE(one.found[3]) << "nobody meters";
    // All that the sun shines on is white unless it is metered.
    EXPECT_GT(whiteOf(one.pictures[3]), 0.15);
    EXPECT_LT(whiteOf(one.pictures[0]), 0.01);
    EXPECT_NEAR(meanOf(one.pictures[1]), meanOf(one.pictures[0]), 12);
}

TEST(ExposureWall, OptionsCountInPlaceOfTheSceneAndWhatIsNoneIsRefusedInWords) {
    AskedWall wall({.wall = "1x1", .scene = kSunlit, .server = {"--exposure", "-14", "--tone-map", "aces"}});
    const json said = wall.ask({"exposure"});
    EXPECT_EQ(said["exposure"]["stops"], -14) << said.dump();
    EXPECT_EQ(said["exposure"]["metered"], false);
    EXPECT_EQ(said["exposure"]["tone_map"], "aces");
    EXPECT_FALSE(said.contains("metered_stops"));
    const double mean = meanOf(wall.settledPicture());
    EXPECT_GT(mean, 30);
    EXPECT_LT(mean, 200);
    for (const std::vector<std::string>& wrong :
         {std::vector<std::string>{"exposure", "bright"}, {"exposure", "41"}, {"exposure", "--tone-map", "filmic"}}) {
        const CommandOutcome outcome = wall.ctl(wrong);
        EXPECT_NE(outcome.exitCode, 0) << wrong.back();
        EXPECT_WORDS(outcome.output);
    }
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::simulation
