#include "common/wall/Navigation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tessera {

std::string_view nameOf(NavigationMode mode) {
    return kNavigationModeNames[static_cast<std::size_t>(mode)];
}

std::optional<NavigationMode> parseNavigationMode(std::string_view name) {
    for (std::size_t i = 0; i < kNavigationModeNames.size(); ++i)
        if (kNavigationModeNames[i] == name) return static_cast<NavigationMode>(i);
    return std::nullopt;
}

double paceAfter(double pace, double clicks) {
    constexpr double kOfClick = 1.25, kSlowest = 1.0 / 4096, kFastest = 4096;
    return std::clamp(pace * std::pow(kOfClick, clicks), kSlowest, kFastest);
}

std::optional<std::string> findNavigationFault(const Navigation& n) {
    struct Bound {
        std::string_view name;
        double value, least, most;
    };
    for (const Bound& b : {Bound{"speed_m_s", n.speed, 0.001, 1000}, Bound{"faster", n.fasterFactor, 1, 100},
                           Bound{"turn_deg_s", n.turnDegrees, 1, 720}, Bound{"body_radius_m", n.bodyRadius, 0.05, 1},
                           Bound{"step_m", n.step, 0, 1}, Bound{"steepest_deg", n.steepestDegrees, 0, 80}})
        if (!(b.value >= b.least && b.value <= b.most))
            return fmt::format("{} is {:.6g}: {:.6g} to {:.6g} are possible", b.name, b.value, b.least, b.most);
    return std::nullopt;
}

}  // namespace tessera
