#include "common/wall/WallNotes.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {

std::vector<std::string> wallNotes(const Wall& wall) {
    constexpr double kOddShare = 1.02;  // who measures a screen by hand is not exact
    std::vector<std::string> notes;
    for (const Screen& screen : wall.screens) {
        const ScreenPixels pixels = screenPixels(screen);
        const double width = screen.widthMetres() / pixels.width, height = screen.heightMetres() / pixels.height;
        if (std::max(width, height) <= kOddShare * std::min(width, height)) continue;
        notes.push_back(
            fmt::format("screen \"{}\": its pixels are not square but {:.3g} x {:.3g} mm: {:.4g} x {:.4g} m hold "
                        "{} x {} pixels",
                        screen.name, 1000 * width, 1000 * height, screen.widthMetres(), screen.heightMetres(),
                        pixels.width, pixels.height));
    }
    return notes;
}

}  // namespace tessera
