/// How a file stands where somebody puts it: which way is up, and where.
#pragma once

#include "common/cores/Transform.h"
#include "server/import/SceneDraft.h"

namespace tessera {

/// The Transform that puts a file where it shall stand, but for `Placing::fit`, which takes all of it to be known. What
/// was guessed is a note.
[[nodiscard]] Transform standOf(SceneDraft& draft, const LoadedFile& file, const Placing& placing);

}  // namespace tessera
