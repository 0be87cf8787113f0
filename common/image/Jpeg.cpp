#include <cstdio>
// Wants FILE.
#include <jpeglib.h>

#include <cstdlib>
#include <memory>

#include "common/image/Picture.h"

namespace tessera {

Bytes encodeJpeg(const Picture& picture, int quality) {
    TESSERA_CHECK(picture.widthPx > 0 && picture.heightPx > 0 && picture.widthPx <= PictureSheet::kMaxSidePx &&
                      picture.heightPx <= PictureSheet::kMaxSidePx,
                  "a picture without pixels, or too large");
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);  // of what is left it ends the program: memory alone
    jpeg_create_compress(&jpeg);
    unsigned char* out = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &out, &size);
    jpeg.image_width = static_cast<JDIMENSION>(picture.widthPx);
    jpeg.image_height = static_cast<JDIMENSION>(picture.heightPx);
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < jpeg.image_height) {
        auto* row = const_cast<JSAMPLE*>(picture.rgb.data() + std::size_t{3} * jpeg.next_scanline * jpeg.image_width);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    const std::unique_ptr<unsigned char, decltype(&std::free)> owner(out, &std::free);
    const auto* bytes = reinterpret_cast<const std::byte*>(out);
    Bytes all(bytes, bytes + size);
    jpeg_destroy_compress(&jpeg);
    return all;
}

}  // namespace tessera
