// Files that hold nothing but blocks and a header of sixteen bytes, as encoders write them: .astc (astcenc's "File
// formats", The ".astc" file format) and .pkm (etcpack's).
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "server/import/reader/PictureFormats.h"
#include "server/import/reader/TexelLayout.h"

namespace tessera {
namespace {

constexpr std::size_t kBlockFileHeader = 16;

std::uint64_t byteOf(ByteSpan bytes, std::size_t at) {
    return std::to_integer<std::uint64_t>(bytes[at]);
}

/// All that lies behind the header.
Expected<DecodedImage> decodeBehindHeader(TextureFile file, ByteSpan bytes, const PictureBounds& bounds) {
    file.part = [&file, bytes](std::uint64_t, std::uint64_t, std::uint64_t size) -> Expected<ByteSpan> {
        if (size > bytes.size() - kBlockFileHeader)
            return fail(ErrorCode::kBadInput, fmt::format("{} that is cut off", file.kind));
        return bytes.subspan(kBlockFileHeader, size);
    };
    return decodeTexture(file, bounds);
}

/// Of a .pkm's number.
std::optional<EtcFormat> pkmFormat(std::uint64_t number) {
    switch (number) {
        case 0:
        case 1:
            return EtcFormat::kRgb;
        case 2:  // RGBA as an early version had it, and as it was published
        case 3:
            return EtcFormat::kRgba;
        case 4:
            return EtcFormat::kRgbCutOut;
        case 5:
            return EtcFormat::kRed;
        case 6:
            return EtcFormat::kRedGreen;
        case 7:
            return EtcFormat::kSignedRed;
        case 8:
            return EtcFormat::kSignedRedGreen;
        default:
            return std::nullopt;
    }
}

}  // namespace

bool isAstcFile(ByteSpan bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "\x13\xab\xa1\x5c", 4) == 0;
}

Expected<DecodedImage> decodeAstcFile(ByteSpan bytes, const PictureBounds& bounds) {
    constexpr const char* kKind = "an ASTC texture (.astc)";
    if (bytes.size() < kBlockFileHeader) return fail(ErrorCode::kBadInput, fmt::format("{} that is cut off", kKind));
    const unsigned width = static_cast<unsigned>(byteOf(bytes, 4)), height = static_cast<unsigned>(byteOf(bytes, 5));
    const auto& sizes = TexelLayout::kAstcSizes;
    const auto size = std::ranges::find(sizes, std::array<unsigned, 2>{width, height});
    if (size == sizes.end() || byteOf(bytes, 6) != 1)
        return fail(ErrorCode::kBadInput, fmt::format("{} of blocks of {} × {} × {}: 4 × 4 to 12 × 12 are read", kKind,
                                                      width, height, byteOf(bytes, 6)));
    const auto number = [bytes](std::size_t at) {
        return byteOf(bytes, at) | byteOf(bytes, at + 1) << 8 | byteOf(bytes, at + 2) << 16;
    };
    TextureFile file{.kind = kKind,
                     .layout = TexelLayout::astc(static_cast<std::size_t>(size - sizes.begin()), true),
                     .widthPx = number(7),
                     .heightPx = number(10),
                     .depthPx = number(13)};
    if (file.depthPx > 1) file.shape = proto::scene::Image::SOLID;
    return decodeBehindHeader(std::move(file), bytes, bounds);
}

bool isPkm(ByteSpan bytes) {
    return bytes.size() >= 6 && (asText(bytes.first(6)) == "PKM 10" || asText(bytes.first(6)) == "PKM 20");
}

Expected<DecodedImage> decodePkm(ByteSpan bytes, const PictureBounds& bounds) {
    constexpr const char* kKind = "an ETC texture (.pkm)";
    if (bytes.size() < kBlockFileHeader) return fail(ErrorCode::kBadInput, fmt::format("{} that is cut off", kKind));
    const auto number = [bytes](std::size_t at) { return byteOf(bytes, at) << 8 | byteOf(bytes, at + 1); };
    const std::optional<EtcFormat> format = pkmFormat(number(6));
    if (!format) return fail(ErrorCode::kBadInput, fmt::format("{} of kind {}, which is not read", kKind, number(6)));
    return decodeBehindHeader(
        {.kind = kKind, .layout = TexelLayout::etc(*format), .widthPx = number(12), .heightPx = number(14)}, bytes,
        bounds);
}

}  // namespace tessera
