/// What of an InputState takes hold of things on the wall: the handles of manipulators.
///
/// Who takes hold does so at the cursor (`cursorX`, `cursorY`), and asks for a grab of the view too
/// (InputAction::kGrab): where there is no handle, that is what it is. From then on the hand is as far from the cursor
/// as the drags (`lookRight`, `panRight`, …) have gone since.
#pragma once

#include "common/input/InputState.h"

namespace tessera {

/// Of `InputState::held`: what has been taken hold of is held on to.
inline constexpr std::uint32_t kHandHolds = 2;
static_assert((kHandHolds & InputState::kFaster) == 0);

/// The place in `InputState::asked` that counts how often somebody has taken hold: behind those of all InputActions.
inline constexpr std::size_t kHandTakes = 27;
static_assert(kInputActions <= kHandTakes && kHandTakes < std::tuple_size_v<decltype(InputState::asked)>);

}  // namespace tessera
