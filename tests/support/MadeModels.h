/// Models that need no files: of each kind that collision finds hard, one.
#pragma once

#include <optional>
#include <string_view>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

/// "made/knot": a tube along a trefoil, 5,760 faces, holes within holes. "made/gear": 24 teeth, flat sides of which
/// many lie in one plane. "made/plate": a thousandth as thick as it is wide. "made/terrain": a height field, open.
/// Nothing for other names.
[[nodiscard]] std::optional<TriangleMesh> madeModel(std::string_view name);

}  // namespace tessera
