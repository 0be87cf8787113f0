/// A head as a tracker sees it, for the view.
#pragma once

#include <cstdint>
#include <string>

#include "common/math/Types.h"

namespace tessera {

/// Metres, in the wall's frame.
struct TrackedHead {
    std::string user;
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
    double share = 0;         ///< 1: the tracker's word alone; 0: it has said nothing, or nothing for long
    std::uint64_t poses = 0;  ///< of its sensor, so far
};

}  // namespace tessera
