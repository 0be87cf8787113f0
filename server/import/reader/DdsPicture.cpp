#include "server/import/reader/DdsPicture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include "server/import/reader/TexelLayout.h"

namespace tessera {
namespace {

using DdsMessage = proto::scene::Image;

tl::unexpected<Error> badDds(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a DDS texture {}", why));
}

std::uint32_t ddsWord(ByteSpan bytes, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
}

constexpr std::uint32_t fourCc(const char (&text)[5]) {
    return static_cast<std::uint32_t>(text[0]) | static_cast<std::uint32_t>(text[1]) << 8 |
           static_cast<std::uint32_t>(text[2]) << 16 | static_cast<std::uint32_t>(text[3]) << 24;
}

/// Of a DXGI_FORMAT.
Expected<TexelLayout> dxgiLayout(std::uint32_t format) {
    switch (format) {
        case 2:
            return TexelLayout::floating(32, 4);
        case 6:
            return TexelLayout::floating(32, 3);
        case 10:
            return TexelLayout::floating(16, 4);
        case 24:
            return TexelLayout::bits("rgba", {10, 10, 10, 2});
        case 27:
        case 28:
        case 29:
            return TexelLayout::bits("rgba", {8, 8, 8, 8});
        case 49:
            return TexelLayout::bits("rg", {8, 8, 0, 0});
        case 61: {
            TexelLayout layout = TexelLayout::bits("r", {8, 0, 0, 0});
            layout.grey = true;
            return layout;
        }
        case 85:
            return TexelLayout::bits("bgr", {5, 6, 5, 0});
        case 86:
            return TexelLayout::bits("bgra", {5, 5, 5, 1});
        case 115:
            return TexelLayout::bits("bgra", {4, 4, 4, 4});
        case 87:
        case 90:
        case 91:
            return TexelLayout::bits("bgra", {8, 8, 8, 8});
        case 88:
        case 92:
        case 93:
            return TexelLayout::bits("bgrx", {8, 8, 8, 8});
        case 70:
        case 71:
        case 72:
            return TexelLayout::blocks(DdsMessage::BC1);
        case 73:
        case 74:
        case 75:
            return TexelLayout::blocks(DdsMessage::BC2);
        case 76:
        case 77:
        case 78:
            return TexelLayout::blocks(DdsMessage::BC3);
        case 79:
        case 80:
            return TexelLayout::blocks(DdsMessage::BC4);
        case 82:
        case 83:
            return TexelLayout::blocks(DdsMessage::BC5);
        case 94:
        case 95:
            return TexelLayout::blocks(DdsMessage::BC6H);
        case 97:
        case 98:
        case 99:
            return TexelLayout::blocks(DdsMessage::BC7);
        case 81:
        case 84:
        case 96:
            return badDds("of signed blocks (BC4, BC5 or BC6H), which are not read: those without a sign are");
        default:
            return badDds(fmt::format("of DXGI format {}, which is not read", format));
    }
}

/// Of the pixel format of files without a DXGI_FORMAT.
Expected<TexelLayout> oldLayout(ByteSpan bytes) {
    constexpr std::uint32_t kAlphaPixels = 0x1, kAlpha = 0x2, kFourCc = 0x4, kRgb = 0x40, kLuminance = 0x20000;
    const std::uint32_t flags = ddsWord(bytes, 80), code = ddsWord(bytes, 84), bits = ddsWord(bytes, 88);
    if (flags & kFourCc) {
        switch (code) {
            case fourCc("DXT1"):
                return TexelLayout::blocks(DdsMessage::BC1);
            case fourCc("DXT2"):
            case fourCc("DXT3"):
                return TexelLayout::blocks(DdsMessage::BC2);
            case fourCc("DXT4"):
            case fourCc("DXT5"):
                return TexelLayout::blocks(DdsMessage::BC3);
            case fourCc("ATI1"):
            case fourCc("BC4U"):
                return TexelLayout::blocks(DdsMessage::BC4);
            case fourCc("ATI2"):
            case fourCc("BC5U"):
                return TexelLayout::blocks(DdsMessage::BC5);
            case 113:  // D3DFMT_A16B16G16R16F
                return TexelLayout::floating(16, 4);
            case 116:  // D3DFMT_A32B32G32R32F
                return TexelLayout::floating(32, 4);
            default: {
                std::string name;
                for (int i = 0; i < 4; ++i)
                    if (const char c = static_cast<char>(code >> 8 * i & 255); c > ' ' && c < 127) name += c;
                return badDds(fmt::format("of format '{}' ({}), which is not read", name, code));
            }
        }
    }
    if (!(flags & (kRgb | kLuminance | kAlpha)) || bits == 0 || bits > 32 || bits % 8 != 0)
        return badDds(fmt::format("of pixels of {} bits (kind {:#x}), which are not read", bits, flags));
    TexelLayout layout;
    layout.bytes = bits / 8;
    layout.grey = (flags & kLuminance) != 0;
    if (flags & (kRgb | kLuminance))
        for (std::size_t c = 0; c < 3; ++c) layout.masks[c] = ddsWord(bytes, 92 + 4 * c);
    if (flags & (kAlphaPixels | kAlpha)) layout.masks[3] = ddsWord(bytes, 104);
    if (layout.masks == std::array<std::uint64_t, 4>{}) return badDds("whose pixels have no channel");
    const std::uint64_t inside = (std::uint64_t{1} << bits) - 1;
    for (const std::uint64_t mask : layout.masks)
        if ((mask & ~inside) != 0) return badDds("with a channel beyond its pixels");
    return layout;
}

}  // namespace

bool isDds(ByteSpan bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "DDS ", 4) == 0;
}

