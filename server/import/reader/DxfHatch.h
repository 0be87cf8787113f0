/// What a HATCH fills.
#pragma once

#include <vector>

#include "server/import/reader/DxfCurves.h"
#include "server/import/reader/DxfGroups.h"

namespace tessera {

struct DxfFill {
    std::vector<Vec3d> corners;  ///< in the hatch's own coordinates
    std::vector<std::uint32_t> triangles;
};

/// The boundary paths of a hatch as closed rings, in its own coordinates.
[[nodiscard]] std::vector<DxfPath> dxfHatchRings(const DxfRecord& record, const DxfChords& chords);
/// What an odd number of rings is around (z is the first corner's). kLimit: too many corners or rings.
[[nodiscard]] Expected<DxfFill> dxfFilled(const std::vector<DxfPath>& rings);

}  // namespace tessera
