/// Real models for tests and benchmarks.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

/// TESSERA_TEST_DATA, else shared/data beside the project. Need not exist.
[[nodiscard]] std::filesystem::path testDataFolder();

/// A mesh as plain arrays, for libraries that want their own copy.
struct MeshArrays3 {
    std::vector<double> positions;       ///< xyz per vertex, no two alike
    std::vector<std::uint32_t> indices;  ///< three per triangle, in the mesh's order
};
[[nodiscard]] MeshArrays3 arraysOf(const TriangleMesh& mesh);
[[nodiscard]] TriangleMesh meshOf(const MeshArrays3& arrays);

/// Any file that the importer reads, in its own units.
[[nodiscard]] Expected<TriangleMesh> loadModel(const std::filesystem::path& file);

/// Centred on its box, scaled to a diagonal of 1, rounded to float32, faces without area dropped: how the figures of
/// shared/design/collision.md, section 7, were measured.
[[nodiscard]] TriangleMesh normalised(const TriangleMesh& mesh);

/// Are the three corners exactly on one line (or in one point)?
[[nodiscard]] bool withoutArea(const Triangle& t);

}  // namespace tessera
