// Textures whose blocks become pixels, and KTX 1: written here byte by byte, in either order of bytes.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "server/import/reader/blocks/AstcBlock.h"
#include "server/import/reader/blocks/EtcBlock.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/PictureBytes.h"

namespace tessera {
namespace {

constexpr std::uint32_t kByteType = 0x1401, kShortType = 0x1403, kFloatType = 0x1406, kHalfType = 0x140b,
                        kRgbFormat = 0x1907, kRgbaFormat = 0x1908;

/// A KTX 1's header.
struct Ktx1 {
    std::uint32_t type = kByteType, unit = 1, format = kRgbaFormat, internal = 0, width = 2, height = 3, depth = 0,
                  layers = 0, faces = 1;
    std::string keys = {};
    bool bigEndian = false;
};
/// Of each level its faces, one after the other.
std::string ktx1File(const Ktx1& ktx, const std::vector<std::vector<std::string>>& levels) {
    const auto word = [&](std::uint64_t value) { return ktx.bigEndian ? big(value, 4) : little(value, 4); };
    const auto whole = [](std::string bytes) {
        bytes.resize((bytes.size() + 3) / 4 * 4);
        return bytes;
    };
    const std::string keys = ktx.keys.empty() ? std::string() : whole(word(ktx.keys.size()) + ktx.keys);
    std::string text("\xABKTX 11\xBB\r\n\x1A\n", 12);
    for (const std::uint64_t value :
         {std::uint64_t{0x04030201}, std::uint64_t{ktx.type}, std::uint64_t{ktx.unit}, std::uint64_t{ktx.format},
          std::uint64_t{ktx.internal}, std::uint64_t{ktx.format}, std::uint64_t{ktx.width}, std::uint64_t{ktx.height},
          std::uint64_t{ktx.depth}, std::uint64_t{ktx.layers}, std::uint64_t{ktx.faces}, levels.size(), keys.size()})
        text += word(value);
    text += keys;
    for (const std::vector<std::string>& faces : levels) {
        text += word(faces.front().size());
        for (const std::string& face : faces) text += whole(face);
    }
    return text;
}
Ktx1 ofBlocks(std::uint32_t internal, std::uint32_t width = 8, std::uint32_t height = 8) {
    return {.type = 0, .format = 0, .internal = internal, .width = width, .height = height};
}

/// Two pixels of 16 bits a channel, the highest byte first or last.
std::string shorts(bool bigEndian) {
    std::string text;
    for (const Texel& texel : kTexels)
        for (const int channel : texel)
            text += bigEndian ? big(static_cast<std::uint64_t>(channel) * 257, 2)
                              : little(static_cast<std::uint64_t>(channel) * 257, 2);
    return text;
}

/// A block of 16 bytes that is one colour (of ASTC), and one of EAC and ETC2: any bytes are.
const std::string kAstcBlock("\xfc\xfd\xff\xff\xff\xff\xff\xff\x00\x20\x00\x40\x00\x60\x00\xff", 16);
const std::string kEtcBlock("\x80\x35\x12\x34\x56\x78\x9a\xbc\x13\x57\x9b\xdf\x02\x46\x8a\xce", 16);

Bytes decodedEtc(EtcFormat format) {
    Bytes rgba(64);
    decodeEtcBlock(format, asBytes(kEtcBlock).data(), rgba.data());
    return rgba;
}

DecodedImage imageIn(const std::string& file) {
    const Expected<DecodedImage> image = pictureIn(file);
    EXPECT_TRUE(image) << (image ? "" : image.error().message);
    return image ? *image : DecodedImage();
}
std::string refusal(const std::string& file) {
    const Expected<DecodedImage> image = pictureIn(file);
    return image ? std::string("decoded") : image.error().message;
}

std::map<std::string, std::string> ktx1Samples() {
    const std::string upwards = std::string("KTXorientation\0S=r,T=u\0", 23);
    return {{"rgba", ktx1File({}, {{texels("rgba")}})},
            {"bgra", ktx1File({.format = 0x80e1}, {{texels("bgra")}})},
            {"rgb, whose rows are filled up", ktx1File({.format = kRgbFormat}, {{texels("rgb", true, 8)}})},
            {"big endian", ktx1File({.bigEndian = true}, {{texels("rgba")}})},
            {"upwards", ktx1File({.keys = upwards}, {{texels("rgba", false)}})},
            {"16 bits", ktx1File({.type = kShortType, .unit = 2}, {{shorts(false)}})},
            {"16 bits, big endian", ktx1File({.type = kShortType, .unit = 2, .bigEndian = true}, {{shorts(true)}})}};
}
std::map<std::string, std::string> blockSamples() {
    std::string etc8 = kEtcBlock.substr(0, 8);
    return {{"ktx bc1", ktx1File(ofBlocks(0x83f0), {{blocksOf(4)}, {blocksOf(1)}, {blocksOf(1)}, {blocksOf(1)}})},
            {"ktx etc1", ktx1File(ofBlocks(0x8d64, 4, 4), {{etc8}})},
            {"ktx cube", ktx1File({.type = 0, .format = 0, .internal = 0x83f3, .width = 4, .height = 4, .faces = 6},
                                  {std::vector<std::string>(6, blocksOf(1, 16))})},
            {"ktx floats", ktx1File({.type = kFloatType, .unit = 4, .format = kRgbFormat, .width = 1, .height = 1},
                                    {{little(0x3f800000, 4) + little(0x3f000000, 4) + little(0x40000000, 4)}})},
            {"ktx2 etc2", ktxFile({.format = 151, .width = 4, .height = 4, .scheme = 2}, {kEtcBlock})},
            {"ktx2 astc",
             ktxFile({.format = 166, .width = 7, .height = 7}, {kAstcBlock + kAstcBlock + kAstcBlock + kAstcBlock})},
            {"astc", std::string("\x13\xab\xa1\x5c\x05\x04\x01", 7) + little(7, 3) + little(3, 3) + little(1, 3) +
                         kAstcBlock + kAstcBlock},
            {"pkm", "PKM 20" + big(3, 2) + big(4, 2) + big(4, 2) + big(3, 2) + big(4, 2) + kEtcBlock}};
}

TEST(Ktx1Pictures, SayTheSamePixelsInEitherOrderOfBytes) {
    for (const auto& [name, file] : ktx1Samples()) {
        const DecodedImage image = imageIn(file);
        ASSERT_EQ(image.widthPx, 2) << name;
        ASSERT_EQ(image.heightPx, 3) << name;
        ASSERT_EQ(image.rgba.size(), 24u) << name;
        for (std::size_t i = 0; i < 24; ++i)
            EXPECT_EQ(std::to_integer<int>(image.rgba[i]), kTexels[i / 4][i % 4]) << name << ", byte " << i;
    }
}

TEST(Ktx1Pictures, OfFewBitsGreyAndFloats) {
    const auto first = [](const Ktx1& ktx, const std::string& texel) {
        const DecodedImage image = imageIn(ktx1File(ktx, {{texel}}));
        std::string text;
        for (std::size_t i = 0; i < 4 && i < image.rgba.size(); ++i)
            text += std::to_string(std::to_integer<int>(image.rgba[i])) + ' ';
        return text;
    };
    const Ktx1 one{.width = 1, .height = 1};
    const auto of = [one](std::uint32_t type, std::uint32_t unit, std::uint32_t format) {
        Ktx1 ktx = one;
        ktx.type = type, ktx.unit = unit, ktx.format = format;
        return ktx;
    };
    EXPECT_EQ(first(of(0x8363, 2, kRgbFormat), little(0xf81f, 2)), "255 0 255 255 ");
    EXPECT_EQ(first(of(0x8033, 2, kRgbaFormat), little(0xf0f8, 2)), "255 0 255 136 ");
    EXPECT_EQ(first(of(0x8034, 2, kRgbaFormat), little(0xf83e, 2)), "255 0 255 0 ");
    EXPECT_EQ(first(of(0x8368, 4, kRgbaFormat), little(0xc00003ff, 4)), "255 0 0 255 ");
    EXPECT_EQ(first(of(kByteType, 1, 0x190a), little(0x4080, 2)), "128 128 128 64 ") << "light and opacity";
    EXPECT_EQ(first(of(kByteType, 1, 0x1909), little(0x80, 1)), "128 128 128 255 ") << "light";
    EXPECT_EQ(first(of(kByteType, 1, 0x1906), little(0x80, 1)), "0 0 0 128 ") << "opacity";
    // 1, 0.5 and 2, with the exponent that they share.
    const std::string halves = little(0x3c00, 2) + little(0x3800, 2) + little(0x4000, 2);
    EXPECT_EQ(first(of(kHalfType, 2, kRgbFormat), halves), "64 32 128 130 ");
    EXPECT_EQ(first(of(kHalfType, 2, 0x1903), little(0x3c00, 2)), "128 128 128 129 ") << "alone";
    EXPECT_EQ(first(of(kHalfType, 2, 0x8227), halves), "128 64 0 129 ") << "no blue";
    EXPECT_EQ(imageIn(blockSamples().at("ktx floats")).rgba,
              (Bytes{std::byte{64}, std::byte{32}, std::byte{128}, std::byte{130}}));
}

TEST(Ktx1Pictures, KeepBlocksMipmapsAndCubes) {
    const DecodedImage mipmaps = imageIn(blockSamples().at("ktx bc1"));
    EXPECT_EQ(mipmaps.encoding, PictureMessage::BC1);
    EXPECT_EQ(mipmaps.mipmaps, 4);
    EXPECT_EQ(asText(mipmaps.rgba), blocksOf(4) + blocksOf(1) + blocksOf(1) + blocksOf(1));
    const DecodedImage cube = imageIn(blockSamples().at("ktx cube"));
    EXPECT_EQ(cube.shape, PictureMessage::CUBE);
    EXPECT_EQ(cube.encoding, PictureMessage::BC3);
    EXPECT_EQ(cube.rgba.size(), 6u * 16);
    // Faces of three bytes begin at multiples of four.
    std::vector<std::string> faces;
    for (int i = 0; i < 6; ++i) faces.push_back(little(0x302010 + static_cast<std::uint64_t>(i), 3));
    const DecodedImage small = imageIn(ktx1File({.format = kRgbFormat, .width = 1, .height = 1, .faces = 6}, {faces}));
    ASSERT_EQ(small.rgba.size(), 24u);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(std::to_integer<std::size_t>(small.rgba[4 * i]), 0x10 + i);
    const std::pair<std::uint32_t, PictureMessage::Encoding> kinds[] = {
        {0x8c4d, PictureMessage::BC1}, {0x83f2, PictureMessage::BC2}, {0x8c4f, PictureMessage::BC3},
        {0x8dbb, PictureMessage::BC4}, {0x8dbd, PictureMessage::BC5}, {0x8e8f, PictureMessage::BC6H},
        {0x8e8d, PictureMessage::BC7}};
    for (const auto& [internal, encoding] : kinds)
        EXPECT_EQ(imageIn(ktx1File(ofBlocks(internal, 4, 4), {{blocksOf(1, 16)}})).encoding, encoding) << internal;
}

TEST(BlockPictures, AreTheirBlocksPixels) {
    const auto all = blockSamples();
    EXPECT_EQ(imageIn(all.at("ktx etc1")).rgba, decodedEtc(EtcFormat::kRgb));
    EXPECT_EQ(imageIn(all.at("ktx2 etc2")).rgba, decodedEtc(EtcFormat::kRgba));
    // 3 × 4 of a block's 4 × 4.
    const DecodedImage pkm = imageIn(all.at("pkm"));
    EXPECT_EQ(pkm.widthPx, 3);
    const Bytes block = decodedEtc(EtcFormat::kRgba);
    for (std::size_t y = 0; y < 4; ++y)
        EXPECT_EQ(asText(ByteSpan(pkm.rgba).subspan(12 * y, 12)), asText(ByteSpan(block).subspan(16 * y, 12))) << y;
    // Two blocks of 5 × 4 make 7 × 3, four of 6 × 6 make 7 × 7: all of one colour.
    for (const auto& [name, texelCount] : {std::pair("astc", 21u), std::pair("ktx2 astc", 49u)}) {
        const DecodedImage astc = imageIn(all.at(name));
        ASSERT_EQ(astc.rgba.size(), std::size_t{4} * texelCount) << name;
        for (std::size_t i = 0; i < texelCount; ++i)
            EXPECT_EQ(asText(ByteSpan(astc.rgba).subspan(4 * i, 4)), "\x20\x40\x60\xff") << name << ' ' << i;
        EXPECT_EQ(astc.encoding, PictureMessage::SRGB);
    }
}

TEST(BlockPictures, OfAllKindsThatOpenGlAndVulkanNumber) {
    // ETC2 and EAC as OpenGL numbers them, and as Vulkan does; some twice, with sRGB's colours.
    const std::pair<std::uint32_t, EtcFormat> kGl[] = {
        {0x9274, EtcFormat::kRgb},           {0x9275, EtcFormat::kRgb},       {0x9276, EtcFormat::kRgbCutOut},
        {0x9277, EtcFormat::kRgbCutOut},     {0x9278, EtcFormat::kRgba},      {0x9279, EtcFormat::kRgba},
        {0x9270, EtcFormat::kRed},           {0x9271, EtcFormat::kSignedRed}, {0x9272, EtcFormat::kRedGreen},
        {0x9273, EtcFormat::kSignedRedGreen}};
    const std::pair<std::uint32_t, EtcFormat> kVulkan[] = {
        {147, EtcFormat::kRgb},           {148, EtcFormat::kRgb},       {149, EtcFormat::kRgbCutOut},
        {150, EtcFormat::kRgbCutOut},     {151, EtcFormat::kRgba},      {152, EtcFormat::kRgba},
        {153, EtcFormat::kRed},           {154, EtcFormat::kSignedRed}, {155, EtcFormat::kRedGreen},
        {156, EtcFormat::kSignedRedGreen}};
    for (const auto& [number, format] : kGl)
        EXPECT_EQ(imageIn(ktx1File(ofBlocks(number, 4, 4), {{kEtcBlock.substr(0, etcBlockBytes(format))}})).rgba,
                  decodedEtc(format))
            << std::hex << number;
    for (const auto& [number, format] : kVulkan)
        EXPECT_EQ(
            imageIn(ktxFile({.format = number, .width = 4, .height = 4}, {kEtcBlock.substr(0, etcBlockBytes(format))}))
                .rgba,
            decodedEtc(format))
            << number;
    constexpr unsigned kSizes[14][2] = {{4, 4}, {5, 4},  {5, 5},  {6, 5},  {6, 6},   {8, 5},   {8, 6},
                                        {8, 8}, {10, 5}, {10, 6}, {10, 8}, {10, 10}, {12, 10}, {12, 12}};
    // One of whose texels all differ; linear and sRGB's.
    const std::string block("\x53\x80\x00\xff\x00\x80\x40\xc0\x12\x34\x56\x78\x9a\xbc\xde\xf0", 16);
    for (std::uint32_t i = 0; i < 14; ++i)
        for (const bool srgb : {false, true}) {
            const auto [width, height] = kSizes[i];
            Bytes expected(std::size_t{4} * width * height);
            AstcDecoder(width, height, srgb ? AstcDecoder::Colours::kSrgb : AstcDecoder::Colours::kLinear)
                .decode(asBytes(block).data(), expected.data());
            EXPECT_EQ(imageIn(ktx1File(ofBlocks((srgb ? 0x93d0 : 0x93b0) + i, width, height), {{block}})).rgba,
                      expected);
            EXPECT_EQ(imageIn(ktxFile({.format = 157 + 2 * i + srgb, .width = width, .height = height}, {block})).rgba,
                      expected);
        }
}

TEST(BlockPictures, WhatIsNotReadIsNamed) {
    EXPECT_WORDS(refusal(ktx1File(ofBlocks(0x8e8e), {{blocksOf(4, 16)}})));
    EXPECT_WORDS(refusal(ktx1File(ofBlocks(0x93c3), {{kAstcBlock}})));
    EXPECT_WORDS(refusal(ktx1File(ofBlocks(0x8c00), {{kAstcBlock}})));
    EXPECT_WORDS(refusal(ktx1File({.layers = 3}, {{texels("rgba")}})));
    EXPECT_WORDS(refusal(ktx1File({.format = 0x8d99}, {{texels("rgba")}})));
    const std::string upwards = std::string("KTXorientation\0S=r,T=u\0", 23);
    Ktx1 blocks = ofBlocks(0x83f0);
    blocks.keys = upwards;
    EXPECT_WORDS(refusal(ktx1File(blocks, {{blocksOf(4)}})));
    const std::string hdr = std::string("\xfc\xff", 2) + std::string(14, '\xff');
    EXPECT_WORDS(refusal(ktx1File(ofBlocks(0x93b0, 4, 4), {{hdr}})));
    EXPECT_WORDS(refusal(ktxFile({.format = 1000066000, .width = 4, .height = 4}, {hdr})));
    EXPECT_WORDS(refusal(std::string("\x13\xab\xa1\x5c\x03\x03\x03", 7) + std::string(30, '\0')));
    EXPECT_WORDS(refusal("PKM 20" + big(9, 2) + std::string(30, '\0')));
    EXPECT_WORDS(refusal(ktxFile({.format = 0, .scheme = 1}, {"x"})));
}

TEST(BlockPictures, SizesThatAreNotThereTakeNoMemory) {
    for (const std::string& file :
         {ktx1File(ofBlocks(0x9278, 16384, 16384), {{kEtcBlock}}),
          ktx1File(ofBlocks(0x93bd, 16384, 16384), {{kAstcBlock}}),
          ktx1File({.width = 0xffffffff, .height = 0xffffffff}, {{"x"}}),
          ktxFile({.format = 184, .width = 16384, .height = 16384, .scheme = 2}, {kAstcBlock}),
          std::string("\x13\xab\xa1\x5c\x0c\x0c\x01", 7) + little(16384, 3) + little(16384, 3) + little(1, 3) +
              kAstcBlock,
          "PKM 20" + big(3, 2) + big(0xffff, 2) + big(0xffff, 2) + big(0xffff, 2) + big(0xffff, 2) + kEtcBlock})
        EXPECT_NE(refusal(file), "decoded");
}

/// 12 × 12 texels of a colour each.
std::string astcOf(std::size_t side, char red) {
    std::string blocks, block = kAstcBlock;
    block[8] = '\0';
    block[9] = red;
    for (std::size_t i = 0; i < (side + 11) / 12 * ((side + 11) / 12); ++i) blocks += block;
    return blocks;
}

TEST(BlockPictures, LargerThanWantedShowTheMipmapThatIsNot) {
    const std::string file = ktxFile({.format = 184, .width = 400, .height = 400, .scheme = 2},
                                     {astcOf(400, 10), astcOf(200, 20), astcOf(100, 30)});
    for (const auto& [most, side, red] : {std::tuple(400, 400, 10), {399, 200, 20}, {100, 100, 30}, {60, 50, 30}}) {
        const DecodedImage image = pictureIn(file, most).value();
        EXPECT_EQ(image.widthPx, side);
        EXPECT_EQ(image.heightPx, side);
        EXPECT_EQ(image.mipmaps, 1);
        EXPECT_EQ(image.halved, side < 400);
        EXPECT_EQ(image.rgba.size(), static_cast<std::size_t>(4 * side * side));
        EXPECT_EQ(image.rgba.back(), std::byte{255});
        EXPECT_EQ(std::to_integer<int>(image.rgba.front()), red);
    }
}

TEST(BlockPictures, OfFewBytesAreDecodedAsFarAsTheseBear) {
    EXPECT_WORDS(refusal(ktxFile({.format = 184, .width = 16384, .height = 16384, .scheme = 2}, {astcOf(16384, 10)})));
    EXPECT_WORDS(refusal(ktxFile({.format = 145, .width = 16384, .height = 16384, .scheme = 2},
                                 {std::string(std::size_t{1} << 28, '\0')})))
        << "of blocks that stay, as well";
}

TEST(BlockPictures, CutOffTheyAreWholeOrRefused) {
    auto all = blockSamples();
    for (const auto& [name, file] : ktx1Samples()) all["ktx " + name] = file;
    for (const auto& [name, file] : all) {
        const Bytes whole = imageIn(file).rgba;
        for (std::size_t length = 0; length < file.size(); ++length) {
            const Expected<DecodedImage> image = pictureIn(file.substr(0, length));
            if (image) EXPECT_EQ(image->rgba, whole) << name << ", " << length << " of " << file.size();
        }
    }
}

TEST(BlockPictures, AnyDamageLeadsToAPictureOrAnError) {
    auto all = blockSamples();
    for (const auto& [name, file] : ktx1Samples()) all["ktx " + name] = file;
    damageEach(all, 2000, "BlockPictures.AnyDamage*");
}

}  // namespace
}  // namespace tessera
