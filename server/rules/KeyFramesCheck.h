/// Whether key frames that a list touches would play.
#pragma once

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Of key frames as the list leaves them behind, with ids in place of placeholders: blank ones and sound ones pass
/// (KeyTrack::of says what is not). A list that says other nonsense is the scene's to refuse. Costs a look-up per
/// entry, and the numbers of the key frames that it touches.
[[nodiscard]] Sound checkKeyFrames(const Aspect& scene, const ChangeList& list);

}  // namespace tessera
