/// Two eyes' pictures as one, the ways that monitors, projectors and glasses take them.
#pragma once

#include "common/image/Picture.h"
#include "common/wall/Output.h"

namespace tessera {

/// Both eyes' pictures are of this size and packed without gaps between rows.
struct EyePictures {
    const std::uint8_t* left = nullptr;
    const std::uint8_t* right = nullptr;
    int widthPx = 0, heightPx = 0;
};

/// Of the picture that comes out. Quad-buffered: both beside each other, nothing squeezed; who shows it takes them
/// apart.
struct PackedSize {
    int widthPx = 0, heightPx = 0;
    bool operator==(const PackedSize&) const = default;
};
[[nodiscard]] PackedSize packedSize(StereoPacking packing, int widthPx, int heightPx);

/// Whether eyes are mixed as colours, which comes before warp and colour of the projector; all others come after.
[[nodiscard]] bool mixesColours(StereoPacking packing);

/// Writes each pixel of `to`. Not kNone.
/// - Squeezed: each pixel is the mean of the light of two (of gamma 2.2).
/// - Interlaced: each pixel of one eye's picture stays where it is, every other one is left out.
/// - kAnaglyph: the matrices for red-cyan glasses of E. Dubois, "Conversion of a Stereo Pair to Anaglyph with the
/// Least-Squares
///   Projection Method", 2009, applied to the light of sRGB values.
void packEyes(StereoPacking packing, const EyePictures& eyes, PixelRows to);

}  // namespace tessera
