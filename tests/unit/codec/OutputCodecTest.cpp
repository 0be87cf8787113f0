/// Outputs in wall files and on the wire, with the files that they name.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "common/codec/WallCodec.h"
#include "common/output/BlendPicture.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMeshText = "2\n2 2\n-2 -1 0 0 1\n2 -1 1 0 1\n-2 1 0 1 1\n2 1 1 1 0.5\n";

class OutputFiles : public testing::Test {
protected:
    OutputFiles() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
        write("left.warp", kMeshText);
        const auto grey = [&](const std::string& name, std::uint16_t value) {
            const Bytes png =
                encodeBlendPicture({.widthPx = 8, .heightPx = 4, .values = std::vector<std::uint16_t>(32, value)});
            write(name, std::string(asText(png)));
        };
        grey("half.png", 32767);
        grey("all.png", 65535);
    }
    ~OutputFiles() override { fs::remove_all(folder_); }
    void write(const std::string& name, const std::string& text) {
        fs::create_directories((folder_ / name).parent_path());
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    /// Two tiles of 8 × 4 pixels, 4 of which both show.
    [[nodiscard]] static std::string wallText(const std::string& left, const std::string& right) {
        return R"(screens { name: "s" lower_left { x: -1.6 y: 0.6 } lower_right { x: 1.6 y: 0.6 } )"
               R"(upper_left { x: -1.6 y: 2.4 }
  grid { columns: 2 rows: 1 tile_width_px: 8 tile_height_px: 4 overlap_x_px: 4 } }
users { name: "u" position { y: 1.7 z: 2.4 } }
hosts { name: "a" tiles { screen: "s" column: 0 row: 0 user: "u" output { )" +
               left + R"( } } }
hosts { name: "b" tiles { screen: "s" column: 1 row: 0 user: "u" output { )" +
               right + " } } }\n";
    }
    [[nodiscard]] Expected<Wall> load(const std::string& left, const std::string& right = "") {
        write("w.wall", wallText(left, right));
        return loadWall((folder_ / "w.wall").string());
    }
    [[nodiscard]] std::string errorOf(const std::string& left, const std::string& right = "") {
        const auto wall = load(left, right);
        return wall ? "accepted" : wall.error().message;
    }
    fs::path folder_;
};

TEST_F(OutputFiles, AreReadBesideTheWallAndTravelInItsBytes) {
    const auto wall = load(
        "warp: \"left.warp\" blend_picture: \"half.png\" blend_picture_gamma: 1.5 gain { g: 0.5 } gamma { r: 2.4 } "
        "black: 0.001 flip_x: true monitor: \"HDMI-1\"",
        "blend_picture: \"half.png\" width_px: 16 height_px: 9");
    ASSERT_TRUE(wall) << wall.error().message;
    const TileOutput& left = wall->hosts[0].tiles[0].output;
    ASSERT_TRUE(left.warp);
    EXPECT_EQ(left.warp->at(1, 1), (WarpNode{.x = 1, .y = 1, .u = 1, .v = 1, .intensity = 0.5f}))
        << "x in halves of the width, which is twice the height";
    EXPECT_EQ(left.gain, (ChannelValues{1, 0.5, 1}));
    EXPECT_EQ(left.gamma, (ChannelValues{2.4, 2.2, 2.2}));
    EXPECT_EQ(left.monitor, "HDMI-1");
    fs::remove_all(folder_);
    const auto back = decodeWall(encodeWall(*wall));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->hosts[0].tiles[0].output, left);
    EXPECT_EQ(back->hosts[1].tiles[0].output, wall->hosts[1].tiles[0].output);
    EXPECT_EQ(encodeWall(*back), encodeWall(*wall));
}

TEST_F(OutputFiles, WhatIsWrongIsSaidWithItsLine) {
    const auto isSaidAt = [&](const std::string& place, const std::string& error) {
        EXPECT_TRUE(error.starts_with((folder_ / "w.wall").string() + place)) << error;
        EXPECT_WORDS(error);
    };
    isSaidAt(":4:19: ", errorOf("warp: \"none.warp\""));
    isSaidAt(":4:", errorOf("stereo: ANAGLIPH"));
    EXPECT_WORDS(errorOf("stereo: 77"));
    EXPECT_WORDS(errorOf("wrap: \"left.warp\""));
    write("bad.warp", "2\n2 2\n-2 -1 0 0 1\n2 -1 1 0 -1\n-2 1 0 1 1\n2 1 1 1 1\n");
    isSaidAt(":4:19: bad.warp:4: ", errorOf("warp: \"bad.warp\""));
    isSaidAt(":4:19: ", errorOf("blend_picture: \"left.warp\"", "blend_picture: \"all.png\""));
    isSaidAt(":5:19: ", errorOf("blend_picture: \"half.png\"", "blend_picture: \"all.png\""));
    EXPECT_WORDS(errorOf("blend_picture: \"half.png\""));
    EXPECT_EQ(errorOf("blend_picture: \"half.png\"", "blend_picture: \"half.png\""), "accepted");
    EXPECT_WORDS(parseWall(wallText("warp: \"left.warp\"", ""), "f").error().message);
}

TEST_F(OutputFiles, OfOtherFoldersAreNotRead) {
    write("below/left.warp", kMeshText);
    EXPECT_EQ(errorOf("warp: \"below/left.warp\""), "accepted");
    EXPECT_EQ(errorOf("warp: \"below/../left.warp\""), "accepted");
    for (const char* name : {"../left.warp", "/etc/passwd", "below/../../x", ".."})
        EXPECT_WORDS(errorOf(std::string("warp: \"") + name + "\""));
    EXPECT_WORDS(errorOf("warp: \"below\""));
    fs::create_symlink("/dev/zero", folder_ / "endless");
    EXPECT_WORDS(errorOf("warp: \"endless\""));
    fs::create_directory(folder_ / "deep");
    fs::create_directory_symlink("..", folder_ / "deep" / "up");
    EXPECT_WORDS(errorOf("warp: \"deep/up/../secret\""));
    EXPECT_WORDS(errorOf("warp: \"deep/up/up/left.warp\""));
    fs::create_directory_symlink("../..", folder_ / "deep" / "out");
    EXPECT_WORDS(errorOf("warp: \"deep/out/left.warp\""));
    fs::create_symlink("left.warp", folder_ / "same.warp");
    EXPECT_EQ(errorOf("warp: \"same.warp\""), "accepted");
    write("large.warp", std::string((32 << 20) + 1, '#'));
    EXPECT_WORDS(errorOf("warp: \"large.warp\""));
}

TEST_F(OutputFiles, DamagedBytesNeverCrash) {
    const Bytes whole = encodeWall(load("warp: \"left.warp\" blend_picture: \"half.png\" stereo: NONE gain { r: 1 }",
                                        "blend_picture: \"half.png\"")
                                       .value());
    for (std::size_t length = 0; length < whole.size(); ++length) (void)decodeWall(ByteSpan(whole).first(length));
    std::mt19937_64 random(11);
    for (int i = 0; i < 20'000; ++i) {
        Bytes damaged = whole;
        for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<std::byte>(random());
        const auto wall = decodeWall(damaged);
        EXPECT_TRUE(!wall || checkWall(*wall));
    }
}

}  // namespace
}  // namespace tessera
