/// Levels of detail, chosen by where a user stands.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// Shows one child to each user: the finest first, the next one beyond each of the `ranges`, and the last beyond the
/// last range; so there is one range less than there are children. An empty group as the last child lets all vanish.
/// Both eyes of a user, and all screens that are drawn for the same user, show the same child. Collisions and picks
/// look at the first child, wherever users are. `Node::levels` has what is chosen.
struct DistanceLOD {
    static constexpr ObjectType kType{22};
    static constexpr std::int64_t kDistance = 0, kSize = 1;
    static constexpr std::size_t kMostLevels = 256;
    /// double per range. kDistance: from the user's head to `center`, in world units, each greater than the one before.
    /// kSize: diameters on the screen in pixels, of the sphere with `radius` around `center`, each less than the one
    /// before.
    Blob ranges;
    std::int64_t measure = kDistance;
    Vec3d center = Vec3d::Zero();  ///< in the node's coordinates
    double radius = 1;             ///< in the node's coordinates; of kSize
    /// A level is left only when the range is passed by this share of it: who stands at a range does not see it
    /// flicker.
    double hysteresis = 0.1;
};
template <>
inline constexpr auto kSaid<DistanceLOD> = []<typename T>(Describing<T>) {
    return describe(
        "DistanceLOD", field<&T::ranges>(1, "ranges").doublesEach(1).affects(Effect::kVisibility | Effect::kView),
        field<&T::measure>(2, "measure")
            .oneOf({{DistanceLOD::kDistance, "distance"}, {DistanceLOD::kSize, "size"}})
            .affects(Effect::kVisibility | Effect::kView),
        field<&T::center>(3, "center")
            .unit(Unit::kWorld)
            .between(-1e30, 1e30)
            .affects(Effect::kVisibility | Effect::kView),
        field<&T::radius>(4, "radius").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kVisibility | Effect::kView),
        field<&T::hysteresis>(5, "hysteresis").between(0, 0.9).affects(Effect::kVisibility | Effect::kView));
};

}  // namespace tessera
