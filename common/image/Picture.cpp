#include "common/image/Picture.h"

#include <algorithm>
#include <cstring>
#include <utility>

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

void dropAlpha(const std::uint8_t* rgba, std::size_t count, std::uint8_t* rgb) {
    std::size_t i = 0;
    // Two pixels at a time; the two bytes too many are overwritten by the next ones, so that the last two pixels are
    // left.
    for (; i + 4 <= count; i += 2, rgba += 8, rgb += 6) {
        std::uint64_t two = 0;
        std::memcpy(&two, rgba, 8);
        two = (two & 0xffffffu) | ((two >> 8) & 0xffffff000000u);
        std::memcpy(rgb, &two, 8);
    }
    for (; i < count; ++i, rgba += 4, rgb += 3) std::memcpy(rgb, rgba, 3);
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

PictureSheet::PictureSheet(int widthPx, int heightPx, std::uint8_t filled)
    : shrunkBy_(std::max(1, (std::max(widthPx, heightPx) + kMaxSidePx - 1) / kMaxSidePx)) {
    const auto shrunk = [&](int px) { return (px + shrunkBy_ - 1) / shrunkBy_; };
    picture_ = Picture::filled(shrunk(widthPx), shrunk(heightPx), filled, filled, filled);
    if (shrunkBy_ > 1) sums_.resize(picture_.rgb.size() / 3);
}

void PictureSheet::paste(const Picture& part, int xPx, int yPx) {
    TESSERA_CHECK(xPx >= 0 && yPx >= 0 && (xPx + part.widthPx - 1) / shrunkBy_ < picture_.widthPx &&
                      (yPx + part.heightPx - 1) / shrunkBy_ < picture_.heightPx,
                  "parts lie on their sheet");
    if (shrunkBy_ == 1) {
        tessera::paste(picture_, part, xPx, yPx);
        return;
    }
    const std::uint8_t* in = part.rgb.data();
    for (int y = 0; y < part.heightPx; ++y) {
        Sum* const row =
            sums_.data() + static_cast<std::size_t>((yPx + y) / shrunkBy_) * static_cast<std::size_t>(picture_.widthPx);
        for (int x = 0; x < part.widthPx; ++x, in += 3) {
            Sum& sum = row[(xPx + x) / shrunkBy_];
            for (int c = 0; c < 3; ++c) sum.rgb[c] += in[c];
            ++sum.count;
        }
    }
}

Picture PictureSheet::take() && {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        const Sum& sum = sums_[i];
        // What was covered in part has the colour of that part; at the sheet's edge there is nothing more.
        if (sum.count == 0) continue;
        for (std::size_t c = 0; c < 3; ++c)
            picture_.rgb[3 * i + c] = static_cast<std::uint8_t>((sum.rgb[c] + sum.count / 2) / sum.count);
    }
    return std::move(picture_);
}

}  // namespace tessera
