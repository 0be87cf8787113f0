#include "client/window/KeysOverlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/testpicture/ScreenCanvas.h"
#include "client/testpicture/StrokeFont.h"

namespace tessera {
namespace {

struct Row {
    std::string_view keys, what;
};
/// In letters that the font has.
constexpr std::array kRows = {
    Row{"W A S D, arrows", "go, step aside"},
    Row{"E, Q", "up, down"},
    Row{"Shift", "faster"},
    Row{"Left drag", "look. Orbit: turn around what is there"},
    Row{"Right drag", "shift"},
    Row{"Wheel", "the pace. Orbit: nearer, farther"},
    Row{"Tab, or F2 F3 F4", "fly, orbit, walk"},
    Row{"F, Shift+F", "fit what is below the cursor, fit all"},
    Row{"Home", "back to the first view"},
    Row{"1 - 9", "to a bookmark. With Ctrl: keep one"},
    Row{"Z, C, L", "roll, roll, upright"},
    Row{"F1", "these keys, or none"},
    Row{"Escape", "closes the window"},
};

constexpr ScreenColor kBack{14, 18, 26}, kWords{232, 236, 240}, kKeys{250, 208, 92};
constexpr double kLine = 1.9, kMargin = 1.6, kGap = 1.5;  // in heights of a capital
constexpr double kSmallestPx = 5, kLargestPx = 14;

std::string titleOf(const AskedManner& manner) {
    return fmt::format("Mode: {}   Pace: {:.3g} x", nameOf(manner.mode()), manner.pace());
}

double keysWidth() {
    double width = 0;
    for (const Row& row : kRows) width = std::max(width, widthOfText(row.keys));
    return width;
}

}  // namespace

std::uint16_t AskedManner::newly(const InputState& state, InputAction action) const {
    const auto at = static_cast<std::size_t>(action);
    return static_cast<std::uint16_t>(state.asked[at] - last_.asked[at]);
}

bool AskedManner::take(const InputState& state) {
    const NavigationMode mode = mode_;
    const double pace = pace_;
    if (newly(state, InputAction::kFly) > 0) mode_ = NavigationMode::kFly;
    if (newly(state, InputAction::kOrbit) > 0) mode_ = NavigationMode::kOrbit;
    if (newly(state, InputAction::kWalk) > 0) mode_ = NavigationMode::kWalk;
    const auto next = newly(state, InputAction::kNextMode);
    mode_ = static_cast<NavigationMode>((static_cast<unsigned>(mode_) + next) % 3);
    // Around what is there the wheel leads nearer.
    if (mode == NavigationMode::kFly || mode == NavigationMode::kWalk)
        pace_ = paceAfter(pace_, static_cast<double>(static_cast<std::int64_t>(state.wheel - last_.wheel)) /
                                     static_cast<double>(InputState::kUnit));
    last_ = state;
    return mode_ != mode || pace_ != pace;
}

Picture keysOverlay(const AskedManner& manner, int windowWidthPx, int windowHeightPx) {
    const std::string title = titleOf(manner);
    const double keys = keysWidth();
    double width = widthOfText(title);
    for (const Row& row : kRows) width = std::max(width, keys + kGap + widthOfText(row.what));
    width += 2 * kMargin;
    const double height = 2 * kMargin + kLine * static_cast<double>(kRows.size() + 1) + 0.2 * kLine;
    const double size =
        std::clamp(std::floor(std::min(windowWidthPx / width, windowHeightPx / height)), kSmallestPx, kLargestPx);
    ScreenCanvas canvas(0, 0, std::clamp(static_cast<int>(std::ceil(size * width)), 1, std::max(1, windowWidthPx)),
                        std::clamp(static_cast<int>(std::ceil(size * height)), 1, std::max(1, windowHeightPx)));
    canvas.fill(0, 0, canvas.right(), canvas.bottom(), kBack);
    double y = kMargin * size;
    canvas.text(kMargin * size, y, size, title, kKeys);
    y += 1.2 * kLine * size;
    for (const Row& row : kRows) {
        canvas.text(kMargin * size, y, size, row.keys, kKeys);
        canvas.text((kMargin + keys + kGap) * size, y, size, row.what, kWords);
        y += kLine * size;
    }
    return std::move(canvas).take();
}

}  // namespace tessera
