#include "server/tools/mpcdi/PfmFile.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

namespace tessera {
namespace {

/// The next word of a header, and the one space behind it.
std::string_view takeWord(std::string_view& rest) {
    while (!rest.empty() && std::isspace(static_cast<unsigned char>(rest.front()))) rest.remove_prefix(1);
    std::size_t end = 0;
    while (end < rest.size() && end < 40 && !std::isspace(static_cast<unsigned char>(rest[end]))) ++end;
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(end);
    return word;
}

template <typename Number>
Number numberOr(std::string_view word, Number other) {
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() ? value : other;
}

}  // namespace

Expected<FloatPicture> readPfm(ByteSpan bytes, const std::string& name) {
    const auto bad = [&](std::string what) { return fail(ErrorCode::kBadInput, fmt::format("{}: {}", name, what)); };
    std::string_view rest = asText(bytes);
    if (takeWord(rest) != "PF") return bad("not a PFM of three channels (its first word is not PF)");
    FloatPicture picture;
    picture.widthPx = numberOr(takeWord(rest), 0);
    picture.heightPx = numberOr(takeWord(rest), 0);
    const double scale = numberOr(takeWord(rest), 0.0);
    constexpr int kMostPx = 8192;
    if (picture.widthPx < 2 || picture.heightPx < 2 || picture.widthPx > kMostPx || picture.heightPx > kMostPx)
        return bad(
            fmt::format("a PFM of {} x {} pixels: 2 to {} are read", picture.widthPx, picture.heightPx, kMostPx));
    if (scale == 0 || !std::isfinite(scale) || rest.empty()) return bad("a PFM without a scale");
    rest.remove_prefix(1);
    const std::size_t count = static_cast<std::size_t>(picture.widthPx) * static_cast<std::size_t>(picture.heightPx);
    if (rest.size() != 12 * count) return bad(fmt::format("{} bytes of pixels instead of {}", rest.size(), 12 * count));
    picture.pixels.resize(count);
    const bool swapped = scale > 0;
    for (std::size_t i = 0; i < 3 * count; ++i) {
        std::uint32_t word = 0;
        std::memcpy(&word, rest.data() + 4 * i, 4);
        if (swapped) word = __builtin_bswap32(word);
        picture.pixels[i / 3][i % 3] = std::bit_cast<float>(word);
    }
    return picture;
}

}  // namespace tessera
