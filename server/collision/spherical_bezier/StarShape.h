/// Is a body a radius as a function of direction? Of what is not, spherical patches bound more than the body fills.
#pragma once

#include <optional>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

/// A place from which every face is seen from the same side, and none from its edge; of a closed surface then none in a
/// direction of another, while an open one may lie behind itself. Nothing where none is found: the body is not
/// star-shaped, or so little that nobody would gain by it (the place must be farther from each face's plane than a
/// millionth of the body's size). Faces without an area (2^-40 of the size squared) do not count. Costs some passes
/// over the faces; a few hundred where there is no such place.
[[nodiscard]] std::optional<Vec3d> starCentreOf(const TriangleMesh& mesh);

}  // namespace tessera
