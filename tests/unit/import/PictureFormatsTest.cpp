// Pictures and textures of all formats: small ones written here byte by byte, what is decoded of them, and what
// thousands of damaged ones lead to.
#include <gtest/gtest.h>
#include <tiffio.h>
#include <webp/encode.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "tests/support/words/Words.h"
#include "tests/unit/import/PictureBytes.h"

namespace tessera {
namespace {

std::string bmp() {
    return "BM" + little(14 + 40 + 24, 4) + little(0, 4) + little(54, 4) + little(40, 4) + little(2, 4) + little(3, 4) +
           little(1, 2) + little(24, 2) + little(0, 24) + texels("bgr", false, 8);
}
std::string tgaFile() {
    return std::string("\0\0\2\0\0\0\0\0\0\0\0\0", 12) + little(2, 2) + little(3, 2) + little(24, 1) + little(0x20, 1) +
           texels("bgr");
}
/// A palette of eight, and codes of four bits: a clear code before each two keeps them so.
std::string gif() {
    std::string text = "GIF89a" + little(2, 2) + little(3, 2) + little(0x82, 1) + little(0, 2);
    for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t c = 0; c < 3; ++c) text += static_cast<char>(i < 6 ? kTexels[i][c] : 0);
    text += "," + little(0, 4) + little(2, 2) + little(3, 2) + little(0, 1) + little(3, 1);
    std::string codes;
    unsigned bits = 0, count = 0;
    const auto put = [&](unsigned code) {
        bits |= code << count;
        for (count += 4; count >= 8; count -= 8, bits >>= 8) codes += static_cast<char>(bits & 255);
    };
    for (unsigned i = 0; i < 6; ++i) {
        if (i % 2 == 0) put(8);
        put(i);
    }
    put(9);
    if (count > 0) codes += static_cast<char>(bits);
    return text + little(codes.size(), 1) + codes + little(0, 1) + ";";
}
std::string pic() {
    std::string text = "\x53\x80\xf6\x34" + std::string(84, '\0') + "PICT" + big(2, 2) + big(3, 2) +
                       big(0x3f800000, 4) + big(3, 2) + big(0, 2);
    return text + std::string("\0\x08\0\xe0", 4) + texels("rgb");
}
std::string pnm(int kind, int most) {
    std::string text = "P" + std::to_string(kind) + "\n# of six\n2 3\n" + std::to_string(most) + "\n";
    for (const Texel& texel : kTexels)
        for (std::size_t c = 0; c < 3; ++c) {
            const int value = texel[c] * most / 255;
            text +=
                kind == 3 ? std::to_string(value) + " " : big(static_cast<std::uint64_t>(value), most > 255 ? 2 : 1);
        }
    return text;
}
std::string sgi(bool inRuns, int valueBytes) {
    std::string text = big(474, 2) + big(inRuns, 1) + big(static_cast<std::uint64_t>(valueBytes), 1) + big(3, 2) +
                       big(2, 2) + big(3, 2) + big(3, 2);
    text.resize(512);
    std::string starts, lengths, rows;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t y = 0; y < 3; ++y) {
            std::string row;
            if (inRuns) row += big(0x82, valueBytes);
            for (std::size_t x = 0; x < 2; ++x)
                row += big(static_cast<std::uint64_t>(kTexels[2 * (2 - y) + x][c]) << 8 * (valueBytes - 1), valueBytes);
            if (inRuns) row += big(0, valueBytes);
            starts += big(512 + 72 + rows.size(), 4);
            lengths += big(row.size(), 4);
            rows += row;
        }
    return text + (inRuns ? starts + lengths : "") + rows;
}
std::string tiff(std::uint16_t compression, std::uint16_t bits) {
    const std::string path = testing::TempDir() + "tessera-formats-" + std::to_string(::getpid()) + ".tif";
    TIFF* file = TIFFOpen(path.c_str(), "w");
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, 2);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, 3);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 3);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(file, TIFFTAG_COMPRESSION, compression);
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 3);
    for (std::uint32_t y = 0; y < 3; ++y) {
        std::string row;
        for (std::size_t x = 0; x < 2; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                row += little(static_cast<std::uint64_t>(kTexels[2 * y + x][c]) * (bits == 16 ? 257 : 1), bits / 8);
        TIFFWriteScanline(file, row.data(), y, 0);
    }
    TIFFClose(file);
    std::ifstream in(path, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    std::filesystem::remove(path);
    return bytes;
}

struct Dds {
    int width = 2, height = 3, depth = 1, mipmaps = 1;
    std::string format;  ///< 32 bytes
    std::uint32_t caps2 = 0;
    std::string later = {};  ///< the header of 20 bytes
};
std::string fourCcFormat(const std::string& code) {
    return little(32, 4) + little(4, 4) + code + little(0, 20);
}
std::string ddsFile(const Dds& dds, const std::string& data) {
    std::string text = "DDS " + little(124, 4) + little(0x1007, 4) + little(static_cast<std::uint64_t>(dds.height), 4) +
                       little(static_cast<std::uint64_t>(dds.width), 4) + little(0, 4) +
                       little(static_cast<std::uint64_t>(dds.depth), 4) +
                       little(static_cast<std::uint64_t>(dds.mipmaps), 4) + std::string(44, '\0') + dds.format +
                       little(0x1000, 4) + little(dds.caps2, 4) + std::string(12, '\0');
    return text + dds.later + data;
}
std::string ddsRgb() {
    return ddsFile({.format = little(32, 4) + little(0x41, 4) + little(0, 4) + little(32, 4) + little(0xff0000, 4) +
                              little(0xff00, 4) + little(0xff, 4) + little(0xff000000, 4)},
                   texels("bgra"));
}
std::string dxgi(std::uint32_t format, std::uint32_t dimension = 3, std::uint32_t flags = 0, std::uint32_t count = 1) {
    return little(format, 4) + little(dimension, 4) + little(flags, 4) + little(count, 4) + little(0, 4);
}
/// All that are read, by their names.
std::map<std::string, std::string> samples() {
    std::map<std::string, std::string> all = {
        {"bmp", bmp()},
        {"tga", tgaFile()},
        {"gif", gif()},
        {"pic", pic()},
        {"P3", pnm(3, 255)},
        {"P3 of 1000", pnm(3, 1020)},
        {"P6", pnm(6, 255)},
        {"P6 of 16 bits", pnm(6, 65535)},
        {"sgi", sgi(false, 1)},
        {"sgi in runs", sgi(true, 1)},
        {"sgi of 16 bits", sgi(false, 2)},
        {"sgi of 16 bits in runs", sgi(true, 2)},
        {"tiff", tiff(COMPRESSION_NONE, 8)},
        {"tiff by LZW", tiff(COMPRESSION_LZW, 8)},
        {"tiff of 16 bits", tiff(COMPRESSION_ADOBE_DEFLATE, 16)},
        {"dds", ddsRgb()},
        {"dds by DXGI", ddsFile({.format = fourCcFormat("DX10"), .later = dxgi(28)}, texels("rgba"))},
        {"ktx2", ktxFile({}, {texels("rgba")})},
        {"ktx2 of BGR", ktxFile({.format = 30}, {texels("bgr")})},
        {"ktx2 by zstd", ktxFile({.scheme = 2}, {texels("rgba")})},
        {"ktx2 upwards",
         ktxFile({.keys = little(18, 4) + std::string("KTXorientation\0ru\0", 18)}, {texels("rgba", false)})},
    };
    return all;
}
/// And those whose pixels are blocks, cubes or solids.
std::map<std::string, std::string> shapedSamples() {
    return {
        {"dds bc1", ddsFile({.width = 8, .height = 8, .mipmaps = 4, .format = fourCcFormat("DXT1")}, blocksOf(7))},
        {"dds cube", ddsFile({.width = 4, .height = 4, .mipmaps = 3, .format = fourCcFormat("DXT1"), .caps2 = 0xfe00},
                             blocksOf(18))},
        {"dds solid",
         ddsFile(
             {.width = 4, .height = 4, .depth = 4, .mipmaps = 1, .format = fourCcFormat("DX10"), .later = dxgi(98, 4)},
             blocksOf(4, 16))},
        {"dds floats",
         ddsFile({.width = 2, .height = 1, .format = little(32, 4) + little(4, 4) + little(113, 4) + little(0, 20)},
                 little(0x3c003c003c00, 8) + little(0x3c0040003800, 8))},
        {"ktx2 cube", ktxFile({.format = 131, .width = 4, .height = 4, .faces = 6, .scheme = 2}, {blocksOf(6)})},
        {"ktx2 line", ktxFile({.width = 6, .height = 0}, {texels("rgba")})}};
}

TEST(PictureFormats, SayTheSamePixels) {
    for (const auto& [name, file] : samples()) {
        const Expected<DecodedImage> image = pictureIn(file);
        ASSERT_TRUE(image) << name << ": " << image.error().message;
        ASSERT_EQ(image->widthPx, 2) << name;
        ASSERT_EQ(image->heightPx, 3) << name;
        ASSERT_EQ(image->rgba.size(), 24u) << name;
        for (std::size_t i = 0; i < 24; ++i)
            EXPECT_EQ(std::to_integer<int>(image->rgba[i]), kTexels[i / 4][i % 4]) << name << ", byte " << i;
        EXPECT_EQ(image->shape, PictureMessage::FLAT) << name;
    }
}

TEST(PictureFormats, BitsAreBlackAndWhite) {
    for (const std::string& file :
         {std::string("P1 2 3 10 01#a comment\n11"), std::string("P4 2 3\n") + "\x80\x40\xc0"}) {
        const Expected<DecodedImage> image = pictureIn(file);
        ASSERT_TRUE(image) << image.error().message;
        std::string seen;
        for (std::size_t i = 0; i < 6; ++i) seen += image->rgba[4 * i] == std::byte{0} ? '1' : '0';
        EXPECT_EQ(seen, "100111");
    }
}

TEST(PictureFormats, GreyAndAlphaAreKept) {
    const std::string grey = ddsFile({.width = 1,
                                      .height = 1,
                                      .format = little(32, 4) + little(0x20001, 4) + little(0, 4) + little(16, 4) +
                                                little(0xff, 4) + little(0, 8) + little(0xff00, 4)},
                                     little(0x4080, 2));
    const Expected<DecodedImage> image = pictureIn(grey);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->rgba, (Bytes{std::byte{0x80}, std::byte{0x80}, std::byte{0x80}, std::byte{0x40}}));
    const Expected<DecodedImage> high =
        pictureIn(ddsFile({.width = 1,
                           .height = 1,
                           .format = little(32, 4) + little(0x40, 4) + little(0, 4) + little(16, 4) +
                                     little(0xf800, 4) + little(0x7e0, 4) + little(0x1f, 4) + little(0, 4)},
                          little(0xf81f, 2)));
    ASSERT_TRUE(high);
    EXPECT_EQ(high->rgba, (Bytes{std::byte{255}, std::byte{0}, std::byte{255}, std::byte{255}}));
}

