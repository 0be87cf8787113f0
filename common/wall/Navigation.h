/// How a person moves through the scene, as a wall's file says it. Lengths and speeds are the wall's: metres in the
/// room, times the view's scale in the world.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tessera {

enum class NavigationMode : std::uint8_t {
    kFly,    ///< anywhere, through anything
    kOrbit,  ///< around a point that is looked at
    kWalk,   ///< on the ground, between the walls
};
inline constexpr std::array<std::string_view, 3> kNavigationModeNames{"fly", "orbit", "walk"};
inline constexpr NavigationMode kLastNavigationMode = NavigationMode::kWalk;
static_assert(kNavigationModeNames.size() == static_cast<std::size_t>(kLastNavigationMode) + 1);
[[nodiscard]] std::string_view nameOf(NavigationMode mode);
[[nodiscard]] std::optional<NavigationMode> parseNavigationMode(std::string_view name);

struct Navigation {
    NavigationMode mode = NavigationMode::kFly;  ///< to begin with
    double speed = 2;                            ///< m/s, with a key held or a stick pushed all the way
    double fasterFactor = 4;                     ///< with Shift
    double turnDegrees = 60;                     ///< per second, with a stick pushed all the way
    double bodyRadius = 0.25;                    ///< of who walks, m
    double step = 0.4;                           ///< as much higher the ground may be a step on, m
    double steepestDegrees = 50;                 ///< of a slope that one can walk up

    bool operator==(const Navigation&) const = default;
};

/// Walking is no faster, whatever the speed and the pace: m/s.
inline constexpr double kFastestWalk = 100;

/// The pace, as a factor of `Navigation::speed`, after so many clicks of the wheel (fractions too), within its bounds.
[[nodiscard]] double paceAfter(double pace, double clicks);

/// What is out of its bounds, in words; none: all is well.
[[nodiscard]] std::optional<std::string> findNavigationFault(const Navigation& navigation);

}  // namespace tessera
