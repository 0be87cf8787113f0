#include "client/render/scene/ShadowCasters.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "client/render/scene/SceneItems.h"
#include "client/render/scene/StudioLook.h"
#include "common/wall/Detail.h"

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

/// Of two looks of one sun: enough to be worth a map, across or in depth.
bool isFiner(const ScreenCamera& a, const ScreenCamera& than) {
    constexpr double kEnough = 1 / 0.7;
    return a.clip_T_eye(0, 0) > kEnough * than.clip_T_eye(0, 0) || a.clip_T_eye(2, 2) < kEnough * than.clip_T_eye(2, 2);
}

/// The next of a quarter octave's steps.
double roundedUp(double size) {
    return std::exp2(std::ceil(4 * std::log2(std::max(size, 1e-9))) / 4);
}

ScreenCamera sunCamera(const LightItem& light, const Box& shaded) {
    const Mat3d light_R_world = lookingAlong(light.direction);
    const Vec3d half = 0.5 * (light_R_world.cwiseAbs() * shaded.size());
    Vec3d center = light_R_world * shaded.center();
    // One size both ways; the middle on its map's pixels, a few of which stay free around.
    const double side = roundedUp(2 * std::max(half.x(), half.y()) * 1.02), step = side / 64;
    center.x() = step * std::floor(center.x() / step + 0.5);
    center.y() = step * std::floor(center.y() / step + 0.5);
    // Along the light, too: what moves at the edge of a scene would else move the view.
    center.z() = step * std::floor(center.z() / step + 0.5);
    const double reach = 0.5 * side + step, depth = roundedUp(half.z() * 1.05 + step);
    ScreenCamera camera{.eyeWorld = Vec3d::Zero(),
                        .eye_T_world = Affine3d::Identity(),
                        .clip_T_eye = Mat4d::Identity(),
                        .pixels = {.width = kSunMapPx, .height = kSunMapPx}};
    camera.eye_T_world.linear() = light_R_world;
    camera.eye_T_world.translation() = -center - Vec3d(0, 0, depth);
    camera.eyeWorld = light_R_world.transpose() * (center + Vec3d(0, 0, depth));
    camera.clip_T_eye(0, 0) = camera.clip_T_eye(1, 1) = 1 / reach;
    camera.clip_T_eye(2, 2) = -1 / depth;
    camera.clip_T_eye(2, 3) = -1;
    return camera;
}

ScreenCamera lampCamera(const LightItem& light, const Vec3d& direction, double slope, const Box& shaded) {
    ScreenCamera camera{.eyeWorld = light.position,
                        .eye_T_world = Affine3d::Identity(),
                        .clip_T_eye = Mat4d::Zero(),
                        .pixels = {.width = kSpotMapPx, .height = kSpotMapPx}};
    camera.eye_T_world.linear() = lookingAlong(direction);
    camera.eye_T_world.translation() = -(camera.eye_T_world.linear() * light.position);
    const Vec3d farthest =
        (shaded.upper - light.position).cwiseAbs().cwiseMax((shaded.lower - light.position).cwiseAbs());
    const double reach = roundedUp(farthest.norm());
    // Depths are finest near the light whatever their end is (a reversed float): one that does not follow the scene.
    const double near = 1e-3 * (light.range > 0 ? std::min<double>(light.range, reach) : reach);
    const double far = light.range > 0 ? std::max<double>(light.range, 2 * near) : 1e5 * near;
    camera.clip_T_eye(0, 0) = camera.clip_T_eye(1, 1) = slope;
    camera.clip_T_eye(2, 2) = -(far + near) / (far - near);
    camera.clip_T_eye(2, 3) = -2 * far * near / (far - near);
    camera.clip_T_eye(3, 2) = -1;
    return camera;
}

}  // namespace

