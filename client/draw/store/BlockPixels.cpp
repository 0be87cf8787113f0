#include "client/draw/store/BlockPixels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/cores/Image.h"

namespace tessera {
namespace {

using BlockColors = std::array<std::array<std::uint8_t, 4>, 16>;

unsigned byteAt(const std::byte* block, std::size_t i) {
    return std::to_integer<unsigned>(block[i]);
}

/// Two ends of 5, 6 and 5 bits and what lies between them. `punched`: bc1, whose fourth is nothing where the first end
/// is not the larger.
void colorsOf(const std::byte* block, bool punched, BlockColors& out) {
    std::array<std::array<unsigned, 4>, 4> palette{};
    const std::array<unsigned, 2> ends = {byteAt(block, 0) | byteAt(block, 1) << 8, byteAt(block, 2) | byteAt(block, 3)
                                                                                                           << 8};
    for (std::size_t i = 0; i < 2; ++i) {
        const unsigned r = ends[i] >> 11, g = ends[i] >> 5 & 63, b = ends[i] & 31;
        palette[i] = {r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2, 255};
    }
    const bool three = punched && ends[0] <= ends[1];
    for (std::size_t c = 0; c < 3; ++c) {
        const unsigned a = palette[0][c], b = palette[1][c];
        palette[2][c] = three ? (a + b) / 2 : (2 * a + b + 1) / 3;
        palette[3][c] = three ? 0 : (a + 2 * b + 1) / 3;
    }
    palette[2][3] = 255;
    palette[3][3] = three ? 0 : 255;
    for (std::size_t i = 0; i < 16; ++i) {
        const auto& color = palette[byteAt(block, 4 + i / 4) >> 2 * (i % 4) & 3];
        for (std::size_t c = 0; c < 4; ++c) out[i][c] = static_cast<std::uint8_t>(color[c]);
    }
}

/// Two ends and six between them, or four, 0 and 255.
void stepsOf(const std::byte* block, std::size_t channel, BlockColors& out) {
    std::array<unsigned, 8> palette{byteAt(block, 0), byteAt(block, 1)};
    const unsigned a = palette[0], b = palette[1], steps = a > b ? 7 : 5;
    for (unsigned i = 1; i < steps; ++i) palette[1 + i] = ((steps - i) * a + i * b + steps / 2) / steps;
    if (a <= b) palette[6] = 0, palette[7] = 255;
    std::uint64_t indices = 0;
    for (std::size_t i = 0; i < 6; ++i) indices |= std::uint64_t{byteAt(block, 2 + i)} << 8 * i;
    for (auto& pixel : out) {
        pixel[channel] = static_cast<std::uint8_t>(palette[indices & 7]);
        indices >>= 3;
    }
}

void decodeBlock(const std::byte* block, std::int64_t encoding, BlockColors& out) {
    switch (encoding) {
        case Image::kBc1:
            return colorsOf(block, true, out);
        case Image::kBc2:
            colorsOf(block + 8, false, out);
            for (std::size_t i = 0; i < 16; ++i)
                out[i][3] = static_cast<std::uint8_t>(17 * (byteAt(block, i / 2) >> 4 * (i % 2) & 15));
            return;
        case Image::kBc3:
            colorsOf(block + 8, false, out);
            return stepsOf(block, 3, out);
        case Image::kBc4:
            stepsOf(block, 0, out);
            for (auto& pixel : out) pixel = {pixel[0], pixel[0], pixel[0], 255};
            return;
        default:
            stepsOf(block, 0, out);
            stepsOf(block + 8, 1, out);
            for (auto& pixel : out) {
                const double x = pixel[0] / 127.5 - 1, y = pixel[1] / 127.5 - 1;
                pixel[2] =
                    static_cast<std::uint8_t>(std::lround(127.5 + 127.5 * std::sqrt(std::max(0.0, 1 - x * x - y * y))));
                pixel[3] = 255;
            }
    }
}

}  // namespace

Bytes decodeBlocks(ByteSpan blocks, std::int64_t encoding, std::int64_t widthPx, std::int64_t heightPx) {
    const auto width = static_cast<std::size_t>(widthPx), height = static_cast<std::size_t>(heightPx);
    const std::size_t blockBytes = encoding == Image::kBc1 || encoding == Image::kBc4 ? 8 : 16;
    const std::size_t across = (width + 3) / 4;
    Bytes pixels(width * height * 4);
    BlockColors colors{};
    for (std::size_t i = 0; (i + 1) * blockBytes <= blocks.size() && i < across * ((height + 3) / 4); ++i) {
        decodeBlock(blocks.data() + i * blockBytes, encoding, colors);
        const std::size_t left = i % across * 4, top = i / across * 4;
        for (std::size_t y = top; y < std::min(top + 4, height); ++y)
            for (std::size_t x = left; x < std::min(left + 4, width); ++x)
                for (std::size_t c = 0; c < 4; ++c)
                    pixels[4 * (y * width + x) + c] = static_cast<std::byte>(colors[4 * (y - top) + x - left][c]);
    }
    return pixels;
}

}  // namespace tessera
