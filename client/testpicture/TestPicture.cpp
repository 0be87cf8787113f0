#include "client/testpicture/TestPicture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "client/testpicture/ScreenCanvas.h"
#include "client/testpicture/StrokeFont.h"

namespace tessera {

namespace {

constexpr ScreenColor kBlack{0, 0, 0}, kWhite{255, 255, 255}, kGround{40, 40, 40}, kGrid{92, 92, 92},
    kCounted{168, 168, 168}, kDiagonal{230, 200, 0}, kArrow{90, 230, 90}, kShared{230, 80, 230}, kHidden{255, 150, 30};
constexpr int kGridStepPx = 64, kCountedStepPx = 256;

/// Stereo: red for the left eye and cyan for the right one, as in anaglyph glasses.
ScreenColor colorOf(Eye eye) {
    switch (eye) {
        case Eye::kLeft:
            return {255, 90, 90};
        case Eye::kRight:
            return {80, 220, 255};
        case Eye::kCenter:
            break;
    }
    return kWhite;
}
std::string_view wordsOf(Eye eye) {
    return eye == Eye::kLeft ? "LEFT EYE" : eye == Eye::kRight ? "RIGHT EYE" : "BOTH EYES";
}
/// What lies behind everything: with a breath of the eye's colour.
ScreenColor groundOf(Eye eye) {
    return eye == Eye::kLeft ? ScreenColor{58, 34, 34} : eye == Eye::kRight ? ScreenColor{30, 48, 56} : kGround;
}

/// A screen's whole picture, of which the canvas keeps a part.
class ScreenPainter {
public:
    ScreenPainter(const Screen& screen, ScreenCanvas& canvas)
        : screen_(screen),
          canvas_(canvas),
          width_(screenPixels(screen).width),
          height_(screenPixels(screen).height),
          shorter_(std::min(width_, height_)),
          letter_(std::clamp(shorter_ / 40, 5, 60)) {}

    void draw(const ScreenColor& ground) {
        canvas_.fill(0, 0, width_, height_, ground);
        drawGrid();
        drawCircles();
        drawBorder();
        drawNumbers();
        drawTitle();
        drawArrows();
        drawRamps();
        drawPatches();
    }

private:
    /// Rows are counted from below, as in wall files.
    [[nodiscard]] int rowOf(int fromBelow) const { return height_ - 1 - fromBelow; }

    void drawGrid() {
        for (int x = 0; x < width_; x += kGridStepPx)
            canvas_.fill(x, 0, x + 1, height_, x % kCountedStepPx == 0 ? kCounted : kGrid);
        for (int y = 0; y < height_; y += kGridStepPx)
            canvas_.fill(0, rowOf(y), width_, rowOf(y) + 1, y % kCountedStepPx == 0 ? kCounted : kGrid);
    }

    void drawCircles() {
        const double thin = std::max(1.0, shorter_ / 540.0), centerX = 0.5 * width_, centerY = 0.5 * height_;
        canvas_.line(0, 0, width_, height_, thin, kDiagonal);
        canvas_.line(0, height_, width_, 0, thin, kDiagonal);
        // Large ones side by side along the longer way, from the middle outwards.
        const double radius = 0.48 * shorter_;
        const int aside = std::max(0, static_cast<int>((0.5 * std::max(width_, height_) - radius) / (2 * radius)));
        for (int i = -aside; i <= aside; ++i) {
            const double shift = 2 * radius * i;
            canvas_.ring(centerX + (width_ >= height_ ? shift : 0), centerY + (width_ >= height_ ? 0 : shift), radius,
                         2 * thin, kWhite);
        }
        const double small = 0.11 * shorter_, inset = 0.14 * shorter_;
        for (const double x : {inset, width_ - inset})
            for (const double y : {inset, height_ - inset}) canvas_.ring(x, y, small, 2 * thin, kWhite);
    }

    /// White, black, white: whoever sees no outer white line does not see all of the screen.
    void drawBorder() {
        for (int i = 0; i < 3; ++i) {
            const ScreenColor& color = i == 1 ? kBlack : kWhite;
            canvas_.fill(i, i, width_ - i, i + 1, color);
            canvas_.fill(i, height_ - 1 - i, width_ - i, height_ - i, color);
            canvas_.fill(i, i, i + 1, height_ - i, color);
            canvas_.fill(width_ - 1 - i, i, width_ - i, height_ - i, color);
        }
    }

