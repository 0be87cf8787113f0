/// The boxes of up to eight parts, as the kernel takes them (BoxGaps.h). Values only; in the shape's frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/math/Types.h"
#include "server/collision/freeform/BoxGaps.h"

namespace tessera {

/// Around its middle, along three directions of length 1 at right angles (columns).
struct PartBox {
    Vec3d middle = Vec3d::Zero();
    Mat3d axes = Mat3d::Identity();
    Vec3d half = Vec3d::Zero();
};

/// Parts of a part, some halvings down, which together are all of it. Most of them nobody comes near to: parts are made
/// of those alone (FreeformParts::partOf).
struct PartBlock {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    std::uint32_t of = 0;                                  ///< the part
    std::uint32_t count = 0;                               ///< of lanes
    std::array<std::uint32_t, kernel::kBoxLanes> parts{};  ///< kNone: not made yet
    std::array<std::uint32_t, kernel::kBoxLanes>
        ways{};  ///< down to each: two bits for which child, the first above the others; above all a 1
    std::array<double, kernel::kBoxColumns * kernel::kBoxLanes> boxes{};  ///< lanes that are not used are points

    void set(std::size_t lane, const PartBox& box) {
        for (Eigen::Index k = 0; k < 3; ++k) {
            at(k, lane) = box.middle[k];
            at(12 + k, lane) = box.half[k];
            for (Eigen::Index i = 0; i < 3; ++i) at(3 + 3 * i + k, lane) = box.axes(k, i);
        }
    }
    [[nodiscard]] PartBox box(std::size_t lane) const {
        PartBox box;
        for (Eigen::Index k = 0; k < 3; ++k) {
            box.middle[k] = at(k, lane);
            box.half[k] = at(12 + k, lane);
            for (Eigen::Index i = 0; i < 3; ++i) box.axes(k, i) = at(3 + 3 * i + k, lane);
        }
        return box;
    }

private:
    [[nodiscard]] double& at(Eigen::Index column, std::size_t lane) {
        return boxes[static_cast<std::size_t>(column) * kernel::kBoxLanes + lane];
    }
    [[nodiscard]] double at(Eigen::Index column, std::size_t lane) const {
        return boxes[static_cast<std::size_t>(column) * kernel::kBoxLanes + lane];
    }
};

}  // namespace tessera
