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
#include "server/import/reader/Ktx1Picture.h"
#include "server/import/reader/Ktx2Picture.h"
#include "server/import/reader/PictureFormats.h"
#include "server/import/reader/RadiancePicture.h"

namespace tessera {
namespace {

/// The one size below; of a cube or solid slice by slice.
Bytes averaged(ByteSpan from, std::size_t width, std::size_t height, bool rgbe) {
    const std::size_t w = std::max<std::size_t>(1, width / 2), h = std::max<std::size_t>(1, height / 2),
                      slice = 4 * width * height;
    Bytes small(from.size() / slice * w * h * 4);
    std::size_t out = 0;
    for (std::size_t start = 0; start < from.size(); start += slice)
        for (std::size_t y = 0; y < h; ++y)
            for (std::size_t x = 0; x < w; ++x, out += 4) {
                std::array<const std::byte*, 4> texels{};
                for (std::size_t k = 0; k < 4; ++k)
                    texels[k] = from.data() + start +
                                4 * (std::min(2 * y + k / 2, height - 1) * width + std::min(2 * x + k % 2, width - 1));
                if (rgbe) {
                    // Of exponents there is no mean: that of what they say.
                    double sum[3] = {};
                    for (const std::byte* texel : texels) {
                        double rgb[3];
                        rgbeToLinear(texel, rgb);
                        for (int c = 0; c < 3; ++c) sum[c] += 0.25 * rgb[c];
                    }
                    linearToRgbe(sum, &small[out]);
                    continue;
                }
                for (std::size_t c = 0; c < 4; ++c) {
                    unsigned sum = 2;
                    for (const std::byte* texel : texels) sum += std::to_integer<unsigned>(texel[c]);
                    small[out + c] = static_cast<std::byte>(sum / 4);
                }
            }
    return small;
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

Expected<DecodedImage> decodeByStb(ByteSpan encoded) {
    constexpr const char* kNone =
        "an image that cannot be decoded (PNG, JPEG, BMP, TGA, GIF, PIC, PNM, SGI, TIFF, WebP, MNG, .hdr, .exr, DDS, "
        "KTX, KTX2, .astc and .pkm can)";
    // None of its formats says more pixels with a byte (PNG: 8 a byte before deflate, which reaches 1 : 1032): memory
    // for others would be for nothing.
    constexpr std::size_t kMostPixelsPerByte = 8256, kFew = std::size_t{1} << 16;
    const auto* bytes = reinterpret_cast<const stbi_uc*>(encoded.data());
    const int size = static_cast<int>(encoded.size());
    int width = 0, height = 0, channels = 0;
    if (!stbi_info_from_memory(bytes, size, &width, &height, &channels) || width <= 0 || height <= 0)
        return fail(ErrorCode::kBadInput, kNone);
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (std::max<std::size_t>(static_cast<std::size_t>(width), static_cast<std::size_t>(height)) > kMaxPictureSide ||
        pixels > kMaxPicturePixels || pixels > kFew + encoded.size() * kMostPixelsPerByte)
        return fail(ErrorCode::kBadInput,
                    fmt::format("an image of {} × {} pixels in {} bytes: up to {} a side and {} in all can be read",
                                width, height, size, kMaxPictureSide, kMaxPicturePixels));
    AskedBytes asked(encoded);
    const stbi_io_callbacks callbacks{.read = &AskedBytes::read, .skip = &AskedBytes::skip, .eof = &AskedBytes::atEnd};
    const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> loaded(
        stbi_load_from_callbacks(&callbacks, &asked, &width, &height, &channels, 4), &stbi_image_free);
    // JPEG and PNG say themselves what they miss; a JPEG may lack its end alone.
    const bool saysItself = bytes[0] == 0xff || bytes[0] == 0x89;
    if (loaded && asked.askedBeyond() && !saysItself) return fail(ErrorCode::kBadInput, "an image that is cut off");
    // What it says first and then might differ in a file that means harm.
    if (!loaded || static_cast<std::size_t>(width) * static_cast<std::size_t>(height) != pixels)
        return fail(ErrorCode::kBadInput, kNone);
    DecodedImage image{.widthPx = width, .heightPx = height, .rgba = Bytes(4 * pixels)};
    std::memcpy(image.rgba.data(), loaded.get(), image.rgba.size());
    return image;
}

Expected<DecodedImage> decodeFrame(const PngFrame& frame) {
    const Expected<DecodedImage> picture = decodeByStb(frame.png);
    return picture ? onCanvas(frame, *picture) : picture;
}

Expected<DecodedImage> decodeMng(ByteSpan encoded) {
    const Expected<Bytes> png = firstPngOfMng(encoded);
    if (!png) return tl::unexpected(png.error());
    return decodeByStb(*png);
}

Expected<DecodedImage> decodeAny(ByteSpan encoded) {
    if (isRadiancePicture(encoded)) return decodeRadiance(encoded);
    if (isDds(encoded)) return decodeDds(encoded);
    if (isKtx1(encoded)) return decodeKtx1(encoded);
    if (isKtx2(encoded)) return decodeKtx2(encoded);
    if (isAstcFile(encoded)) return decodeAstcFile(encoded);
    if (isPkm(encoded)) return decodePkm(encoded);
    if (isExr(encoded)) return decodeExr(encoded);
    if (isTiff(encoded)) return decodeTiff(encoded);
    if (isSgi(encoded)) return decodeSgi(encoded);
    if (isPnm(encoded)) return decodePnm(encoded);
    if (isWebp(encoded)) return decodeWebp(encoded);
    if (isMng(encoded)) return decodeMng(encoded);
    if (const std::string_view name = unreadFormat(encoded); !name.empty())
        return fail(ErrorCode::kBadInput, fmt::format("{}, which is not read", name));
    if (const std::optional<PngFrame> frame = firstFrameOfPng(encoded)) return decodeFrame(*frame);
    return decodeByStb(encoded);
}

}  // namespace

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
    if (encoded.empty() || encoded.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
        return fail(ErrorCode::kBadInput, "an empty or enormous image");
    Expected<DecodedImage> image = decodeAny(encoded);
    constexpr int kMostCompressed = 16384;
    while (image && std::max(image->widthPx, image->heightPx) > (image->compressed() ? kMostCompressed : maxSidePx))
        if (!halve(*image))
            return fail(ErrorCode::kLimit, fmt::format("a compressed image of {} × {} pixels without smaller ones",
                                                       image->widthPx, image->heightPx));
    return image;
}

}  // namespace tessera