ScreenCamera shadowCamera(const LightItem& light, const Box& shaded, std::size_t side) {
    if (light.kind == LightItem::Kind::kDirectional) return sunCamera(light, shaded);
    if (light.kind == LightItem::Kind::kSpot) {
        constexpr double kWidest = 80 * M_PI / 180;
        return lampCamera(light, light.direction,
                          1 / std::tan(std::clamp<double>(light.outerAngle * 1.02, 0.01, kWidest)), shaded);
    }
    // Beyond the edges of a cube as far as surfaces look for shadows, and the rim that is not looked into.
    constexpr double kSlope = 1 - 32.0 / kSpotMapPx;
    const double sign = side % 2 == 0 ? 1 : -1;
    return lampCamera(light, sign * Vec3d::Unit(static_cast<Eigen::Index>(side / 2)), kSlope, shaded);
}

Box shadedAround(const Vec3d& place, double metres, double unitsPerMetre) {
    const double step = roundedUp(0.2 * metres * unitsPerMetre);
    const Vec3d center = step * (place / step + Vec3d::Constant(0.5)).array().floor().matrix();
    return {.lower = center - Vec3d::Constant(5.5 * step), .upper = center + Vec3d::Constant(5.5 * step)};
}

std::optional<ScreenCamera> nearShadowCamera(const ScreenCamera& sun, const ScreenCamera& screen) {
    // A ball around the eye and the corners of what it sees at that distance: of one size, however the eye turns.
    const Affine3d world_T_eye = screen.eye_T_world.inverse();
    const Mat4d eye_T_clip = screen.clip_T_eye.inverse();
    std::array<Vec3d, 5> corners{world_T_eye.translation()};
    Vec3d center = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
        const Vec4d seen = eye_T_clip * Vec4d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, 0, 1);
        const Vec3d towards = seen.head<3>() / seen.w();
        corners[i + 1] = world_T_eye * Vec3d(towards * (kNearMetres / -towards.z()));
        center += 0.25 * corners[i + 1];
    }
    center = 0.45 * corners[0] + 0.55 * center;
    double radius = 0;
    for (const Vec3d& corner : corners) radius = std::max(radius, (corner - center).norm());
    const double side = roundedUp(2 * radius * 1.0001), step = side / 16, reach = 0.5 * side + 0.75 * step;
    if (!(reach * sun.clip_T_eye(0, 0) < 0.7)) return std::nullopt;
    ScreenCamera camera = sun;
    Vec3d at = sun.eye_T_world.linear() * center;
    for (int i = 0; i < 2; ++i) camera.eye_T_world.translation()[i] = -step * std::floor(at[i] / step + 0.5);
    camera.clip_T_eye(0, 0) = camera.clip_T_eye(1, 1) = 1 / reach;
    return camera;
}

std::vector<std::shared_ptr<const ShadowView>> ShadowCasters::all() const {
    std::vector<std::shared_ptr<const ShadowView>> all = views;
    for (const auto& finer : {middle, near})
        if (finer) all.push_back(finer);
    return all;
}

/// Around what the items' boxes have within this one.
Box RenderScene::Impl::boundsWithin(const Box& part) const {
    Box bounds;
    const auto extend = [&](const Box& box) {
        if (box.overlaps(part))
            bounds.extend(Box{.lower = box.lower.cwiseMax(part.lower), .upper = box.upper.cwiseMin(part.upper)});
    };
    std::vector<std::uint32_t> open;
    if (!tree.empty()) open.push_back(BoxTree::kRoot);
    while (!open.empty()) {
        const BoxTree::Node& node = tree.node(open.back());
        open.pop_back();
        if (!node.box.overlaps(part)) continue;
        if (part.contains(node.box.lower) && part.contains(node.box.upper))
            bounds.extend(node.box);
        else if (!node.leaf)
            open.insert(open.end(), node.below.begin(), node.below.begin() + 2);
        else
            for (const std::uint32_t item : node.items()) extend(boxes[item]);
    }
    return bounds;
}

