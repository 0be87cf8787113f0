/// How applications point at things, and what they do with the handles of manipulators (server/manipulators), as values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/math/Ray.h"

namespace tessera::request {

/// Pixel of the mosaic, from the upper left; or what a wand points at.
struct PickAt {
    double xPx = 0, yPx = 0;
    std::string wand;  ///< empty: the pixel
};

/// Takes hold of a handle, drags it, lets go. An application holds one at a time; what it drags from a grab on is one step of undo, and it lets go
/// when it leaves.
struct Manipulate {
    enum class Deed : std::uint8_t {
        kGrab,     ///< answered by Picked: the manipulator's node, and the handle's number as `face`
        kDrag,     ///< answered by Committed, once the frame is made; refused where nothing is held
        kRelease,  ///< answered by Done
    };
    Deed deed = Deed::kGrab;
    PickAt aim = {};
    std::optional<Ray> ray = {};  ///< of the world, instead of `aim`
};

}  // namespace tessera::request
