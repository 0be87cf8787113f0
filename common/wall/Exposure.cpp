#include "common/wall/Exposure.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace tessera {

Expected<ExposureWish> parseExposure(std::string_view text) {
    if (text == "metered") return ExposureWish{.stops = {}, .metered = true, .toneMap = {}};
    if (text == "off") return ExposureWish{.stops = 0.0, .metered = false, .toneMap = {}};
    double stops = 0;
    const char *first = text.data(), *const last = text.data() + text.size();
    // As it is printed; from_chars takes no plus.
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++first;
    const auto [end, error] = std::from_chars(first, last, stops);
    if (error != std::errc() || end != last || !(std::abs(stops) <= kMostStops))
        return fail(ErrorCode::kUsage, fmt::format("\"{}\" is no exposure: write metered, off, or -{} to {} stops",
                                                   text, kMostStops, kMostStops));
    return ExposureWish{.stops = stops, .metered = false, .toneMap = {}};
}

std::string exposureFault(const std::string& text) {
    const Expected<ExposureWish> wish = parseExposure(text);
    return wish ? std::string() : wish.error().message;
}

Expected<ToneMap> parseToneMap(std::string_view name) {
    const auto found = std::ranges::find(kToneMapNames, name);
    if (found == kToneMapNames.end())
        return fail(ErrorCode::kUsage,
                    fmt::format("\"{}\" is no tone map: there are {}", name, fmt::join(kToneMapNames, ", ")));
    return static_cast<ToneMap>(found - kToneMapNames.begin());
}

}  // namespace tessera
