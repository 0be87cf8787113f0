/// Who is seen: every triangle against every sample, in double, without any cleverness. Slow and plainly right.
#pragma once

#include <set>

#include "tests/unit/render/TestScene.h"

namespace tessera {

/// Nodes of the list's items of which a sample of the tile shows something. Each pixel has the four samples of 4× MSAA
/// and a grid of 4 × 4 more. What is nearest by less than one part in 10^6 counts as seen, too.
[[nodiscard]] std::set<ObjectId> visibleNodes(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                              const PixelRect& tile);

}  // namespace tessera
