/// Who holds which handle, and what that asks of the scene.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Ray.h"
#include "common/scene/Aspect.h"
#include "server/manipulators/Drag.h"
#include "server/manipulators/ManipulatorDisplay.h"

namespace tessera {

/// One handle each. Who holds it edits the manipulator's target as by hand: the edits of one grab are one gesture, and
/// what stands in the way of others' edits stands in its way too. A handle is found through whatever lies in front of
/// it.
///
/// Not thread-safe. Whoever goes on after an end of the server holds nothing: `corrections` says so to the scene.
class ManipulatorDrags {
public:
    /// Motions and animations that play and write what the list writes.
    using Drivers = std::function<std::vector<ObjectId>(const ChangeList&)>;

    struct Held {
        bool any = false;  ///< a handle is there
        ObjectId node;     ///< the manipulator's
        std::int64_t handle = 0;
        Vec3d point = Vec3d::Zero();  ///< world
        double t = 0;                 ///< world units from where the ray begins
    };
    /// Where users' heads are, as many as see handles of their own size (sightsOf). A ray is of whoever it begins
    /// nearest to: what it meets is what they see.
    void headsAre(std::vector<Vec3d> world) { heads_ = std::move(world); }

    /// Takes hold of the nearest handle on the ray; lets go of what was held before. No handle there: `any` is false.
    /// kRefused: somebody else holds this manipulator, or another one of the same target; something drives the target.
    /// kBadInput: no ray.
    [[nodiscard]] Expected<Held> grab(const Aspect& scene, ManipulatorDisplay& display, std::uint64_t holder,
                                      const Ray& ray, const Drivers& drivers);

    /// What the ray makes of it; empty: nothing, all stays. kRefused: nothing is held (any more), or something drives
    /// the target; then it is let go.
    [[nodiscard]] Expected<ChangeList> drag(const Aspect& scene, std::uint64_t holder, const Ray& ray,
                                            const Drivers& drivers);

    /// Harmless where nothing is held.
    void release(std::uint64_t holder) { held_.erase(holder); }
    [[nodiscard]] bool holds(std::uint64_t holder) const { return held_.contains(holder); }
    /// Of the grab that the holder has: another one for each, never 0.
    [[nodiscard]] std::uint64_t gesture(std::uint64_t holder) const;

    /// Lets go of what is not there any more, and says what `Manipulator::held` should be where it is not. Nobody's
    /// step.
    [[nodiscard]] ChangeList corrections(const Aspect& scene, const ManipulatorDisplay& display);

private:
    struct Hold {
        ObjectId node, core;  ///< the manipulator's
        std::int64_t handle = 0;
        Grab grab;
        ObjectId light;  ///< of spot lights: its core
        std::uint64_t gesture = 0;
    };
    [[nodiscard]] std::size_t userOf(const Ray& ray) const;
    [[nodiscard]] static bool stands(const Aspect& scene, const Hold& hold);

    std::map<std::uint64_t, Hold> held_;  ///< by holder
    std::vector<Vec3d> heads_;
    std::uint64_t grabs_ = 0;
};

}  // namespace tessera
