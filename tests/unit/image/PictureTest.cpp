#include "common/image/Picture.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <random>

#include "common/image/PngRows.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

Picture noise(int widthPx, int heightPx, unsigned seed) {
    Picture picture = Picture::filled(widthPx, heightPx, 0, 0, 0);
    std::mt19937 random(seed);
    for (std::uint8_t& value : picture.rgb) value = static_cast<std::uint8_t>(random());
    return picture;
}

TEST(Picture, DropsAlphaForAnyNumberOfPixels) {
    std::mt19937 random(5);
    for (std::size_t count = 0; count < 100; ++count) {
        std::vector<std::uint8_t> rgba(4 * count), rgb(3 * count + 1, 171);
        for (std::uint8_t& value : rgba) value = static_cast<std::uint8_t>(random());
        dropAlpha(rgba.data(), count, rgb.data());
        for (std::size_t i = 0; i < 3 * count; ++i) ASSERT_EQ(rgb[i], rgba[i / 3 * 4 + i % 3]) << count << " pixels";
        EXPECT_EQ(rgb.back(), 171) << "nothing is written behind " << count << " pixels";
    }
}

TEST(Png, BringsEveryPixelAndTheFrameNumberBack) {
    const Picture picture = noise(37, 11, 1);
    const auto decoded = decodePng(encodePng(picture, 119));
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->picture, picture);
    EXPECT_EQ(decoded->frame, 119u);
}

TEST(Png, IsAsWideAsAllScreensOfTheWidestWallBesideEachOther) {
    constexpr int kWidthPx = 64 * 65'536;
    Bytes file;
    PngRowWriter png(kWidthPx, 1, std::nullopt,
                     [&](ByteSpan bytes) { file.insert(file.end(), bytes.begin(), bytes.end()); });
    png.row(std::vector<std::uint8_t>(std::size_t{3} * kWidthPx).data());
    png.end();
    constexpr std::size_t kWidthAt = 16;
    std::uint32_t width = 0;
    for (std::size_t i = 0; i < 4; ++i) width = width << 8 | std::to_integer<std::uint32_t>(file.at(kWidthAt + i));
    EXPECT_EQ(width, kWidthPx);
}

TEST(Png, KeepsTheFrameNumberBesideThePixelsNotInThem) {
    const Picture picture = noise(8, 8, 2);
    const auto first = decodePng(encodePng(picture, 0));
    const auto last = decodePng(encodePng(picture, ~std::uint64_t{0}));
    const auto without = decodePng(encodePng(picture, std::nullopt));
    ASSERT_TRUE(first && last && without);
    EXPECT_EQ(first->picture, last->picture);
    EXPECT_EQ(first->frame, 0u);
    EXPECT_EQ(last->frame, ~std::uint64_t{0});
    EXPECT_EQ(without->frame, std::nullopt);
}

TEST(Png, RefusesEveryTruncation) {
    const Bytes whole = encodePng(noise(16, 16, 3), 5);
    // The last 12 bytes are the end chunk, which adds nothing to the pixels.
    for (std::size_t length = 0; length + 12 < whole.size(); ++length)
        EXPECT_FALSE(decodePng(ByteSpan(whole).first(length))) << length;
}

TEST(Png, SurvivesEveryFlippedByte) {
    const Picture picture = noise(6, 5, 4);
    const Bytes whole = encodePng(picture, 5);
    for (std::size_t i = 0; i < whole.size(); ++i) {
        Bytes damaged = whole;
        damaged[i] ^= std::byte{0x55};
        const auto decoded = decodePng(damaged);
        if (decoded) {
            EXPECT_EQ(decoded->picture.rgb.size(), 3u * static_cast<std::size_t>(decoded->picture.widthPx) *
                                                       static_cast<std::size_t>(decoded->picture.heightPx));
        }
    }
}

TEST(Png, RefusesASizeThatOnlyTheHeaderHas) {
    Bytes bytes = encodePng(noise(4, 4, 5), std::nullopt);
    // Width and height stand at 16 and 20; 0x4001 = 16385 is one too many.
    for (const std::size_t at : {std::size_t{18}, std::size_t{22}}) {
        Bytes huge = bytes;
        huge[at] = std::byte{0x40};
        huge[at + 1] = std::byte{0x01};
        const auto decoded = decodePng(huge);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().code, ErrorCode::kBadInput);
    }
    EXPECT_FALSE(decodePng({}));
    EXPECT_FALSE(decodePng(asBytes("P6 4 4 255 not a PNG at all")));
}

TEST(Png, TakesNoMemoryForATextThatIsNotThere) {
    Bytes bytes = encodePng(noise(4, 4, 5), 7);
    const std::string_view text = asText(bytes);
    const std::size_t lengthAt = text.find("tEXt") - 4;
    bytes[lengthAt] = std::byte{0x55};  // 1.4 GB
    const auto decoded = decodePng(bytes);
    ASSERT_FALSE(decoded);
    EXPECT_WORDS(decoded.error().message);
}

TEST(Paste, CutsOffWhatDoesNotFit) {
    const Picture part = noise(4, 3, 6);
    for (int x = -5; x <= 6; ++x) {
        for (int y = -4; y <= 6; ++y) {
            Picture whole = Picture::filled(5, 5, 1, 2, 3);
            paste(whole, part, x, y);
            for (int wy = 0; wy < 5; ++wy) {
                for (int wx = 0; wx < 5; ++wx) {
                    const std::size_t at = 3 * static_cast<std::size_t>(wy * 5 + wx);
                    const bool inside = wx >= x && wx < x + 4 && wy >= y && wy < y + 3;
                    const std::uint8_t expected =
                        inside ? part.rgb[3 * static_cast<std::size_t>((wy - y) * 4 + wx - x)] : std::uint8_t{1};
                    ASSERT_EQ(whole.rgb[at], expected) << x << ' ' << y << ' ' << wx << ' ' << wy;
                }
            }
        }
    }
}

