#include "common/request/Check.h"

#include <fmt/format.h>

namespace tessera {

std::string textOf(const NumberBounds& bounds) {
    const bool low = bounds.least != -NumberBounds::kNone, high = bounds.greatest != NumberBounds::kNone;
    std::string text;
    if (low && high)
        text = fmt::format("from {:g} to {:g}", bounds.least, bounds.greatest);
    else if (low)
        text = fmt::format("at least {:g}", bounds.least);
    else if (high)
        text = fmt::format("at most {:g}", bounds.greatest);
    if (bounds.notZero) text += text.empty() ? "other than 0" : ", but not 0";
    if (bounds.orElse) text += fmt::format(", or {:g}", *bounds.orElse);
    return text;
}

void FaultFinder::beyond(std::string_view name, const NumberBounds& bounds, double value) {
    if (std::isfinite(value))
        say(ErrorCode::kBadInput, fmt::format("{} must be {}, not {}", name, textOf(bounds), value));
    else
        say(ErrorCode::kBadInput, fmt::format("{} is a number that is not finite", name));
}

void FaultFinder::noRotation(std::string_view name) {
    say(ErrorCode::kBadInput, fmt::format("{} is a quaternion that cannot be normalised", name));
}

void FaultFinder::noWord(std::string_view name, std::uint64_t value) {
    say(ErrorCode::kUnsupported, fmt::format("{} says {}, which this version does not know", name, value));
}

void FaultFinder::tooLong(std::string_view name, std::size_t bytes, std::size_t most) {
    say(ErrorCode::kLimit, fmt::format("{} has {} bytes; at most {} are allowed", name, bytes, most));
}

void FaultFinder::tooMany(std::string_view name, std::size_t count, std::size_t most) {
    say(ErrorCode::kLimit, fmt::format("{} has {} entries; at most {} are allowed", name, count, most));
}

Error roleRefusal(const RequestInfo& info, Role role) {
    return {ErrorCode::kRefused, fmt::format("{} is for an {}; this link is of {} {}", info.name, nameOf(info.role),
                                             role == Role::kViewer ? "a" : "an", nameOf(role))};
}

}  // namespace tessera
