/// The walls' pictures, from separate processes, against one big picture: byte for byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

class Oracles : public testing::Test {
protected:
    /// Draws a wall to `name` in the test's folder; returns its report.
    nlohmann::json draw(const std::string& name, const std::string& wall, std::vector<std::string> more = {},
                        int frames = 12) {
        const std::string out = folder_.path() + "/" + name;
        std::vector<std::string> command = {program("tessera-wall"), "--wall",   wall, "--scene", kYard, "--frames",
                                            std::to_string(frames),  "--output", out};
        command.insert(command.end(), more.begin(), more.end());
        const Outcome outcome = run(folder_.path(), command, 120s);
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
        const std::string report = readText(out + "/report.json");
        EXPECT_FALSE(report.empty()) << outcome.output;
        return report.empty() ? nlohmann::json() : nlohmann::json::parse(report);
    }
    Picture picture(const std::string& name, const std::string& file = "wall.png") {
        const Expected<Bytes> bytes = readFile(folder_.path() + "/" + name + "/" + file, 100 << 20);
        if (!bytes) {
            ADD_FAILURE() << bytes.error().message;
            return {};
        }
        const Expected<DecodedPng> png = decodePng(*bytes);
        if (!png) {
            ADD_FAILURE() << png.error().message;
            return {};
        }
        return png->picture;
    }
    /// Not blank: many colours, and no single one nearly everywhere.
    static void expectContent(const Picture& p) {
        std::map<std::uint32_t, std::size_t> colours;
        for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3)
            ++colours[static_cast<std::uint32_t>(p.rgb[i] << 16 | p.rgb[i + 1] << 8 | p.rgb[i + 2])];
        std::size_t most = 0;
        for (const auto& [colour, count] : colours) most = std::max(most, count);
        EXPECT_GT(colours.size(), 100u);
        EXPECT_LT(most, p.rgb.size() / 3 * 95 / 100);
    }
    TemporaryFolder folder_;
};

/// The one 2x2 wall of a real model, of separate processes and threads, under each culler.
TEST_F(Oracles, TwoByTwoOfProcessesShowsTheOneBigPictureUnderEachCuller) {
    const std::vector<std::string> engine = {
        "--scene", std::string(kModels) + "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb", "--size",
        "642x362"};
    draw("one", "1x1", engine);
    const Picture one = picture("one");
    expectContent(one);
    for (const CullerKind kind : kAllCullers) {
        const std::string name(nameOf(kind));
        std::vector<std::string> words = engine;
        words.insert(words.end(), {"--culler", name});
        draw(name, "2x2", words);
        EXPECT_TRUE(one == picture(name)) << name;
    }
}

TEST_F(Oracles, EglOnMesasSoftwareDrawsTheBytesThatOsmesaDraws) {
    draw("osmesa", "2x2", {"--size", "642x362"});
    // Its first device is the software one where there is no GPU. What a GPU draws is compared with itself alone.
    const nlohmann::json report = draw("egl", "2x2", {"--size", "642x362", "--surface", "egl"});
    const Picture drawn = picture("egl");
    expectContent(drawn);
    EXPECT_TRUE(report["faults"].empty()) << report["faults"];
    draw("alone", "1x1", {"--size", "642x362", "--surface", "egl"});
    EXPECT_TRUE(drawn == picture("alone"));
    const Outcome client =
        run(folder_.path(),
            {program("tessera-client"), "--server", "127.0.0.1:1", "--host", "x", "--surface", "egl", "--device", "63"},
            20s);
    EXPECT_EQ(client.exitCode, 1) << client.output;
    if (client.output.find("0: Mesa's software") != std::string::npos) {
        EXPECT_TRUE(drawn == picture("osmesa"));
    }
}

}  // namespace
}  // namespace tessera::test
