/// View frusta as planes, and the test of a box against them.
#pragma once

#include <array>
#include <cstdint>

#include "common/math/Box.h"

namespace tessera {

/// The half space normal·x + offset >= 0.
struct Plane {
    Vec3d normal = Vec3d::UnitZ();
    double offset = 0;
};

/// Convex region of up to six planes whose normals point inwards.
class Frustum {
public:
    /// From clip = projection * x (column vectors, OpenGL clip space: -w <= x, y, z <= w) (Gribb and Hartmann 2001).
    [[nodiscard]] static Frustum fromClipMatrix(const Mat4d& clip);

    /// One bit per plane that still has to be tested.
    using Mask = std::uint8_t;
    static constexpr Mask kAllPlanes = 0x3f;

    struct Result {
        bool outside = false;
        Mask undecided = 0;  ///< planes that the box crosses; pass it down to the box's parts
    };
    /// Conservative: "outside" only when the box lies wholly behind one plane.
    [[nodiscard]] Result classify(const Box& box, Mask planes = kAllPlanes) const;

    [[nodiscard]] const std::array<Plane, 6>& planes() const { return planes_; }

private:
    std::array<Plane, 6> planes_;
};

}  // namespace tessera
