/// How a wall brings radiance onto its screens, beside what its scene's Environment says of that.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// The curves of Environment::toneMap, by the same numbers; on the wire too.
enum class ToneMap : std::uint8_t { kNeutral, kClamp, kReinhard, kAces, kAgx };
inline constexpr std::array<std::string_view, 5> kToneMapNames{"neutral", "clamp", "reinhard", "aces", "agx"};
inline constexpr ToneMap kLastToneMap = ToneMap::kAgx;

/// What people want of a wall, in place of what its scene says; what is absent the scene says.
struct ExposureWish {
    std::optional<double> stops;  ///< see Environment::exposure
    std::optional<bool> metered;
    std::optional<ToneMap> toneMap;
    bool operator==(const ExposureWish&) const = default;
};
inline constexpr double kMostStops = 40;  ///< either way, of what people and scenes say

/// As options of a command line say it: "metered" (and the scene's stops on top), "off", or a number of stops that is
/// not metered.
[[nodiscard]] Expected<ExposureWish> parseExposure(std::string_view text);
/// What is wrong with such a text; empty: nothing.
[[nodiscard]] std::string exposureFault(const std::string& text);
[[nodiscard]] Expected<ToneMap> parseToneMap(std::string_view name);

/// The same for all tiles and eyes of a frame, as it is a part of its View.
struct Exposure {
    ExposureWish wish;
    /// What the wall has found by looking (LightHistogram.h), in steps; it counts where the exposure is metered. A
    /// whole number: so it comes to rest, and is the same on all hosts.
    std::int32_t found = 0;
    static constexpr int kStepsPerStop = 64;
    bool operator==(const Exposure&) const = default;

    [[nodiscard]] double foundStops() const { return static_cast<double>(found) / kStepsPerStop; }
};

}  // namespace tessera
