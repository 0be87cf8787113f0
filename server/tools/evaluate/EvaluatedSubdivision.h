/// Subdivision surfaces of OBJ files (ObjControlMesh.h), by ptex faces.
#pragma once

#include "common/freeform/subdivision/ControlMesh.h"
#include "server/tools/evaluate/EvaluatedSurface.h"

namespace tessera {

[[nodiscard]] Expected<std::unique_ptr<EvaluatedSurface>> loadSubdivision(std::string_view text, std::string_view file,
                                                                          SubdivisionScheme scheme);

template <SubdivisionScheme Scheme>
Expected<std::unique_ptr<EvaluatedSurface>> loadSubdivision(std::string_view text, std::string_view file) {
    return loadSubdivision(text, file, Scheme);
}

}  // namespace tessera
