/// Films whose pictures carry their own numbers, made with ffmpeg's encoders: what a decoder should say is known.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tessera::test {

struct FilmRecipe {
    std::string codec = "ffv1";   ///< an encoder; empty: no pictures at all
    std::string pixels = "bgr0";  ///< a pixel format of it
    int widthPx = 64, heightPx = 48;
    int pictures = 24;
    std::vector<std::int64_t> times = {};  ///< ms, of each picture; empty: 40 ms each
    int keyEvery = 12;                     ///< pictures
    int turnedDeg = 0;                     ///< clockwise, said in the container (.mp4 or .mov)
    bool sound = false;                    ///< a track of silence besides
    int alpha = 255;                       ///< of the right half, where the format has any
};

/// Writes it; the container follows from the name. False: not with these encoders.
[[nodiscard]] bool makeFilm(const std::string& path, const FilmRecipe& recipe);

/// Picture `number` in 4 columns of 2 bits each, the highest on the left: black, dark, light, white. The lower half is
/// red in the left quarter.
[[nodiscard]] std::vector<std::uint8_t> numberedPixels(int number, int widthPx, int heightPx, int alpha = 255);
/// Reads it off the upper half; -1: it says none.
[[nodiscard]] int numberIn(std::span<const std::uint8_t> rgba, int widthPx, int heightPx);

}  // namespace tessera::test
