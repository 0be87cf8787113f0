/// What moves in the pipeline's benchmark: shapes, where they are in each frame, all from seeds.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/math/Pose.h"
#include "tests/bench/PipelineScene.h"
#include "tests/support/Models.h"

namespace tessera {

/// Hulls of 8 to 60 corners on dented ellipsoids of a radius of about 0.5, with their triangles. Coordinates are
/// floats.
[[nodiscard]] std::vector<MeshArrays3> makeHulls(std::size_t count, std::uint64_t seed);

/// Poses per frame, frame 0 where everything begins; which bodies move.
struct BodyFrames {
    std::vector<std::vector<Pose>> poses;
    std::vector<std::uint32_t> movers;  ///< ascending; the others stay

    [[nodiscard]] std::size_t bodies() const { return poses.front().size(); }
    [[nodiscard]] std::size_t last() const { return poses.size() - 1; }
    /// What the frame loop is asked for, bodies numbered as in the scene.
    [[nodiscard]] std::vector<std::vector<TentativeTransform>> wishes(const PipelineScene& scene) const;
};

/// Bodies of diameter 1 in a cube, `volume` of it for each; each flies at 0.05 per frame in a direction of its own, is
/// reflected at the walls, and turns at 0.03 about an axis of its own. Every `everyNth` moves.
[[nodiscard]] BodyFrames flyingBodies(std::size_t count, double volume, std::size_t everyNth, std::size_t frames,
                                      std::uint64_t seed);

/// Bodies on a body-centred lattice of this spacing, which turn like the flying ones and swing by 0.05 about their
/// places: the boxes of the eight nearest overlap, while few of the bodies touch.
[[nodiscard]] BodyFrames packedBodies(std::size_t count, double spacing, std::size_t frames, std::uint64_t seed);

/// Parts that swing about places on a surface, near it and into it: `sizes` are their diagonals; a swing of half of one
/// takes 120 frames.
[[nodiscard]] BodyFrames swingingParts(const std::vector<double>& sizes, const std::vector<TriangleMesh>& surfaces,
                                       std::size_t frames, std::uint64_t seed);

}  // namespace tessera
