#include "client/image/Picture.h"

#include <algorithm>
#include <cstring>

namespace tessera {

Picture Picture::filled(int widthPx, int heightPx, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    TESSERA_CHECK(widthPx >= 0 && heightPx >= 0, "a picture's size is not negative");
    Picture picture{.widthPx = widthPx, .heightPx = heightPx, .rgb = {}};
    picture.rgb.resize(static_cast<std::size_t>(widthPx) * static_cast<std::size_t>(heightPx) * 3);
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
        picture.rgb[i] = r;
        picture.rgb[i + 1] = g;
        picture.rgb[i + 2] = b;
    }
    return picture;
}

void paste(Picture& whole, const Picture& part, int xPx, int yPx) {
    const int left = std::max(0, -xPx);
    const int right = std::min(part.widthPx, whole.widthPx - xPx);
    if (left >= right) return;
    const auto offset = [](const Picture& picture, int x, int y) {
        return 3 *
               (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.widthPx) + static_cast<std::size_t>(x));
    };
    for (int y = std::max(0, -yPx); y < std::min(part.heightPx, whole.heightPx - yPx); ++y)
        std::memcpy(whole.rgb.data() + offset(whole, xPx + left, yPx + y), part.rgb.data() + offset(part, left, y),
                    3 * static_cast<std::size_t>(right - left));
}

}  // namespace tessera