Expected<DecodedImage> decodeDds(ByteSpan bytes, const PictureBounds& bounds) {
    constexpr std::size_t kHeader = 128, kLaterHeader = 20;
    constexpr std::uint32_t kCube = 0x200, kAllFaces = 0xfc00, kVolume = 0x200000;
    if (bytes.size() < kHeader || ddsWord(bytes, 4) != 124) return badDds("whose header is cut off or damaged");
    const bool later = (ddsWord(bytes, 80) & 0x4) && ddsWord(bytes, 84) == fourCc("DX10");
    if (later && bytes.size() < kHeader + kLaterHeader) return badDds("that is cut off");
    const Expected<TexelLayout> layout = later ? dxgiLayout(ddsWord(bytes, 128)) : oldLayout(bytes);
    if (!layout) return tl::unexpected(layout.error());
    const std::uint32_t caps = ddsWord(bytes, 112), dimension = later ? ddsWord(bytes, 132) : 3;
    const bool cube = (caps & kCube) || (later && (ddsWord(bytes, 136) & 0x4));
    const bool solid = dimension == 4 || (!later && (caps & kVolume));
    if (!later && cube && (caps & kAllFaces) != kAllFaces) return badDds("is a cube that lacks faces");
    if (later && ddsWord(bytes, 140) > 1)
        return badDds(fmt::format("is an array of {} textures, which is not read", ddsWord(bytes, 140)));
    TextureFile file{
        .kind = "a DDS texture", .layout = *layout, .widthPx = ddsWord(bytes, 16), .heightPx = ddsWord(bytes, 12)};
    if (solid) file.depthPx = ddsWord(bytes, 24);
    if (dimension == 2) file.heightPx = 1;
    file.shape = cube             ? DdsMessage::CUBE
                 : solid          ? DdsMessage::SOLID
                 : dimension == 2 ? DdsMessage::LINE
                                  : DdsMessage::FLAT;
    file.mipmaps = std::max<std::uint32_t>(1, ddsWord(bytes, 28));
    // Face by face, of each its levels; what is asked for comes in another order.
    const std::size_t start = kHeader + (later ? kLaterHeader : 0);
    file.part = [&](std::uint64_t level, std::uint64_t face, std::uint64_t size) -> Expected<ByteSpan> {
        std::uint64_t ofFace = 0, before = 0;
        for (std::uint64_t i = 0; i < file.mipmaps; ++i) {
            if (i == level) before = ofFace;
            ofFace += file.partBytes(i);
        }
        const std::uint64_t at = start + face * ofFace + before;
        if (at > bytes.size() || size > bytes.size() - at) return badDds("that is cut off");
        return bytes.subspan(at, size);
    };
    return decodeTexture(file, bounds);
}

}  // namespace tessera
