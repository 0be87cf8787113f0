/// FCL 0.7 on two models whose vertices all move in every frame: refit, then collide.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

enum class DeformingFclVolume : std::uint8_t { kObb, kObbRss, kAabb };

class DeformingFclPair {
public:
    virtual ~DeformingFclPair() = default;
    /// To state `frame`, both bodies, bottom up.
    virtual void refit(std::size_t frame) = 0;
    [[nodiscard]] virtual bool any(const Affine3d& a_T_b) = 0;
};

/// With one position per vertex and frame, brought into FCL's own type here. The first frames' shapes are what is
/// built.
[[nodiscard]] std::unique_ptr<DeformingFclPair> deformingFclPair(DeformingFclVolume volume, const TriangleMesh& a,
                                                                 const TriangleMesh& b,
                                                                 const std::vector<std::vector<Vec3d>>& framesA,
                                                                 const std::vector<std::vector<Vec3d>>& framesB);

}  // namespace tessera
