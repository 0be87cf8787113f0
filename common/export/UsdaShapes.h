/// Meshes, curves, points and smooth surfaces as properties of a USD prim.
#pragma once

#include <string>
#include <string_view>

#include "common/export/ExportNotes.h"
#include "common/export/Selection.h"
#include "common/geometry/Mesh.h"

namespace tessera {

/// "Mesh", "BasisCurves" or "Points".
[[nodiscard]] std::string_view usdShapeType(const MeshArrays& arrays);
/// A line each, behind `in`. What USD has no place for is noted.
[[nodiscard]] std::string usdShape(const SelectedNode& node, const MeshArrays& arrays, const std::string& in,
                                   ExportNotes& notes);

}  // namespace tessera
