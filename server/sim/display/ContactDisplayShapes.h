/// The three shapes that contacts are drawn with: a ball, an arrow, a triangle.
#pragma once

#include <array>

#include "common/geometry/Mesh.h"

namespace tessera {

enum class MarkKind : std::uint8_t { kPoint, kNormal, kFace };
inline constexpr std::size_t kMarkKinds = 3;

/// kPoint: a ball of radius 1 around the origin. kNormal: an arrow of length 1 from the origin along +Z. kFace: the
/// triangle (0, 0), (1, 0), (0, 1) in the plane z = 0, seen from +Z. Made with sums, products and square roots alone:
/// the same bytes on every machine.
[[nodiscard]] const std::array<MeshArrays, kMarkKinds>& markShapes();

}  // namespace tessera
