/// Clouds of points that were scanned from above.
#pragma once

#include "server/import/LoadedFile.h"

namespace tessera {

/// Whether a model holds points alone, and they lie as an airborne scan does, all meshes together, as they stand in the
/// file: their heights along Z reach over less than a quarter of what the shorter of X and Y does. Of each axis the
/// outermost twentieth at either end does not count (masts, birds, echoes), nor do points that are not finite. Looks at
/// about 65,536 of them; false of fewer than 16.
[[nodiscard]] bool isFlatCloud(const LoadedFile& file);

}  // namespace tessera
