#include "server/import/reader/CameraStand.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// The front screen of the walls that Tessera ships, in metres: what a camera's field of view is fitted to.
constexpr double kWindowHeight = 1.8, kWindowCenterY = 1.5, kEyeDistance = 2.4;

}  // namespace

/// At one depth d, the wall's window shall cover exactly what the file's camera shows there: scale = 2 d tan(fov / 2) /
/// window height, and the eye stands 2.4 m × scale before that window. For a field of 41° that is the file's own eye,
/// whatever d is. A narrower one brings the eye nearer, so d is where the scene begins: what lies beyond the window is
/// seen at a wider angle than in the file, and nothing is cut off. For a wider one d is the scene's middle.
std::optional<CameraStand> standOf(const Affine3d& world_T_camera, const Box& bounds, double perDistance,
                                   double height) {
    const double nodeScale = std::cbrt(std::abs(world_T_camera.linear().determinant()));
    if (!(nodeScale > 1e-12)) return std::nullopt;
    const Vec3d forward = -world_T_camera.linear().col(2).normalized();
    double distance = bounds.empty() ? 0.0 : (bounds.center() - world_T_camera.translation()).dot(forward);
    if (perDistance > 0) {
        if (distance > 0.0 && perDistance < kWindowHeight / kEyeDistance) {
            const double reach = 0.5 * bounds.size().dot(forward.cwiseAbs());  // of the box along the line of sight
            distance = std::max(distance - reach, 0.2 * distance);
        }
        // A camera that looks away from the middle: its own window, one metre high.
        if (!(distance > 1e-9)) distance = kWindowHeight / perDistance;
        height = perDistance * distance;
    } else {
        distance = std::max(distance, 0.0);
    }
    const double worldScale = height / kWindowHeight;
    if (!(worldScale > 1e-9 && worldScale < 1e12)) return std::nullopt;
    return CameraStand{(Vec3d(0.0, 0.0, -distance) - Vec3d(0.0, kWindowCenterY * worldScale, 0.0)) / nodeScale,
                       worldScale};
}

}  // namespace tessera
