// What lights see: the same on every tile, and the same as before as long as nothing of it is another.
#include <random>

#include "client/render/ShadowCasters.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

Vec4d seenAt(const ScreenCamera& camera, const Vec3d& point) {
    const Vec3d eye = camera.eye_T_world * point;
    const Vec4d clip = camera.clip_T_eye * eye.homogeneous();
    return clip / clip.w();
}

TEST(ShadowCasters, TheSunSeesAllOfTheSceneAndASpotAllOfItsCone) {
    std::mt19937 random(1);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    const auto vector = [&](double side) { return Vec3d(between(-side, side), between(-side, side), between(-side, side)); };
    for (int round = 0; round < 500; ++round) {
        const double size = std::exp(between(-5, 8));
        const Vec3d middle = vector(3 * size), half = vector(size).cwiseAbs();
        Box scene;
        scene.lower = middle - half;
        scene.upper = middle + half;
        LightItem light;
        light.kind = LightItem::Kind::kDirectional;
        light.direction = vector(1).normalized();
        const ScreenCamera sun = shadowCamera(light, scene);
        light.kind = LightItem::Kind::kSpot;
        light.position = vector(2 * size);
        light.outerAngle = static_cast<float>(between(0.05, 1.35));
        light.range = round % 2 ? static_cast<float>(between(0.1, 3) * size) : 0;
        const ScreenCamera spot = shadowCamera(light, scene);
        for (int i = 0; i < 30; ++i) {
            const Vec3d point = middle + half.cwiseProduct(vector(1));
            EXPECT_LE(seenAt(sun, point).head<3>().cwiseAbs().maxCoeff(), 1 + 1e-9) << "round " << round;
            const Vec3d away = point - light.position;
            const double far = -(spot.eye_T_world * point).z();
            if (away.normalized().dot(light.direction) < std::cos(light.outerAngle)) continue;
            if ((light.range > 0 && away.norm() > light.range) || far < 2e-3 * away.norm()) continue;
            EXPECT_LE(seenAt(spot, point).head<2>().cwiseAbs().maxCoeff(), 1 + 1e-9) << "round " << round;
            EXPECT_LE(seenAt(spot, point).z(), 1 + 1e-9) << "round " << round;
        }
    }
}

TEST(ShadowCasters, AreOthersOnlyWhenTheSceneIsOrTheEyeGoesFar) {
    TestScene scene;
    const ObjectId sun = scene.create(typeOf<DirectionalLight>());
    setField<&DirectionalLight::shadows>(scene.edit, sun, true);
    scene.node(sun);
    const ObjectId box = scene.geometry(makeBox({1, 1, 1}));
    const ObjectId moved = scene.transform({0, 0, -5});
    const ObjectId node = scene.node(box, scene.node(moved));
    scene.put(box, {80, 0, -90});
    const ObjectId behind = scene.put(box, {0, 0, 6});
    const ObjectId glass = scene.put(scene.geometry(makeBox({1, 1, 1}), scene.material(0.5f)), {0, 1, -4});
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    RenderAction action(CullerKind::kMasked), other(CullerKind::kFrustum);
    TestCamera camera(320, 200, 2, 2);
    const auto castersOf = [&](RenderAction& by, int column) { return by.run(all, camera.camera(), camera.tile(column, 0), nullptr).casters; };
    const auto first = castersOf(action, 0);
    ASSERT_TRUE(first && first->views.size() == 1 && first->near);
    EXPECT_TRUE(draws({.opaque = first->views[0]->items}, node));
    EXPECT_TRUE(draws({.opaque = first->views[0]->items}, behind)) << "what stands behind the eye casts shadows, too";
    EXPECT_FALSE(draws({.opaque = first->views[0]->items}, glass));
    EXPECT_EQ(castersOf(other, 1), first) << "another tile, another culler";
    // A head that moves a little.
    camera.user.position += Vec3d(0.02, 0.01, 0);
    EXPECT_EQ(castersOf(action, 0)->views, first->views);
    EXPECT_EQ(castersOf(action, 0)->near, first->near);
    // The whole wall goes far: the finer view goes along, the other one stays.
    camera.view.position += Vec3d(30, 0, 0);
    const auto far = castersOf(action, 0);
    EXPECT_EQ(far->views, first->views);
    EXPECT_NE(far->near, first->near);
    // Something moves.
    scene.place(moved, {0, 1, -5}, Quatd::Identity(), Vec3d::Ones());
    const ChangeList list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_NE(castersOf(action, 0)->views[0], first->views[0]);
    // Nobody asks for shadows any more.
    setField<&DirectionalLight::shadows>(scene.edit, sun, false);
    const ChangeList dark = scene.apply();
    all.update(scene.aspect, &dark);
    EXPECT_EQ(castersOf(action, 0), nullptr);
}

}  // namespace
}  // namespace tessera
