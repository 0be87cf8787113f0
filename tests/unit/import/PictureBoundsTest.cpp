// PNG files of all kinds, and pictures of few bytes that are much.
#include <gtest/gtest.h>

#include <string>

#include "server/import/reader/HalvedRows.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"
#include "tests/unit/import/PngBytes.h"

namespace tessera {
namespace {

std::string pixelsIn(const std::string& file, int most = 4096) {
    const Expected<DecodedImage> image = pictureIn(file, most);
    return image ? std::string(asText(image->rgba)) : image.error().message;
}

TEST(PngPictures, OfAllKindsBecomeFourBytesAPixel) {
    const std::string plain(1, '\0');
    EXPECT_EQ(pixelsIn(pngOf(2, 3, {},
                             plain + texels("rgba").substr(0, 8) + plain + texels("rgba").substr(8, 8) + plain +
                                 texels("rgba").substr(16))),
              texels("rgba"));
    const auto grey = [](std::initializer_list<int> values) {
        std::string pixels;
        for (const int value : values) pixels += std::string(3, static_cast<char>(value)) + '\xff';
        return pixels;
    };
    EXPECT_EQ(pixelsIn(pngOf(4, 1, {.bits = 2, .colours = 0}, plain + '\x1b')), grey({0, 85, 170, 255}));
    EXPECT_EQ(pixelsIn(pngOf(2, 1, {.bits = 16, .colours = 0}, plain + "\x7f\xff\x80\1")), grey({127, 128}));
    EXPECT_EQ(pixelsIn(pngOf(1, 1, {.colours = 4}, plain + "\x11\x22")), "\x11\x11\x11\x22");
    EXPECT_EQ(pixelsIn(pngOf(2, 1, {.bits = 4, .colours = 3}, plain + '\x01',
                             pngChunk("PLTE", "abcdef") + pngChunk("tRNS", "\x7f"))),
              "abc\x7f"
              "def\xff");
    EXPECT_EQ(pixelsIn(pngOf(2, 1, {.colours = 2}, plain + "abcdef", pngChunk("tRNS", std::string("\0a\0b\0c", 6)))),
              std::string("abc\0def\xff", 8));
    // Seven passes, of which such a small picture has four.
    EXPECT_EQ(pixelsIn(pngOf(2, 2, {.colours = 0, .passes = 1}, plain + '\1' + plain + '\2' + plain + "\3\4")),
              grey({1, 2, 3, 4}));
}

TEST(PngPictures, AreReadWhateverSumsSayAndRefusedWhereRowsAreMissing) {
    const std::string sound = blackPng(8, 8), pixels = pixelsIn(sound);
    constexpr std::size_t kEndBytes = 12, kSumBytes = 4;
    for (const std::size_t sums : {1, 2}) {  // that of the chunk, and that of what it unpacks to
        std::string file = sound;
        file[file.size() - kEndBytes - sums * kSumBytes] ^= 1;
        EXPECT_EQ(pixelsIn(file), pixels);
    }
    const std::string cut = pngOf(8, 8, {.bits = 1, .colours = 0}, std::string(9, '\0'));
    EXPECT_EQ(pixelsIn(cut), "a PNG picture that is cut off or damaged in row 4 of 8");
    EXPECT_EQ(pixelsIn(kPngStart + "IHDR"), "a PNG picture whose header is cut off or damaged");
    EXPECT_EQ(pixelsIn(kPngStart + big(4, 4) + "CgBI" + std::string(8, '\0')),
              "a PNG picture made for iPhones (CgBI), which is not read");
}

/// As `halve` does it, again and again.
TEST(HalvedRows, AreWhatIsHalvedWhenAllIsThere) {
    std::string rows;
    constexpr std::size_t kWidth = 37, kHeight = 23;
    for (std::size_t y = 0; y < kHeight; ++y) {
        rows += '\0';
        for (std::size_t i = 0; i < 4 * kWidth; ++i) rows += static_cast<char>(i * i * 7 + y * 31 + i * y);
    }
    const std::string png = pngOf(kWidth, kHeight, {}, rows);
    for (const int most : {20, 10, 5, 1}) {
        DecodedImage whole = pictureIn(png).value();
        while (std::max(whole.widthPx, whole.heightPx) > most) ASSERT_TRUE(halve(whole));
        const DecodedImage small = pictureIn(png, most).value();
        EXPECT_TRUE(small.halved);
        EXPECT_EQ(small.widthPx, whole.widthPx);
        EXPECT_EQ(small.heightPx, whole.heightPx);
        EXPECT_EQ(small.rgba, whole.rgba) << most;
    }
}

TEST(PixelPool, OfFewBytesIsForAllPicturesTogether) {
    PixelPool pool;
    const auto why = [&](const std::string& file) {
        const Expected<DecodedImage> image = decodeImage(asBytes(file), 64, pool);
        return image ? std::string() : image.error().message;
    };
    const std::string large = blackPng(6000, 6000);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(why(large), "");
    EXPECT_EQ(why(large),
              "a PNG picture of 6000 × 6000 pixels, with the pictures before it, which are more than the 101 million "
              "pixels that are decoded of so few bytes: save the pictures smaller, or with mipmaps");
    EXPECT_EQ(why(blackPng(600, 600)), "") << "there is room for a small one";
    pool.grant(std::size_t{1} << 20);
    EXPECT_EQ(why(large), "") << "a megabyte is 67 million pixels more";
}

/// A zlib stream of so many MiB of zeros, in a thousandth of them.
std::string zeros(int mebibytes) {
    const std::string block(std::size_t{1} << 20, '\0');
    std::string packed(std::size_t{1} << 16, '\0');
    z_stream stream{};
    EXPECT_EQ(::deflateInit2(&stream, 9, Z_DEFLATED, -15, 9, Z_DEFAULT_STRATEGY), Z_OK);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(block.data()));
    stream.avail_in = static_cast<uInt>(block.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    EXPECT_EQ(::deflate(&stream, Z_FULL_FLUSH), Z_OK);  // it ends at a byte, and stands anywhere
    packed.resize(stream.total_out);
    ::deflateEnd(&stream);
    std::string all = "\x78\x01";
    for (int i = 0; i < mebibytes; ++i) all += packed;
    return all + std::string("\3\0\0\0\0\0", 6);
}

/// What says that it is small and unpacks to gigabytes: as a picture, and as an animation's first frame.
TEST(HostilePng, IsUnpackedAsFarAsItsRowsGo) {
    const Scratch scratch;
    const std::string bomb = zeros(1000);
    scratch.write("picture.png", pngHeader(1, 1) + pngChunk("IDAT", bomb) + pngChunk("IEND", ""));
    std::string control;
    for (const int value : {0, 1, 1, 0, 0}) control += big(static_cast<std::uint64_t>(value), 4);
    scratch.write("frame.png", pngHeader(1, 1) + pngChunk("acTL", big(1, 4) + big(0, 4)) +
                                   pngChunk("fcTL", control + std::string("\0\1\0\12\0\0", 6)) +
                                   pngChunk("fdAT", big(1, 4) + bomb) + pngChunk("IEND", ""));
    ImportOptions options = importOptions();
    if (!kSanitized) options.maxCpuTime = std::chrono::seconds(2);
    options.maxMemoryBytes = std::size_t{640} << 20;
    const Expected<ImportedScene> scene = importScene(scratch.write("a.tsct", R"(image { name: "a" uri: "picture.png" }
            image { name: "b" uri: "frame.png" } material { name: "m" base_color_image: "a" emissive_image: "b" }
            node { name: "n" sphere { radius: 1 } material: "m" })"),
                                                      kRootNode, options);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
}

/// Of many scans, each of which says nothing of any block in a few bytes.
TEST(HostileJpeg, OfVeryManyScansIsRefused) {
    const auto segment = [](int marker, const std::string& data) {
        return '\xff' + little(static_cast<std::uint64_t>(marker), 1) + big(data.size() + 2, 2) + data;
    };
    constexpr std::size_t kWidth = 8192, kHeight = 4096, kBlocks = kWidth * kHeight / 64;
    // Tables of one code of one bit: a difference of none; so many blocks without a number, 14 bits say how many.
    const std::string table = '\1' + std::string(15, '\0');
    std::string jpeg = "\xff\xd8" + segment(0xdb, '\0' + std::string(64, '\1')) +
                       segment(0xc2, '\x08' + big(kHeight, 2) + big(kWidth, 2) + std::string("\1\1\x11\0", 4)) +
                       segment(0xc4, '\0' + table + '\0') + segment(0xc4, '\x10' + table + '\xe0') +
                       segment(0xda, std::string("\1\1\0\0\0\0", 6)) + std::string(kBlocks / 8, '\0');
    std::string bits;
    for (std::size_t i = 0; i <= kBlocks / 32767; ++i) bits += '0' + std::string(14, '1');
    std::string scan = segment(0xda, std::string("\1\1\0\1\x3f\0", 6));
    for (std::size_t at = 0; at < bits.size(); at += 8) {
        int byte = 0;
        for (std::size_t i = at; i < at + 8; ++i) byte = byte << 1 | (i < bits.size() && bits[i] == '0' ? 0 : 1);
        scan += static_cast<char>(byte);
        if (byte == 0xff) scan += '\0';
    }
    EXPECT_EQ(pixelsIn(jpeg + scan + "\xff\xd9", 64).size(), std::size_t{4} * 64 * 32);
    for (int i = 0; i < 16'000; ++i) jpeg += scan;
    EXPECT_WORDS(pixelsIn(jpeg + "\xff\xd9", 64));
}

}  // namespace
}  // namespace tessera
