#include "server/tools/walls/WallReading.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace tessera {

std::optional<double> numberOfWord(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
    return value;
}

void WallReading::note(std::string sentence) {
    if (notes_.size() > kMostNotes || std::ranges::find(notes_, sentence) != notes_.end()) return;
    if (notes_.size() == kMostNotes) sentence = "there is more that is not carried over";
    notes_.push_back(std::move(sentence));
}

void WallReading::refuse(std::string_view place, std::string_view what) {
    if (fault_) return;
    fault_ = Error{ErrorCode::kBadInput,
                   place.empty() ? fmt::format("{}: {}", path_, what) : fmt::format("{}: {}: {}", path_, place, what)};
}

double WallReading::number(std::string_view place, std::string_view word, double least, double most) {
    const std::optional<double> value = numberOfWord(word);
    if (value && *value >= least && *value <= most) return *value;
    refuse(place, fmt::format("a number from {:g} to {:g} is needed, not \"{}\"", least, most, word.substr(0, 40)));
    return 0;
}

}  // namespace tessera
