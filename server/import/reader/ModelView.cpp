#include "server/import/reader/ModelView.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// The front screen of the walls that Tessera ships, in metres: what a camera's field of view is fitted to.
constexpr double kWindowHeight = 1.8, kWindowCenterY = 1.5, kEyeDistance = 2.4;

/// Times the light that makes a white surface white. Files that reckon without an exposure have less; a dim room, in
/// lux, has more.
constexpr double kDazzling = 20;

}  // namespace

bool addModelCamera(const ModelCamera& camera, const Affine3d& world_T_node, const Box& bounds, PlainScene& scene,
                    proto::scene::Node& node) {
    const double nodeScale = std::cbrt(std::abs(world_T_node.linear().determinant()));
    if (!(nodeScale > 1e-12)) return false;
    const Vec3d forward = -world_T_node.linear().col(2).normalized();
    const Vec3d eye = world_T_node.translation();
    double distance = bounds.empty() ? 0.0 : (bounds.center() - eye).dot(forward);
    double height = camera.height;
    if (camera.fieldOfView) {
        const double fov = *camera.fieldOfView;
        if (!(fov > 0.0 && fov < EIGEN_PI)) return false;
        const double perDistance = 2.0 * std::tan(fov / 2.0);
        if (distance > 0.0 && perDistance < kWindowHeight / kEyeDistance) {
            const double reach = 0.5 * bounds.size().dot(forward.cwiseAbs());  // of the box along the line of sight
            distance = std::max(distance - reach, 0.2 * distance);
        }
        // A camera that looks away from the middle: its own window, one metre high.
        if (!(distance > 1e-9)) distance = kWindowHeight / perDistance;
        height = perDistance * distance;
    } else {
        distance = std::max(distance, 0.0);
        scene.note("an orthographic camera is shown in perspective");
    }
    const double worldScale = height / kWindowHeight;
    if (!(worldScale > 1e-9 && worldScale < 1e12)) return false;
    proto::scene::Node* wall = node.add_node();
    wall->set_name(camera.name);
    const Vec3d windowCenter = Vec3d(0.0, 0.0, -distance);
    const Vec3d offset = (windowCenter - Vec3d(0.0, kWindowCenterY * worldScale, 0.0)) / nodeScale;
    setTransform(*wall->mutable_transform(), offset, Quatd::Identity(), Vec3d::Ones());
    wall->mutable_camera()->set_world_units_per_metre(worldScale);
    return true;
}

void ModelLight::add(double intensity, bool directional, const Vec3d& at, const Box& bounds) {
    // Within the model it is as if the light were half way out.
    const double reach = bounds.empty() ? 0 : 0.25 * bounds.size().norm();
    const Vec3d middle = bounds.empty() ? Vec3d(Vec3d::Zero()) : bounds.center();
    const double distance = std::max({(at - middle).norm(), reach, 1e-9});
    illuminance_ += intensity / (directional ? 1 : distance * distance);
}

void ModelLight::addExposure(PlainScene& scene) const {
    if (illuminance_ <= kDazzling) return;
    proto::scene::Node& node = *scene.file.add_node();
    node.set_name("exposure");
    node.mutable_environment()->set_metered(true);
    scene.note(fmt::format("its lights are as strong as real ones, {:.0f} lx in the middle of it, where 1 makes white",
                           illuminance_));
}

}  // namespace tessera
