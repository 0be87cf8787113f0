#include "server/import/reader/Ktx2Picture.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "server/import/reader/TexelLayout.h"

namespace tessera {
namespace {

using KtxMessage = proto::scene::Image;

constexpr unsigned char kIdentifier[12] = {0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};

tl::unexpected<Error> badKtx(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a KTX2 texture {}", why));
}

template <typename Word>
Word ktxWord(ByteSpan bytes, std::size_t at) {
    Word value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof(Word));
    return value;
}

/// Of a VkFormat.
Expected<TexelLayout> vulkanLayout(std::uint32_t format) {
    const auto grey = [](TexelLayout layout) {
        layout.grey = true;
        return layout;
    };
    switch (format) {
        case 9:
        case 15:
            return grey(TexelLayout::bits("r", {8, 0, 0, 0}));
        case 76:
            return TexelLayout::floating(16, 1);
        case 83:
            return TexelLayout::floating(16, 2);
        case 90:
            return TexelLayout::floating(16, 3);
        case 100:
            return TexelLayout::floating(32, 1);
        case 103:
            return TexelLayout::floating(32, 2);
        case 16:
        case 22:
            return TexelLayout::bits("rg", {8, 8, 0, 0});
        case 23:
        case 29:
            return TexelLayout::bits("rgb", {8, 8, 8, 0});
        case 30:
        case 36:
            return TexelLayout::bits("bgr", {8, 8, 8, 0});
        case 37:
        case 43:
            return TexelLayout::bits("rgba", {8, 8, 8, 8});
        case 44:
        case 50:
            return TexelLayout::bits("bgra", {8, 8, 8, 8});
        case 70:
            return grey(TexelLayout::bits("r", {16, 0, 0, 0}));
        case 91:
            return TexelLayout::bits("rgba", {16, 16, 16, 16});
        case 97:
            return TexelLayout::floating(16, 4);
        case 106:
            return TexelLayout::floating(32, 3);
        case 109:
            return TexelLayout::floating(32, 4);
        case 131:
        case 132:
        case 133:
        case 134:
            return TexelLayout::blocks(KtxMessage::BC1);
        case 135:
        case 136:
            return TexelLayout::blocks(KtxMessage::BC2);
        case 137:
        case 138:
            return TexelLayout::blocks(KtxMessage::BC3);
        case 139:
            return TexelLayout::blocks(KtxMessage::BC4);
        case 141:
            return TexelLayout::blocks(KtxMessage::BC5);
        case 143:
            return TexelLayout::blocks(KtxMessage::BC6H);
        case 145:
        case 146:
            return TexelLayout::blocks(KtxMessage::BC7);
        case 140:
        case 142:
        case 144:
            return badKtx("of signed blocks (BC4, BC5 or BC6H), which are not read: those without a sign are");
        case 147:
        case 148:
            return TexelLayout::etc(EtcFormat::kRgb);
        case 149:
        case 150:
            return TexelLayout::etc(EtcFormat::kRgbCutOut);
        case 151:
        case 152:
            return TexelLayout::etc(EtcFormat::kRgba);
        case 153:
            return TexelLayout::etc(EtcFormat::kRed);
        case 154:
            return TexelLayout::etc(EtcFormat::kSignedRed);
        case 155:
            return TexelLayout::etc(EtcFormat::kRedGreen);
        case 156:
            return TexelLayout::etc(EtcFormat::kSignedRedGreen);
        default:
            // Of each size the one of plain numbers, then that of sRGB; and those of HDR, which come in an extension.
            constexpr std::uint32_t kAstc = 157, kLastAstc = 184, kAstcHdr = 1000066000;
            if (format >= kAstc && format <= kLastAstc)
                return TexelLayout::astc((format - kAstc) / 2, (format - kAstc) % 2 != 0);
            if (format - kAstcHdr < TexelLayout::kAstcSizes.size())
                return badKtx(
                    "of ASTC with a wide range of light (HDR), which is not read: .exr and .hdr pictures are");
            return badKtx(fmt::format("of VkFormat {}, which is not read", format));
    }
}

/// The colour model of the data format descriptor: what vkFormat 0 stands for.
std::string_view nameOfModel(ByteSpan bytes) {
    const std::uint64_t at = ktxWord<std::uint32_t>(bytes, 48);
    const std::uint64_t model = at + 12;  // total size, two words of the block's header
    if (at == 0 || model >= bytes.size()) return "no format";
    switch (std::to_integer<unsigned>(bytes[model])) {
        case 163:
            return "Basis Universal's ETC1S";
        case 166:
            return "Basis Universal's UASTC";
        default:
            return "no format";
    }
}

/// 'r' 'd' is from the left and from the top, and what no value says.
bool isFromTop(ByteSpan bytes) {
    const std::uint64_t from = ktxWord<std::uint32_t>(bytes, 56), length = ktxWord<std::uint32_t>(bytes, 60);
    if (from > bytes.size() || length > bytes.size() - from) return true;
    const std::string_view values(reinterpret_cast<const char*>(bytes.data() + from), length);
    constexpr std::string_view kKey("KTXorientation\0", 15);
    const std::size_t at = values.find(kKey);
    return at == std::string_view::npos || at + 17 > values.size() || values[at + 16] != 'u';
}

}  // namespace

