/// libpng reports errors by longjmp: nothing with a destructor may live in the frames it leaves.
#include "common/output/BlendPicture.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstring>

namespace tessera {
namespace {

constexpr int kMaxBlendSidePx = 16384;
constexpr std::size_t kMaxBlendPixels = std::size_t{1} << 26;

struct GreyFailure {
    char text[128] = "";
};
[[noreturn]] void onGreyError(png_structp png, png_const_charp text) {
    auto* failure = static_cast<GreyFailure*>(png_get_error_ptr(png));
    std::strncpy(failure->text, text, sizeof failure->text - 1);
    png_longjmp(png, 1);
}
void onGreyWarning(png_structp, png_const_charp) {}

void takeGrey(png_structp png, png_bytep data, std::size_t bytes) {
    auto* rest = static_cast<ByteSpan*>(png_get_io_ptr(png));
    if (bytes > rest->size()) png_error(png, "the file ends too early");
    std::memcpy(data, rest->data(), bytes);
    *rest = rest->subspan(bytes);
}
void appendGrey(png_structp png, png_bytep data, std::size_t bytes) {
    auto* out = static_cast<Bytes*>(png_get_io_ptr(png));
    const auto* from = reinterpret_cast<const std::byte*>(data);
    out->insert(out->end(), from, from + bytes);
}
void flushGrey(png_structp) {}

/// Rows become two bytes a channel, one or three channels, most significant byte first.
bool readGreyHeader(png_structp png, png_infop info, png_uint_32* size, int* channels) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_info(png, info);
    size[0] = png_get_image_width(png, info);
    size[1] = png_get_image_height(png, info);
    // Rows of an interlaced file are complete only at its end, so that its memory would have to be taken on its word.
    if (png_get_interlace_type(png, info) != PNG_INTERLACE_NONE) png_error(png, "interlaced files are not read");
    if (std::size_t{size[0]} * size[1] > kMaxBlendPixels) png_error(png, "too many pixels");
    png_set_expand(png);
    png_set_expand_16(png);
    png_set_strip_alpha(png);
    png_read_update_info(png, info);
    *channels = png_get_channels(png, info);
    if ((*channels != 1 && *channels != 3) ||
        png_get_rowbytes(png, info) != std::size_t{size[0]} * static_cast<std::size_t>(*channels) * 2)
        png_error(png, "its pixels cannot be made grey");
    return true;
}

bool readGreyRow(png_structp png, std::uint8_t* row) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_row(png, row, nullptr);
    return true;
}

bool writeGrey(png_structp png, png_infop info, const BlendPicture& picture, std::uint8_t* row) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_IHDR(png, info, static_cast<png_uint_32>(picture.widthPx), static_cast<png_uint_32>(picture.heightPx), 16,
                 PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < picture.heightPx; ++y) {
        for (int x = 0; x < picture.widthPx; ++x) {
            const std::uint16_t value =
                picture.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.widthPx) +
                               static_cast<std::size_t>(x)];
            row[2 * x] = static_cast<std::uint8_t>(value >> 8);
            row[2 * x + 1] = static_cast<std::uint8_t>(value);
        }
        png_write_row(png, row);
    }
    png_write_end(png, info);
    return true;
}

}  // namespace

double BlendPicture::at(double u, double v) const {
    const double x = std::clamp(u * widthPx - 0.5, 0.0, widthPx - 1.0),
                 y = std::clamp(v * heightPx - 0.5, 0.0, heightPx - 1.0);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, widthPx - 1), y1 = std::min(y0 + 1, heightPx - 1);
    const double fx = x - x0, fy = y - y0;
    const auto value = [&](int px, int py) {
        return values[static_cast<std::size_t>(py) * static_cast<std::size_t>(widthPx) + static_cast<std::size_t>(px)] /
               65535.0;
    };
    return (1 - fy) * ((1 - fx) * value(x0, y0) + fx * value(x1, y0)) +
           fy * ((1 - fx) * value(x0, y1) + fx * value(x1, y1));
}

Expected<BlendPicture> decodeBlendPicture(ByteSpan bytes) {
    GreyFailure failure;
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, onGreyError, onGreyWarning);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    TESSERA_CHECK(info, "libpng starts");
    png_set_user_limits(png, kMaxBlendSidePx, kMaxBlendSidePx);
    png_set_chunk_cache_max(png, 64);
    png_set_chunk_malloc_max(png, std::size_t{8} << 20);
    png_set_benign_errors(png, 0);
    ByteSpan rest = bytes;
    png_set_read_fn(png, &rest, takeGrey);

    png_uint_32 size[2] = {};
    int channels = 0;
    BlendPicture picture;
    bool good = readGreyHeader(png, info, size, &channels);
    std::vector<std::uint8_t> row(good ? std::size_t{size[0]} * static_cast<std::size_t>(channels) * 2 : 0);
    for (png_uint_32 y = 0; good && y < size[1]; ++y) {
        good = readGreyRow(png, row.data());
        const std::size_t pixel = 2 * static_cast<std::size_t>(channels), first = channels == 3 ? 2 : 0;
        for (std::size_t x = 0; good && x < size[0]; ++x)
            picture.values.push_back(
                static_cast<std::uint16_t>(row[x * pixel + first] << 8 | row[x * pixel + first + 1]));
    }
    png_destroy_read_struct(&png, &info, nullptr);
    if (!good) return fail(ErrorCode::kBadInput, std::string("not a readable PNG: ") + failure.text);
    picture.widthPx = static_cast<int>(size[0]);
    picture.heightPx = static_cast<int>(size[1]);
    return picture;
}

Bytes encodeBlendPicture(const BlendPicture& picture) {
    TESSERA_CHECK(picture.widthPx > 0 && picture.heightPx > 0, "a PNG has at least one pixel");
    Bytes out;
    GreyFailure failure;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, onGreyError, onGreyWarning);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    TESSERA_CHECK(info, "libpng starts");
    png_set_write_fn(png, &out, appendGrey, flushGrey);
    std::vector<std::uint8_t> row(2 * static_cast<std::size_t>(picture.widthPx));
    const bool written = writeGrey(png, info, picture, row.data());
    png_destroy_write_struct(&png, &info);
    TESSERA_CHECK(written, failure.text);
    return out;
}

}  // namespace tessera
