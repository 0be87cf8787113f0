#include "client/window/Monitors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/base/LowerCase.h"

namespace tessera {
std::string describe(const std::vector<Monitor>& monitors) {
    std::string text;
    for (std::size_t i = 0; i < monitors.size(); ++i) {
        const Monitor& m = monitors[i];
        text += fmt::format("{}: \"{}\", {}x{} at {},{}{}\n", i, m.name, m.all.width, m.all.height, m.all.x, m.all.y,
                            m.refreshHz > 0 ? fmt::format(", {} Hz", m.refreshHz) : "");
    }
    return text;
}

Expected<std::size_t> findMonitor(const std::vector<Monitor>& monitors, const std::string& wanted) {
    std::size_t found = monitors.size(), same = 0;
    for (std::size_t i = 0; i < monitors.size(); ++i) {
        if (lowerCase(monitors[i].name) != lowerCase(wanted)) continue;
        if (same++ == 0) found = i;
    }
    if (same == 1) return found;
    if (same > 1)
        return fail(ErrorCode::kNotFound, fmt::format("{} monitors are called \"{}\": say their number\n{}", same,
                                                      wanted, describe(monitors)));
    for (std::size_t i = 0; i < monitors.size(); ++i)
        if (std::to_string(i) == wanted) return i;
    return fail(ErrorCode::kNotFound, fmt::format("no monitor \"{}\"; there are:\n{}", wanted, describe(monitors)));
}

DesktopRect placeOnDesktop(const PlacedPart& placed, const DesktopRect& usable) {
    const double width = std::max(1, placed.wholeWidthPx), height = std::max(1, placed.wholeHeightPx);
    const double scale = std::min({1.0, 0.9 * usable.width / width, 0.9 * usable.height / height});
    const double left = usable.x + 0.5 * (usable.width - scale * width),
                 top = usable.y + 0.5 * (usable.height - scale * height);
    // Edges are rounded, not sizes: neighbours meet.
    const auto edge = [scale](double from, int pixels) { return static_cast<int>(std::lround(from + scale * pixels)); };
    const int x0 = edge(left, placed.part.x), x1 = edge(left, placed.part.x + placed.part.width);
    const int y0 = edge(top, placed.part.y), y1 = edge(top, placed.part.y + placed.part.height);
    return {.x = x0, .y = y0, .width = std::max(1, x1 - x0), .height = std::max(1, y1 - y0)};
}

DesktopRect fitted(int pictureWidthPx, int pictureHeightPx, int windowWidthPx, int windowHeightPx) {
    const std::int64_t pw = std::max(1, pictureWidthPx), ph = std::max(1, pictureHeightPx);
    const std::int64_t ww = std::max(1, windowWidthPx), wh = std::max(1, windowHeightPx);
    const bool wide = pw * wh > ph * ww;  // than the window
    const std::int64_t width = wide ? ww : std::max<std::int64_t>(1, (pw * wh + ph / 2) / ph);
    const std::int64_t height = wide ? std::max<std::int64_t>(1, (ph * ww + pw / 2) / pw) : wh;
    return {.x = static_cast<int>((ww - width) / 2),
            .y = static_cast<int>((wh - height) / 2),
            .width = static_cast<int>(width),
            .height = static_cast<int>(height)};
}

}  // namespace tessera
