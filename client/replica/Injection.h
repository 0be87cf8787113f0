/// Faults on demand, for tests of what the rest of the wall does about them. Off unless asked for.
#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

struct Injection {
    enum class Kind : std::uint8_t {
        kNone,
        kDrawHang,  ///< the draw thread stops for good, heartbeats go on
        kDrawSlow,  ///< the draw thread sleeps before it draws this frame
        kDrawFail,  ///< drawing ends in an error
        kShowHang,  ///< from this frame on the session thread shows nothing, heartbeats go on
        kCorrupt,   ///< one field of the replica gets another value
        kLie,       ///< from this frame on it says another hash than its replica has
    } kind = Kind::kNone;
    std::uint64_t frame = 0;
    std::chrono::milliseconds pause{0};  ///< kDrawSlow

    [[nodiscard]] bool at(Kind wanted, std::uint64_t now) const { return kind == wanted && frame == now; }
};

/// "draw-hang@20", "draw-slow@20:500" (milliseconds), "draw-fail@20", "show-hang@20", "corrupt@20",
/// "lie@20".
[[nodiscard]] Expected<Injection> parseInjection(std::string_view text);

}  // namespace tessera
