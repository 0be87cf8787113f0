/// What an oracle of culling draws: the items that a picture needs, and no others.
#pragma once

#include <array>
#include <set>
#include <utility>

#include "client/draw/passes/Renderer.h"
#include "tests/bench/DrawingStage.h"

namespace tessera::bench {

/// Of `all`, the items with a visible sample in the part `rect`. A pixel's four samples lie at middles of the sixteen
/// parts of a finer picture (the pattern of GL_SAMPLES 4 in llvmpipe, and Direct3D's); of one sample it is the pixel's
/// own middle.
inline DrawList visibleItems(Renderer& renderer, const Aspect& aspect, DrawList all, const ScreenCamera& camera,
                             const PixelRect& rect, int samples) {
    const int fine = samples == 4 ? 4 : 1;
    ScreenCamera finer = camera;
    finer.pixels = {camera.pixels.width * fine, camera.pixels.height * fine};
    const PixelRect part{rect.x * fine, rect.y * fine, rect.width * fine, rect.height * fine};
    const auto ids = orExit(renderer.drawNodeIds(aspect, all, finer, part));
    constexpr std::array<std::pair<int, int>, 4> kSamples{{{1, 0}, {3, 1}, {0, 2}, {2, 3}}};  // from the lower left
    std::set<std::uint64_t> seen;
    for (int y = 0; y < rect.height; ++y)
        for (int x = 0; x < rect.width; ++x)
            for (int s = 0; s < samples; ++s) {
                const auto [right, up] = fine == 1 ? std::pair{0, 0} : kSamples[static_cast<std::size_t>(s)];
                const int fromTop = part.height - 1 - (y * fine + up);
                seen.insert(ids[static_cast<std::size_t>(fromTop) * static_cast<std::size_t>(part.width) +
                                static_cast<std::size_t>(x * fine + right)]);
            }
    const auto hidden = [&](const DrawItem& item) { return !seen.contains(item.node.value); };
    std::erase_if(all.opaque, hidden);
    std::erase_if(all.transparent, hidden);
    return all;
}

}  // namespace tessera::bench
