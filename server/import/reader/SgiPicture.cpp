#include <fmt/format.h>

#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

tl::unexpected<Error> badSgi(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("an SGI picture {}", why));
}

/// Most significant byte first.
std::size_t sgiNumber(ByteSpan bytes, std::size_t at, std::size_t count) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value = value << 8 | std::to_integer<std::size_t>(bytes[at + i]);
    return value;
}

/// The upper byte of each value of a row, written every four bytes. Runs: a count of seven bits, and whether so many
/// values follow or one for all.
bool readSgiRow(ByteSpan runs, std::size_t valueBytes, std::size_t width, std::byte* to) {
    std::size_t at = 0, x = 0;
    while (x < width) {
        if (at + valueBytes > runs.size()) return false;
        const std::size_t head = sgiNumber(runs, at, valueBytes), count = head & 0x7f;
        at += valueBytes;
        if (count == 0 || count > width - x) return false;
        const bool each = (head & 0x80) != 0;
        if (at + (each ? count : 1) * valueBytes > runs.size()) return false;
        for (std::size_t i = 0; i < count; ++i, ++x) to[4 * x] = runs[at + (each ? i * valueBytes : 0)];
        at += (each ? count : 1) * valueBytes;
    }
    return true;
}

}  // namespace

bool isSgi(ByteSpan bytes) {
    return bytes.size() >= 12 && bytes[0] == std::byte{1} && bytes[1] == std::byte{0xda} && bytes[2] <= std::byte{1} &&
           bytes[3] >= std::byte{1} && bytes[3] <= std::byte{2};
}

Expected<DecodedImage> decodeSgi(ByteSpan bytes, const PictureBounds& bounds) {
    constexpr std::size_t kHeader = 512;
    if (!isSgi(bytes) || bytes.size() < kHeader) return badSgi("whose header is cut off or damaged");
    const bool inRuns = bytes[2] == std::byte{1};
    const std::size_t valueBytes = sgiNumber(bytes, 3, 1), dimensions = sgiNumber(bytes, 4, 2);
    const std::size_t width = sgiNumber(bytes, 6, 2), height = dimensions >= 2 ? sgiNumber(bytes, 8, 2) : 1,
                      channels = dimensions >= 3 ? sgiNumber(bytes, 10, 2) : 1;
    if (dimensions < 1 || dimensions > 3) return badSgi(fmt::format("of {} dimensions", dimensions));
    if (Expected<void> allowed = bounds.allow("an SGI picture", width, height); !allowed)
        return tl::unexpected(allowed.error());
    if (channels < 1 || channels > 4) return badSgi(fmt::format("of {} channels: 1 to 4 can be read", channels));
    if (sgiNumber(bytes, 104, 4) != 0) return badSgi("with a colour map, which is not read");
    const std::size_t rows = height * channels;
    if (bytes.size() - kHeader < (inRuns ? rows * 8 : rows * width * valueBytes)) return badSgi("that is cut off");
    DecodedImage image{.widthPx = static_cast<int>(width),
                       .heightPx = static_cast<int>(height),
                       .rgba = Bytes(width * height * 4, std::byte{255})};
    for (std::size_t channel = 0; channel < channels; ++channel) {
        for (std::size_t y = 0; y < height; ++y) {  // from the bottom
            const std::size_t row = channel * height + y;
            const std::size_t place = channels == 2 && channel == 1 ? 3 : channel;
            std::byte* to = image.rgba.data() + 4 * (height - 1 - y) * width + place;
            if (inRuns) {
                const std::size_t start = sgiNumber(bytes, kHeader + 4 * row, 4),
                                  length = sgiNumber(bytes, kHeader + 4 * (rows + row), 4);
                if (start > bytes.size() || length > bytes.size() - start ||
                    !readSgiRow(bytes.subspan(start, length), valueBytes, width, to))
                    return badSgi(fmt::format("whose row {} is cut off or damaged", y));
            } else {
                for (std::size_t x = 0; x < width; ++x) to[4 * x] = bytes[kHeader + (row * width + x) * valueBytes];
            }
        }
    }
    for (std::size_t i = 0; channels < 3 && i < width * height; ++i)
        image.rgba[4 * i + 1] = image.rgba[4 * i + 2] = image.rgba[4 * i];
    return image;
}

}  // namespace tessera