    void drawNumbers() {
        const double size = std::max(5.0, 0.45 * letter_);
        for (int y = 0; y < height_; y += kCountedStepPx)
            for (int x = 0; x < width_; x += kCountedStepPx)
                canvas_.text(x + 4, rowOf(y) - size - 4, size, fmt::format("{},{}", x, y), kCounted);
    }

    /// Text on a black ground, which makes it readable whatever lies behind.
    void label(double x, double y, double size, std::string_view text, const ScreenColor& color) {
        const double edge = 0.4 * size, right = x + size * widthOfText(text);
        canvas_.fill(static_cast<int>(x - edge), static_cast<int>(y - edge), static_cast<int>(right + edge) + 1,
                     static_cast<int>(y + size + edge) + 1, kBlack);
        canvas_.text(x, y, size, text, color);
    }

    void drawTitle() {
        const std::string text = fmt::format("screen {}  {} x {} pixels  {:.3f} x {:.3f} m", screen_.name, width_,
                                             height_, screen_.widthMetres(), screen_.heightMetres());
        const double size = std::min<double>(letter_, 0.55 * width_ / widthOfText(text));
        if (size >= 4) label(0.5 * (width_ - size * widthOfText(text)), 0.05 * height_, size, text, kWhite);
    }

    void drawArrows() {
        const double x = 0.5 * width_, y = 0.42 * height_, long_ = 0.14 * shorter_, head = 0.035 * shorter_,
                     thick = std::max(1.0, shorter_ / 270.0);
        canvas_.line(x, y, x, y - long_, thick, kArrow);
        canvas_.line(x, y - long_, x - head, y - long_ + head, thick, kArrow);
        canvas_.line(x, y - long_, x + head, y - long_ + head, thick, kArrow);
        canvas_.line(x, y, x + long_, y, thick, kArrow);
        canvas_.line(x + long_, y, x + long_ - head, y - head, thick, kArrow);
        canvas_.line(x + long_, y, x + long_ - head, y + head, thick, kArrow);
        canvas_.text(x + head + 4, y - long_, letter_, "UP", kArrow);
        canvas_.text(x + long_ + 0.5 * letter_, y - 0.5 * letter_, letter_, "RIGHT", kArrow);
    }

