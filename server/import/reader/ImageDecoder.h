/// Pictures of all formats that are read, to pixels or blocks. By what is in a file; names say nothing.
#pragma once

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "proto/scene.pb.h"
#include "server/import/reader/PixelPool.h"

namespace tessera {

struct DecodedImage {
    int widthPx = 0, heightPx = 0;
    Bytes rgba;  ///< as `encoding` says, rows from the top; of solids all slices, of cubes all faces, of each mipmap
    proto::scene::Image::Encoding encoding = proto::scene::Image::SRGB;
    proto::scene::Image::Shape shape = proto::scene::Image::FLAT;
    int depthPx = 1, mipmaps = 1;
    bool halved = false;  ///< it was larger than allowed, and was averaged down, or lost its largest mipmaps

    [[nodiscard]] bool compressed() const { return encoding >= proto::scene::Image::BC1; }
};

/// Averages 2 × 2 pixels, slice by slice; an odd last row or column is dropped. Of what is compressed the largest
/// mipmap goes. False: it is one pixel a slice, or compressed and without others, and stays.
bool halve(DecodedImage& image);

/// PNG by libpng, JPEG, BMP, TGA, GIF, PIC, PSD by stb_image; PNM, SGI, TIFF, WebP, MNG, Radiance's .hdr, OpenEXR; DDS,
/// KTX, KTX2, .astc, .pkm. Of animations the first picture. Not compressed ones are halved until no side is above
/// `maxSidePx`, others until none is above 16384. What it decodes is taken of the pool. kBadInput or kLimit, with the
/// reason; of formats that are known and not read, their names.
[[nodiscard]] Expected<DecodedImage> decodeImage(ByteSpan encoded, int maxSidePx, PixelPool& pool);
/// One that has a pool of its own.
[[nodiscard]] Expected<DecodedImage> decodeImage(ByteSpan encoded, int maxSidePx);

}  // namespace tessera
