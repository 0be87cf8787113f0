#include "server/import/reader/ModelView.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/import/reader/CameraStand.h"

namespace tessera {
bool addModelCamera(const ModelCamera& camera, const Affine3d& world_T_node, const Box& bounds, PlainScene& scene,
                    proto::scene::Node& node) {
    const bool perspective = camera.fieldOfView.has_value();
    const double fov = camera.fieldOfView.value_or(0);
    if (perspective && !(fov > 0.0 && fov < EIGEN_PI)) return false;
    const std::optional<CameraStand> stand =
        standOf(world_T_node, bounds, perspective ? 2.0 * std::tan(fov / 2.0) : 0.0, camera.height);
    if (!perspective) scene.note("an orthographic camera is shown in perspective");
    if (!stand) return false;
    proto::scene::Node* wall = node.add_node();
    wall->set_name(camera.name);
    setTransform(*wall->mutable_transform(), stand->offset, Quatd::Identity(), Vec3d::Ones());
    wall->mutable_camera()->set_world_units_per_metre(stand->unitsPerMetre);
    return true;
}

void ModelLight::add(double intensity, const Vec3d& falloff, const Vec3d& at, const Box& bounds) {
    // Within the model it is as if the light were half way out.
    const double reach = bounds.empty() ? 0 : 0.25 * bounds.size().norm();
    const Vec3d middle = bounds.empty() ? Vec3d(Vec3d::Zero()) : bounds.center();
    const double distance = std::max({(at - middle).norm(), reach, 1e-9});
    illuminance_ += intensity / falloff.dot(Vec3d(1, distance, distance * distance));
}

void ModelLight::addExposure(PlainScene& scene, double dazzling) const {
    if (illuminance_ <= dazzling) return;
    proto::scene::Node& node = *scene.file.add_node();
    node.set_name("exposure");
    node.mutable_environment()->set_metered(true);
    scene.note(fmt::format("its lights are as strong as real ones, {:.0f} lx in the middle of it, where 1 makes white",
                           illuminance_));
}

}  // namespace tessera
