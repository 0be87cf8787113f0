// Films whose pictures are known: each is found by its time, from wherever, and in whatever form it was written.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "common/base/FileHandle.h"
#include "common/cores/Image.h"
#include "server/movies/decoder/FilmDecoder.h"
#include "server/movies/decoder/FilmPicture.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/movies/NumberedFilm.h"
#include "tests/unit/movies/Seed.h"

namespace tessera::test {
namespace {

struct Kind {
    const char* codec;
    const char* pixels;
    const char* file;
};
/// Lossless and not, with and without pictures between that need others, indexed and not.
constexpr Kind kKinds[] = {
    {"ffv1", "bgr0", "a.mkv"},          {"ffv1", "yuv420p10le", "b.mkv"},  {"mpeg4", "yuv420p", "c.mp4"},
    {"mpeg4", "yuv420p", "d.avi"},      {"mjpeg", "yuvj420p", "e.avi"},    {"png", "rgb24", "f.mov"},
    {"mpeg2video", "yuv420p", "g.mkv"}, {"gif", "gray", "h.gif"},          {"huffyuv", "rgb24", "i.avi"},
    {"ffv1", "gray", "j.mkv"},          {"mpeg2video", "yuv420p", "k.ts"}, {"ffv1", "bgra", "l.mkv"}};

class OpenFilm {
public:
    explicit OpenFilm(const std::string& path) : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
        auto opened = FilmDecoder::open(file_.get());
        if (opened)
            decoder = std::move(*opened);
        else
            problem = opened.error().message;
    }
    /// What a picture shows; -1: nothing that can be read.
    int number(const FilmDecoder::Shown& shown) {
        std::vector<std::uint8_t> slot(kFilmSlotBytes);
        const auto written = pictures_.write(*shown.frame, decoder->orientation(), slot);
        if (!written || written->encoding != Image::kSrgb) return -1;
        return numberIn(slot, static_cast<int>(written->widthPx), static_cast<int>(written->heightPx));
    }
    std::unique_ptr<FilmDecoder> decoder;
    std::string problem;

private:
    FileHandle file_;
    FilmPictures pictures_;
};

TEST(FilmDecoder, EveryPictureOfEveryKindIsFoundByItsTime) {
    TestFolder folder;
    const std::uint64_t seed = seedOfRun();
    SCOPED_TRACE(againWith(seed));
    std::mt19937_64 random(seed);
    for (const Kind& kind : kKinds) {
        SCOPED_TRACE(fmt::format("{} {} {}", kind.codec, kind.pixels, kind.file));
        const std::string path = folder / kind.file;
        const int pictures = 30 + static_cast<int>(random() % 60);
        ASSERT_TRUE(makeFilm(path, {.codec = kind.codec,
                                    .pixels = kind.pixels,
                                    .pictures = pictures,
                                    .keyEvery = 1 + static_cast<int>(random() % 20),
                                    .sound = std::string(kind.file).ends_with("avi")}));
        OpenFilm film(path);
        ASSERT_TRUE(film.decoder) << film.problem;
        std::vector<double> begins;
        for (int i = 0; i < pictures; ++i) {
            const auto shown = i == 0 ? film.decoder->at(0) : film.decoder->following(0, false);
            ASSERT_TRUE(shown) << shown.error().message;
            ASSERT_EQ(film.number(*shown), i);
            EXPECT_NEAR(shown->begin, 0.04 * i, 0.011) << "a GIF counts in hundredths";
            begins.push_back(shown->begin);
        }
        const auto last = film.decoder->following(0, false);
        ASSERT_TRUE(last);
        EXPECT_EQ(film.number(*last), pictures - 1) << "after the last the last";
        EXPECT_NEAR(film.decoder->length(), 0.04 * pictures, 0.05);
        const auto again = film.decoder->following(0, true);
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_TRUE(again->wrapped);
        EXPECT_EQ(film.number(*again), 0);
        for (int i = 0; i < 25; ++i) {
            // Within a picture, not at its edges, whose times containers round.
            const auto wanted = static_cast<std::size_t>(random() % static_cast<std::size_t>(pictures));
            const auto shown = film.decoder->at(begins[wanted] + 0.015);
            ASSERT_TRUE(shown) << shown.error().message;
            ASSERT_EQ(film.number(*shown), static_cast<int>(wanted)) << "look " << i;
        }
    }
}

TEST(FilmDecoder, PicturesOfUnevenLengthAreShownForAsLongAsTheyLast) {
    TestFolder folder;
    const std::vector<std::int64_t> times = {0, 10, 500, 510, 2000, 2001, 9000};
    const std::string path = folder / "uneven.mkv";
    ASSERT_TRUE(makeFilm(path, {.pictures = 7, .times = times}));
    OpenFilm film(path);
    ASSERT_TRUE(film.decoder) << film.problem;
    for (std::size_t i = times.size() - 1; i-- > 0;) {
        const double begin = 1e-3 * static_cast<double>(times[i]), end = 1e-3 * static_cast<double>(times[i + 1]);
        for (const double at : {begin + 1e-4, 0.5 * (begin + end), end - 1e-4}) {
            const auto shown = film.decoder->at(at);
            ASSERT_TRUE(shown);
            EXPECT_EQ(film.number(*shown), static_cast<int>(i)) << at;
            EXPECT_NEAR(shown->begin, begin, 1e-6);
            EXPECT_NEAR(shown->end, end, 1e-6);
        }
    }
}

TEST(FilmDecoder, WhatIsTurnedIsShownUpright) {
    TestFolder folder;
    const auto pixelsOf = [&](int turned, int& width, int& height) {
        const std::string path = folder / fmt::format("{}.mov", turned);
        EXPECT_TRUE(makeFilm(
            path,
            {.codec = "png", .pixels = "rgb24", .widthPx = 41, .heightPx = 23, .pictures = 1, .turnedDeg = turned}));
        const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
        auto decoder = FilmDecoder::open(file.get());
        EXPECT_TRUE(decoder);
        const auto shown = (*decoder)->at(0);
        FilmPictures pictures;
        std::vector<std::uint8_t> slot(kFilmSlotBytes);
        const auto written = pictures.write(*shown->frame, (*decoder)->orientation(), slot);
        EXPECT_TRUE(written);
        width = static_cast<int>(written->widthPx);
        height = static_cast<int>(written->heightPx);
        slot.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
        return slot;
    };
    const std::vector<std::uint8_t> truth = numberedPixels(0, 41, 23);
    const auto at = [](const std::vector<std::uint8_t>& pixels, int width, int x, int y) {
        return pixels[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
                      4];
    };
    for (const int turned : {0, 90, 180, 270}) {
        SCOPED_TRACE(turned);
        int width = 0, height = 0;
        const std::vector<std::uint8_t> pixels = pixelsOf(turned, width, height);
        ASSERT_EQ(width, turned % 180 == 0 ? 41 : 23);
        ASSERT_EQ(height, turned % 180 == 0 ? 23 : 41);
        for (int y = 0; y < 23; ++y)
            for (int x = 0; x < 41; ++x) {
                // Clockwise by a quarter: the left edge becomes the upper one, the upper one the right.
                const int toX = turned == 0 ? x : turned == 90 ? 22 - y : turned == 180 ? 40 - x : y;
                const int toY = turned == 0 ? y : turned == 90 ? x : turned == 180 ? 22 - y : 40 - x;
                ASSERT_EQ(at(pixels, width, toX, toY), at(truth, 41, x, y)) << x << ", " << y;
            }
    }
}

TEST(FilmDecoder, WhatLetsThroughStaysSo) {
    TestFolder folder;
    for (const int side : {64, 300}) {
        const std::string path = folder / fmt::format("{}.mkv", side);
        ASSERT_TRUE(makeFilm(path, {.pixels = "bgra", .widthPx = side, .heightPx = side, .pictures = 1, .alpha = 77}));
        const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
        auto decoder = FilmDecoder::open(file.get());
        ASSERT_TRUE(decoder);
        FilmPictures pictures;
        std::vector<std::uint8_t> slot(kFilmSlotBytes);
        const auto written = pictures.write(*(*decoder)->at(0)->frame, (*decoder)->orientation(), slot);
        ASSERT_TRUE(written);
        EXPECT_EQ(written->encoding, side == 64 ? Image::kSrgb : Image::kBc3);
        if (side == 64)
            EXPECT_TRUE(std::ranges::equal(std::span(slot).first(written->sizeBytes), numberedPixels(0, 64, 64, 77)));
        // Of a bc3 block the first two bytes are the ends of what lets through.
        const std::size_t right = 16 * (300 / 4 - 1);
        if (side == 300) EXPECT_TRUE(slot[right] == 77 && slot[0] == 255) << int(slot[right]);
    }
}

TEST(FilmDecoder, WhatIsNoFilmIsNamed) {
    TestFolder folder;
    ASSERT_TRUE(makeFilm(folder / "sound.wav", {.codec = "", .sound = true}));
    EXPECT_EQ(OpenFilm(folder / "sound.wav").problem, "it has sound and no moving pictures");
    ASSERT_TRUE(makeFilm(folder / "none.mkv", {.pictures = 0}));
    EXPECT_NE(OpenFilm(folder / "none.mkv").problem, "");
    EXPECT_NE(OpenFilm("/dev/null").problem, "");
    EXPECT_WORDS(OpenFilm("/etc/passwd").problem);
    const char* const lists[] = {"#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:9,\na.ts\n",
                                 "\xEF\xBB\xBF#EXTM3U\na.avi\n",
                                 "ffconcat version 1.0\nfile a.avi\n",
                                 "\n[playlist]\nFile1=a.avi\n",
                                 "<?xml version=\"1.0\"?>\n<MPD><Period/></MPD>\n",
                                 "<asx version=\"3.0\"></asx>\n"};
    for (const char* const list : lists)
        for (const char* const name : {"list.m3u8", "list.avi"}) {
            std::ofstream(folder / name) << list;
            EXPECT_EQ(OpenFilm(folder / name).problem, "it is a playlist, which names films, and no film itself")
                << list;
        }
}

TEST(FilmPictures, MipmapsAreMeans) {
    std::vector<std::uint8_t> pixels(64 * 32 * 4), blocks(65536);
    double sum = 0;
    for (int i = 0; i < 64 * 32; ++i) {
        pixels[static_cast<std::size_t>(4 * i)] = static_cast<std::uint8_t>(i * 37 % 251);
        sum += i * 37 % 251;
    }
    std::uint32_t mipmaps = 0;
    EXPECT_EQ(writeFilmBlocks(pixels, 64, 32, true, blocks.data(), mipmaps),
              16u * (16 * 8 + 8 * 4 + 4 * 2 + 2 * 1 + 3));
    EXPECT_EQ(mipmaps, 7u);
    EXPECT_NEAR(pixels[0], sum / (64 * 32), 3) << "each of six is rounded by a half at most";
}

TEST(FilmPictures, BlocksAreNearWhatTheyStandFor) {
    // Block corners of a smooth picture: bc1 has 5 or 6 bits a channel and two colours between.
    const int width = 61, height = 35;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height) * 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            std::uint8_t* p = pixels.data() + (y * width + x) * 4;
            p[0] = static_cast<std::uint8_t>(4 * x);
            p[1] = static_cast<std::uint8_t>(7 * y);
            p[2] = 90;
            p[3] = 255;
        }
    std::vector<std::uint8_t> work = pixels, blocks(65536);
    std::uint32_t mipmaps = 0;
    const std::size_t size = writeFilmBlocks(work, width, height, false, blocks.data(), mipmaps);
    EXPECT_EQ(mipmaps, 6u);
    EXPECT_EQ(size, 8u * (16 * 9 + 8 * 5 + 4 * 2 + 2 * 1 + 1 + 1));
    int worst = 0;
    for (int by = 0; by < 9; ++by)
        for (int bx = 0; bx < 16; ++bx) {
            const std::uint8_t* b = blocks.data() + 8 * (by * 16 + bx);
            const int c0 = b[0] | b[1] << 8, c1 = b[2] | b[3] << 8;
            ASSERT_GE(c0, c1) << "else a pixel could let through";
            const auto red = [](int c) { return (c >> 11) * 255 / 31; };
            for (int i = 0; i < 16; ++i) {
                const int x = 4 * bx + i % 4, y = 4 * by + i / 4;
                if (x >= width || y >= height) continue;
                const int which = b[4 + i / 4] >> (2 * (i % 4)) & 3;
                const int value = which == 0   ? red(c0)
                                  : which == 1 ? red(c1)
                                  : which == 2 ? (2 * red(c0) + red(c1)) / 3
                                               : (red(c0) + 2 * red(c1)) / 3;
                worst = std::max(worst, std::abs(value - pixels[static_cast<std::size_t>(y * width + x) * 4]));
            }
        }
    EXPECT_LE(worst, 24) << "a block is 12 wide in red and 21 in green, on one line";
}

}  // namespace
}  // namespace tessera::test
