#include "client/render/ShadowCasters.h"

#include <algorithm>
#include <cmath>

#include "client/render/SceneItems.h"

namespace tessera {
namespace {

/// A light's frame: it looks along -Z.
Mat3d lookingAlong(const Vec3d& direction) {
    const Vec3d z = -direction.normalized();
    const Vec3d up = std::abs(z.y()) < 0.9 ? Vec3d::UnitY() : Vec3d::UnitX();
    Mat3d light_R_world;
    light_R_world.row(0) = up.cross(z).normalized();
    light_R_world.row(1) = z.cross(light_R_world.row(0).transpose());
    light_R_world.row(2) = z;
    return light_R_world;
}

/// The next of a quarter octave's steps.
double roundedUp(double size) {
    return std::exp2(std::ceil(4 * std::log2(std::max(size, 1e-9))) / 4);
}

ScreenCamera sunCamera(const LightItem& light, const Box& scene) {
    const Mat3d light_R_world = lookingAlong(light.direction);
    const Vec3d half = 0.5 * (light_R_world.cwiseAbs() * scene.size());
    Vec3d center = light_R_world * scene.center();
    // One size both ways; the middle on its map's pixels, a few of which stay free around.
    const double side = roundedUp(2 * std::max(half.x(), half.y()) * 1.02), step = side / 64;
    center.x() = step * std::floor(center.x() / step + 0.5);
    center.y() = step * std::floor(center.y() / step + 0.5);
    const double reach = 0.5 * side + step, depth = roundedUp(half.z() * 1.05 + 1e-3 * side);
    ScreenCamera camera{.eyeWorld = Vec3d::Zero(), .eye_T_world = Affine3d::Identity(), .clip_T_eye = Mat4d::Identity(),
                        .pixels = {.width = kSunMapPx, .height = kSunMapPx}};
    camera.eye_T_world.linear() = light_R_world;
    camera.eye_T_world.translation() = -center - Vec3d(0, 0, depth);
    camera.eyeWorld = light_R_world.transpose() * (center + Vec3d(0, 0, depth));
    camera.clip_T_eye(0, 0) = camera.clip_T_eye(1, 1) = 1 / reach;
    camera.clip_T_eye(2, 2) = -1 / depth;
    camera.clip_T_eye(2, 3) = -1;
    return camera;
}

ScreenCamera spotCamera(const LightItem& light, const Box& scene) {
    constexpr double kWidest = 80 * M_PI / 180;
    ScreenCamera camera{.eyeWorld = light.position, .eye_T_world = Affine3d::Identity(), .clip_T_eye = Mat4d::Zero(),
                        .pixels = {.width = kSpotMapPx, .height = kSpotMapPx}};
    camera.eye_T_world.linear() = lookingAlong(light.direction);
    camera.eye_T_world.translation() = -(camera.eye_T_world.linear() * light.position);
    const Vec3d farthest = (scene.upper - light.position).cwiseAbs().cwiseMax((scene.lower - light.position).cwiseAbs());
    const double far = light.range > 0 ? std::min<double>(light.range, roundedUp(farthest.norm())) : roundedUp(farthest.norm());
    const double near = 1e-3 * far;
    const double slope = 1 / std::tan(std::clamp<double>(light.outerAngle * 1.02, 0.01, kWidest));
    camera.clip_T_eye(0, 0) = camera.clip_T_eye(1, 1) = slope;
    camera.clip_T_eye(2, 2) = -(far + near) / (far - near);
    camera.clip_T_eye(2, 3) = -2 * far * near / (far - near);
    camera.clip_T_eye(3, 2) = -1;
    return camera;
}

}  // namespace

ScreenCamera shadowCamera(const LightItem& light, const Box& scene) {
    return light.kind == LightItem::Kind::kSpot ? spotCamera(light, scene) : sunCamera(light, scene);
}

std::shared_ptr<const ShadowCasters> RenderScene::Impl::shadowCasters() const {
    if (castersOf_ == version) return casters_;
    castersOf_ = version;
    casters_.reset();
    const Box bounds = tree.bounds();
    if (bounds.empty()) return casters_;
    auto casters = std::make_shared<ShadowCasters>();
    std::vector<std::uint32_t> found;
    for (const LightItem& light : lights) {
        if (!light.shadows) continue;
        ShadowView& view = casters->views.emplace_back(ShadowView{shadowCamera(light, bounds), {}});
        found.clear();
        collectInFrustum(*this, tileFrustum(view.camera, {.x = 0, .y = 0, .width = view.camera.pixels.width, .height = view.camera.pixels.height}),
                         found);
        for (const std::uint32_t i : found)
            if (!items[i].transparent && items[i].lineWidth == 0) view.items.push_back(drawItem(i));
    }
    if (!casters->views.empty()) casters_ = std::move(casters);
    return casters_;
}

DrawItem RenderScene::Impl::drawItem(std::uint32_t index) const {
    const SceneItem& item = items[index];
    return {.node = item.node,
            .geometry = item.geometry,
            .material = item.material,
            .world_T_item = places[item.place].world_T_node,
            .mirrored = item.mirrored,
            .lineWidth = item.lineWidth};
}

}  // namespace tessera
