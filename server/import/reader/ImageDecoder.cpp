#include "server/import/reader/ImageDecoder.h"

#include <fmt/format.h>
#include <stb/stb_image.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/import/reader/AnimatedPng.h"
#include "server/import/reader/DdsPicture.h"
#include "server/import/reader/HalvedRows.h"
#include "server/import/reader/Ktx1Picture.h"
#include "server/import/reader/Ktx2Picture.h"
#include "server/import/reader/PictureFormats.h"
#include "server/import/reader/RadiancePicture.h"

namespace tessera {
namespace {

/// The one size below; of a cube or solid slice by slice.
Bytes averaged(ByteSpan from, std::size_t width, std::size_t height, bool rgbe) {
    const std::size_t slice = 4 * width * height, small = 4 * halvedSide(width, 1) * halvedSide(height, 1);
    Bytes made(from.size() / slice * small);
    for (std::size_t i = 0; i < from.size() / slice; ++i) {
        HalvedRows rows(width, height, 1, rgbe, made.data() + i * small);
        for (std::size_t y = 0; y < height; ++y) rows.add(from.data() + i * slice + 4 * width * y);
    }
    return made;
}

/// Of the largest mipmap, all slices or faces; of blocks.
std::size_t largestBytes(const DecodedImage& image) {
    using Message = proto::scene::Image;
    const auto across = [](int px) { return (static_cast<std::size_t>(px) + 3) / 4; };
    const std::size_t slices = image.shape == Message::CUBE ? 6 : static_cast<std::size_t>(image.depthPx);
    return across(image.widthPx) * across(image.heightPx) * slices *
           (image.encoding == Message::BC1 || image.encoding == Message::BC4 ? 8 : 16);
}

/// By the first bytes, so that the message can say more than that it is none of those that are read.
std::string_view unreadFormat(ByteSpan bytes) {
    std::string text(16, '\0');
    std::memcpy(text.data(), bytes.data(), std::min(bytes.size(), text.size()));
    if (text.substr(12, 4) == "CgBI") return "a PNG picture made for iPhones (CgBI)";
    if (text.starts_with("sB")) return "a Basis Universal texture";
    if (text.starts_with("\x8bJNG")) return "a JNG picture";
    if (text.substr(4, 8) == "ftypavif" || text.substr(4, 8) == "ftypheic") return "an AVIF or HEIC picture";
    if (text.substr(4, 4) == "jP  " || text.starts_with("\xff\x4f\xff\x51")) return "a JPEG 2000 picture";
    if (text.starts_with("<svg") || text.starts_with("<?xml")) return "an SVG drawing";
    return {};
}

/// A file's bytes as stb_image asks for them. Of TGA, BMP and GIF it takes what it has asked for as read, whether there
/// were so many bytes or not: what was in that memory before would be shown.
class AskedBytes {
public:
    explicit AskedBytes(ByteSpan bytes) : bytes_(bytes) {}
    [[nodiscard]] bool askedBeyond() const { return beyond_; }

    static int read(void* self, char* to, int size) {
        return static_cast<AskedBytes*>(self)->give(to, static_cast<std::size_t>(std::max(size, 0)));
    }
    static void skip(void* self, int count) {
        AskedBytes& of = *static_cast<AskedBytes*>(self);
        const auto at = static_cast<std::int64_t>(of.at_) + count;
        of.at_ = static_cast<std::size_t>(std::clamp<std::int64_t>(at, 0, static_cast<std::int64_t>(of.bytes_.size())));
    }
    static int atEnd(void* self) {
        return static_cast<AskedBytes*>(self)->at_ == static_cast<AskedBytes*>(self)->bytes_.size();
    }

private:
    int give(char* to, std::size_t size) {
        // The first that it fills is its buffer, which may be filled in part; everything else is wanted whole.
        if (!buffer_) buffer_ = to;
        const std::size_t count = std::min(size, bytes_.size() - at_);
        beyond_ = beyond_ || (to == buffer_ ? count == 0 && size > 0 : count < size);
        std::memcpy(to, bytes_.data() + at_, count);
        at_ += count;
        return static_cast<int>(count);
    }

