#include "server/sim/view/ExposureMeter.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace tessera {

void ExposureMeter::ask(const ExposureWish& wish, bool reset) {
    if (reset) exposure_.wish = {};
    if (wish.stops) exposure_.wish.stops = wish.stops;
    if (wish.metered) exposure_.wish.metered = wish.metered;
    // Metered, with the scene's stops on top of what is found.
    if (wish.metered.value_or(false) && !wish.stops) exposure_.wish.stops.reset();
    if (wish.toneMap) exposure_.wish.toneMap = wish.toneMap;
}

void ExposureMeter::drawn(const std::string& host, const HostStats& stats) {
    anyHost_ = true;
    if (!stats.light) return;
    anyMetered_ = true;
    light_[host] = *stats.light;
}

void ExposureMeter::released() {
    const bool told = std::exchange(anyHost_, false), metered = std::exchange(anyMetered_, false);
    if (!told) return;
    // What was found stays, to begin from: frames between two metered ones would else flash.
    if (!metered) {
        light_.clear();
        known_ = moves_ = false;
        return;
    }
    std::array<std::uint64_t, LightHistogram::kClasses> pixels{};
    for (const auto& [host, light] : light_)
        for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] += light.pixels[i];
    const std::optional<double> wanted = exposureFor(pixels);
    if (!wanted) return;
    const auto target = static_cast<std::int32_t>(std::lround(*wanted * Exposure::kStepsPerStop));
    if (!std::exchange(known_, true)) return take(target);
    const std::int32_t rest = target - exposure_.found;
    if (!moves_ && std::abs(rest) <= kStays) return;
    moves_ = rest != 0;
    const std::int32_t step = rest / kEase;
    take(exposure_.found + (step != 0 ? step : (rest > 0) - (rest < 0)));
}

void ExposureMeter::take(std::int32_t found) {
    if (found != exposure_.found) ++changes_;
    exposure_.found = found;
}

}  // namespace tessera