TEST(WriteFile, ReplacesWholeFilesAndMakesFolders) {
    const test::TestFolder folder;
    const std::string path = folder / "tiles/front-0-0/000001.png";
    ASSERT_TRUE(writeFile(path, asBytes("first")));
    ASSERT_TRUE(writeFile(path, asBytes("second")));
    const auto read = readFile(path, 100);
    ASSERT_TRUE(read);
    EXPECT_EQ(asText(*read), "second");
    const auto begin = std::filesystem::directory_iterator(std::filesystem::path(path).parent_path());
    EXPECT_EQ(std::distance(begin, std::filesystem::directory_iterator()), 1) << "no temporary file is left";
}

TEST(WriteFile, HasTheRightsThatTheMaskLeaves) {
    const test::TestFolder folder;
    const mode_t before = ::umask(0027);
    const auto written = writeFile(folder / "a.png", asBytes("x"));
    ::umask(before);
    ASSERT_TRUE(written);
    using std::filesystem::perms;
    EXPECT_EQ(std::filesystem::status(folder / "a.png").permissions(),
              perms::owner_read | perms::owner_write | perms::group_read);
}

TEST(WriteFile, SaysWhatIsInTheWay) {
    const test::TestFolder folder;
    ASSERT_TRUE(writeFile(folder / "plain", asBytes("x")));
    const auto written = writeFile(folder / "plain/below", asBytes("y"));
    ASSERT_FALSE(written);
    EXPECT_WORDS(written.error().message);
}

// A picture that took the name of /dev/null would have been the last that was heard of it.
TEST(WriteFile, TakesThePlaceOfFilesAlone) {
    const test::TestFolder folder;
    const std::string pipe = folder / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    ASSERT_FALSE(writeFile(pipe, asBytes("x")));
    EXPECT_TRUE(std::filesystem::is_fifo(pipe));
    const auto written = writeFile(folder.path(), asBytes("x"));
    ASSERT_FALSE(written);
    EXPECT_WORDS(written.error().message);
    // A link stays, and leads to what was written.
    const std::string file = folder / "file", link = folder / "link", loose = folder / "loose";
    std::filesystem::create_symlink("file", link);
    std::filesystem::create_symlink("pipe", loose);
    ASSERT_TRUE(writeFile(link, asBytes("new")));
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_EQ(std::filesystem::file_size(file), 3u);
    EXPECT_FALSE(writeFile(loose, asBytes("x"))) << "a pipe at its end";
    EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST(PictureSheet, IsShrunkToMeansWhereItWouldBeTooLarge) {
    constexpr int kWidth = 2 * PictureSheet::kMaxSidePx + 3;
    PictureSheet sheet(kWidth, 8, 14);
    const Picture part = noise(100, 5, 3);
    sheet.paste(part, kWidth - 100, 1);
    sheet.paste(Picture::filled(300, 2, 90, 60, 30), 0, 6);
    const Picture picture = std::move(sheet).take();
    EXPECT_EQ(picture.widthPx, (kWidth + 2) / 3);
    EXPECT_EQ(picture.heightPx, 3);
    const auto at = [&](int x, int y, int c) {
        return picture.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.widthPx) +
                                static_cast<std::size_t>(x)) +
                           static_cast<std::size_t>(c)];
    };
    EXPECT_EQ(at(0, 0, 0), 14) << "nothing was put there";
    EXPECT_EQ(at(5, 2, 0), 90);
    EXPECT_EQ(at(5, 2, 2), 30);
    for (int x = (kWidth - 100) / 3 + 1; x < picture.widthPx - 1; ++x)
        for (int c = 0; c < 3; ++c) {
            int sum = 0;
            for (int dy = 0; dy < 3; ++dy)
                for (int dx = 0; dx < 3; ++dx)
                    sum += part.rgb[3 * static_cast<std::size_t>((3 + dy - 1) * 100 + 3 * x + dx - (kWidth - 100)) +
                                    static_cast<std::size_t>(c)];
            ASSERT_NEAR(at(x, 1, c), sum / 9.0, 0.51);
        }
    PictureSheet same(30, 20, 0);
    const Picture whole = noise(30, 20, 1);
    same.paste(whole, 0, 0);
    EXPECT_EQ(std::move(same).take(), whole);
}

TEST(ReadFile, StopsAtItsLimit) {
    const test::TestFolder folder;
    ASSERT_TRUE(writeFile(folder / "ten", asBytes("0123456789")));
    EXPECT_TRUE(readFile(folder / "ten", 10));
    const auto tooLarge = readFile(folder / "ten", 9);
    ASSERT_FALSE(tooLarge);
    EXPECT_EQ(tooLarge.error().code, ErrorCode::kLimit);
    const auto endless = readFile("/dev/zero", 100'000);
    ASSERT_FALSE(endless);
    EXPECT_EQ(endless.error().code, ErrorCode::kLimit);
    const auto missing = readFile(folder / "none", 10);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
    EXPECT_FALSE(readFile(folder / "", 10)) << "a folder is no file";
}

}  // namespace
}  // namespace tessera
