/// Files of warp meshes: text, as Paul Bourke describes it ("Mesh format for image warping",
/// paulbourke.net/dataformats/meshwarp, 2006) and calibration tools write it.
///
///     2                      type: 2, a rectangular mesh (1, a polar one, is refused)
///     3 2                    columns and rows of nodes
///     -1.777 -1 0 0 1        a line for each node, row by row: x y u v i
///
/// x y: the node's place in the output; y from -1 (lower edge) to 1, x from -A to A, where A is the output's width over
/// its height. u v: what it shows of the tile's picture, 0 (left, lower edge) to 1; beyond that the output is black. i:
/// how much of its light, 0 to 1; below 0 marks a node that is missing, which is refused. Empty lines and those that
/// begin with # say nothing.
#pragma once

#include <string>
#include <string_view>

#include "common/base/Error.h"
#include "common/wall/Output.h"

namespace tessera {

/// `aspect`: A above. Errors (kBadInput) begin with `name`, name the line where it is one, and the node. The mesh has
/// passed `findWarpFault`.
[[nodiscard]] Expected<WarpMesh> readMesh(std::string_view text, std::string_view name, double aspect);
/// Reads back as the same mesh, but for what 9 digits lose.
[[nodiscard]] std::string meshText(const WarpMesh& mesh, double aspect);

}  // namespace tessera
