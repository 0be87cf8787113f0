/// PNG files byte by byte.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>

#include "tests/unit/import/PictureBytes.h"

namespace tessera {

inline const std::string kPngStart("\x89PNG\r\n\x1a\n", 8);

inline std::string pngChunk(const std::string& name, const std::string& data) {
    const std::string all = name + data;
    return big(data.size(), 4) + all +
           big(::crc32(0, reinterpret_cast<const Bytef*>(all.data()), static_cast<uInt>(all.size())), 4);
}
inline std::string deflated(const std::string& bytes) {
    uLongf size = ::compressBound(bytes.size());
    std::string out(size, '\0');
    ::compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
                1);
    out.resize(size);
    return out;
}
/// How a PNG has its pixels: `colours` 0: grey, 2: red, green, blue, 3: of a palette, 4 and 6: 0 and 2 with opacity.
struct PngKind {
    unsigned bits = 8, colours = 6, passes = 0;
};
inline std::string pngHeader(std::size_t width, std::size_t height, const PngKind& kind = {}) {
    return kPngStart + pngChunk("IHDR", big(width, 4) + big(height, 4) + big(kind.bits, 1) + big(kind.colours, 1) +
                                            big(0, 2) + big(kind.passes, 1));
}
/// `rows`: each with its filter in front. `before`: chunks.
inline std::string pngOf(std::size_t width, std::size_t height, const PngKind& kind, const std::string& rows,
                         const std::string& before = "") {
    return pngHeader(width, height, kind) + before + pngChunk("IDAT", deflated(rows)) + pngChunk("IEND", "");
}
/// Black, and of a bit each pixel: the fewest bytes that so many can have.
inline std::string blackPng(std::size_t width, std::size_t height) {
    return pngOf(width, height, {.bits = 1, .colours = 0}, std::string((1 + (width + 7) / 8) * height, '\0'));
}

}  // namespace tessera
