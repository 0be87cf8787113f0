/// 8-bit pictures, PNG files, and the wall's mosaic.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// RGB, 8 bit, sRGB, rows from the top, no padding.
struct Picture {
    int widthPx = 0, heightPx = 0;
    std::vector<std::uint8_t> rgb;

    [[nodiscard]] static Picture filled(int widthPx, int heightPx, std::uint8_t r, std::uint8_t g, std::uint8_t b);
    bool operator==(const Picture&) const = default;
};

/// Where pixels lie that somebody else keeps: four bytes each, red, green, blue (sRGB), and one that means nothing;
/// rows from the top.
struct PixelRows {
    std::uint8_t* rgbx = nullptr;
    std::size_t pitchBytes = 0;  ///< from one row to the next
};

/// The colours of `count` pixels of RGBA, 8 bit each, packed as a picture has them.
void dropAlpha(const std::uint8_t* rgba, std::size_t count, std::uint8_t* rgb);

/// PNG with the frame's number in a text chunk "frame". Fast compression.
[[nodiscard]] Bytes encodePng(const Picture& picture, std::optional<std::uint64_t> frame);
/// Of RGBA, 8 bit each, rows from the top; without alpha where all of it is opaque. Both sides at least 1.
[[nodiscard]] Bytes encodePng(int widthPx, int heightPx, std::span<const std::uint8_t> rgba);
/// Without the last of what the eye would see, at a tenth of a PNG's bytes. `quality` from 1 to 100; sides up to
/// PictureSheet::kMaxSidePx.
[[nodiscard]] Bytes encodeJpeg(const Picture& picture, int quality);
struct DecodedPng {
    Picture picture;
    std::optional<std::uint64_t> frame;
};
/// At most PictureSheet::kMaxSidePx each way; never crashes whatever the bytes are.
[[nodiscard]] Expected<DecodedPng> decodePng(ByteSpan bytes);

/// Writes to a temporary name beside `path` and renames: a reader never sees half a file. Makes missing folders.
[[nodiscard]] Expected<void> writeFile(const std::string& path, ByteSpan bytes);
[[nodiscard]] Expected<Bytes> readFile(const std::string& path, std::size_t maxBytes);

/// A picture put together from parts. Where it would be larger than PNG readers take it is shrunk by a whole number:
/// each pixel is the mean of those it stands for.
class PictureSheet {
public:
    static constexpr int kMaxSidePx = 16384;
    /// `filled`: what no part covers.
    PictureSheet(int widthPx, int heightPx, std::uint8_t filled);

    /// With the part's upper left corner at (xPx, yPx) of what is not shrunk; it must lie on the sheet.
    void paste(const Picture& part, int xPx, int yPx);
    [[nodiscard]] Picture take() &&;

private:
    int shrunkBy_;
    Picture picture_;
    struct Sum {
        std::uint32_t rgb[3] = {}, count = 0;
    };
    std::vector<Sum> sums_;  ///< by pixel, where it is shrunk
};

/// Copies `part` into `whole` with its upper left corner at (xPx, yPx); what does not fit is cut off.
void paste(Picture& whole, const Picture& part, int xPx, int yPx);

}  // namespace tessera
