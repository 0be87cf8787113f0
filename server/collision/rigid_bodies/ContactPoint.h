/// Where two bodies touch or may come to touch in a frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/math/Types.h"

namespace tessera::rigid {

/// B must not come nearer to A along the normal than the gap allows.
struct ContactPoint {
    Vec3d position;  ///< world, midway between the two surfaces
    Vec3d normal;    ///< world, unit length, from A to B
    double gap = 0;  ///< along it; below 0 they overlap
};

/// A face that may be met, and by how much some direction parts it from who looks, as the frame begins; below 0: they
/// overlap by that.
struct NearFace {
    std::uint32_t face = 0;
    double gap = 0;
};

inline constexpr std::size_t kMostPoints = 4;    ///< of one normal direction
inline constexpr std::size_t kMostClusters = 6;  ///< normal directions of one encounter
inline constexpr std::size_t kMostOfEncounter = kMostPoints * kMostClusters;

/// Keeps those that hold the bodies as all would: for each direction (to within acos 0.97) up to four points far from
/// each other, beginning with the deepest; of points nearer than `near` to each other one. Of those from `first` on;
/// the choice depends on them and their order alone.
void reduceContacts(std::vector<ContactPoint>& points, std::size_t first, double near);

}  // namespace tessera::rigid
