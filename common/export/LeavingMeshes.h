/// What drawables are made of when they leave: arrays of triangles, lines, points or copies.
#pragma once

#include <map>

#include "common/drawable/Drawable.h"
#include "common/export/ExportNotes.h"
#include "common/export/Selection.h"

namespace tessera {

/// Whether a tolerance counts for it: a surface by control points, or letters.
[[nodiscard]] bool isSmooth(const Object& core);

/// Makes each core's arrays once. One thread.
class LeavingMeshes {
public:
    /// `tolerance`: how far triangles may be off a smooth surface, in world units; 0: as the surface's own fields say.
    LeavingMeshes(const Aspect& scene, double tolerance, ExportNotes& notes)
        : scene_(scene), tolerance_(tolerance), notes_(notes) {}

    /// Checked arrays (checkMesh); empty where nothing is drawn here, or nothing that a file could have (a note says
    /// so). kRefused: their bytes are not here.
    [[nodiscard]] Expected<MeshArrays> of(const SelectedNode& node);

private:
    [[nodiscard]] Expected<MeshArrays> make(const SelectedNode& node, double tolerance);

    const Aspect& scene_;
    double tolerance_;
    ExportNotes& notes_;
    std::map<std::pair<ObjectId, double>, MeshArrays> made_;
};

/// The whole mesh of kGlyphs: its shape at the place of each copy, with the copy's colour.
[[nodiscard]] Expected<MeshArrays> expandedCopies(const MeshArrays& glyphs);

}  // namespace tessera
