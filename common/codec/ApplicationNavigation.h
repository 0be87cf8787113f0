/// What applications ask of the navigator (server/sim/navigation), as values.
#pragma once

#include <cstdint>
#include <optional>

#include "common/change/Value.h"
#include "common/input/InputState.h"
#include "common/wall/Navigation.h"

namespace tessera::request {

/// Moves the wall as a person would who flies: first the mode, then what is asked for, then what is held. Refused by a
/// server that takes no input.
struct NavigateView {
    enum class Deed : std::uint8_t {
        kNone,
        kHome,          ///< to the first view
        kFit,           ///< until `node`, or the whole scene, fills the wall
        kGoToBookmark,  ///< refused where nobody has kept it
        kKeepBookmark,  ///< where the wall stands now
    };
    std::optional<NavigationMode> mode;
    Deed deed = Deed::kNone;
    ObjectId node;               ///< of kFit; none: the whole scene
    std::uint32_t bookmark = 0;  ///< 1 to 9
    /// This application's own input from now on: its `source` does not count. It is released when the application leaves.
    std::optional<InputState> input;
};

}  // namespace tessera::request
