/// Where a model stands that brings no light of its own: hosts draw it on a ground, in the light of a studio. No part
/// of the scene: nothing counts it, saves it, finds it, touches it.
#pragma once

#include <optional>

#include "common/math/Box.h"
#include "common/math/Types.h"

namespace tessera {

/// Stays where the model stood when the view was made for it.
struct Studio {
    Vec3d middle = Vec3d::Zero();  ///< of the ground, a horizontal plane; world units
    double reach = 1;              ///< of the model around it, world units
    bool operator==(const Studio&) const = default;
};

/// Below a model that stands in `now`, and that its animations take through `bounds`; none where those have no size
/// that a picture could show.
[[nodiscard]] inline std::optional<Studio> studioBelow(const Box& bounds, const Box& now) {
    const double reach = bounds.empty() ? 0 : 0.5 * bounds.size().norm();
    if (!(reach > 1e-12 && reach < 1e15)) return std::nullopt;
    const Vec3d middle = bounds.center();
    const double height = now.empty() ? bounds.lower.y() : now.lower.y();
    return Studio{.middle = Vec3d(middle.x(), height, middle.z()), .reach = reach};
}

}  // namespace tessera
