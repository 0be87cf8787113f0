// What lights see: the same on every tile, and the same as before as long as nothing of it is another.
#include <algorithm>
#include <random>
#include <tuple>

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
    const ObjectId walker = scene.transform({0, 0, 3});
    scene.node(scene.create(typeOf<Camera>()), scene.node(walker));
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
    // Somebody's camera moves, and what casts nothing.
    scene.place(walker, {3, 1, -5}, Quatd::Identity(), Vec3d::Ones());
    const ChangeList step = scene.apply();
    all.update(scene.aspect, &step);
    EXPECT_EQ(castersOf(action, 0)->views, first->views) << "nothing that casts a shadow has changed";
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

/// Whatever happens to a scene: what was kept of the views is what a fresh look finds.
TEST(ShadowCasters, AreThoseOfAFreshLookAfterAnyHistory) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
        const auto place = [&] { return Vec3d(between(-9, 9), between(-2, 2), between(-20, 2)); };
        TestScene scene;
        const ObjectId sun = scene.create(typeOf<DirectionalLight>());
        setField<&DirectionalLight::shadows>(scene.edit, sun, true);
        scene.node(sun);
        std::vector<ObjectId> shapes = {scene.geometry(makeBox({1, 1, 1})), scene.geometry(makeBox({2, 1, 1}), scene.material(1)),
                                        scene.geometry(makeBox({1, 3, 1}), scene.material(0.5f))};
        std::vector<ObjectId> transforms, nodes;
        const auto add = [&] {
            transforms.push_back(scene.transform(place()));
            const ObjectId above = scene.node(transforms.back());
            nodes.push_back(random() % 4 ? scene.node(shapes[random() % 3], above) : above);
        };
        for (int i = 0; i < 12; ++i) add();
        scene.apply();
        RenderScene all;
        all.update(scene.aspect, nullptr);
        RenderAction action(CullerKind::kFrustum);
        TestCamera camera(320, 200, 2, 2);
        for (int step = 0; step < 40; ++step) {
            const std::size_t one = random() % transforms.size();
            switch (random() % 5) {
                case 0: scene.place(transforms[one], place(), Quatd::Identity(), Vec3d::Constant(between(0.5, 2))); break;
                case 1: add(); break;
                case 2: setField<&Node::core>(scene.edit, nodes[one], shapes[random() % 3]); break;
                case 3: setField<&Geometry::material>(scene.edit, shapes[random() % 3], scene.material(random() % 2 ? 1.0f : 0.4f)); break;
                default: break;  // nothing at all
            }
            const ChangeList list = scene.apply();
            all.update(scene.aspect, &list);
            RenderScene fresh;
            fresh.update(scene.aspect, nullptr);
            const auto known = [&](const RenderScene& from) {
                std::vector<std::tuple<ObjectId, ObjectId, ObjectId, Vec3d>> items;
                const auto casters = action.run(from, camera.camera(), camera.tile(0, 0), nullptr).casters;
                for (const DrawItem& item : casters->views[0]->items)
                    items.emplace_back(item.node, item.geometry, item.material, item.world_T_item.translation());
                std::sort(items.begin(), items.end(), [](const auto& a, const auto& b) { return std::get<0>(a) < std::get<0>(b); });
                return items;
            };
            ASSERT_EQ(known(all), known(fresh)) << "step " << step
                << "; again: unit_render --gtest_filter=ShadowCasters.AreThoseOfAFreshLookAfterAnyHistory, seed " << seed;
        }
    }
}

}  // namespace
}  // namespace tessera