    ByteSpan bytes_;
    std::size_t at_ = 0;
    const char* buffer_ = nullptr;
    bool beyond_ = false;
};

/// Each goes through all blocks of the picture once more, and may take a few bytes. Progressive ones have some ten.
unsigned jpegScans(ByteSpan encoded) {
    if (encoded[0] != std::byte{0xff}) return 0;
    unsigned scans = 0;
    const std::string_view text = asText(encoded);
    for (std::size_t at = text.find("\xff\xda"); at != text.npos; at = text.find("\xff\xda", at + 2)) ++scans;
    return scans;
}

/// Of rows that are there, halved until no side is larger than that.
DecodedImage pictureOfRows(const std::byte* rgba, std::size_t width, std::size_t height, int maxSidePx) {
    const int halvings = halvingsOf(width, height, maxSidePx);
    DecodedImage image{.widthPx = static_cast<int>(halvedSide(width, halvings)),
                       .heightPx = static_cast<int>(halvedSide(height, halvings))};
    image.rgba.resize(4 * static_cast<std::size_t>(image.widthPx) * static_cast<std::size_t>(image.heightPx));
    image.halved = halvings > 0;
    HalvedRows rows(width, height, halvings, false, image.rgba.data());
    for (std::size_t y = 0; y < height; ++y) rows.add(rgba + 4 * width * y);
    return image;
}

Expected<DecodedImage> decodeByStb(ByteSpan encoded, const PictureBounds& bounds) {
    constexpr const char* kNone =
        "an image that cannot be decoded (PNG, JPEG, BMP, TGA, GIF, PIC, PNM, SGI, TIFF, WebP, MNG, .hdr, .exr, DDS, "
        "KTX, KTX2, .astc and .pkm can)";
    // None of its formats says more pixels with a byte: memory for others would be for nothing.
    constexpr std::size_t kMostPixelsPerByte = 8256, kFew = std::size_t{1} << 16;
    const auto* bytes = reinterpret_cast<const stbi_uc*>(encoded.data());
    const int size = static_cast<int>(encoded.size());
    int width = 0, height = 0, channels = 0;
    if (!stbi_info_from_memory(bytes, size, &width, &height, &channels) || width <= 0 || height <= 0)
        return fail(ErrorCode::kBadInput, kNone);
    const auto rowPixels = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
    const std::size_t pixels = rowPixels * rows;
    // It keeps all that it has unpacked, and then the pixels.
    if (Expected<void> allowed = bounds.allow("an image", rowPixels, rows, 2 + jpegScans(encoded) / 128); !allowed)
        return tl::unexpected(allowed.error());
    if (pixels > kFew + encoded.size() * kMostPixelsPerByte)
        return fail(ErrorCode::kBadInput, fmt::format("an image of {} × {} pixels in {} bytes", width, height, size));
    AskedBytes asked(encoded);
    const stbi_io_callbacks callbacks{.read = &AskedBytes::read, .skip = &AskedBytes::skip, .eof = &AskedBytes::atEnd};
    const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> loaded(
        stbi_load_from_callbacks(&callbacks, &asked, &width, &height, &channels, 4), &stbi_image_free);
    // JPEG says itself what it misses, and may lack its end alone.
    const bool saysItself = bytes[0] == 0xff;
    if (loaded && asked.askedBeyond() && !saysItself) return fail(ErrorCode::kBadInput, "an image that is cut off");
    // What it says first and then might differ in a file that means harm.
    if (!loaded || static_cast<std::size_t>(width) * static_cast<std::size_t>(height) != pixels)
        return fail(ErrorCode::kBadInput, kNone);
    return pictureOfRows(reinterpret_cast<const std::byte*>(loaded.get()), rowPixels, rows, bounds.maxSidePx);
}

/// Of an animation the frame, where it stands on the canvas.
Expected<DecodedImage> decodeFrame(const PngFrame& frame, const PictureBounds& bounds) {
    if (Expected<void> allowed =
            bounds.allow("an animated PNG", std::size_t{frame.canvasWidthPx}, std::size_t{frame.canvasHeightPx});
        !allowed)
        return tl::unexpected(allowed.error());
    const Expected<DecodedImage> picture =
        decodePng(frame.png, {.maxSidePx = static_cast<int>(kMaxPictureSide), .pool = bounds.pool});
    return picture ? onCanvas(frame, *picture) : picture;
}

Expected<DecodedImage> decodeMng(ByteSpan encoded, const PictureBounds& bounds) {
    const Expected<Bytes> png = firstPngOfMng(encoded);
    if (!png) return tl::unexpected(png.error());
    return decodePng(*png, bounds);
}

Expected<DecodedImage> decodeAny(ByteSpan encoded, const PictureBounds& bounds) {
    if (isRadiancePicture(encoded)) return decodeRadiance(encoded, bounds);
    if (isDds(encoded)) return decodeDds(encoded, bounds);
    if (isKtx1(encoded)) return decodeKtx1(encoded, bounds);
    if (isKtx2(encoded)) return decodeKtx2(encoded, bounds);
    if (isAstcFile(encoded)) return decodeAstcFile(encoded, bounds);
    if (isPkm(encoded)) return decodePkm(encoded, bounds);
    if (isExr(encoded)) return decodeExr(encoded, bounds);
    if (isTiff(encoded)) return decodeTiff(encoded, bounds);
    if (isSgi(encoded)) return decodeSgi(encoded, bounds);
    if (isPnm(encoded)) return decodePnm(encoded, bounds);
    if (isWebp(encoded)) return decodeWebp(encoded, bounds);
    if (isMng(encoded)) return decodeMng(encoded, bounds);
    if (const std::string_view name = unreadFormat(encoded); !name.empty())
        return fail(ErrorCode::kBadInput, fmt::format("{}, which is not read", name));
    if (const std::optional<PngFrame> frame = firstFrameOfPng(encoded)) return decodeFrame(*frame, bounds);
    if (isPng(encoded)) return decodePng(encoded, bounds);
    return decodeByStb(encoded, bounds);
}

}  // namespace

Expected<void> PictureBounds::allow(std::string_view what, std::size_t widthPx, std::size_t heightPx,
                                    unsigned weight) const {
    const std::string sized = fmt::format("{} of {} × {} pixels", what, widthPx, heightPx);
    if (widthPx == 0 || heightPx == 0 || std::max(widthPx, heightPx) > kMaxPictureSide ||
        widthPx * heightPx > kMaxPicturePixels)
        return fail(ErrorCode::kBadInput, fmt::format("{}: up to {} a side and {} in all can be read", sized,
                                                      kMaxPictureSide, kMaxPicturePixels));
    return pool.take(sized, std::uint64_t{weight} * widthPx * heightPx);
}

bool halve(DecodedImage& image) {
    if (image.widthPx <= 1 && image.heightPx <= 1) return false;
    if (image.compressed()) {
        if (image.mipmaps <= 1) return false;
        image.rgba.erase(image.rgba.begin(), image.rgba.begin() + static_cast<std::ptrdiff_t>(largestBytes(image)));
        --image.mipmaps;
        image.depthPx = std::max(1, image.depthPx / 2);
    } else {
        image.rgba = averaged(image.rgba, static_cast<std::size_t>(image.widthPx),
                              static_cast<std::size_t>(image.heightPx), image.encoding == proto::scene::Image::RGBE);
    }
    image.widthPx = std::max(1, image.widthPx / 2);
    image.heightPx = std::max(1, image.heightPx / 2);
    return image.halved = true;
}

Expected<DecodedImage> decodeImage(ByteSpan encoded, int maxSidePx) {
    PixelPool alone;
    alone.grant(encoded.size());
    return decodeImage(encoded, maxSidePx, alone);
}

Expected<DecodedImage> decodeImage(ByteSpan encoded, int maxSidePx, PixelPool& pool) {
    if (encoded.empty() || encoded.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
        return fail(ErrorCode::kBadInput, "an empty or enormous image");
    Expected<DecodedImage> image = decodeAny(encoded, {.maxSidePx = maxSidePx, .pool = pool});
    constexpr int kMostCompressed = 16384;
    while (image && std::max(image->widthPx, image->heightPx) > (image->compressed() ? kMostCompressed : maxSidePx))
        if (!halve(*image))
            return fail(ErrorCode::kLimit, fmt::format("a compressed image of {} × {} pixels without smaller ones",
                                                       image->widthPx, image->heightPx));
    return image;
}

}  // namespace tessera
