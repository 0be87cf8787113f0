/// Parts of a layer of shadow maps, in blocks. No GL.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/render/scene/ShadowCasters.h"

namespace tessera {

/// Blocks of 64×64 pixels, the grid that scissors lie on.
class MapBlocks {
public:
    static constexpr int kSidePx = 64, kCount = kSunMapPx / kSidePx;

    /// All that the rectangle touches.
    void add(const PixelRect& rect);
    void add(const MapBlocks& other);
    [[nodiscard]] bool empty() const;
    [[nodiscard]] bool meets(const PixelRect& rect) const;
    [[nodiscard]] PixelRect around() const;
    /// Rectangles that lie apart, few and large.
    [[nodiscard]] std::vector<PixelRect> rectangles() const;

private:
    std::array<std::uint32_t, kCount> rows_{};  ///< bit: column
    static_assert(kCount == 32);
};

}  // namespace tessera