std::shared_ptr<const ShadowCasters> RenderScene::Impl::shadowCasters(const ScreenCamera& screen) const {
    shadows.beginLook();
    const bool any = detailStep(screen.detail).shadows && std::ranges::any_of(lights, &LightItem::shadows);
    if (!any) return casters_ = nullptr;
    const double unitsPerMetre = 1 / std::cbrt(std::abs(screen.eye_T_world.linear().determinant()));
    const Box shaded = boundsWithin(shadedAround(screen.headWorld, kFarMetres, unitsPerMetre));
    if (shaded.empty()) return casters_ = nullptr;
    const Box middle = boundsWithin(shadedAround(screen.headWorld, kMiddleMetres, unitsPerMetre));
    auto now = std::make_shared<ShadowCasters>();
    const unsigned user = byUser_.empty() && billboards_.empty() ? 0 : screen.user % kLevelUsers + 1;
    for (const LightItem& light : lights) {
        if (!light.shadows) continue;
        const bool sun = light.kind == LightItem::Kind::kDirectional;
        // What a spot's depths begin with says what is about it.
        const Box about = sun ? shaded : boundsWithin(shadedAround(light.position, kMiddleMetres, unitsPerMetre));
        Box around = about.empty() ? shaded : about;
        if (sun && studio) {
            const Box floor = studioFloor(*studio), near = shadedAround(screen.headWorld, kFarMetres, unitsPerMetre);
            const Box both{.lower = floor.lower.cwiseMax(near.lower), .upper = floor.upper.cwiseMin(near.upper)};
            if ((both.lower.array() <= both.upper.array()).all()) around.extend(both);
        }
        now->firstOf.push_back(now->views.size());
        if (light.kind == LightItem::Kind::kPoint) {
            for (std::size_t side = 0; side < kCubeViews; ++side)
                now->views.push_back(shadows.view(*this, shadowCamera(light, around, side), false, user));
            continue;
        }
        const ScreenCamera camera = shadowCamera(light, around);
        if (sun) {
            now->sun = now->views.size();
            const ScreenCamera aroundHead = middle.empty() ? camera : shadowCamera(light, middle);
            const ScreenCamera& finer = isFiner(aroundHead, camera) ? aroundHead : camera;
            if (&finer != &camera) now->middle = shadows.view(*this, finer, true, user);
            if (const auto near = nearShadowCamera(finer, screen)) now->near = shadows.view(*this, *near, true, user);
        }
        now->views.push_back(shadows.view(*this, camera, sun, user));
    }
    if (!casters_ || casters_->views != now->views || casters_->near != now->near || casters_->middle != now->middle)
        casters_ = std::move(now);
    return casters_;
}

void RenderScene::Impl::describe(std::uint32_t index, DrawItem& drawn) const {
    const SceneItem& item = items[index];
    drawn.node = item.node;
    drawn.geometry = item.geometry;
    drawn.material = item.material;
    drawn.mesh = item.mesh->drawn;
    drawn.look = item.look;
    drawn.world_T_item = item.world_T_item;
    drawn.mirrored = item.mirrored;
    drawn.asWhole = item.asWhole;
    drawn.kind = item.kind;
    drawn.lineWidth = std::min(item.lineWidth, item.widestLinePx);
    drawn.widestLinePx = item.widestLinePx;
    drawn.pointRadius = item.mesh->shownRadius;
    drawn.fill = item.fill;
    drawn.scopes = item.scopes;
    drawn.box = boxes[index];
}

void RenderScene::Impl::askFor(std::uint32_t index) const {
    constexpr std::size_t kLine = alignof(SceneItem);
    const auto* item = reinterpret_cast<const char*>(&items[index]);
    for (std::size_t line = 0; line < 4; ++line) __builtin_prefetch(item + line * kLine);
    __builtin_prefetch(&boxes[index]);
}

}  // namespace tessera
