/// The shapes that contacts and distances are drawn with: a ball, an arrow, a triangle, a rod.
#pragma once

#include <array>

#include "common/geometry/Mesh.h"

namespace tessera {

enum class MarkKind : std::uint8_t { kPoint, kNormal, kFace, kLine, kTick };
inline constexpr std::size_t kMarkKinds = 5;

/// kPoint: a ball of radius 1 around the origin. kNormal: an arrow of length 1 from the origin along +Z. kFace: the
/// triangle (0, 0), (1, 0), (0, 1) in the plane z = 0, seen from +Z. kLine, kTick: a rod of radius 1, closed, around
/// the Z axis from z = 0 to 1. Made with sums, products and square roots alone: the same bytes on every machine.
[[nodiscard]] const std::array<MeshArrays, kMarkKinds>& markShapes();

}  // namespace tessera
