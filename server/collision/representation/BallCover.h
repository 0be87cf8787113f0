/// A surface covered by few balls of one radius: a level of detail whose error is known.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

struct BallCover {
    double radius = 0;
    std::vector<Vec3d> centres;
    std::vector<std::uint32_t> faces;  ///< of each ball one face that has a point in it
};

struct BallCoverLimits {
    std::size_t maxBalls = 1'000'000;
    /// Corners of pieces looked at: what bounds the time where many large faces lie upon each other, to a second
    /// or two.
    std::uint64_t maxCorners = 100'000'000;
};

/// Every point of every triangle lies in a ball, and every ball holds a point of a triangle: what is farther from the
/// surface than two radii is in none. The surface is cut by planes along the axes until what is left of it on either
/// side fits in a ball. So there are about area / radius² of them, and one for each bit that lies alone, however small
/// the triangles are. The same for the same mesh, always. Centres are floats where the radius leaves room for that.
///
/// kBadInput: no triangles; balls that are too small beside the coordinates (their places are not numbers), or a mesh
/// smaller than 1e-100 but larger than a point. kLimit: more balls, or more work, than allowed.
[[nodiscard]] Expected<BallCover> coverOf(const TriangleMesh& mesh, double radius, const BallCoverLimits& limits = {});

inline constexpr unsigned kFinestLevel = 12;

/// That of a level of detail, 1 to kFinestLevel: the diagonal of the box / 2^(level + 1).
[[nodiscard]] double coverRadius(const Box& bounds, unsigned level);

}  // namespace tessera