TEST(PictureFormats, CubesOfDdsComeLevelByLevel) {
    const Expected<DecodedImage> image = pictureIn(shapedSamples().at("dds cube"));
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->shape, PictureMessage::CUBE);
    EXPECT_EQ(image->encoding, PictureMessage::BC1);
    EXPECT_EQ(image->mipmaps, 3);
    ASSERT_EQ(image->rgba.size(), 18u * 8);
    // In the file face by face, of each its three levels.
    for (std::size_t level = 0; level < 3; ++level)
        for (std::size_t face = 0; face < 6; ++face)
            EXPECT_EQ(std::to_integer<std::size_t>(image->rgba[8 * (6 * level + face)]), 3 * face + level)
                << level << ' ' << face;
}

TEST(PictureFormats, ShapesAreTheFilesOwn) {
    const auto all = shapedSamples();
    const auto of = [&](const char* name) {
        const Expected<DecodedImage> image = pictureIn(all.at(name));
        EXPECT_TRUE(image) << name << ": " << (image ? "" : image.error().message);
        return image ? *image : DecodedImage();
    };
    EXPECT_EQ(of("dds bc1").mipmaps, 4);
    EXPECT_EQ(of("dds bc1").rgba.size(), 7u * 8);
    EXPECT_EQ(of("dds solid").depthPx, 4);
    EXPECT_EQ(of("dds solid").encoding, PictureMessage::BC7);
    EXPECT_EQ(of("ktx2 cube").shape, PictureMessage::CUBE);
    EXPECT_EQ(of("ktx2 line").shape, PictureMessage::LINE);
    EXPECT_EQ(of("ktx2 line").heightPx, 1);
    // 1, 1, 1 and 0.5, 2, 1 with the exponent that they share.
    EXPECT_EQ(of("dds floats").rgba, (Bytes{std::byte{128}, std::byte{128}, std::byte{128}, std::byte{129},
                                            std::byte{32}, std::byte{128}, std::byte{64}, std::byte{130}}));
    EXPECT_EQ(of("dds floats").encoding, PictureMessage::RGBE);
}

