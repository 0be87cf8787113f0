/// Faces with a vertex twice in a row: quadrilaterals that end at a pole.
///
/// OpenSubdiv takes such an edge without length as one that is no manifold, so the pole is fixed and what ends there is
/// sharp towards itself. The same surface comes of as many fixed vertices in the same place as there are fans of faces:
/// that mesh is made here.
#pragma once

#include "common/base/Error.h"
#include "common/freeform/subdivision/ControlMesh.h"

namespace tessera {

struct UnrolledMesh {
    ControlMesh mesh;
    std::vector<std::uint32_t> sources;  ///< which vertex each was
};

[[nodiscard]] bool hasCollapsedEdges(const ControlMesh& mesh);

/// Of a mesh whose indices are in range. kBadInput where an edge at such a vertex is one of more than two faces, or
/// goes the same way in two, or where the faces around it come back to the one that has it twice: OpenSubdiv's answer
/// is not known to be one surface.
[[nodiscard]] Expected<UnrolledMesh> unrollCollapsedEdges(const ControlMesh& mesh);

}  // namespace tessera
