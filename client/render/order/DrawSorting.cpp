#include "client/render/order/DrawSorting.h"

#include <cmath>

namespace tessera {

std::string_view nameOf(DrawSorting sorting) {
    switch (sorting) {
        case DrawSorting::kDepth:
            return "depth";
        case DrawSorting::kState:
            return "state";
        case DrawSorting::kBoth:
            return "both";
    }
    return {};
}

std::int32_t depthBand(double depth) {
    // Written so that it holds for NaN. Depths below a thousandth of a unit are all at the eye.
    if (!(depth > 1e-3)) return 0;
    int octave = 0;
    const double within = std::frexp(depth, &octave);  // 0.5 to 1; no logarithm: libraries round those otherwise
    constexpr double kHalfAnOctave = 0.7071067811865476;
    return 64 + 2 * octave + (within >= kHalfAnOctave ? 1 : 0);
}

}  // namespace tessera