TEST(PictureFormats, WhatIsTooLargeLosesItsLargestMipmaps) {
    DecodedImage image = pictureIn(shapedSamples().at("dds bc1")).value();
    ASSERT_TRUE(halve(image));
    EXPECT_EQ(image.widthPx, 4);
    EXPECT_EQ(image.mipmaps, 3);
    EXPECT_EQ(std::to_integer<int>(image.rgba[0]), 4) << "the block behind the four of the largest";
    ASSERT_TRUE(halve(image));
    ASSERT_TRUE(halve(image));
    EXPECT_FALSE(halve(image));
    EXPECT_EQ(image.rgba.size(), 8u);
}

/// Without loss, as libwebp writes it.
std::string webp() {
    const std::string rgba = texels("rgba");
    std::uint8_t* made = nullptr;
    const std::size_t size =
        WebPEncodeLosslessRGBA(reinterpret_cast<const std::uint8_t*>(rgba.data()), 2, 3, 4 * 2, &made);
    std::string file(reinterpret_cast<const char*>(made), size);
    WebPFree(made);
    return file;
}
std::string riff(const std::string& chunks) {
    return "RIFF" + little(4 + chunks.size(), 4) + "WEBP" + chunks;
}
/// An animation of that twice, on a canvas of 4 × 5: the first picture stands at (2, 2).
std::string webpAnimation() {
    const std::string one = webp().substr(12);
    const auto frame = [&](int x, int y) {
        const std::string body =
            little(x / 2, 3) + little(y / 2, 3) + little(1, 3) + little(2, 3) + little(100, 3) + little(0, 1) + one;
        return "ANMF" + little(body.size(), 4) + body + std::string(body.size() % 2, '\0');
    };
    const std::string extended = little(0x12, 4) + little(3, 3) + little(4, 3);
    return riff("VP8X" + little(extended.size(), 4) + extended + "ANIM" + little(6, 4) + little(0, 6) + frame(2, 2) +
                frame(0, 0));
}

