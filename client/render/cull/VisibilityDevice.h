/// What cullers ask of whoever draws: a depth buffer like the picture's own, and whether anything would show before it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/render/DrawList.h"
#include "common/base/Error.h"
#include "common/wall/View.h"

namespace tessera {

/// One depth buffer at a time, of one part of a tile. A value of depth is the picture's: 1 at the near plane, 0 at the
/// far one and where nothing is, greater is nearer. Whoever implements it promises that an item leaves in each sample
/// the very depth that it leaves there in the picture, and that the parts together are the tile.
///
/// All errors are the renderer's; an answer is never a guess. One thread, that of the surface.
class VisibilityDevice {
public:
    /// Pixels that are drawn in coordinates of their own.
    struct Part {
        ScreenCamera camera;
        PixelRect pixels;  ///< in those of `camera`
    };
    /// Pixels of a part, counted from its own lower left corner, at one depth.
    struct Plate {
        int left = 0, bottom = 0, right = 0, top = 0;  ///< left <= x < right
        float depth = 0;
        [[nodiscard]] double areaPx() const { return static_cast<double>(right - left) * (top - bottom); }
    };
    using Ticket = std::uint32_t;

    VisibilityDevice() = default;
    VisibilityDevice(const VisibilityDevice&) = delete;
    VisibilityDevice& operator=(const VisibilityDevice&) = delete;
    virtual ~VisibilityDevice() = default;

    /// `rect`: a tile in the pixels of its screen.
    [[nodiscard]] virtual std::vector<Part> partsOf(const ScreenCamera& screen, const PixelRect& rect) const = 0;
    /// This part from now on, with an empty depth buffer; forgets what was asked.
    [[nodiscard]] virtual Expected<void> begin(const Part& part) = 0;
    /// Adds the items' depths. Only surfaces that are opaque in every pixel; what cannot be drawn is left away.
    [[nodiscard]] virtual Expected<void> drawDepth(std::span<const DrawItem> items) = 0;
    /// Asks one question per group: has any sample of any of its plates a depth, by what was drawn before, that is not
    /// nearer than the plate? `sizes` cuts the plates into groups. Tickets are counted on from the one returned.
    [[nodiscard]] virtual Expected<Ticket> ask(std::span<const Plate> plates, std::span<const std::uint32_t> sizes) = 0;
    /// Waits where it must. False: the group's plates are hidden.
    [[nodiscard]] virtual Expected<bool> answer(Ticket ticket) = 0;
    /// The farthest depth of each pixel's samples, rows from below; valid until the next call.
    [[nodiscard]] virtual Expected<std::span<const float>> farthest() = 0;
};

}  // namespace tessera
