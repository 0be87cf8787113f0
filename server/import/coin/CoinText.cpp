#include "server/import/coin/CoinText.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "server/import/reader/TextEncoding.h"

namespace tessera {
namespace {

std::string_view firstLineOf(std::string_view text) {
    return text.substr(0, std::min(text.find_first_of("\r\n"), std::size_t{200}));
}

/// Refused beyond `maxBytes`, or where it is packed more than a hundredfold.
Expected<std::string> unpackGzip(ByteSpan packed, std::size_t maxBytes) {
    // Text of coordinates shrinks to a tenth; only what repeats itself on purpose shrinks to a hundredth.
    constexpr std::size_t kMostFactor = 100, kAlways = std::size_t{16} << 20;
    const std::size_t most = std::min(maxBytes, std::max(kAlways, packed.size() * kMostFactor));
    z_stream stream{};
    if (inflateInit2(&stream, 16 + MAX_WBITS) != Z_OK) return fail(ErrorCode::kFailed, "zlib does not start");
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    std::string text;
    int state = Z_OK;
    while (state == Z_OK && text.size() <= most) {
        constexpr std::size_t kPiece = std::size_t{1} << 16;
        const std::size_t before = text.size();
        text.resize(before + kPiece);
        stream.next_out = reinterpret_cast<Bytef*>(text.data() + before);
        stream.avail_out = kPiece;
        state = inflate(&stream, Z_NO_FLUSH);
        text.resize(before + kPiece - stream.avail_out);
        // A file may be several, one behind the other.
        if (state == Z_STREAM_END && stream.avail_in > 0 && *stream.next_in == 0x1f) state = inflateReset(&stream);
    }
    inflateEnd(&stream);
    if (text.size() > most)
        return fail(ErrorCode::kLimit,
                    fmt::format("unpacked it has more than {} MiB: unpack it by gunzip", most >> 20));
    if (state != Z_STREAM_END)
        return fail(ErrorCode::kBadInput, fmt::format("its gzip is damaged or cut short, after {} bytes", text.size()));
    return text;
}

/// What X3D became, whose prototypes are to be looked at too.
Expected<CoinText> checked(Expected<CoinText> made, const MissingProto& missing) {
    if (!made) return made;
    if (const Expected<void> sound = scanVrml(made->text, Dialect::kVrml2, missing, made->notes); !sound)
        return fail(sound.error().code, "as VRML, " + sound.error().message);
    return made;
}

}  // namespace

Expected<CoinText> coinTextOf(ByteSpan packed, std::size_t maxBytes, const MissingProto& missing) {
    CoinText result;
    if (packed.size() >= 2 && packed[0] == std::byte{0x1f} && packed[1] == std::byte{0x8b}) {
        Expected<std::string> unpacked = unpackGzip(packed, maxBytes);
        if (!unpacked) return tl::unexpected(unpacked.error());
        result.text = std::move(*unpacked);
    } else {
        result.text = asText(packed);
    }
    if (Expected<void> letters = checkLetters(result.text); !letters) return tl::unexpected(letters.error());
    if (result.text.starts_with("\xef\xbb\xbf")) result.text.erase(0, 3);
    if (result.text.starts_with(std::string_view("\xe0\0", 2)))
        return fail(ErrorCode::kUnsupported, "it is X3D in binary, which is not read: write it as XML (.x3d)");
    const std::string_view first = firstLineOf(result.text);
    const std::size_t begin = result.text.find_first_not_of(" \t\r\n");
    if (begin != std::string::npos && result.text[begin] == '<')
        return checked(vrmlOfX3dXml(std::move(result.text)), missing);
    if (first.starts_with("#Inventor ") && first.find("binary") != first.npos) return result;
    const bool classic = first.starts_with("#X3D ");
    if (!classic && !first.starts_with("#VRML ") && !first.starts_with("#Inventor "))
        return fail(ErrorCode::kBadInput,
                    "its first line is none of VRML, X3D or Inventor ('#VRML V2.0 utf8', '#Inventor V2.1 ascii')");
    const Dialect dialect = classic                         ? Dialect::kX3d
                            : first.starts_with("#VRML V2") ? Dialect::kVrml2
                                                            : Dialect::kInventor;
    if (const Expected<void> sound = scanVrml(result.text, dialect, missing, result.notes); !sound)
        return tl::unexpected(sound.error());
    return classic ? checked(vrmlOfX3dClassic(result.text), missing) : std::move(result);
}

}  // namespace tessera
