/// Pairs of triangles that may meet, decided many at a time. For the queries of this folder.
#pragma once

#include <array>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/tree/Kernels.h"

namespace tessera {

/// What is plain eight at once (tree/kernel/Pairs.inl), what is not by trianglesIntersect: so each as that says, on A's
/// triangles and B's mapped to A's frame in double.
class PairDecider {
public:
    /// Triangles lie within the bounds, each in its own frame.
    PairDecider(const Box& boundsA, const Box& boundsB, const Affine3d& a_T_b);

    static constexpr std::uint32_t kRoom = 64;
    [[nodiscard]] std::uint32_t count() const { return count_; }
    /// While there is room.
    void add(const FacePair& faces, const Triangle& a, const Triangle& b);
    /// Appends those that meet, the first alone where `one`; then nothing is left.
    void decide(bool one, std::vector<FacePair>& meeting);

private:
    kernel::PairMap map_;
    Affine3d a_T_b_;
    std::uint32_t count_ = 0;
    std::array<FacePair, kRoom> faces_;
    std::array<Triangle, kRoom> a_, b_;
};

}  // namespace tessera
