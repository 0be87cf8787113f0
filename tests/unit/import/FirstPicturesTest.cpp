// Animations made of PNG pictures: MNG, and PNG files that hold frames.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/words/Words.h"
#include "tests/unit/import/PngBytes.h"

namespace tessera {
namespace {

/// Its rows begin with the filter that does nothing.
std::string rowsOf(std::size_t width, std::size_t height, const std::string& rgba) {
    std::string rows;
    for (std::size_t y = 0; y < height; ++y) rows += '\0' + rgba.substr(4 * width * y, 4 * width);
    return deflated(rows);
}
std::string header(int width, int height, int colours = 6) {
    return pngChunk("IHDR", big(static_cast<std::uint64_t>(width), 4) + big(static_cast<std::uint64_t>(height), 4) +
                                big(8, 1) + big(static_cast<std::uint64_t>(colours), 1) + big(0, 3));
}
const std::string kMng("\x8aMNG\r\n\x1a\n", 8);

/// The six texels, 2 × 3.
std::string sixPixels() {
    return rowsOf(2, 3, texels("rgba"));
}
std::string frameControl(int number, int width, int height, int left, int top) {
    std::string data;
    for (const int value : {number, width, height, left, top}) data += big(static_cast<std::uint64_t>(value), 4);
    return pngChunk("fcTL", data + std::string("\0\1\0\12\0\0", 6));
}

/// A picture of 4 × 5 that is no frame of its animation, whose first frame is the six texels at (1, 2).
std::string apngBeside(int left = 1, int top = 2) {
    return kPngStart + header(4, 5) + pngChunk("acTL", big(2, 4) + big(0, 4)) +
           pngChunk("IDAT", rowsOf(4, 5, std::string(80, '\x77'))) + frameControl(0, 2, 3, left, top) +
           pngChunk("fdAT", big(1, 4) + sixPixels()) + frameControl(2, 1, 1, 0, 0) +
           pngChunk("fdAT", big(3, 4) + rowsOf(1, 1, "\1\2\3\4")) + pngChunk("IEND", "");
}
std::string mngOf(const std::string& picture) {
    return kMng + pngChunk("MHDR", big(2, 4) + big(3, 4) + std::string(20, '\0')) + picture + pngChunk("MEND", "");
}
std::string pngInMng() {
    return header(2, 3) + pngChunk("IDAT", sixPixels()) + pngChunk("IEND", "");
}

DecodedImage firstIn(const std::string& file) {
    const Expected<DecodedImage> image = pictureIn(file);
    EXPECT_TRUE(image) << (image ? "" : image.error().message);
    return image ? *image : DecodedImage();
}
std::string whyNot(const std::string& file) {
    const Expected<DecodedImage> image = pictureIn(file);
    return image ? std::string("decoded") : image.error().message;
}

TEST(AnimatedPng, ShowsItsPictureWhereThatIsTheFirstFrame) {
    const std::string animated = kPngStart + header(2, 3) + pngChunk("acTL", big(2, 4) + big(0, 4)) +
                                 frameControl(0, 2, 3, 0, 0) + pngChunk("IDAT", sixPixels()) +
                                 frameControl(1, 1, 1, 0, 0) + pngChunk("fdAT", big(2, 4) + rowsOf(1, 1, "\1\2\3\4")) +
                                 pngChunk("IEND", "");
    EXPECT_EQ(asText(firstIn(animated).rgba), texels("rgba"));
    // Without frames nothing but the picture is there, whatever it says.
    const std::string none = kPngStart + header(2, 3) + pngChunk("acTL", big(2, 4) + big(0, 4)) +
                             pngChunk("IDAT", sixPixels()) + pngChunk("IEND", "");
    EXPECT_EQ(asText(firstIn(none).rgba), texels("rgba"));
}

TEST(AnimatedPng, ShowsItsFirstFrameWhereThatIsAnotherPicture) {
    const DecodedImage image = firstIn(apngBeside());
    ASSERT_EQ(image.widthPx, 4);
    ASSERT_EQ(image.heightPx, 5);
    std::string expected(80, '\0');
    for (std::size_t y = 0; y < 3; ++y) expected.replace(4 * (4 * (y + 2) + 1), 8, texels("rgba").substr(8 * y, 8));
    EXPECT_EQ(asText(image.rgba), expected);
    EXPECT_WORDS(whyNot(apngBeside(3, 2)));
}

TEST(Mng, ShowsItsFirstPngPicture) {
    EXPECT_EQ(asText(firstIn(mngOf(pngInMng() + header(1, 1) + pngChunk("IEND", ""))).rgba), texels("rgba"));
    // Colours of a palette that stands before the pictures.
    std::string palette, indices;
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t c = 0; c < 3; ++c) palette += static_cast<char>(kTexels[i][c]);
    for (char y = 0; y < 3; ++y) indices += {'\0', static_cast<char>(2 * y), static_cast<char>(2 * y + 1)};
    EXPECT_EQ(asText(firstIn(mngOf(pngChunk("PLTE", palette) + header(2, 3, 3) + pngChunk("PLTE", "") +
                                   pngChunk("IDAT", deflated(indices)) + pngChunk("IEND", "")))
                         .rgba),
              texels("rgba"));
}

TEST(Mng, NamesWhatItDoesNotShow) {
    EXPECT_WORDS(whyNot(mngOf(pngChunk("JHDR", std::string(16, '\0')))));
    EXPECT_WORDS(whyNot(std::string("\x8bJNG\r\n\x1a\n", 8)));
    EXPECT_WORDS(whyNot(mngOf("")));
}

TEST(AnimatedPng, AnyDamageLeadsToAPictureOrAnError) {
    const std::map<std::string, std::string> all = {{"apng", apngBeside()}, {"mng", mngOf(pngInMng())}};
    for (const auto& [name, file] : all) {
        const Bytes whole = firstIn(file).rgba;
        for (std::size_t length = 0; length < file.size(); ++length)
            if (const Expected<DecodedImage> image = pictureIn(file.substr(0, length)); image && name == "mng")
                EXPECT_EQ(image->rgba, whole) << name << ' ' << length;
    }
    damageEach(all, 5000, "AnimatedPng.AnyDamage*");
}

}  // namespace
}  // namespace tessera
