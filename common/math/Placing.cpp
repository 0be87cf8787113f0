#include "common/math/Placing.h"

#include <fmt/format.h>

namespace tessera {

Expected<void> checkPlacing(const Placing& placing) {
    // (What is no number passes by the largest of three.)
    if (placing.at && !(placing.at->allFinite() && placing.at->cwiseAbs().maxCoeff() <= kMaxPlacingCoordinate))
        return fail(
            ErrorCode::kBadInput,
            fmt::format("it would stand farther than {:g} units from the origin, or nowhere", kMaxPlacingCoordinate));
    if (placing.scale && placing.fit)
        return fail(ErrorCode::kBadInput, "a scale and a size that it shall have contradict each other");
    const auto good = [](double factor) { return factor >= 1 / kMaxPlacingScale && factor <= kMaxPlacingScale; };
    if (placing.scale && !good(*placing.scale))
        return fail(ErrorCode::kBadInput, fmt::format("a scale of {:g}: it has to be between {:g} and {:g}",
                                                      *placing.scale, 1 / kMaxPlacingScale, kMaxPlacingScale));
    if (placing.fit && !good(*placing.fit))
        return fail(ErrorCode::kBadInput, fmt::format("a size of {:g}: it has to be between {:g} and {:g}",
                                                      *placing.fit, 1 / kMaxPlacingScale, kMaxPlacingScale));
    if (placing.pointRadius && !(*placing.pointRadius > 0 && *placing.pointRadius <= kMaxPlacedRadius))
        return fail(ErrorCode::kBadInput,
                    fmt::format("a radius of points of {:g}: it has to be above 0 and at most {:g}",
                                *placing.pointRadius, kMaxPlacedRadius));
    if (placing.variants.size() > kMostVariants)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} variants, at most {} are allowed", placing.variants.size(), kMostVariants));
    for (const std::string& variant : placing.variants) {
        const std::size_t set = variant.find(':');
        if (!variant.starts_with('/') || set == std::string::npos || variant.find('=', set) == std::string::npos ||
            variant.size() > kMostVariantBytes)
            return fail(ErrorCode::kBadInput, fmt::format("the variant '{}' is not PRIM:SET=NAME, as /Chair:color=red",
                                                          variant.substr(0, kMostVariantBytes)));
    }
    return {};
}

std::string optionsText(const Placing& placing) {
    std::string text;
    const auto say = [&](const std::string& option) { text += (text.empty() ? "" : " ") + option; };
    if (placing.at) say(fmt::format("--at {} {} {}", placing.at->x(), placing.at->y(), placing.at->z()));
    if (placing.scale) say(fmt::format("--scale {}", *placing.scale));
    if (placing.fit) say(fmt::format("--fit {}", *placing.fit));
    if (placing.up != UpAxis::kOfFile) say(placing.up == UpAxis::kZ ? "--up z" : "--up y");
    if (placing.pointRadius) say(fmt::format("--point-radius {}", *placing.pointRadius));
    for (const std::string& variant : placing.variants) say("--variant " + variant);
    return text;
}

}  // namespace tessera
