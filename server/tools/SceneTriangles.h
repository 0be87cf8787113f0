/// The triangles or points of a whole file, as the pairwise stage wants them.
#pragma once

#include <string>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/import/Importer.h"

namespace tessera {

/// All triangles that the file shows, in world coordinates and in file order (polygons fanned, nodes depth first).
/// Equal positions become one vertex; no triangle is left out, so a face is the triangle's place in the file. Blocks;
/// errors name the file, kBadInput also where it has no triangle at all, or not all of them (ImportOptions::whole).
/// `notes`: what is to be said of the file, in words; null: nobody hears it.
[[nodiscard]] Expected<TriangleMesh> readTriangles(const std::string& path, ImportOptions options,
                                                   std::vector<std::string>* notes = nullptr);

struct FilePoints {
    std::vector<Vec3d> places;
    double radius = 0;
};
/// Its points, in the order in which they are imported, with the radius that they are shown with, the largest where
/// there are several. kBadInput also where it has no points, or not all of them.
[[nodiscard]] Expected<FilePoints> readPoints(const std::string& path, ImportOptions options,
                                              std::vector<std::string>* notes = nullptr);

}  // namespace tessera
