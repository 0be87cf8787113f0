/// Poses and motions of one body past another, from a seed: uniform rotations, and every closeness in equal parts
/// (shared/design/collision.md, section 7).
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "server/collision/query/TimeOfImpact.h"

namespace tessera {

/// s_c: the distance of the bodies' origins at which B, on its way along a direction d to A's origin, first touches A.
enum class Closeness : std::uint8_t {
    kSeparated,  ///< s_c + 0.02 + 0.38 u, u uniform in 0 … 1
    kNear,       ///< s_c + 10^(-4 + 2 u): does not touch
    kShallow,    ///< s_c - 10^(-4 + 2 u): touches
    kDeep,       ///< s_c (0.3 + 0.5 u): touches
};
[[nodiscard]] std::string_view name(Closeness closeness);

struct TestPose {
    Closeness closeness = Closeness::kSeparated;
    Pose a_T_b;
};

/// Who is asked how two bodies lie to each other. Where the answers are to be judged, it must be somebody else than who
/// is judged.
struct PoseOracle {
    std::function<bool(const Affine3d& a_T_b)> touching;
    std::function<double(const Affine3d& a_T_b)> distance;
};
/// Tessera's own queries, for benchmarks. Both trees must outlive it.
[[nodiscard]] PoseOracle ownOracle(const TriangleTree& a, const TriangleTree& b);

// Both bodies are of diagonal 1 and about their origin; B's pose is relative to A.

/// `count` poses, the i-th of class i mod 4. A class is what the oracle says: a pose that belies it (a thin body may be
/// passed right through) is drawn again.
[[nodiscard]] std::vector<TestPose> makePoses(const PoseOracle& oracle, std::size_t count, std::uint64_t seed);

/// Ways of B past A, which stays: from d (s_c + 0.1 + 0.2 u) to -0.4 d + 0.5 e, e a direction of its own, turning by up
/// to 60 degrees.
[[nodiscard]] std::vector<BodyMotion> makeMotions(const PoseOracle& oracle, std::size_t count, std::uint64_t seed);

}  // namespace tessera
