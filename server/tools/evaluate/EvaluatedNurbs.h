/// NURBS surfaces of OBJ files (common/freeform/nurbs/ObjSurfaces.h), by their number in the file and the parameters of
/// their knots.
#pragma once

#include "server/tools/evaluate/EvaluatedSurface.h"

namespace tessera {

[[nodiscard]] Expected<std::unique_ptr<EvaluatedSurface>> loadNurbs(std::string_view text, std::string_view file);

}  // namespace tessera
