#include "server/import/reader/Ktx1Picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "server/import/reader/TexelLayout.h"

namespace tessera {
namespace {

using Ktx1Message = proto::scene::Image;

constexpr unsigned char kKtx1Identifier[12] = {0xAB, 'K', 'T', 'X', ' ', '1', '1', 0xBB, '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kKtx1Header = 64;

tl::unexpected<Error> badKtx1(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a KTX texture {}", why));
}

/// The file's words, in the machine's order.
class Ktx1Words {
public:
    explicit Ktx1Words(ByteSpan bytes) : bytes_(bytes), turned_(plain(12) == 0x01020304) {}
    [[nodiscard]] bool areSound() const { return turned_ || plain(12) == 0x04030201; }
    [[nodiscard]] bool turned() const { return turned_; }
    [[nodiscard]] std::uint32_t at(std::size_t at) const { return turned_ ? __builtin_bswap32(plain(at)) : plain(at); }

private:
    [[nodiscard]] std::uint32_t plain(std::size_t at) const {
        std::uint32_t word = 0;
        std::memcpy(&word, bytes_.data() + at, 4);
        return word;
    }
    ByteSpan bytes_;
    bool turned_;
};

/// Of a glInternalFormat of blocks.
Expected<TexelLayout> blockLayout(std::uint32_t format) {
    switch (format) {
        case 0x83f0:  // GL_EXT_texture_compression_s3tc, GL_EXT_texture_sRGB
        case 0x83f1:
        case 0x8c4c:
        case 0x8c4d:
            return TexelLayout::blocks(Ktx1Message::BC1);
        case 0x83f2:
        case 0x8c4e:
            return TexelLayout::blocks(Ktx1Message::BC2);
        case 0x83f3:
        case 0x8c4f:
            return TexelLayout::blocks(Ktx1Message::BC3);
        case 0x8dbb:  // OpenGL 3.0, 4.2
            return TexelLayout::blocks(Ktx1Message::BC4);
        case 0x8dbd:
            return TexelLayout::blocks(Ktx1Message::BC5);
        case 0x8e8f:
            return TexelLayout::blocks(Ktx1Message::BC6H);
        case 0x8e8c:
        case 0x8e8d:
            return TexelLayout::blocks(Ktx1Message::BC7);
        case 0x8dbc:
        case 0x8dbe:
        case 0x8e8e:
            return badKtx1("of signed blocks (BC4, BC5 or BC6H), which are not read: those without a sign are");
        case 0x8d64:  // GL_OES_compressed_ETC1_RGB8_texture; OpenGL 4.3
        case 0x9274:
        case 0x9275:
            return TexelLayout::etc(EtcFormat::kRgb);
        case 0x9276:
        case 0x9277:
            return TexelLayout::etc(EtcFormat::kRgbCutOut);
        case 0x9278:
        case 0x9279:
            return TexelLayout::etc(EtcFormat::kRgba);
        case 0x9270:
            return TexelLayout::etc(EtcFormat::kRed);
        case 0x9271:
            return TexelLayout::etc(EtcFormat::kSignedRed);
        case 0x9272:
            return TexelLayout::etc(EtcFormat::kRedGreen);
        case 0x9273:
            return TexelLayout::etc(EtcFormat::kSignedRedGreen);
        default:
            break;
    }
    // GL_KHR_texture_compression_astc_ldr, GL_OES_texture_compression_astc.
    constexpr std::uint32_t kAstc = 0x93b0, kAstcSrgb = 0x93d0, kAstcSizes = 14, kAstcSolid = 0x93c0, kSolids = 10;
    if (format >= kAstc && format < kAstc + kAstcSizes) return TexelLayout::astc(format - kAstc, false);
    if (format >= kAstcSrgb && format < kAstcSrgb + kAstcSizes) return TexelLayout::astc(format - kAstcSrgb, true);
    if ((format & ~std::uint32_t{0x20}) - kAstcSolid < kSolids)
        return badKtx1("of ASTC in three dimensions, which is not read");
    return badKtx1(fmt::format("of blocks of kind {:#x}, which is not read", format));
}

/// Of glType and glFormat: numbers of 8 or 16 bits, floats, and some in which several share one.
Expected<TexelLayout> pixelLayout(std::uint32_t type, std::uint32_t format) {
    struct Order {
        std::uint32_t format;
        const char* channels;
        bool grey;
    };
    constexpr Order kOrders[] = {{0x1903, "r", true},     {0x1906, "a", false},   {0x1907, "rgb", false},
                                 {0x1908, "rgba", false}, {0x1909, "r", true},    {0x190a, "ra", true},
                                 {0x8227, "rg", false},   {0x80e0, "bgr", false}, {0x80e1, "bgra", false}};
    constexpr std::uint32_t kByte = 0x1401, kShort = 0x1403, kFloat = 0x1406, kHalf = 0x140b, kRgb = 0x1907,
                            kRgba = 0x1908;
    const auto order = std::ranges::find(kOrders, format, &Order::format);
    const auto unread = [&] {
        return badKtx1(fmt::format("of pixels of type {:#x} and format {:#x}, which are not read", type, format));
    };
    if (order == std::end(kOrders)) return unread();
    const std::string_view channels(order->channels);
    if (type == kByte || type == kShort) {
        const unsigned width = type == kByte ? 8 : 16;
        TexelLayout layout = TexelLayout::bits(order->channels, {width, width, width, width});
        layout.grey = order->grey;
        return layout;
    }
    if ((type == kHalf || type == kFloat) && channels.starts_with('r') && channels != "ra")
        return TexelLayout::floating(type == kHalf ? 16 : 32, static_cast<unsigned>(channels.size()));
    if (type == 0x8363 && format == kRgb) return TexelLayout::bits("bgr", {5, 6, 5, 0});
    if (type == 0x8033 && format == kRgba) return TexelLayout::bits("abgr", {4, 4, 4, 4});
    if (type == 0x8034 && format == kRgba) return TexelLayout::bits("abgr", {1, 5, 5, 5});
    if (type == 0x8368 && format == kRgba) return TexelLayout::bits("rgba", {10, 10, 10, 2});
    return unread();
}

/// From the top where nothing is said, as the specification wants of whoever writes one: "T=d".
bool isKtx1FromTop(std::string_view values) {
    constexpr std::string_view kKey("KTXorientation\0", 15);
    const std::size_t at = values.find(kKey);
    return at == std::string_view::npos || !values.substr(at + kKey.size(), 16).starts_with("S=r,T=u");
}

/// Where the parts of the file lie. All begin at multiples of four bytes.
class Ktx1Parts {
public:
    Ktx1Parts(ByteSpan bytes, const Ktx1Words& words, const TextureFile& file, std::size_t unitBytes)
        : bytes_(bytes), words_(words), file_(file), unitBytes_(unitBytes) {}

    /// As `TextureFile::part`: without what rows are filled up with, in the machine's order. Valid until the next.
    [[nodiscard]] Expected<ByteSpan> at(std::uint64_t level, std::uint64_t face, std::uint64_t size) {
        const bool cube = file_.shape == Ktx1Message::CUBE;
        std::uint64_t at = kKtx1Header + words_.at(60);
        std::uint64_t stored = 0;
        for (std::uint64_t i = 0; i <= level; ++i) {
            if (at > bytes_.size() || bytes_.size() - at < 4) return badKtx1("that is cut off");
            stored = words_.at(at);
            at += 4;
            if (i < level) at += upToFour(stored) * (cube ? 6 : 1);
        }
        at += upToFour(stored) * face;
        // Some do not fill rows up, and say so by the size.
        const std::uint64_t row = rowBytes(level), rows = size / row, padded = stored == size ? row : upToFour(row);
        if (stored < rows * padded)
            return badKtx1(fmt::format("whose mipmap {} has {} bytes of {}", level, stored, rows * padded));
        if (at > bytes_.size() || rows * padded > bytes_.size() - at) return badKtx1("that is cut off");
        const ByteSpan all = bytes_.subspan(at, rows * padded);
        if (padded == row && unitBytes_ == 1) return all;
        unpacked_.resize(size);
        for (std::uint64_t y = 0; y < rows; ++y) std::memcpy(unpacked_.data() + y * row, all.data() + y * padded, row);
        for (std::size_t i = 0; unitBytes_ > 1 && i + unitBytes_ <= unpacked_.size(); i += unitBytes_)
            std::reverse(unpacked_.begin() + static_cast<std::ptrdiff_t>(i),
                         unpacked_.begin() + static_cast<std::ptrdiff_t>(i + unitBytes_));
        return ByteSpan(unpacked_);
    }

private:
    static std::uint64_t upToFour(std::uint64_t bytes) { return (bytes + 3) / 4 * 4; }
    [[nodiscard]] std::uint64_t rowBytes(std::uint64_t level) const {
        const std::uint64_t width = std::max<std::uint64_t>(1, file_.widthPx >> level);
        return (width + file_.layout.blockWidthPx - 1) / file_.layout.blockWidthPx * file_.layout.bytes;
    }

    ByteSpan bytes_;
    const Ktx1Words& words_;
    const TextureFile& file_;
    std::size_t unitBytes_;  ///< of numbers whose bytes are to be turned round; 1: as they are
    Bytes unpacked_;
};

}  // namespace

bool isKtx1(ByteSpan bytes) {
    return bytes.size() >= 12 && std::memcmp(bytes.data(), kKtx1Identifier, 12) == 0;
}

Expected<DecodedImage> decodeKtx1(ByteSpan bytes, const PictureBounds& bounds) {
    if (bytes.size() < kKtx1Header) return badKtx1("that is cut off");
    const Ktx1Words words(bytes);
    if (!words.areSound()) return badKtx1("whose order of bytes is neither");
    const std::uint32_t type = words.at(16), unitBytes = words.at(20), keyBytes = words.at(60);
    if (keyBytes > bytes.size() - kKtx1Header || keyBytes % 4 != 0) return badKtx1("that is cut off");
    const Expected<TexelLayout> layout = type == 0 ? blockLayout(words.at(28)) : pixelLayout(type, words.at(24));
    if (!layout) return tl::unexpected(layout.error());
    if (unitBytes != 1 && unitBytes != 2 && unitBytes != 4)
        return badKtx1(fmt::format("of numbers of {} bytes", unitBytes));
    const std::uint32_t height = words.at(40), depth = words.at(44), layers = words.at(48), faces = words.at(52);
    if (layers > 1) return badKtx1(fmt::format("is an array of {} textures, which is not read", layers));
    if (faces != 1 && faces != 6) return badKtx1(fmt::format("has {} faces", faces));
    TextureFile file{.kind = "a KTX texture",
                     .layout = *layout,
                     .widthPx = words.at(36),
                     .heightPx = std::max<std::uint32_t>(1, height),
                     .depthPx = std::max<std::uint32_t>(1, depth),
                     .mipmaps = std::max<std::uint32_t>(1, words.at(56)),
                     .shape = faces == 6    ? Ktx1Message::CUBE
                              : depth > 0   ? Ktx1Message::SOLID
                              : height == 0 ? Ktx1Message::LINE
                                            : Ktx1Message::FLAT,
                     .fromTop = isKtx1FromTop(asText(bytes.subspan(kKtx1Header, keyBytes)))};
    Ktx1Parts parts(bytes, words, file, words.turned() ? unitBytes : 1);
    file.part = [&](std::uint64_t level, std::uint64_t face, std::uint64_t size) {
        return parts.at(level, face, size);
    };
    return decodeTexture(file, bounds);
}

}  // namespace tessera
