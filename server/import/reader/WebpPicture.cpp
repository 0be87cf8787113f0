#include <fmt/format.h>
#include <webp/decode.h>
#include <webp/demux.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

/// Where the picture of a frame stands on that of all.
Expected<void> drawFrame(const WebPIterator& frame, DecodedImage& image) {
    const auto width = static_cast<std::size_t>(image.widthPx);
    if (frame.x_offset < 0 || frame.y_offset < 0 || frame.width <= 0 || frame.height <= 0 ||
        frame.width > image.widthPx - frame.x_offset || frame.height > image.heightPx - frame.y_offset)
        return fail(ErrorCode::kBadInput, "a WebP picture whose first frame lies outside");
    auto* to = reinterpret_cast<std::uint8_t*>(image.rgba.data()) +
               4 * (static_cast<std::size_t>(frame.y_offset) * width + static_cast<std::size_t>(frame.x_offset));
    const std::size_t room =
        image.rgba.size() - static_cast<std::size_t>(to - reinterpret_cast<std::uint8_t*>(image.rgba.data()));
    if (!frame.complete ||
        !WebPDecodeRGBAInto(frame.fragment.bytes, frame.fragment.size, to, room, static_cast<int>(4 * width)))
        return fail(ErrorCode::kBadInput, "a WebP picture that is damaged or cut off");
    return {};
}

}  // namespace

bool isWebp(ByteSpan bytes) {
    return bytes.size() >= 12 && asText(bytes.first(4)) == "RIFF" && asText(bytes.subspan(8, 4)) == "WEBP";
}

Expected<DecodedImage> decodeWebp(ByteSpan bytes) {
    const WebPData data{reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
    const std::unique_ptr<WebPDemuxer, decltype(&WebPDemuxDelete)> demuxer(WebPDemux(&data), &WebPDemuxDelete);
    if (!demuxer) return fail(ErrorCode::kBadInput, "a WebP picture that is damaged or cut off");
    const std::size_t width = WebPDemuxGetI(demuxer.get(), WEBP_FF_CANVAS_WIDTH),
                      height = WebPDemuxGetI(demuxer.get(), WEBP_FF_CANVAS_HEIGHT);
    if (width == 0 || height == 0 || std::max(width, height) > kMaxPictureSide || width * height > kMaxPicturePixels)
        return fail(ErrorCode::kBadInput,
                    fmt::format("a WebP picture of {} × {} pixels: up to {} a side and {} in all can be read", width,
                                height, kMaxPictureSide, kMaxPicturePixels));
    WebPIterator frame;
    if (!WebPDemuxGetFrame(demuxer.get(), 1, &frame))
        return fail(ErrorCode::kBadInput, "a WebP picture without a frame");
    const std::unique_ptr<WebPIterator, decltype(&WebPDemuxReleaseIterator)> held(&frame, &WebPDemuxReleaseIterator);
    DecodedImage image{
        .widthPx = static_cast<int>(width), .heightPx = static_cast<int>(height), .rgba = Bytes(4 * width * height)};
    if (Expected<void> drawn = drawFrame(frame, image); !drawn) return tl::unexpected(drawn.error());
    return image;
}

}  // namespace tessera
