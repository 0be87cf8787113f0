#include "client/render/scene/StudioLook.h"

namespace tessera {
namespace {

LightItem directional(const Vec3d& travels, const Vec3f& radiance) {
    LightItem light;
    light.kind = LightItem::Kind::kDirectional;
    light.direction = travels.normalized();
    light.radiance = radiance;
    return light;
}

}  // namespace

std::vector<LightItem> defaultLights() {
    // A key from the upper left in front (a default view looks along -Z), a weak cool fill from the right, a rim from
    // behind.
    return {directional({0.5, -0.8, -0.6}, {0.66f, 0.63f, 0.58f}),
            directional({-0.8, -0.15, -0.5}, {0.07f, 0.09f, 0.12f}),
            directional({0.1, -0.4, 0.9}, {0.15f, 0.15f, 0.15f})};
}

std::vector<LightItem> studioLights() {
    std::vector<LightItem> lights = {directional({0.55, -0.85, -0.35}, {0.90f, 0.87f, 0.81f}),
                                     directional({-0.85, -0.20, -0.5}, {0.09f, 0.11f, 0.14f}),
                                     directional({-0.2, -0.5, 0.85}, {0.25f, 0.26f, 0.28f})};
    lights.front().shadows = true;
    return lights;
}

Environment studioEnvironment() {
    Environment environment;
    environment.sky = {0.20f, 0.21f, 0.23f};
    environment.ground = {0.10f, 0.095f, 0.09f};
    environment.background = {0.085f, 0.09f, 0.10f};
    return environment;
}

Box studioFloor(const Studio& studio) {
    // So far reaches what a model of that size throws, and as much again: one map for all of it is coarse enough to be
    // soft.
    constexpr double kReaches = 3.5;
    const Vec3d around(kReaches * studio.reach, 0, kReaches * studio.reach);
    return {.lower = studio.middle - around, .upper = studio.middle + around};
}

}  // namespace tessera
