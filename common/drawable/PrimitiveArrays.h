/// A Geometry's arrays, whatever its primitive: strips, loops, fans, quads and polygons become the triangles or lines
/// that they are (common/geometry/Primitives.h). Its vertices stay as they stand, so that ranges of them lead on;
/// indices alone are made, once a process of each content, and where quads and polygons have moved in parts, from those
/// before.
#pragma once

#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"

namespace tessera {

/// Without indices where a run does not pass the check; with absent ones, of as many bytes as they would have, where an
/// array that they are made of is not here. Any thread.
[[nodiscard]] MeshArrays arraysOf(const Geometry& geometry);

/// What keeps a geometry's primitives from being made into triangles or lines, its other arrays aside. Nothing at all
/// is fine.
[[nodiscard]] Expected<void> checkPrimitives(const Geometry& geometry);

}  // namespace tessera
