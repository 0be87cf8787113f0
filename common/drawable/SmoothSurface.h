/// What the triangles of a derived drawable are of, for who looks at the surface itself: collision.
#pragma once

#include <variant>

#include "common/freeform/nurbs/NurbsSurface.h"
#include "common/freeform/subdivision/ControlMesh.h"

namespace tessera {

/// In the coordinates of the drawable's arrays. The positions of a control mesh are DerivedSource::points, three floats
/// each: where two sources differ by these alone, nothing else of the control mesh does.
struct SmoothSurface {
    std::variant<ControlMesh, NurbsSurface> surface;
};

}  // namespace tessera
