/// Pictures and textures byte by byte, and what is to come of thousands of damaged ones.
#pragma once

#include <gtest/gtest.h>
#include <zstd.h>

#include <array>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "server/import/reader/ImageDecoder.h"

namespace tessera {

using PictureMessage = proto::scene::Image;
using Texel = std::array<int, 4>;

/// Two pixels across, three down: all different, and of a few bits.
inline constexpr std::array<Texel, 6> kTexels = {{{255, 0, 0, 255},
                                                  {0, 255, 0, 255},
                                                  {0, 0, 255, 255},
                                                  {255, 255, 0, 255},
                                                  {0, 255, 255, 255},
                                                  {255, 255, 255, 255}}};

inline std::string little(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(i < 8 ? value >> 8 * i & 255 : 0);
    return text;
}
inline std::string big(std::uint64_t value, int bytes) {
    std::string text = little(value, bytes);
    return {text.rbegin(), text.rend()};
}

/// `order`: which channels, as in "bgra"; rows from the top or from the bottom.
inline std::string texels(const std::string& order, bool fromTop = true, std::size_t rowBytes = 0) {
    std::string text;
    for (std::size_t y = 0; y < 3; ++y) {
        std::string row;
        for (std::size_t x = 0; x < 2; ++x)
            for (const char channel : order)
                row +=
                    static_cast<char>(kTexels[2 * (fromTop ? y : 2 - y) + x][std::string_view("rgba").find(channel)]);
        row.resize(std::max(row.size(), rowBytes));
        text += row;
    }
    return text;
}

/// bc1 blocks of one colour, each its own: the first `count` of a series.
inline std::string blocksOf(std::size_t count, std::size_t bytes = 8) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i)
        text += std::string(bytes - 8, '\xff') + little(0x1000 + i, 2) + little(0, 6);
    return text;
}

/// A KTX2's header.
struct Ktx {
    std::uint32_t format = 37, width = 2, height = 3, depth = 0, layers = 0, faces = 1, scheme = 0;
    std::string keys = {};
    std::uint32_t model = 1;
};
inline std::string ktxFile(const Ktx& ktx, const std::vector<std::string>& levels) {
    const std::string descriptor = little(28, 4) + little(0, 8) + little(ktx.model, 1) + little(0, 15);
    const std::size_t begin = 80 + 24 * levels.size(), data = begin + descriptor.size() + ktx.keys.size();
    std::string text("\xABKTX 20\xBB\r\n\x1A\n", 12);
    for (const std::uint32_t word : {ktx.format, 1u, ktx.width, ktx.height, ktx.depth, ktx.layers, ktx.faces,
                                     static_cast<std::uint32_t>(levels.size()), ktx.scheme})
        text += little(word, 4);
    text += little(begin, 4) + little(descriptor.size(), 4) +
            little(ktx.keys.empty() ? 0 : begin + descriptor.size(), 4) + little(ktx.keys.size(), 4) + little(0, 16);
    std::string index, all;
    for (const std::string& level : levels) {
        std::string packed = level;
        if (ktx.scheme == 2) {
            packed.resize(ZSTD_compressBound(level.size()));
            packed.resize(ZSTD_compress(packed.data(), packed.size(), level.data(), level.size(), 5));
        }
        index += little(data + all.size(), 8) + little(packed.size(), 8) + little(level.size(), 8);
        all += packed;
    }
    return text + index + descriptor + ktx.keys + all;
}

inline Expected<DecodedImage> pictureIn(const std::string& file, int most = 4096) {
    return decodeImage(asBytes(file), most);
}

/// Cuts each file at every byte, and changes bytes `runs` times: a picture of a sound size comes of it, or an error in
/// words, and both do. Reads that go astray show with AddressSanitizer (tests/README.md), those that end the process
/// without as well. `filter`: the test's.
inline void damageEach(const std::map<std::string, std::string>& all, int runs, const std::string& filter) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : 1;
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " unit_import --gtest_filter=" + filter);
    std::mt19937 random(seed);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    std::size_t decodedOnes = 0, refused = 0;
    for (const auto& [name, file] : all) {
        for (std::size_t length = 0; length < file.size(); ++length)
            (pictureIn(file.substr(0, length), 64) ? decodedOnes : refused)++;
        for (int i = 0; i < runs; ++i) {
            std::string damaged = file;
            for (std::size_t k = 1 + below(4); k > 0; --k) {
                // Headers say most.
                const std::size_t at =
                    below(2) ? below(damaged.size()) : below(std::min<std::size_t>(damaged.size(), 160));
                static constexpr std::array<char, 6> kExtremes = {0, 1, '\x7f', '\xff', '\x80', '\x40'};
                damaged[at] = below(2) ? kExtremes[below(6)] : static_cast<char>(random());
            }
            const Expected<DecodedImage> image = pictureIn(damaged, 64);
            (image ? decodedOnes : refused)++;
            if (!image) {
                EXPECT_FALSE(image.error().message.empty());
                continue;
            }
            ASSERT_GT(image->widthPx, 0);
            ASSERT_GT(image->heightPx, 0);
            ASSERT_FALSE(image->rgba.empty());
            if (!image->compressed())
                ASSERT_EQ(image->rgba.size(),
                          std::size_t{4} * static_cast<std::size_t>(image->widthPx) *
                              static_cast<std::size_t>(image->heightPx) *
                              static_cast<std::size_t>(image->shape == PictureMessage::CUBE ? 6 : image->depthPx))
                    << name;
        }
    }
    // Both happen, or nothing was tried.
    EXPECT_GT(decodedOnes, 200u);
    EXPECT_GT(refused, 200u);
}

}  // namespace tessera
