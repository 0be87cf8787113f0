#include "server/sim/navigation/WandInput.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// Sticks do not come back to the very middle. NaN is no wish.
double wishOf(const WandState& wand, std::size_t axis) {
    constexpr double kMiddle = 0.1;
    const double value = axis < wand.axes.size() ? wand.axes[axis] : 0;
    if (!(std::abs(value) > kMiddle)) return 0;
    return std::copysign((std::min(std::abs(value), 1.0) - kMiddle) / (1 - kMiddle), value);
}

}  // namespace

NavigationInput inputOf(const WandState& wand) {
    NavigationInput input;
    if (!wand.tracked) return input;
    input.turn.x() = wishOf(wand, 0);
    input.move = wishOf(wand, 1) * (wand.orientation * -Vec3d::UnitZ());
    return input;
}

}  // namespace tessera
