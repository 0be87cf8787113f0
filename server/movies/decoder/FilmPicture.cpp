#include "server/movies/decoder/FilmPicture.h"

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "common/cores/Image.h"

#define STB_DXT_IMPLEMENTATION
#define STB_DXT_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_dxt.h>
#pragma GCC diagnostic pop

namespace tessera {
namespace {

/// The formats that say "full range" by their name, which the scaler is told otherwise.
AVPixelFormat withoutRange(AVPixelFormat format, bool& full) {
    const auto is = [&](AVPixelFormat same) {
        full = true;
        return same;
    };
    switch (format) {
        case AV_PIX_FMT_YUVJ420P:
            return is(AV_PIX_FMT_YUV420P);
        case AV_PIX_FMT_YUVJ422P:
            return is(AV_PIX_FMT_YUV422P);
        case AV_PIX_FMT_YUVJ444P:
            return is(AV_PIX_FMT_YUV444P);
        case AV_PIX_FMT_YUVJ440P:
            return is(AV_PIX_FMT_YUV440P);
        case AV_PIX_FMT_YUVJ411P:
            return is(AV_PIX_FMT_YUV411P);
        default:
            return format;
    }
}

int matrixOf(const AVFrame& frame) {
    switch (frame.colorspace) {
        case AVCOL_SPC_BT709:
            return SWS_CS_ITU709;
        case AVCOL_SPC_FCC:
            return SWS_CS_FCC;
        case AVCOL_SPC_BT470BG:
        case AVCOL_SPC_SMPTE170M:
            return SWS_CS_ITU601;
        case AVCOL_SPC_SMPTE240M:
            return SWS_CS_SMPTE240M;
        case AVCOL_SPC_BT2020_NCL:
        case AVCOL_SPC_BT2020_CL:
            return SWS_CS_BT2020;
        default:
            return frame.height >= 720 ? SWS_CS_ITU709 : SWS_CS_ITU601;
    }
}

bool letsThrough(std::span<const std::uint8_t> pixels) {
    for (std::size_t i = 3; i < pixels.size(); i += 4)
        if (pixels[i] != 255) return true;
    return false;
}

/// Half the size in place, rounded down but not below 1.
void halve(std::vector<std::uint8_t>& pixels, int& width, int& height) {
    const int newWidth = std::max(1, width / 2), newHeight = std::max(1, height / 2);
    const int right = width > 1 ? 4 : 0;
    const std::size_t down = height > 1 ? static_cast<std::size_t>(width) * 4 : 0;
    for (int y = 0; y < newHeight; ++y) {
        const std::uint8_t* from =
            pixels.data() + static_cast<std::size_t>(y) * (height > 1 ? 2 : 1) * static_cast<std::size_t>(width) * 4;
        std::uint8_t* to = pixels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(newWidth) * 4;
        for (int x = 0; x<newWidth; ++x, from += width> 1 ? 8 : 4, to += 4)
            for (int c = 0; c < 4; ++c)
                to[c] = static_cast<std::uint8_t>(
                    (from[c] + from[c + right] + from[c + down] + from[c + right + down] + 2) / 4);
    }
    width = newWidth;
    height = newHeight;
}

}  // namespace

FilmPictures::FilmPictures() = default;
FilmPictures::~FilmPictures() {
    sws_freeContext(scaler_);
}

Expected<void> FilmPictures::toPixels(const AVFrame& frame, int width, int height) {
    bool full = frame.color_range == AVCOL_RANGE_JPEG;
    const AVPixelFormat format = withoutRange(static_cast<AVPixelFormat>(frame.format), full);
    if (!sws_isSupportedInput(format))
        return fail(ErrorCode::kUnsupported, "its pictures have a form that cannot be converted");
    const int scaling = width == frame.width && height == frame.height ? SWS_BILINEAR : SWS_AREA;
    scaler_ =
        sws_getCachedContext(scaler_, frame.width, frame.height, format, width, height, AV_PIX_FMT_RGBA,
                             scaling | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_BITEXACT, nullptr, nullptr, nullptr);
    if (!scaler_) return fail(ErrorCode::kBadInput, "its pictures cannot be converted");
    (void)sws_setColorspaceDetails(scaler_, sws_getCoefficients(matrixOf(frame)), full,
                                   sws_getCoefficients(SWS_CS_DEFAULT), 1, 0, 1 << 16, 1 << 16);
    // The scaler writes rows in wide steps, beyond the last pixel too.
    pixels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4 + 64);
    std::uint8_t* const to[4] = {pixels_.data(), nullptr, nullptr, nullptr};
    const int strides[4] = {4 * width, 0, 0, 0};
    if (sws_scale(scaler_, frame.data, frame.linesize, 0, frame.height, to, strides) != height)
        return fail(ErrorCode::kBadInput, "a picture of it is damaged");
    pixels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
    return {};
}

