#include "server/import/coin/GreyPicture.h"

#include <string_view>

namespace tessera {
namespace {

/// Of the frame's header (ITU-T T.81, B.2.2), which segments of tables and comments stand before.
bool isGreyJpeg(std::string_view text) {
    const auto byteAt = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
    for (std::size_t at = 2; at + 4 <= text.size();) {
        if (byteAt(at) != 0xff) return false;
        const unsigned marker = byteAt(at + 1);
        if (marker == 0xff) {  // any number of them may fill
            ++at;
            continue;
        }
        const bool isTable = marker == 0xc4 || marker == 0xc8 || marker == 0xcc;
        if (marker >= 0xc0 && marker <= 0xcf && !isTable) return byteAt(at + 9) == 1;
        if (marker == 0xd9 || marker == 0xda) return false;
        const bool isAlone = marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
        at += isAlone ? 2 : 2 + (byteAt(at + 2) << 8 | byteAt(at + 3));
    }
    return false;
}

}  // namespace

bool isGreyPicture(ByteSpan encoded) {
    const std::string_view text = asText(encoded);
    if (text.starts_with("\xff\xd8\xff")) return isGreyJpeg(text);
    // The first chunk is the header: its length, its name, width, height, bits, and how colours are kept.
    constexpr std::size_t kColours = 25;
    return text.starts_with("\x89PNG\r\n\x1a\n") && text.size() > kColours &&
           (text[kColours] == 0 || text[kColours] == 4);
}

}  // namespace tessera
