#include "server/import/reader/AnimatedPng.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

constexpr std::string_view kPngStart("\x89PNG\r\n\x1a\n", 8), kMngStart("\x8aMNG\r\n\x1a\n", 8);

std::uint32_t bigWord(ByteSpan bytes, std::size_t at) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 4; ++i) word = word << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
    return word;
}

struct Chunk {
    std::string_view name;  ///< empty: there is none, the file ends
    ByteSpan data;
    ByteSpan whole;  ///< with length, name and checksum
};

Chunk chunkAt(ByteSpan file, std::size_t at) {
    if (at > file.size() || file.size() - at < 12) return {};
    const std::size_t size = bigWord(file, at);
    if (size > file.size() - at - 12) return {};
    return {asText(file.subspan(at + 4, 4)), file.subspan(at + 8, size), file.subspan(at, size + 12)};
}

void append(Bytes& to, ByteSpan bytes) {
    to.insert(to.end(), bytes.begin(), bytes.end());
}

/// Checksums are not looked at by what reads it.
void appendChunk(Bytes& to, std::string_view name, ByteSpan data) {
    for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::byte>(data.size() >> shift & 255));
    append(to, asBytes(name));
    append(to, data);
    to.insert(to.end(), 4, std::byte{});
}

tl::unexpected<Error> badMng(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("an MNG animation {}", why));
}

}  // namespace

bool isMng(ByteSpan bytes) {
    return bytes.size() >= 8 && asText(bytes.first(8)) == kMngStart;
}

Expected<Bytes> firstPngOfMng(ByteSpan bytes) {
    ByteSpan palette, clear;
    Bytes png;
    for (std::size_t at = kMngStart.size();;) {
        const Chunk chunk = chunkAt(bytes, at);
        if (chunk.name.empty()) return badMng("that is cut off, or has no picture");
        at += chunk.whole.size();
        if (chunk.name == "JHDR") return badMng("whose first picture is a JNG (JPEG in MNG), which is not read");
        if (chunk.name == "IHDR") png.assign(asBytes(kPngStart).begin(), asBytes(kPngStart).end());
        if (png.empty()) {
            // What stands before the pictures is for those that leave their own empty.
            if (chunk.name == "PLTE") palette = chunk.whole;
            if (chunk.name == "tRNS") clear = chunk.whole;
            if (chunk.name == "MEND") return badMng("without a picture");
            continue;
        }
        if (chunk.name == "PLTE" && chunk.data.empty()) {
            append(png, palette);
            append(png, clear);
        } else {
            append(png, chunk.whole);
        }
        if (chunk.name == "IEND") return png;
    }
}

std::optional<PngFrame> firstFrameOfPng(ByteSpan bytes) {
    if (bytes.size() < 8 || asText(bytes.first(8)) != kPngStart) return std::nullopt;
    PngFrame frame;
    append(frame.png, asBytes(kPngStart));
    bool isAnimated = false, hasFrame = false, hasPixels = false, isBehindPicture = false;
    for (std::size_t at = kPngStart.size();;) {
        const Chunk chunk = chunkAt(bytes, at);
        if (chunk.name.empty() || chunk.name == "IEND") break;
        at += chunk.whole.size();
        isAnimated = isAnimated || chunk.name == "acTL";
        if (chunk.name == "IDAT") {
            // Without an animation, or as its first frame, the picture is what is shown.
            if (!isAnimated || hasFrame) return std::nullopt;
            isBehindPicture = true;
        } else if (chunk.name == "fcTL") {
            if (hasPixels) break;
            if (chunk.data.size() != 26 || frame.png.size() < 8 + 25) return std::nullopt;
            hasFrame = true;
            frame.leftPx = bigWord(chunk.data, 12);
            frame.topPx = bigWord(chunk.data, 16);
            // The header's size becomes the frame's.
            std::copy_n(chunk.data.begin() + 4, 8, frame.png.begin() + 16);
        } else if (chunk.name == "fdAT") {
            if (!hasFrame || chunk.data.size() < 4) return std::nullopt;
            hasPixels = true;
            appendChunk(frame.png, "IDAT", chunk.data.subspan(4));
        } else if (!isBehindPicture) {
            if (chunk.name == "IHDR") {
                if (chunk.data.size() != 13) return std::nullopt;
                frame.canvasWidthPx = bigWord(chunk.data, 0);
                frame.canvasHeightPx = bigWord(chunk.data, 4);
            }
            append(frame.png, chunk.whole);
        }
    }
    if (!hasPixels) return std::nullopt;
    appendChunk(frame.png, "IEND", {});
    return frame;
}

Expected<DecodedImage> onCanvas(const PngFrame& frame, const DecodedImage& picture) {
    const std::uint64_t width = frame.canvasWidthPx, height = frame.canvasHeightPx;
    const auto ownWidth = static_cast<std::uint64_t>(picture.widthPx),
               ownHeight = static_cast<std::uint64_t>(picture.heightPx);
    if (frame.leftPx + ownWidth > width || frame.topPx + ownHeight > height)
        return fail(ErrorCode::kBadInput, "an animated PNG whose first frame lies outside");
    DecodedImage canvas{
        .widthPx = static_cast<int>(width), .heightPx = static_cast<int>(height), .rgba = Bytes(4 * width * height)};
    for (std::uint64_t y = 0; y < ownHeight; ++y)
        std::memcpy(&canvas.rgba[4 * ((frame.topPx + y) * width + frame.leftPx)], &picture.rgba[4 * y * ownWidth],
                    4 * ownWidth);
    return canvas;
}

}  // namespace tessera