TEST(PictureFormats, WebpIsReadOfAnAnimationItsFirstPicture) {
    const Expected<DecodedImage> image = pictureIn(webp());
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->widthPx, 2);
    EXPECT_EQ(image->heightPx, 3);
    const std::string rgba = texels("rgba");
    EXPECT_EQ(asText(image->rgba), rgba);
    const Expected<DecodedImage> first = pictureIn(webpAnimation());
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_EQ(first->widthPx, 4);
    EXPECT_EQ(first->heightPx, 5);
    std::string expected(4 * 4 * 5, '\0');
    for (std::size_t y = 0; y < 3; ++y) expected.replace(4 * (4 * (y + 2) + 2), 8, rgba.substr(8 * y, 8));
    EXPECT_EQ(asText(first->rgba), expected);
    for (const std::string& whole : {webp(), webpAnimation()})
        for (std::size_t size = 12; size + 40 < whole.size(); ++size)
            EXPECT_FALSE(pictureIn(whole.substr(0, size))) << size;
}

TEST(PictureFormats, WhatIsNotReadIsNamed) {
    const auto message = [](const std::string& file) {
        const Expected<DecodedImage> image = pictureIn(file);
        return image ? std::string("decoded") : image.error().message;
    };
    EXPECT_WORDS(message(ktxFile({.format = 0, .scheme = 1}, {"x"})));
    EXPECT_WORDS(message(ktxFile({.format = 0, .model = 166}, {"x"})));
    EXPECT_WORDS(message(ktxFile({.layers = 3}, {texels("rgba")})));
    EXPECT_WORDS(message(ddsFile({.format = fourCcFormat("UYVY")}, "")));
    EXPECT_WORDS(message(ddsFile({.format = fourCcFormat("DX10"), .later = dxgi(84)}, "")));
    EXPECT_WORDS(message("RIFF\1\2\3\4WEBPVP8 "));
    EXPECT_WORDS(message("nothing of the kind"));
}

