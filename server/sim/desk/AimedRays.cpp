#include "server/sim/desk/AimedRays.h"

#include <fmt/format.h>

#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {

Expected<Ray> rayThrough(const DeskSurroundings& around, double xPx, double yPx) {
    const Expected<View> view = around.view.view(around.simulation.scene());
    if (!view) return tl::unexpected(view.error());
    return pickRay(around.wall, *view, xPx, yPx);
}

Expected<Ray> rayAlong(const DeskSurroundings& around, const std::string& wand) {
    const notice::Poses poses = around.poses ? around.poses() : notice::Poses();
    std::string names;
    for (const WandState& known : poses.wands) {
        if (known.name == wand) {
            if (known.tracked) return Ray{known.worldPosition, known.worldOrientation * -Vec3d::UnitZ()};
            return fail(ErrorCode::kRefused,
                        fmt::format("wand {} is not tracked at present; see tessera-ctl trackers", wand));
        }
        names += (names.empty() ? "" : ", ") + known.name;
    }
    return fail(ErrorCode::kNotFound,
                fmt::format("no wand is called '{}'; the wall has: {}", wand, names.empty() ? "none" : names));
}

/// The same half line, whose direction has a length that can be told: squares of what is very long or short cannot.
Expected<Ray> rayGiven(const Ray& ray) {
    constexpr double kShort = 1e-100, kLong = 1e100;
    const double longest = ray.direction.cwiseAbs().maxCoeff();
    if (!(longest > 0)) return fail(ErrorCode::kBadInput, "a ray needs a direction: its length is zero");
    if (longest >= kShort && longest <= kLong) return ray;
    return Ray{ray.origin, ray.direction / longest};
}

}  // namespace

Expected<Ray> rayOf(const DeskSurroundings& around, const Aim& aim) {
    if (aim.ray) return rayGiven(*aim.ray);
    return aim.wand.empty() ? rayThrough(around, aim.xPx, aim.yPx) : rayAlong(around, aim.wand);
}

}  // namespace tessera
