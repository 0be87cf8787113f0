/// Where a visible node stands in the tree and in the world.
#pragma once

#include <cstdint>
#include <cstring>

#include "common/change/Value.h"
#include "common/math/Types.h"

namespace tessera {

inline constexpr std::uint32_t kNobody = 0xffffffffu;

/// A visible node, in document order (depth first, children in order).
struct Place {
    static constexpr std::uint32_t kNone = kNobody;

    std::uint32_t parent = kNone;
    std::uint32_t end = 0;  ///< one past the last place below
    ObjectId transform;     ///< the core that moves it (NodePose); none: the parent's frame
    bool absolute = false;  ///< `local` is the world pose itself
    Affine3d local = Affine3d::Identity();
    Affine3d world = Affine3d::Identity();

    [[nodiscard]] Affine3d below(const Affine3d& above) const {
        if (!transform) return above;
        return absolute ? local : Affine3d(above * local);
    }
};

/// Whether nothing has moved: a NaN equals itself, and 0 is not -0.
[[nodiscard]] inline bool sameBits(const Affine3d& a, const Affine3d& b) {
    return std::memcmp(a.data(), b.data(), 16 * sizeof(double)) == 0;
}

}  // namespace tessera
