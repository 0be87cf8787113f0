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

TEST_F(Oracles, TwoByTwoAndThreeByOneEqualTheOneBigPicture) {
    draw("one", "1x1", {"--size", "642x362"});
    draw("two", "2x2", {"--size", "642x362"});
    draw("three", "3x1", {"--size", "642x362"});
    const Picture one = picture("one");
    EXPECT_EQ(one.widthPx, 642);
    EXPECT_EQ(one.heightPx, 362);
    expectContent(one);
    EXPECT_TRUE(one == picture("two"));
    EXPECT_TRUE(one == picture("three"));
}

TEST_F(Oracles, EveryCullerDrawsTheSamePictureAndTheSameArgumentsDrawItAgain) {
    for (const CullerKind kind : kAllCullers) {
        const std::string name(nameOf(kind));
        draw(name, "2x2", {"--size", "640x360", "--culler", name});
    }
    draw("again", "2x2", {"--size", "640x360", "--culler", "auto"});
    const Picture none = picture("none");
    for (const CullerKind kind : kAllCullers) EXPECT_TRUE(none == picture(std::string(nameOf(kind)))) << nameOf(kind);
    EXPECT_TRUE(none == picture("again"));
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

TEST_F(Oracles, BezelTilesAreCropsOfOnePictureThatGoesOnBehindThem) {
    draw("bezels", "3x1-bezels");
    const Expected<Wall> wall = loadWall(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/3x1-bezels.wall");
    ASSERT_TRUE(wall);
    // The same screen without frames: one tile of all its pixels.
    const ScreenPixels pixels = screenPixels(wall->screens[0]);
    const Screen& s = wall->screens[0];
    const auto corner = [](const Vec3d& v) { return fmt::format("{{ x: {} y: {} z: {} }}", v.x(), v.y(), v.z()); };
    const User& user = wall->users[0];
    const std::string big =
        folder_.write("big.wall", "screens { name: \"front\" lower_left " + corner(s.lowerLeft) + " lower_right " +
                                      corner(s.lowerRight) + " upper_left " + corner(s.upperLeft) +
                                      " grid { columns: 1 rows: 1 tile_width_px: " + std::to_string(pixels.width) +
                                      " tile_height_px: " + std::to_string(pixels.height) +
                                      " } }\nusers { name: \"viewer\" position " + corner(user.position) +
                                      " }\nhosts { name: \"all\" tiles { screen: \"front\" user: \"viewer\" } }\n");
    draw("big", big);
    const Picture all = picture("big");
    ASSERT_EQ(all.widthPx, pixels.width);
    for (const Tile& tile : layoutTiles(*wall)) {
        const Picture drawn = picture("bezels", "tiles/" + tile.name + "/000011.png");
        Picture crop = Picture::filled(tile.rect.width, tile.rect.height, 0, 0, 0);
        paste(crop, all, -tile.rect.x, -(pixels.height - tile.rect.y - tile.rect.height));
        EXPECT_TRUE(drawn == crop) << tile.name;
    }
}

std::vector<std::string> shippedWalls() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(TESSERA_SOURCE_DIR "/deploy/walls"))
        if (entry.path().extension() == ".wall") names.push_back(entry.path().stem());
    std::ranges::sort(names);
    return names;
}
class ShippedWall : public Oracles, public testing::WithParamInterface<std::string> {};

TEST_P(ShippedWall, IsDrawnWithoutFaults) {
    const std::string name = GetParam();
    const std::vector<std::string> size =
        name == "3x1-bezels" ? std::vector<std::string>{} : std::vector<std::string>{"--size", "480x270"};
    const nlohmann::json report = draw(name, name, size);
    ASSERT_FALSE(report.is_null());
    EXPECT_EQ(report["frames"], 12);
    EXPECT_TRUE(report["faults"].empty());
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    EXPECT_EQ(report["sync"]["worst_skew_frames"], 0);
    EXPECT_GE(report["sync"]["widest_swap"]["ms"], 0);
    EXPECT_LT(report["sync"]["widest_swap"]["frame"], 12);
    expectContent(picture(name));
    for (const nlohmann::json& tile : report["tiles"]) {
        EXPECT_EQ(tile["shown"], 12);
        EXPECT_GT(picture(name, "tiles/" + tile["tile"].get<std::string>() + "/000011.png").widthPx, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Every, ShippedWall, testing::ValuesIn(shippedWalls()), [](const auto& info) {
    std::string name = info.param;
    std::ranges::replace_if(
        name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
    return name;
});

TEST_F(Oracles, ContactsReachTheReport) {
    const nlohmann::json report = draw("long", "1x1", {"--size", "64x36"}, 60);
    EXPECT_GE(report["collision"]["contacts"].get<int>(), 1);
    ASSERT_FALSE(report["collision"]["contact_list"].empty());
    const nlohmann::json& contact = report["collision"]["contact_list"][0];
    EXPECT_EQ(contact["objects"][1].get<std::string>().rfind("/post", 0), 0u) << contact.dump();
    EXPECT_NEAR(contact["normal"][0].get<double>(), 1, 1e-6);
}

}  // namespace
}  // namespace tessera::test