TEST(PictureFormats, SizesThatAreNotThereTakeNoMemory) {
    // Of a few bytes each that say gigabytes; the child has less.
    for (const std::string& file :
         {ddsFile({.width = 16384, .height = 16384, .format = fourCcFormat("DXT1")}, ""),
          ktxFile({.width = 16384, .height = 16384, .scheme = 2}, {"x"}), std::string("P6 32768 4096 255\nx"),
          std::string("P3 32768 4096 255\nx"), ddsFile({.width = -1, .height = -1, .format = fourCcFormat("DXT1")}, ""),
          ktxFile({.width = 0xffffffff, .height = 0xffffffff}, {"x"}),
          ddsFile({.width = 2048, .height = 2048, .depth = 2048, .format = fourCcFormat("DX10"), .later = dxgi(28, 4)},
                  "")})
        EXPECT_FALSE(pictureIn(file));
}

/// Of a file that is cut off nothing is shown that is not in it: not what memory held before. (Numbers that are texts
/// may end anywhere, in a smaller one.)
TEST(PictureFormats, CutOffTheyAreWholeOrRefused) {
    auto all = samples();
    std::string tga =
        std::string("\0\0\2\0\0\0\0\0\0\0\0\0", 12) + little(100, 2) + little(61, 2) + std::string("\x18\0", 2);
    std::string bmp = "BM" + little(54 + 300 * 61, 4) + little(0, 4) + little(54, 4) + little(40, 4) + little(100, 4) +
                      little(61, 4) + little(1, 2) + little(24, 2) + little(0, 24);
    for (int i = 0; i < 300 * 61; ++i) {
        tga += static_cast<char>(i * 7);
        bmp += static_cast<char>(i * 7);
    }
    std::erase_if(all, [](const auto& named) { return named.first.starts_with("P3"); });
    all["large tga"] = tga;
    all["large bmp"] = bmp;
    for (const auto& [name, file] : all) {
        const Expected<DecodedImage> whole = pictureIn(file);
        ASSERT_TRUE(whole) << name << ": " << whole.error().message;
        const std::size_t step = file.size() > 4096 ? 61 : 1;
        for (std::size_t length = 0; length < file.size(); length += step) {
            const Expected<DecodedImage> image = pictureIn(file.substr(0, length));
            if (!image) continue;
            EXPECT_EQ(image->rgba, whole->rgba) << name << ", the first " << length << " bytes of " << file.size();
        }
        if (!name.starts_with("large")) continue;
        EXPECT_FALSE(pictureIn(file.substr(0, file.size() - 1))) << name;
    }
}

TEST(PictureFormats, AnyDamageLeadsToAPictureOrAnError) {
    auto all = samples();
    for (const auto& [name, file] : shapedSamples()) all[name] = file;
    damageEach(all, 1500, "PictureFormats.AnyDamage*");
}

}  // namespace
}  // namespace tessera