bool isKtx2(ByteSpan bytes) {
    return bytes.size() >= 12 && std::memcmp(bytes.data(), kIdentifier, 12) == 0;
}

Expected<DecodedImage> decodeKtx2(ByteSpan bytes, const PictureBounds& bounds) {
    constexpr std::size_t kLevels = 80, kLevelBytes = 24;
    constexpr std::uint32_t kBasisLz = 1, kZstd = 2;
    if (bytes.size() < kLevels) return badKtx("that is cut off");
    const auto word = [bytes](std::size_t at) { return ktxWord<std::uint32_t>(bytes, at); };
    const std::uint32_t scheme = word(44), format = word(12);
    constexpr std::string_view kCure = "`ktx transcode` makes one of BC7 or ASTC of it";
    if (scheme == kBasisLz) return badKtx(fmt::format("of BasisLZ, which is not read: {}", kCure));
    if (format == 0) return badKtx(fmt::format("of {}, which is not read: {}", nameOfModel(bytes), kCure));
    if (scheme != 0 && scheme != kZstd)
        return badKtx(scheme == 3 ? std::string("compressed by zlib, which is not read")
                                  : fmt::format("compressed in a way ({}) that is not read", scheme));
    const Expected<TexelLayout> layout = vulkanLayout(format);
    if (!layout) return tl::unexpected(layout.error());
    if (word(32) > 1) return badKtx(fmt::format("is an array of {} textures, which is not read", word(32)));
    if (word(36) != 1 && word(36) != 6) return badKtx(fmt::format("has {} faces", word(36)));
    TextureFile file{.kind = "a KTX2 texture",
                     .layout = *layout,
                     .widthPx = word(20),
                     .heightPx = std::max<std::uint32_t>(1, word(24)),
                     .depthPx = std::max<std::uint32_t>(1, word(28))};
    file.shape = word(36) == 6   ? KtxMessage::CUBE
                 : word(28) > 0  ? KtxMessage::SOLID
                 : word(24) == 0 ? KtxMessage::LINE
                                 : KtxMessage::FLAT;
    file.mipmaps = std::max<std::uint32_t>(1, word(40));
    if (file.mipmaps > 32 || bytes.size() < kLevels + file.mipmaps * kLevelBytes) return badKtx("that is cut off");
    file.fromTop = isFromTop(bytes);
    Bytes unpacked;
    std::uint64_t unpackedLevel = ~std::uint64_t{};
    file.part = [&](std::uint64_t level, std::uint64_t face, std::uint64_t size) -> Expected<ByteSpan> {
        const std::size_t at = kLevels + level * kLevelBytes;
        const auto from = ktxWord<std::uint64_t>(bytes, at), length = ktxWord<std::uint64_t>(bytes, at + 8);
        if (from > bytes.size() || length > bytes.size() - from) return badKtx("that is cut off");
        ByteSpan all = bytes.subspan(from, length);
        const std::uint64_t needed = size * (file.shape == KtxMessage::CUBE ? 6 : 1);
        if (scheme == kZstd && unpackedLevel != level) {
            // Nothing is promised memory on the word of a number: zstd's best is far below this.
            if (needed / 100000 > length) return badKtx("that is cut off");
            unpacked.resize(needed);
            const std::size_t got = ZSTD_decompress(unpacked.data(), unpacked.size(), all.data(), all.size());
            if (ZSTD_isError(got) || got != needed) return badKtx(fmt::format("whose mipmap {} is damaged", level));
            unpackedLevel = level;
        }
        if (scheme == kZstd) all = unpacked;
        if (all.size() < needed)
            return badKtx(fmt::format("whose mipmap {} has {} bytes of {}", level, all.size(), needed));
        return all.subspan(face * size, size);
    };
    return decodeTexture(file, bounds);
}

}  // namespace tessera
