/// Copies of much of a scene: made beside the frames, and brought part by part.
#pragma once

#include "common/scene/Aspect.h"
#include "server/sim/frame/Preparation.h"

namespace tessera {

/// On any thread. A copy stays whole where others' edits may make it senseless before its last part is there: one that
/// brings films (of which each image has one).
[[nodiscard]] Preparation makeCopy(const Aspect& scene, Preparation order);

}  // namespace tessera
