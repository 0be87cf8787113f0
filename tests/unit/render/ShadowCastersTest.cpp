// What lights see: the same on every tile, and the same as before as long as nothing of it is another.
#include <algorithm>
#include <random>
#include <tuple>

#include "client/render/scene/ShadowCasters.h"
#include "common/cores/DirectionalLight.h"
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
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto vector = [&](double side) {
        return Vec3d(between(-side, side), between(-side, side), between(-side, side));
    };
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
    scene.put(box, {30, 0, -50});
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
    const auto castersOf = [&](RenderAction& by, int column) {
        return by.run(all, camera.camera(), camera.tile(column, 0), nullptr).casters;
    };
    const auto first = castersOf(action, 0);
    ASSERT_TRUE(first && first->views.size() == 1 && first->near && first->middle);
    EXPECT_TRUE(draws({.opaque = itemsOf(*first->views[0])}, node));
    EXPECT_TRUE(draws({.opaque = itemsOf(*first->views[0])}, behind))
        << "what stands behind the eye casts shadows, too";
    EXPECT_FALSE(draws({.opaque = itemsOf(*first->views[0])}, glass));
    EXPECT_EQ(castersOf(other, 1), first) << "another tile, another culler";
    // A head that moves a little.
    camera.user.position += Vec3d(0.02, 0.01, 0);
    EXPECT_EQ(castersOf(action, 0)->views, first->views);
    EXPECT_EQ(castersOf(action, 0)->near, first->near);
    EXPECT_EQ(castersOf(action, 0)->middle, first->middle);
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

TEST(ShadowCasters, WhatIsFarAwayIsNoneOfTheFinerOnes) {
    std::mt19937 random(5);
    const auto unit = [&] { return std::normal_distribution<double>()(random); };
    for (const double distance : {300.0, 2e3, 1e6, 1e12, 1e17}) {
        for (int round = 0; round < 20; ++round) {
            const Vec3d travels = Vec3d(unit(), unit(), unit()).normalized();
            const auto castersOf = [&](bool far) {
                TestScene scene;
                const ObjectId sun = scene.create(typeOf<DirectionalLight>());
                setField<&DirectionalLight::shadows>(scene.edit, sun, true);
                scene.node(sun,
                           scene.node(scene.transform(Vec3d::Zero(), Quatd::FromTwoVectors(-Vec3d::UnitZ(), travels))));
                const ObjectId box = scene.geometry(makeBox({1, 1, 1}));
                scene.put(box, {2, 0, -5});
                scene.put(box, {-9, 3, -20});
                // Before what is near, as the sun sees it: it shades that from there.
                if (far) scene.put(box, Vec3d(2, 0, -5) - distance * travels);
                scene.apply();
                RenderScene all;
                all.update(scene.aspect, nullptr);
                const PixelRect whole{.x = 0, .y = 0, .width = 320, .height = 200};
                return RenderAction(CullerKind::kFrustum)
                    .run(all, TestCamera(320, 200, 2, 2).camera(), whole, nullptr)
                    .casters;
            };
            const auto alone = castersOf(false), with = castersOf(true);
            ASSERT_TRUE(alone && with && !alone->middle);
            const ShadowView& finer = with->middle ? *with->middle : *with->views[0];
            EXPECT_TRUE(drawAlike(finer.camera, alone->views[0]->camera)) << distance << ", round " << round;
            // At 1e17 a double knows it to 16 units.
            if (distance < 1e15) {
                EXPECT_EQ(itemsOf(finer).size(), 3u) << distance << ", round " << round;
            }
        }
    }
}

TEST(ShadowCasters, WhatIsOfTheServerCastsNone) {
    TestScene scene;
    const ObjectId sun = scene.create(typeOf<DirectionalLight>());
    setField<&DirectionalLight::shadows>(scene.edit, sun, true);
    scene.node(sun);
    const ObjectId box = scene.geometry(makeBox({1, 1, 1}));
    const ObjectId bearer = scene.put(box, {0, 0, -5});
    const ObjectId handles = scene.node(scene.transform({0, 1, 0}), bearer);
    const ObjectId handle = scene.node(box, scene.node(scene.transform({0, 1, 0}), handles));
    const auto follow = [&](RenderScene& all) {
        const ChangeList list = scene.apply();
        all.update(scene.aspect, &list);
    };
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const auto casts = [&](ObjectId node, const RenderScene& by) {
        const PixelRect whole{.x = 0, .y = 0, .width = 320, .height = 200};
        const auto list =
            RenderAction(CullerKind::kFrustum).run(by, TestCamera(320, 200, 2, 2).camera(), whole, nullptr);
        return draws({.opaque = itemsOf(*list.casters->views[0])}, node);
    };
    EXPECT_TRUE(casts(bearer, all));
    EXPECT_TRUE(casts(handle, all));
    setField<&Node::ofServer>(scene.edit, handles, true);
    follow(all);
    EXPECT_TRUE(casts(bearer, all));
    EXPECT_FALSE(casts(handle, all)) << "below one of the server's own";
    RenderScene fresh;
    fresh.update(scene.aspect, nullptr);
    EXPECT_FALSE(casts(handle, fresh));
    setField<&Node::ofServer>(scene.edit, handles, false);
    follow(all);
    EXPECT_TRUE(casts(handle, all));
}

/// Whatever happens to a scene: what was kept of the views is what a fresh look finds.
TEST(ShadowCasters, AreThoseOfAFreshLookAfterAnyHistory) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        const auto between = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        const auto place = [&] { return Vec3d(between(-9, 9), between(-2, 2), between(-20, 2)); };
        TestScene scene;
        const ObjectId sun = scene.create(typeOf<DirectionalLight>());
        setField<&DirectionalLight::shadows>(scene.edit, sun, true);
        scene.node(sun);
        std::vector<ObjectId> shapes = {scene.geometry(makeBox({1, 1, 1})),
                                        scene.geometry(makeBox({2, 1, 1}), scene.material(1)),
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
                case 0:
                    scene.place(transforms[one], place(), Quatd::Identity(), Vec3d::Constant(between(0.5, 2)));
                    break;
                case 1:
                    add();
                    break;
                case 2:
                    setField<&Node::core>(scene.edit, nodes[one], shapes[random() % 3]);
                    break;
                case 3:
                    setField<&Geometry::material>(scene.edit, shapes[random() % 3],
                                                  scene.material(random() % 2 ? 1.0f : 0.4f));
                    break;
                default:
                    break;  // nothing at all
            }
            const ChangeList list = scene.apply();
            all.update(scene.aspect, &list);
            RenderScene fresh;
            fresh.update(scene.aspect, nullptr);
            const auto known = [&](const RenderScene& from) {
                std::vector<std::tuple<ObjectId, ObjectId, ObjectId, Vec3d>> items;
                const auto casters = action.run(from, camera.camera(), camera.tile(0, 0), nullptr).casters;
                for (const DrawItem& item : itemsOf(*casters->views[0]))
                    items.emplace_back(item.node, item.geometry, item.material, item.world_T_item.translation());
                std::sort(items.begin(), items.end(),
                          [](const auto& a, const auto& b) { return std::get<0>(a) < std::get<0>(b); });
                return items;
            };
            ASSERT_EQ(known(all), known(fresh))
                << "step " << step
                << "; again: unit_render --gtest_filter=ShadowCasters.AreThoseOfAFreshLookAfterAnyHistory, seed "
                << seed;
        }
    }
}

}  // namespace
}  // namespace tessera
