/// The pairs of models that the rows of collision are measured on, and their poses.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/Error.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {

using ModelFiles = std::pair<std::string, std::string>;

/// Two pairs of 70,000 to 80,000 triangles.
[[nodiscard]] std::vector<ModelFiles> standardPairs();
/// Models and, with them, seeds that no threshold or default was chosen by.
[[nodiscard]] std::vector<ModelFiles> heldBackPairs();

struct PairWishes {
    std::size_t poses = 1000;
    std::size_t motions = 200;
    std::uint64_t seed = 1;
    std::string saveTo;  ///< a folder for pose files
};
/// Normalised and posed as shared/design/collision.md says (section 7).
[[nodiscard]] Expected<BenchPair> posedPair(const ModelFiles& files, const PairWishes& wishes);
/// The models and poses as the files have them. Lines of 14 numbers are motions, and their starts are poses too.
[[nodiscard]] Expected<BenchPair> pairFromPoseFile(const ModelFiles& files, const std::string& poses);

}  // namespace tessera
