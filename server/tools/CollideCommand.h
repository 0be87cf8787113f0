/// tessera-collide: the pairwise stage on two files.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/tree/TriangleTree.h"
#include "server/tools/CollideAnswers.h"
#include "server/tools/PoseFile.h"

namespace tessera {

enum class CollideQuery : std::uint8_t { kAny, kAll, kDistance, kImpact, kDepth, kSelf, kRay };

/// Smooth surfaces of a file (server/collision/freeform).
enum class FreeformKind : std::uint8_t { kSubdivision, kLoop, kNurbs, kBezier };
/// Of their answers where nobody says, and what a question may cost: minutes.
inline constexpr double kFreeformTolerance = 1e-6;
inline constexpr std::uint64_t kMostFreeformWork = 2'000'000;

struct CollideArguments {
    std::string a, b, poses;  ///< of self a alone; of ray a, and rays instead of poses
    Representation asA = Representation::kTriangles, asB = Representation::kTriangles;
    std::optional<FreeformKind> freeformA, freeformB;
    unsigned levelA = 0, levelB = 0;  ///< of detail, as CollisionObject::level
    double error = 0.01;              ///< of distance fields, in diagonals of their boxes
    std::optional<double> radius;     ///< of points; else the file's
    CollideQuery query = CollideQuery::kAny;
    AnswerFormat format = AnswerFormat::kText;
    bool time = false;
    /// With smooth surfaces of all questions. toi: the distance that counts as a hit, 1e-4 unless given. distance: by
    /// how much an answer may be too large, 0 unless given.
    std::optional<double> tolerance;
    TreeOptions tree;
    /// Of any and all on k-DOPs of triangles: how B's are bounded in A's directions. No answer depends on it.
    std::optional<Realignment> realignment;
    unsigned threads = 1;  ///< for any and all
    std::vector<std::string> assets;
    std::size_t importMemoryMib = 0;  ///< what reading a file may take; 0: as much as usual
    bool allowUnconfined = false;
};

/// What --help or --version asked for.
struct CollideHelp {
    std::string text;
};

/// kUsage says what is wrong with the words.
[[nodiscard]] Expected<std::variant<CollideArguments, CollideHelp>> parseCollideArguments(
    const std::vector<std::string>& words);

/// Every line of the file is of the kind that the query wants, or kBadInput names the first that is not.
[[nodiscard]] Expected<void> checkPosesFor(CollideQuery query, const std::vector<PoseLine>& poses,
                                           const std::string& file);

/// The whole program; returns its exit code. Writes to stdout and stderr.
[[nodiscard]] int runCollide(const std::vector<std::string>& words);

}  // namespace tessera