void FilmPictures::turn(const FilmDecoder::Orientation& o, int& width, int& height) {
    if (o.upright()) return;
    const int newWidth = o.xx != 0 ? width : height, newHeight = o.xx != 0 ? height : width;
    const int fromX = o.xx + o.xy < 0 ? newWidth - 1 : 0, fromY = o.yx + o.yy < 0 ? newHeight - 1 : 0;
    turned_.resize(pixels_.size());
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int toX = fromX + o.xx * x + o.xy * y, toY = fromY + o.yx * x + o.yy * y;
            std::memcpy(
                turned_.data() + (static_cast<std::size_t>(toY) * static_cast<std::size_t>(newWidth) +
                                  static_cast<std::size_t>(toX)) *
                                     4,
                pixels_.data() +
                    (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4,
                4);
        }
    std::swap(pixels_, turned_);
    width = newWidth;
    height = newHeight;
}

std::size_t writeFilmBlocks(std::vector<std::uint8_t>& pixels, int width, int height, bool alpha, std::uint8_t* into,
                            std::uint32_t& mipmaps) {
    std::uint8_t* to = into;
    const std::size_t blockBytes = alpha ? 16 : 8;
    std::array<std::uint8_t, 64> block;
    for (mipmaps = 1;; ++mipmaps) {
        for (int top = 0; top < height; top += 4)
            for (int left = 0; left < width; left += 4) {
                for (int y = 0; y < 4; ++y)
                    for (int x = 0; x < 4; ++x) {
                        // Beyond the edge is the edge: those pixels are never seen, and must not cost others their
                        // colours.
                        const auto row = static_cast<std::size_t>(std::min(top + y, height - 1)),
                                   column = static_cast<std::size_t>(std::min(left + x, width - 1));
                        std::memcpy(block.data() + static_cast<std::size_t>(4 * y + x) * 4,
                                    pixels.data() + (row * static_cast<std::size_t>(width) + column) * 4, 4);
                    }
                stb_compress_dxt_block(to, block.data(), alpha ? 1 : 0, STB_DXT_NORMAL);
                to += blockBytes;
            }
        if (width == 1 && height == 1) return static_cast<std::size_t>(to - into);
        halve(pixels, width, height);
    }
}

Expected<FilmPicture> FilmPictures::write(const AVFrame& frame, const FilmDecoder::Orientation& orientation,
                                          std::span<std::uint8_t> slot) {
    int width = frame.width, height = frame.height;
    if (width < 1 || height < 1) return fail(ErrorCode::kBadInput, "a picture of it has no size");
    while (width > kMostFilmSidePx || height > kMostFilmSidePx) {
        width = std::max(1, width / 2);
        height = std::max(1, height / 2);
    }
    if (Expected<void> done = toPixels(frame, width, height); !done) return tl::unexpected(done.error());
    turn(orientation, width, height);
    FilmPicture picture{.widthPx = static_cast<std::uint32_t>(width), .heightPx = static_cast<std::uint32_t>(height)};
    if (width * height <= kMostPlainFilmPixels) {
        std::memcpy(slot.data(), pixels_.data(), pixels_.size());
        picture.encoding = Image::kSrgb;
        picture.sizeBytes = pixels_.size();
        return picture;
    }
    const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
    const bool alpha = format && (format->flags & AV_PIX_FMT_FLAG_ALPHA) != 0 && letsThrough(pixels_);
    picture.encoding = alpha ? Image::kBc3 : Image::kBc1;
    picture.sizeBytes = writeFilmBlocks(pixels_, width, height, alpha, slot.data(), picture.mipmaps);
    return picture;
}

}  // namespace tessera
