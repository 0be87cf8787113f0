#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

tl::unexpected<Error> badTiff(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a TIFF picture {}", why));
}

/// A file that libtiff reads, in memory.
struct TiffBytes {
    ByteSpan bytes;
    std::size_t at = 0;
};
tmsize_t readTiff(thandle_t handle, void* to, tmsize_t size) {
    auto& file = *static_cast<TiffBytes*>(handle);
    const std::size_t count =
        file.at >= file.bytes.size()
            ? 0
            : std::min(static_cast<std::size_t>(std::max<tmsize_t>(size, 0)), file.bytes.size() - file.at);
    if (count > 0) std::memcpy(to, file.bytes.data() + file.at, count);
    file.at += count;
    return static_cast<tmsize_t>(count);
}
toff_t seekTiff(thandle_t handle, toff_t offset, int whence) {
    auto& file = *static_cast<TiffBytes*>(handle);
    file.at = static_cast<std::size_t>(offset) + (whence == SEEK_CUR   ? file.at
                                                  : whence == SEEK_END ? file.bytes.size()
                                                                       : 0);
    return file.at;
}

}  // namespace

bool isTiff(ByteSpan bytes) {
    if (bytes.size() < 8) return false;
    for (const char* start : {"II*\0", "MM\0*", "II+\0", "MM\0+"})
        if (std::memcmp(bytes.data(), start, 4) == 0) return true;
    return false;
}

Expected<DecodedImage> decodeTiff(ByteSpan bytes, const PictureBounds& bounds) {
    // It would write to stderr, and is not told where otherwise. Readers have one thread.
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    TiffBytes file{bytes};
    const auto none = [](thandle_t, void*, tmsize_t) -> tmsize_t { return 0; };
    const auto close = [](thandle_t) { return 0; };
    const auto sizeOf = [](thandle_t handle) -> toff_t { return static_cast<TiffBytes*>(handle)->bytes.size(); };
    const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(
        TIFFClientOpen("picture", "rm", &file, readTiff, none, seekTiff, close, sizeOf, nullptr, nullptr), &TIFFClose);
    if (!tiff) return badTiff("whose header is cut off or damaged");
    std::uint32_t width = 0, height = 0;
    TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
    if (Expected<void> allowed = bounds.allow("a TIFF picture", width, height, 2); !allowed)
        return tl::unexpected(allowed.error());
    // A white row of fax is a bit: 65536 pixels a byte are more than any page has.
    if (std::size_t{width} * height > (std::size_t{1} << 16) * bytes.size())
        return badTiff(fmt::format("of {} × {} pixels in {} bytes", width, height, bytes.size()));
    char why[1024] = {};
    if (!TIFFRGBAImageOK(tiff.get(), why)) return badTiff(fmt::format("that libtiff does not show: {}", why));
    // It allocates what a strip or tile says it takes.
    const std::uint64_t unit = TIFFIsTiled(tiff.get()) ? TIFFTileSize64(tiff.get()) : TIFFStripSize64(tiff.get());
    if (unit > kMaxPicturePixels * 4) return badTiff("whose strips or tiles are too large");
    std::uint16_t extras = 0;
    std::uint16_t* kinds = nullptr;
    (void)TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_EXTRASAMPLES, &extras, &kinds);
    std::vector<std::uint32_t> raster(std::size_t{width} * height);
    if (!TIFFReadRGBAImageOriented(tiff.get(), width, height, raster.data(), ORIENTATION_TOPLEFT, 1))
        return badTiff("that is cut off or damaged");
    DecodedImage image{
        .widthPx = static_cast<int>(width), .heightPx = static_cast<int>(height), .rgba = Bytes(raster.size() * 4)};
    for (std::size_t i = 0; i < raster.size(); ++i) {
        const std::uint32_t pixel = raster[i], alpha = TIFFGetA(pixel);
        const std::uint32_t channels[3] = {TIFFGetR(pixel), TIFFGetG(pixel), TIFFGetB(pixel)};
        // Colours come multiplied by alpha.
        for (std::size_t c = 0; c < 3; ++c)
            image.rgba[4 * i + c] = static_cast<std::byte>(
                extras == 0 || alpha == 0 ? channels[c]
                                          : std::min<std::uint32_t>(255, (channels[c] * 255 + alpha / 2) / alpha));
        image.rgba[4 * i + 3] = static_cast<std::byte>(alpha);
    }
    return image;
}

}  // namespace tessera
