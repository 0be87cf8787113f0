/// The surface of an Extrusion.
#pragma once

#include <Inventor/SbMatrix.h>

#include "common/base/Error.h"
#include "common/geometry/Mesh.h"

class SoVRMLExtrusion;

namespace tessera {

/// Triangles as ISO/IEC 14772-1:1997, 6.18 has them: sides, and caps where they are wanted. Normals follow its
/// creaseAngle. With `textured` texture coordinates, moved by `texture`, from the upper left corner.
/// Coin's own takes time by the square of the faces that meet in one point. `faces`: how many sides may still be made,
/// less those of this one afterwards; kLimit: too few. Empty: it has no two points along, or none across.
[[nodiscard]] Expected<MeshData> meshOfExtrusion(const SoVRMLExtrusion& node, bool textured, const SbMatrix& texture,
                                                 std::size_t& faces);

}  // namespace tessera