    /// Four ramps from 0 to 255, a whole number of pixels a step where there is room for that.
    void drawRamps() {
        const int room = static_cast<int>(0.62 * width_), wide = room >= 256 ? room / 256 * 256 : room;
        const int bar = std::max(3, height_ / 36), left = (width_ - wide) / 2, top = static_cast<int>(0.72 * height_);
        if (wide < 16) return;
        constexpr std::array<std::array<int, 3>, 4> kTaking = {{{1, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        canvas_.fill(left - 2, top - 2, left + wide + 2, top + 4 * bar + 2, kBlack);
        // Only the columns that are kept: a wide ramp is many pixels.
        for (int x = std::max(0, canvas_.left() - left); x < std::min(wide, canvas_.right() - left); ++x) {
            const int value = static_cast<int>(std::int64_t{256} * x / wide);
            for (int i = 0; i < 4; ++i) {
                const auto& take = kTaking[static_cast<std::size_t>(i)];
                ScreenColor color;
                for (std::size_t c = 0; c < 3; ++c) color[c] = static_cast<std::uint8_t>(take[c] * value);
                canvas_.fill(left + x, top + i * bar, left + x + 1, top + (i + 1) * bar, color);
            }
        }
        const double size = std::min(0.6 * letter_, wide / 40.0);
        if (size < 4) return;
        for (int value = 0; value <= 256; value += 32) {
            const std::string number = std::to_string(std::min(value, 255));
            const int x = left + static_cast<int>(std::int64_t{wide} * value / 256);
            canvas_.fill(x, top + 4 * bar, x + 1, top + 4 * bar + std::max(2, bar / 3), kWhite);
            canvas_.text(x - 0.5 * size * widthOfText(number), top + 4 * bar + std::max(2, bar / 3) + 0.4 * size, size,
                         number, kWhite);
        }
    }

    /// Squares that differ from their ground by little: where the last ones melt into it, a display clips.
    void drawPatches() {
        constexpr std::array<int, 6> kSteps = {1, 2, 4, 8, 16, 32};
        const int side = std::max(4, shorter_ / 24), gap = std::max(2, side / 3);
        const int wide = static_cast<int>(kSteps.size()) * (side + gap) + gap;
        const int top = static_cast<int>(0.875 * height_), middle = width_ / 2;
        if (2 * wide + 4 * gap > width_) return;
        const double size = std::max(4.0, 0.35 * side);
        for (const bool dark : {true, false}) {
            const int left = dark ? middle - gap - wide : middle + gap;
            const ScreenColor ground = dark ? kBlack : kWhite;
            canvas_.fill(left, top, left + wide, top + side + 2 * gap + static_cast<int>(1.6 * size), ground);
            for (std::size_t i = 0; i < kSteps.size(); ++i) {
                const auto value = static_cast<std::uint8_t>(dark ? kSteps[i] : 255 - kSteps[i]);
                const int x = left + gap + static_cast<int>(i) * (side + gap);
                canvas_.fill(x, top + gap, x + side, top + gap + side, {value, value, value});
                canvas_.text(x, top + 1.5 * gap + side, size, std::to_string(value),
                             dark ? ScreenColor{150, 150, 150} : ScreenColor{105, 105, 105});
            }
        }
    }

    const Screen& screen_;
    ScreenCanvas& canvas_;
    int width_, height_, shorter_, letter_;
};

/// What belongs to one tile: who draws it, for which eye, and what lies beside it.
class TileMarks {
public:
    TileMarks(const Screen& screen, const Tile& tile, ScreenCanvas& canvas)
        : grid_(screen.grid),
          tile_(tile),
          canvas_(canvas),
          letter_(std::clamp(std::min(tile.rect.width, tile.rect.height) / 38, 5, 48)) {}

    void draw(const std::optional<std::uint64_t>& frame) {
        drawShared();
        drawHidden();
        const ScreenColor color = colorOf(tile_.eye);
        const int l = canvas_.left(), t = canvas_.top(), r = canvas_.right(), b = canvas_.bottom();
        canvas_.fill(l, t, r, t + 1, color);
        canvas_.fill(l, b - 1, r, b, color);
        canvas_.fill(l, t, l + 1, b, color);
        canvas_.fill(r - 1, t, r, b, color);
        drawName(color);
        if (frame) drawFrame(*frame, color);
    }

private:
    [[nodiscard]] bool hasLeft() const { return tile_.column > 0; }
    [[nodiscard]] bool hasRight() const { return tile_.column + 1 < grid_.columns; }
    [[nodiscard]] bool hasBelow() const { return tile_.row > 0; }
    [[nodiscard]] bool hasAbove() const { return tile_.row + 1 < grid_.rows; }

    /// Pixels that a neighbour shows too: hatched in the screen's coordinates, so that the two hatchings must lie on
    /// each other.
    void drawShared() {
        const int l = canvas_.left(), t = canvas_.top(), r = canvas_.right(), b = canvas_.bottom();
        const auto hatch = [&](int x0, int y0, int x1, int y1) {
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x)
                    if ((x + y) % 16 == 0 || x == x0 || x == x1 - 1 || y == y0 || y == y1 - 1)
                        canvas_.set(x, y, kShared);
        };
        if (grid_.overlapXPx > 0 && hasLeft()) hatch(l, t, l + grid_.overlapXPx, b);
        if (grid_.overlapXPx > 0 && hasRight()) hatch(r - grid_.overlapXPx, t, r, b);
        if (grid_.overlapYPx > 0 && hasBelow()) hatch(l, b - grid_.overlapYPx, r, b);
        if (grid_.overlapYPx > 0 && hasAbove()) hatch(l, t, r, t + grid_.overlapYPx);
    }

    /// Edges behind which the picture goes on unseen: a thick line, and how many pixels that are.
    void drawHidden() {
        const int l = canvas_.left(), t = canvas_.top(), r = canvas_.right(), b = canvas_.bottom();
        const int thick = std::max(2, letter_ / 6);
        const double size = 0.6 * letter_;
        const double middleX = 0.5 * (l + r), middleY = 0.5 * (t + b);
        if (grid_.bezelXPx > 0) {
            const std::string text = fmt::format("{} hidden", grid_.bezelXPx);
            if (hasLeft())
                canvas_.fill(l, t, l + thick, b, kHidden),
                    canvas_.text(l + 2 * thick, middleY + letter_, size, text, kHidden);
            if (hasRight())
                canvas_.fill(r - thick, t, r, b, kHidden),
                    canvas_.text(r - 2 * thick - size * widthOfText(text), middleY + letter_, size, text, kHidden);
        }
        if (grid_.bezelYPx > 0) {
            const std::string text = fmt::format("{} hidden", grid_.bezelYPx);
            if (hasBelow())
                canvas_.fill(l, b - thick, r, b, kHidden),
                    canvas_.text(middleX + letter_, b - 2 * thick - size, size, text, kHidden);
            if (hasAbove())
                canvas_.fill(l, t, r, t + thick, kHidden),
                    canvas_.text(middleX + letter_, t + 2 * thick, size, text, kHidden);
        }
    }

    void drawName(const ScreenColor& color) {
        const std::vector<std::string> lines = {
            tile_.name, "host " + tile_.host, fmt::format("column {} row {}", tile_.column, tile_.row),
            fmt::format("{} x {} at {},{}", tile_.rect.width, tile_.rect.height, tile_.rect.x, tile_.rect.y),
            fmt::format("{}  {}", wordsOf(tile_.eye), tile_.user)};
        double widest = 0;
        for (const std::string& line : lines) widest = std::max(widest, widthOfText(line));
        const double size = std::min<double>(letter_, 0.45 * tile_.rect.width / (widest + 1.6));
        if (size < 3) return;
        block(canvas_.left() + 0.04 * tile_.rect.width, canvas_.top() + 0.18 * tile_.rect.height, size, lines, widest,
              color);
    }

    void drawFrame(std::uint64_t frame, const ScreenColor& color) {
        const std::string text = fmt::format("frame {}", frame);
        const double size = std::min<double>(1.5 * letter_, 0.9 * tile_.rect.width / (widthOfText(text) + 1.6));
        block(canvas_.left() + 0.05 * tile_.rect.width, canvas_.bottom() - 0.04 * tile_.rect.height - size, size,
              {text}, widthOfText(text), color);
    }

    /// Lines on a black ground.
    void block(double x, double y, double size, const std::vector<std::string>& lines, double widest,
               const ScreenColor& color) {
        const double step = 1.6 * size, edge = 0.6 * size;
        canvas_.fill(static_cast<int>(x - edge), static_cast<int>(y - edge),
                     static_cast<int>(x + size * widest + edge) + 1,
                     static_cast<int>(y + step * static_cast<double>(lines.size()) - 0.6 * size + edge) + 1, kBlack);
        for (std::size_t i = 0; i < lines.size(); ++i)
            canvas_.text(x, y + step * static_cast<double>(i), size, lines[i], color);
    }

    const Screen::Grid& grid_;
    const Tile& tile_;
    ScreenCanvas& canvas_;
    int letter_;
};

}  // namespace

Picture testPicture(const Wall& wall, const Tile& tile, const TestPictureOptions& options) {
    const Screen* screen = wall.findScreen(tile.screen);
    TESSERA_CHECK(screen != nullptr, "a tile names a screen that its wall does not have: checkWall was not called");
    const int top = screenPixels(*screen).height - tile.rect.y - tile.rect.height;
    ScreenCanvas canvas(tile.rect.x, top, tile.rect.width, tile.rect.height);
    ScreenPainter(*screen, canvas).draw(options.marks ? groundOf(tile.eye) : kGround);
    if (options.marks) TileMarks(*screen, tile, canvas).draw(options.frame);
    return std::move(canvas).take();
}

}  // namespace tessera
