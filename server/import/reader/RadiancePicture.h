/// Radiance's pictures (.hdr): Ward, "Real pixels", Graphics Gems II, 1991; the file format is Radiance's `filefmts`.
#pragma once

#include "server/import/reader/PictureFormats.h"

namespace tessera {

/// Whether the bytes begin as such a file does.
[[nodiscard]] bool isRadiancePicture(ByteSpan bytes);
/// To RGBE, a pixel four bytes, rows from the top. Plain and run-length coded ones, old and new; exposures are taken
/// out. kBadInput, with the reason: damaged, of colours other than RGB, or with rows in another order than from the top
/// and from the left.
[[nodiscard]] Expected<DecodedImage> decodeRadiance(ByteSpan bytes, const PictureBounds& bounds);

/// A pixel as linear numbers, and back, each colour within 1/256 of the largest.
void rgbeToLinear(const std::byte* rgbe, double* rgb);
void linearToRgbe(const double* rgb, std::byte* rgbe);

}  // namespace tessera
