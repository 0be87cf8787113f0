/// Which triangles of two bodies meet?
///
/// `a_T_b` maps B's frame to A's; any finite affine map will do (non-uniform scale, mirroring and flattening included).
/// Every yes and no is trianglesIntersect's on A's vertices and on B's vertices mapped to A's frame in double, so
/// answers do not depend on the kind of tree, the instruction set or the number of threads. Every query counts its work
/// and gives up, saying so, where the count passes its limit.
#pragma once

#include "common/math/Types.h"
#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

class Workers;

/// How a k-DOP is bounded in the other body's directions (volume/README.md).
enum class Realignment : std::uint8_t {
    kBoxEnclosure,  ///< of its axis-aligned box
    kThreePlanes,   ///< weighted sums of three of its planes; in both frames where B's tree has many plates
    kTable,  ///< its support profile, where B's tree was built with them (TreeOptions::profiles); else three planes
    // For comparisons: what kThreePlanes chooses from.
    kInOneFrame,
    kInBothFrames,
};

/// How tight a realignment was: of B's k-DOPs, as they were bounded in A's directions.
struct PlacedVolumes {
    std::uint64_t count = 0;
    double volume = 0;  ///< of all together, in A's units, cubed
};

struct TouchOptions {
    Realignment realignment = Realignment::kThreePlanes;
    /// Null, or added to, at some microseconds for each k-DOP, by a query of one thread.
    PlacedVolumes* placed = nullptr;
    Workers* workers = nullptr;  ///< null: the calling thread alone
    /// Not above what the processor has. Answers are equal; counters may differ by a few.
    InstructionSet instructions = instructionSet();
};

/// Whether two bodies touch, and where.
struct TouchedPair {
    Touch touch = Touch::kNo;
    FacePair faces;  ///< one pair that meets, for kYes; always the same one for the same query
};
[[nodiscard]] TouchedPair firstTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                        QueryWork& work, const TouchOptions& options = {});
[[nodiscard]] FacePairs allTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                    QueryWork& work, const TouchOptions& options = {});

}  // namespace tessera
