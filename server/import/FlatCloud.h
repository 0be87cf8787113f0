/// Clouds of points that were scanned from above.
#pragma once

#include <span>

#include "server/import/LoadedFile.h"

namespace tessera {

/// Whether these points, three numbers each, lie as an airborne scan does: their heights along Z reach over less than a quarter of what the shorter of X
/// and Y does. Of each axis the outermost twentieth at either end does not count (masts, birds, echoes), nor do points that are not finite. Looks at 65,536
/// of them at most; false of fewer than 16.
[[nodiscard]] bool liesFlat(std::span<const float> positions);

/// Whether a model holds points alone, and they lie so, all meshes together, as they stand in the file.
[[nodiscard]] bool isFlatCloud(const LoadedFile& file);

}  // namespace tessera
