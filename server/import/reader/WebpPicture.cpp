#include <fmt/format.h>
#include <webp/decode.h>
#include <webp/demux.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "server/import/reader/HalvedRows.h"
#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

/// Where the picture of a frame stands on that of all, whose sides are halved so many times.
Expected<void> drawFrame(const WebPIterator& frame, int halvings, DecodedImage& image) {
    const auto width = static_cast<std::size_t>(image.widthPx);
    const int left = frame.x_offset >> halvings, top = frame.y_offset >> halvings;
    const int frameWidth = std::max(frame.width >> halvings, 1), frameHeight = std::max(frame.height >> halvings, 1);
    if (frame.x_offset < 0 || frame.y_offset < 0 || frame.width <= 0 || frame.height <= 0 ||
        frameWidth > image.widthPx - left || frameHeight > image.heightPx - top)
        return fail(ErrorCode::kBadInput, "a WebP picture whose first frame lies outside");
    auto* to = reinterpret_cast<std::uint8_t*>(image.rgba.data()) +
               4 * (static_cast<std::size_t>(top) * width + static_cast<std::size_t>(left));
    WebPDecoderConfig config;
    const auto damaged = [] { return fail(ErrorCode::kBadInput, "a WebP picture that is damaged or cut off"); };
    if (!frame.complete || !WebPInitDecoderConfig(&config)) return damaged();
    config.options.use_scaling = halvings > 0 ? 1 : 0;
    config.options.scaled_width = frameWidth;
    config.options.scaled_height = frameHeight;
    config.output.colorspace = MODE_RGBA;
    config.output.is_external_memory = 1;
    config.output.u.RGBA.rgba = to;
    config.output.u.RGBA.stride = static_cast<int>(4 * width);
    config.output.u.RGBA.size =
        image.rgba.size() - static_cast<std::size_t>(to - reinterpret_cast<std::uint8_t*>(image.rgba.data()));
    if (WebPDecode(frame.fragment.bytes, frame.fragment.size, &config) != VP8_STATUS_OK) return damaged();
    return {};
}

}  // namespace

bool isWebp(ByteSpan bytes) {
    return bytes.size() >= 12 && asText(bytes.first(4)) == "RIFF" && asText(bytes.subspan(8, 4)) == "WEBP";
}

Expected<DecodedImage> decodeWebp(ByteSpan bytes, const PictureBounds& bounds) {
    const WebPData data{reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
    const std::unique_ptr<WebPDemuxer, decltype(&WebPDemuxDelete)> demuxer(WebPDemux(&data), &WebPDemuxDelete);
    if (!demuxer) return fail(ErrorCode::kBadInput, "a WebP picture that is damaged or cut off");
    const std::size_t width = WebPDemuxGetI(demuxer.get(), WEBP_FF_CANVAS_WIDTH),
                      height = WebPDemuxGetI(demuxer.get(), WEBP_FF_CANVAS_HEIGHT);
    if (Expected<void> allowed = bounds.allow("a WebP picture", width, height); !allowed)
        return tl::unexpected(allowed.error());
    const int halvings = halvingsOf(width, height, bounds.maxSidePx);
    WebPIterator frame;
    if (!WebPDemuxGetFrame(demuxer.get(), 1, &frame))
        return fail(ErrorCode::kBadInput, "a WebP picture without a frame");
    const std::unique_ptr<WebPIterator, decltype(&WebPDemuxReleaseIterator)> held(&frame, &WebPDemuxReleaseIterator);
    DecodedImage image{.widthPx = std::max(static_cast<int>(width) >> halvings, 1),
                       .heightPx = std::max(static_cast<int>(height) >> halvings, 1)};
    image.rgba.resize(4 * static_cast<std::size_t>(image.widthPx) * static_cast<std::size_t>(image.heightPx));
    image.halved = halvings > 0;
    if (Expected<void> drawn = drawFrame(frame, halvings, image); !drawn) return tl::unexpected(drawn.error());
    return image;
}

}  // namespace tessera
