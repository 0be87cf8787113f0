/// Letters made of straight strokes, of our own: readable from five pixels upwards.
#pragma once

#include <string_view>
#include <vector>

namespace tessera {

/// One stroke, in units of a capital's height: x to the right, y down from its top, 1 at the line that letters stand
/// on.
struct Stroke {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// What to draw for `text`, from its upper left corner. Letters of the Latin alphabet (small ones as small capitals),
/// digits and
/// -+_.,:/()=%'; a space; anything else is a box. UTF-8 beyond that: a box per byte.
[[nodiscard]] std::vector<Stroke> strokesOf(std::string_view text);
/// In units of a capital's height, without the gap behind the last letter.
[[nodiscard]] double widthOfText(std::string_view text);

}  // namespace tessera
