/// Support profiles (volume/SupportProfile.h) of a tree's volumes, for realignment by table.
#pragma once

#include "server/collision/tree/TreeStorage.h"
#include "server/collision/volume/SupportProfile.h"

namespace tessera {

/// Of k-DOPs of 14, 18 and 26 directions, four sectors and eight bins; none for others.
[[nodiscard]] bool hasProfiles(const TreeOptions& options);
[[nodiscard]] ProfileShape profileShape(VolumeKind kind);

/// After fitVolumes, where the options ask for them; else empties the arrays. Slow beside it: some three microseconds
/// per vertex and level.
void fitProfiles(TreeStorage& tree, std::span<const OwnPosition> positions);

}  // namespace tessera
