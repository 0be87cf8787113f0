#include <fmt/format.h>

#include <optional>

#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

tl::unexpected<Error> badPnm(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a PNM picture {}", why));
}

/// Numbers in a text with comments, and bits and bytes behind it.
class PnmSource {
public:
    explicit PnmSource(ByteSpan bytes) : bytes_(bytes) {}

    [[nodiscard]] std::optional<unsigned> number() {
        skipSpace();
        unsigned value = 0;
        bool any = false;
        for (; at_ < bytes_.size() && isDigit(bytes_[at_]); ++at_, any = true) {
            value = 10 * value + (std::to_integer<unsigned>(bytes_[at_]) - '0');
            if (value > 1000000) return std::nullopt;
        }
        return any ? std::optional(value) : std::nullopt;
    }
    /// A 0 or a 1, which need no space between them.
    [[nodiscard]] std::optional<unsigned> bit() {
        skipSpace();
        if (at_ >= bytes_.size() || (bytes_[at_] != std::byte{'0'} && bytes_[at_] != std::byte{'1'}))
            return std::nullopt;
        return std::to_integer<unsigned>(bytes_[at_++]) - '0';
    }
    /// Behind the one character of space that ends the header.
    [[nodiscard]] ByteSpan rest() const { return bytes_.subspan(std::min(at_ + 1, bytes_.size())); }
    [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

private:
    static bool isDigit(std::byte b) { return b >= std::byte{'0'} && b <= std::byte{'9'}; }
    void skipSpace() {
        for (; at_ < bytes_.size(); ++at_) {
            const char c = static_cast<char>(bytes_[at_]);
            if (c == '#')
                while (at_ + 1 < bytes_.size() && bytes_[at_] != std::byte{'\n'}) ++at_;
            else if (c != ' ' && c != '\t' && c != '\n' && c != '\r' && c != '\v' && c != '\f')
                return;
        }
    }
    ByteSpan bytes_;
    std::size_t at_ = 2;
};

}  // namespace

bool isPnm(ByteSpan bytes) {
    if (bytes.size() < 3 || bytes[0] != std::byte{'P'} || bytes[1] < std::byte{'1'} || bytes[1] > std::byte{'6'})
        return false;
    const char third = static_cast<char>(bytes[2]);
    return third == ' ' || third == '\n' || third == '\r' || third == '\t' || third == '#';
}

Expected<DecodedImage> decodePnm(ByteSpan bytes, const PictureBounds& bounds) {
    if (!isPnm(bytes)) return badPnm("begins with P1 to P6; this one does not");
    const unsigned kind = std::to_integer<unsigned>(bytes[1]) - '0';
    const bool text = kind <= 3, bits = kind == 1 || kind == 4;
    const std::size_t channels = kind == 3 || kind == 6 ? 3 : 1;
    PnmSource source(bytes);
    const auto width = source.number(), height = source.number();
    const auto most = bits ? std::optional(1u) : source.number();
    if (!width || !height || !most) return badPnm("whose header is cut off or damaged");
    if (Expected<void> allowed = bounds.allow("a PNM picture", *width, *height); !allowed)
        return tl::unexpected(allowed.error());
    if (*most == 0 || *most > 65535) return badPnm(fmt::format("whose largest value is {}", *most));
    const std::size_t pixels = std::size_t{*width} * *height, valueBytes = *most > 255 ? 2 : 1;
    const ByteSpan raw = source.rest();
    const std::size_t rowBytes = bits ? (*width + 7) / 8 : *width * channels * valueBytes;
    // A number of a text takes a character at least.
    if (text ? source.left() < pixels * channels : raw.size() < rowBytes * *height) return badPnm("that is cut off");
    DecodedImage image{
        .widthPx = static_cast<int>(*width), .heightPx = static_cast<int>(*height), .rgba = Bytes(pixels * 4)};
    for (std::size_t i = 0; i < pixels; ++i) {
        std::array<std::byte, 3> rgb{};
        for (std::size_t c = 0; c < channels; ++c) {
            std::optional<unsigned> value;
            if (text) {
                value = bits ? source.bit() : source.number();
            } else if (bits) {
                const std::size_t x = i % *width, y = i / *width;
                value = std::to_integer<unsigned>(raw[y * rowBytes + x / 8]) >> (7 - x % 8) & 1;
            } else {
                const std::size_t at = (i * channels + c) * valueBytes;
                value = std::to_integer<unsigned>(raw[at]);
                if (valueBytes == 2) value = *value << 8 | std::to_integer<unsigned>(raw[at + 1]);
            }
            if (!value || *value > *most) return badPnm(fmt::format("whose pixel {} is cut off or damaged", i));
            if (bits) value = 1 - *value;  // 1 is black
            rgb[c] = static_cast<std::byte>((std::uint64_t{*value} * 255 + *most / 2) / *most);
        }
        for (std::size_t c = 0; c < 3; ++c) image.rgba[4 * i + c] = rgb[channels == 3 ? c : 0];
        image.rgba[4 * i + 3] = std::byte{255};
    }
    return image;
}

}  // namespace tessera
