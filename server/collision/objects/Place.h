/// Where a visible node stands in the tree and in the world.
#pragma once

#include <cstdint>
#include <cstring>

#include "common/change/Value.h"
#include "common/math/Types.h"

namespace tessera {

inline constexpr std::uint32_t kNobody = 0xffffffffu;

/// What a core means for collisions.
enum class CoreKind : std::uint8_t { kOther, kTransform, kDrawable, kSwitch, kInterest, kObject, kEnvironment };

/// A visible node. Its number stays as long as the node is visible; what becomes free is given again.
struct Place {
    static constexpr std::uint32_t kNone = kNobody;

    ObjectId node;  ///< none: the number is free
    std::uint32_t parent = kNone;
    ObjectId core;
    CoreKind kind = CoreKind::kOther;
    ObjectId transform;     ///< the core that moves it (NodePose); none: the parent's frame
    bool absolute = false;  ///< `local` is the world pose itself
    bool movable = false;   ///< it is a Transform, which impulses and motions may move
    Affine3d local = Affine3d::Identity();
    Affine3d world = Affine3d::Identity();

    // How much of interest stands at or below it.
    std::uint32_t parts = 0;    ///< ObjectHandler::parts()
    std::uint32_t objects = 0;  ///< topmost nodes of objects

    /// The place in whose coordinates this one stands; none: the world's.
    [[nodiscard]] std::uint32_t frame() const { return absolute ? kNone : parent; }
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
