/// What does a ray meet in a scene? OpenSG's IntersectAction, for whoever has an aspect of its own.
///
///     IntersectAction action;
///     application->onChanges([&](const ChangeList& list, Sequence) { action.follow(application->scene(), list); });
///     const auto hit = action.nearest(application->scene(), {.origin = eye, .direction = along});
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/math/Ray.h"
#include "common/math/Types.h"
#include "common/scene/Aspect.h"

namespace tessera {

struct Intersection {
    double t = 0;                 ///< in lengths of the ray's direction
    ObjectId node;                ///< that bears the drawable
    std::uint32_t face = 0;       ///< triangle index in the drawable; of points, 8 for each (common/geometry/Points.h)
    Vec3d point = Vec3d::Zero();  ///< world
    Vec3d normal =
        Vec3d::Zero();  ///< world, of length 1, as the face's corners turn there; zero of a face without area
    Vec3d weights = Vec3d::Zero();  ///< barycentric: of the face's corners; they sum up to 1
    std::optional<Vec2d> texcoord;  ///< of the first set, where the drawable has one
};

/// Rays against all triangles and points that are shown: a tree over what is placed, and one over each mesh
/// (RayTree.h), which all that show the mesh share and the first ray that comes near makes. It follows the scene list
/// by list: what that costs follows what the list changed, and O(log n) of the rest. Lines are not met; nor is what a
/// scale flattens, and what is absent or malformed. One thread at a time.
class IntersectAction {
public:
    IntersectAction();
    ~IntersectAction();
    IntersectAction(IntersectAction&&) noexcept;
    IntersectAction& operator=(IntersectAction&&) noexcept;

    /// After every list that was applied to the aspect; before the first, and after what is no list (another scene),
    /// `lookAnew`.
    void follow(const Aspect& aspect, const ChangeList& list);
    void lookAnew(const Aspect& aspect);

    static constexpr double kForever = std::numeric_limits<double>::infinity();
    /// Among those with 0 <= t <= maxT. Of equal t the lowest node, then face. kUsage: a ray that is not finite, or has
    /// no direction; a maxT that is no number or below 0. `aspect` is the one that was followed, as it was then.
    [[nodiscard]] Expected<std::optional<Intersection>> nearest(const Aspect& aspect, const Ray& ray,
                                                                double maxT = kForever);
    [[nodiscard]] Expected<bool> any(const Aspect& aspect, const Ray& ray, double maxT = kForever);
    /// By t, then node, then face; the nearest `most` where there are more.
    [[nodiscard]] Expected<std::vector<Intersection>> all(const Aspect& aspect, const Ray& ray, double maxT = kForever,
                                                          std::size_t most = std::numeric_limits<std::size_t>::max());

    struct Work {
        std::size_t nodesLookedAt = 0;  ///< by `follow` and `lookAnew`
        std::size_t treesMade = 0;      ///< of meshes, by rays
    };
    /// Since the beginning.
    [[nodiscard]] const Work& work() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
