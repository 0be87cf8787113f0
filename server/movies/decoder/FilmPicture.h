/// A decoded picture as an Image holds it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "server/movies/FilmRecords.h"
#include "server/movies/decoder/FilmDecoder.h"

struct AVFrame;
struct SwsContext;

namespace tessera {

/// Where FilmAnswer says what lies in its slot.
struct FilmPicture {
    std::uint32_t widthPx = 0, heightPx = 0, mipmaps = 1, encoding = 0;
    std::uint64_t sizeBytes = 0;
};

/// Any pixel format of ffmpeg's to 8 bits of red, green, blue and what lets through (not premultiplied), upright, rows
/// from the top; more bits are rounded, other matrices and ranges followed (unsaid: BT.709 from 720 rows up, else
/// BT.601), nothing is done about other primaries or curves. Not thread-safe.
class FilmPictures {
public:
    FilmPictures();
    ~FilmPictures();
    /// Into `slot`, of kFilmSlotBytes. kBadInput where the picture says nonsense.
    [[nodiscard]] Expected<FilmPicture> write(const AVFrame& frame, const FilmDecoder::Orientation& orientation,
                                              std::span<std::uint8_t> slot);

private:
    [[nodiscard]] Expected<void> toPixels(const AVFrame& frame, int width, int height);
    void turn(const FilmDecoder::Orientation& orientation, int& width, int& height);

    SwsContext* scaler_ = nullptr;
    std::vector<std::uint8_t> pixels_, turned_;
};

/// Blocks of 4×4 pixels, after each other the mipmaps down to one pixel, each the mean of 2×2 of the one before (an odd
/// last row or column is left out): bc1, or bc3 with `alpha`. `pixels`: RGBA, made smaller on the way. Returns how many
/// bytes.
std::size_t writeFilmBlocks(std::vector<std::uint8_t>& pixels, int width, int height, bool alpha, std::uint8_t* into,
                            std::uint32_t& mipmaps);

}  // namespace tessera
