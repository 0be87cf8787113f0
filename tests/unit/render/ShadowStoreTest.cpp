// What is kept of lights' views from frame to frame: who moves, who rests, whom a change reaches.
#include <algorithm>
#include <memory>
#include <set>

#include "client/render/scene/SceneItems.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/PointLight.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// Boxes on a floor under a sun that shines straight down.
struct SunnyStage {
    TestScene scene;
    RenderScene all;
    ObjectId sun, plain, holes, shape, cut, left, right;
    TestCamera camera{320, 200, 2, 2};

    SunnyStage() {
        sun = scene.create(typeOf<DirectionalLight>());
        setField<&DirectionalLight::shadows>(scene.edit, sun, true);
        scene.node(sun, scene.node(scene.transform(Vec3d::Zero(),
                                                   Quatd::FromTwoVectors(-Vec3d::UnitZ(), Vec3d(0.02, -1, 0.01)))));
        plain = scene.material(1);
        holes = scene.material(1);
        setField<&Material::alphaMode>(scene.edit, holes, Material::kMask);
        shape = scene.geometry(makeBox({0.5, 0.5, 0.5}), plain);
        cut = scene.geometry(makeBox({0.4, 0.4, 0.4}), holes);
        scene.box({0, -1.6, -8}, {20, 0.2, 14});
        left = scene.transform({-2, -1, -6});
        scene.node(shape, scene.node(left));
        right = scene.transform({2, -1, -6});
        scene.node(cut, scene.node(right));
        // So that bounds stay.
        scene.box({9, 4, -14}, {0.1, 0.1, 0.1});
        scene.apply();
        all.update(scene.aspect, nullptr);
    }
    void follow() {
        const ChangeList list = scene.apply();
        all.update(scene.aspect, &list);
        all.beginFrame();
    }
    DrawList look(RenderAction& action, int column, int row = 0) {
        return action.run(all, camera.camera(), camera.tile(column, row), nullptr);
    }
    void move(ObjectId transform, const Vec3d& to) {
        setField<&Transform::translation>(scene.edit, transform, to);
        follow();
    }
};

TEST(ShadowStore, WhatChangesMovesUntilItHasRested) {
    SunnyStage stage;
    RenderAction action(CullerKind::kFrustum);
    const auto far = [&] { return stage.look(action, 0).casters->views[0]; };
    const auto first = far();
    EXPECT_EQ(itemsOf(*first).size(), 4u);
    EXPECT_TRUE(first->moving.empty());
    stage.move(stage.left, {-2, -0.9, -6});
    const auto moved = far();
    EXPECT_EQ(moved->kin, first->kin);
    EXPECT_NE(moved->state, first->state);
    ASSERT_EQ(moved->moving.size(), 1u);
    EXPECT_EQ(moved->moving[0].item.geometry, stage.shape);
    EXPECT_EQ(itemsOf(*moved).size(), 4u) << "what rests stays where it is";
    // Another one moves from then on; the first one has rested before long.
    for (int i = 0; i < 40; ++i) {
        stage.move(stage.right, {2, -1 + 0.01 * i, -6});
        const auto now = far();
        EXPECT_EQ(itemsOf(*now).size(), 4u);
        EXPECT_EQ(now->kin, first->kin);
    }
    ASSERT_EQ(far()->moving.size(), 1u);
    EXPECT_EQ(far()->moving[0].item.geometry, stage.cut);
}

TEST(ShadowStore, LooksCountOnlyWhereTheyCutHoles) {
    SunnyStage stage;
    RenderAction action(CullerKind::kFrustum);
    const auto far = [&] { return stage.look(action, 0).casters->views[0]; };
    const auto first = far();
    setField<&Material::baseColor>(stage.scene.edit, stage.plain, Vec4f(1, 0, 0, 1));
    stage.follow();
    EXPECT_EQ(far(), first);
    setField<&Geometry::material>(stage.scene.edit, stage.shape, stage.scene.material(1));
    stage.follow();
    EXPECT_EQ(far(), first);
    setField<&Material::alphaCutoff>(stage.scene.edit, stage.holes, 0.7f);
    stage.follow();
    EXPECT_NE(far(), first);
    EXPECT_EQ(far()->moving.size(), 1u);
    const auto second = far();
    setField<&Geometry::material>(stage.scene.edit, stage.shape, stage.holes);
    stage.follow();
    EXPECT_EQ(far()->moving.size(), 2u);
    setField<&Geometry::material>(stage.scene.edit, stage.shape, stage.scene.material(0.5f));
    stage.follow();
    EXPECT_EQ(itemsOf(*far()).size(), 3u) << "glass casts none";
}

TEST(ShadowStore, ScreensAndEyesOfAHostKeepTheirViews) {
    SunnyStage stage;
    TestCamera side = stage.camera;
    side.view.orientation = Quatd(Eigen::AngleAxisd(-1.2, Vec3d::UnitY()));
    std::vector<std::unique_ptr<RenderAction>> actions;
    for (int i = 0; i < 3; ++i) actions.push_back(std::make_unique<RenderAction>(CullerKind::kFrustum));
    const auto looks = [&] {
        std::vector<std::shared_ptr<const ShadowView>> views;
        const std::array<ScreenCamera, 3> cameras = {stage.camera.camera(Eye::kLeft), stage.camera.camera(Eye::kRight),
                                                     side.camera()};
        for (std::size_t i = 0; i < 3; ++i) {
            const auto casters = actions[i]->run(stage.all, cameras[i], stage.camera.tile(), nullptr).casters;
            for (const auto& view : casters->all()) views.push_back(view);
        }
        return views;
    };
    stage.all.beginFrame();
    const auto first = looks();
    for (int frame = 0; frame < 5; ++frame) {
        // Something that casts none.
        stage.scene.put(stage.scene.geometry(makeBox({1, 1, 1}), stage.scene.material(0.5f)), {0, 1, -4});
        stage.follow();
        EXPECT_EQ(looks(), first);
    }
}

TEST(ShadowStore, ATileHearsOfWhatReachesIt) {
    SunnyStage stage;
    RenderAction left(CullerKind::kFrustum), right(CullerKind::kFrustum), above(CullerKind::kFrustum);
    const auto states = [&] {
        return std::array<std::uint64_t, 3>{stage.look(left, 0).shadowState, stage.look(right, 1).shadowState,
                                            stage.look(above, 1, 1).shadowState};
    };
    const auto first = states();
    EXPECT_EQ(states(), first);
    stage.move(stage.left, {-2, -0.9, -6});
    auto now = states();
    EXPECT_NE(now[0], first[0]);
    EXPECT_EQ(now[1], first[1]) << "the right tile sees no part of what it shades";
    EXPECT_EQ(now[2], first[2]);
    const auto second = now;
    stage.move(stage.right, {2, -0.9, -6});
    now = states();
    EXPECT_EQ(now[0], second[0]);
    EXPECT_NE(now[1], second[1]);
    EXPECT_EQ(now[2], second[2]);
    // Above all, between the sun and what the left tile shows.
    const auto third = now;
    stage.move(stage.right, {-2, 5, -6});
    now = states();
    EXPECT_NE(now[0], third[0]);
    EXPECT_NE(now[1], third[1]) << "its old shadow is gone";
}

/// A caster above the picture, a sun that shines straight down, and one thing in its light.
struct ShadedThing {
    TestScene scene;
    RenderScene all;
    ObjectId material, caster, place;
    TestCamera camera{320, 200, 1, 1};
    RenderAction action{CullerKind::kFrustum};

    ShadedThing(const MeshData& thing, const Vec3d& at) {
        const ObjectId sun = scene.create(typeOf<DirectionalLight>());
        setField<&DirectionalLight::shadows>(scene.edit, sun, true);
        scene.node(sun, scene.node(scene.transform(Vec3d::Zero(),
                                                   Quatd::FromTwoVectors(-Vec3d::UnitZ(), Vec3d(0.01, -1, 0.01)))));
        material = scene.material(1);
        caster = scene.transform({0, 6, -6});
        scene.node(scene.geometry(makeBox({0.3, 0.3, 0.3}), material), scene.node(caster));
        place = scene.transform(at);
        scene.node(scene.geometry(thing, material), scene.node(place));
        scene.box({9, 9, -14}, {0.1, 0.1, 0.1});  // so that bounds stay
        scene.box({9, -9, -14}, {0.1, 0.1, 0.1});
        scene.apply();
        all.update(scene.aspect, nullptr);
        static_cast<void>(state());
    }
    std::uint64_t state() {
        all.beginFrame();
        return action.run(all, camera.camera(), camera.tile(0, 0), nullptr).shadowState;
    }
    /// Whether the picture may be another one when the caster goes from one place to another.
    bool hears(const Vec3d& from, const Vec3d& to) {
        const auto go = [&](const Vec3d& where) {
            setField<&Transform::translation>(scene.edit, caster, where);
            const ChangeList list = scene.apply();
            all.update(scene.aspect, &list);
            return state();
        };
        const std::uint64_t before = go(from);
        return go(to) != before;
    }
};

TEST(ShadowStore, ATileHearsOfNoShadowBesideTheTriangles) {
    // A ring lies before the eye. Its box holds what falls through it.
    ShadedThing ring(makeTorus(1.5, 0.1, 24, 8), {0, -0.5, -6});
    EXPECT_FALSE(ring.hears({0, 6, -6}, {0.2, 6, -6.1}));
    EXPECT_TRUE(ring.hears({0, 6, -6}, {1.5, 6, -6})) << "onto it";
    EXPECT_TRUE(ring.hears({0, 6, -7.5}, {0, 6, -6})) << "off it";
}

TEST(ShadowStore, ATileHearsOfNoShadowOnWhatTurnsItsBack) {
    // A house whose roof is above the eye: neither that nor the floor within shows its front.
    const Vec3d inside(1.5, 6, -6), beside(1.6, 6, -6.1);
    ShadedThing house(makeBox({2, 3, 2}), {1.5, 0.5, -6});
    EXPECT_FALSE(house.hears(inside, beside));
    setField<&Material::doubleSided>(house.scene.edit, house.material, true);
    EXPECT_TRUE(house.hears(inside, beside)) << "both sides are drawn";
    setField<&Material::doubleSided>(house.scene.edit, house.material, false);
    setField<&Transform::scale>(house.scene.edit, house.place, Vec3d(-1, 1, 1));
    EXPECT_FALSE(house.hears(inside, beside)) << "a mirrored one";
    setField<&Transform::translation>(house.scene.edit, house.place, Vec3d(1.5, -2.5, -6));
    EXPECT_TRUE(house.hears(inside, beside)) << "the roof is below the eye";
}

/// Where the rows of pieces lie.
std::set<const ShadowCaster*> beginsOf(const ShadowView& view) {
    std::set<const ShadowCaster*> begins;
    const ShadowCaster* before = nullptr;
    view.still->all.each([](const PixelRect&) { return true; },
                         [&](const ShadowCaster& caster) {
                             if (!before || &caster != before + 1) begins.insert(&caster);
                             before = &caster;
                         });
    return begins;
}

/// Pieces of `now` that were none of `before`.
std::size_t newPieces(const ShadowView& before, const ShadowView& now) {
    const std::set<const ShadowCaster*> known = beginsOf(before);
    return static_cast<std::size_t>(
        std::ranges::count_if(beginsOf(now), [&](const ShadowCaster* begin) { return !known.contains(begin); }));
}

TEST(ShadowStore, ComingToRestCostsWhatComesToRest) {
    SunnyStage stage;
    for (int i = 0; i < 3000; ++i)
        stage.scene.node(stage.shape,
                         stage.scene.node(stage.scene.transform({0.1 * (i % 80) - 4, -1, -2 - 0.1 * i / 80})));
    stage.follow();
    RenderAction action(CullerKind::kFrustum);
    const auto far = [&] { return stage.look(action, 0).casters->views[0]; };
    const auto first = far();
    ASSERT_GT(beginsOf(*first).size(), 40u);
    stage.move(stage.left, {-2, -0.9, -6});
    const auto moved = far();
    EXPECT_LE(newPieces(*first, *moved), 3u) << "it stands there no more";
    std::uint64_t work = stage.all.impl().shadows.work();
    for (int i = 0; i < 35; ++i) {
        stage.move(stage.right, {2, -1 + 0.01 * i, -6});
        static_cast<void>(far());
    }
    work = stage.all.impl().shadows.work() - work;
    const auto rested = far();
    ASSERT_EQ(rested->moving.size(), 1u);
    EXPECT_EQ(itemsOf(*rested).size(), itemsOf(*first).size());
    EXPECT_LE(newPieces(*moved, *rested), 4u);
    EXPECT_LT(work, 1500u) << "casters that were looked at, and what was copied";
}

TEST(ShadowStore, WhoComesBackFindsTheViewsOfBefore) {
    SunnyStage stage;
    stage.scene.box({0, -1.6, 0}, {400, 0.2, 400});
    stage.follow();
    TestCamera there = stage.camera;
    there.view.position += Vec3d(60, 0, 0);
    RenderAction here(CullerKind::kFrustum), away(CullerKind::kFrustum);
    const auto kinsOf = [&](RenderAction& action, const TestCamera& camera) {
        std::vector<std::uint64_t> kins;
        const auto casters = action.run(stage.all, camera.camera(), camera.tile(), nullptr).casters;
        EXPECT_TRUE(casters->near);
        for (const auto& view : casters->all()) kins.push_back(view->kin);
        return kins;
    };
    const auto first = kinsOf(here, stage.camera);
    for (int i = 0; i < 100; ++i) {
        stage.move(stage.left, {-2, -1 + 0.01 * (i % 7), -6});
        static_cast<void>(kinsOf(away, there));
    }
    EXPECT_NE(kinsOf(away, there), first);
    // Whatever moves all the time.
    for (int i = 0; i < 300'000; ++i) stage.all.impl().shadows.changed(static_cast<std::uint32_t>(i % 5));
    EXPECT_EQ(kinsOf(here, stage.camera), first);
    const auto casters = here.run(stage.all, stage.camera.camera(), stage.camera.tile(), nullptr).casters;
    RenderScene fresh;
    fresh.update(stage.scene.aspect, nullptr);
    const auto anew = here.run(fresh, stage.camera.camera(), stage.camera.tile(), nullptr).casters;
    EXPECT_EQ(itemsOf(*casters->near).size(), itemsOf(*anew->near).size());
}

TEST(ShadowStore, ATileAsksTheFinestViewFirst) {
    SunnyStage stage;
    stage.scene.box({0, -1.6, 0}, {2000, 0.2, 2000});
    const ObjectId near = stage.scene.transform({0, -1, -3});
    stage.scene.node(stage.shape, stage.scene.node(near));
    // Farther away than what it shades.
    for (int i = 0; i < 200; ++i)
        stage.scene.node(stage.shape, stage.scene.node(stage.scene.transform({0.02 * i - 2, -1, -30})));
    stage.follow();
    RenderAction action(CullerKind::kFrustum);
    const auto look = [&] {
        return action.run(stage.all, stage.camera.camera(), {.x = 0, .y = 0, .width = 640, .height = 400}, nullptr);
    };
    const DrawList first = look();
    ASSERT_TRUE(first.casters->near && first.casters->middle);
    ASSERT_GT(first.opaque.size(), 200u);
    stage.move(near, {0.1, -1, -3});
    const std::uint64_t before = stage.all.impl().shadows.work();
    EXPECT_NE(look().shadowState, first.shadowState);
    EXPECT_LT(stage.all.impl().shadows.work() - before, first.opaque.size() + 20);
}

TEST(ShadowStore, NoMeshStaysForTheShadowThatItMade) {
    SunnyStage stage;
    RenderAction action(CullerKind::kFrustum);
    const auto far = [&] { return stage.look(action, 0).casters->views[0]; };
    const auto meshOf = [&](const ShadowView& view) -> std::weak_ptr<const DrawMesh> {
        for (const DrawItem& item : itemsOf(view))
            if (item.geometry == stage.shape) return item.mesh;
        return {};
    };
    for (const bool moves : {false, true}) {
        if (moves) stage.move(stage.left, {-2, -0.9, -6});
        const std::weak_ptr<const DrawMesh> before = meshOf(*far());
        const std::uint64_t state = far()->state;
        ASSERT_FALSE(before.expired());
        // The same corners; of shadows nothing is another.
        std::vector<float> normals(72, moves ? 0.6f : 0.8f);
        setField<&Geometry::normals>(stage.scene.edit, stage.shape, Blob::of(std::span<const float>(normals)));
        stage.follow();
        EXPECT_EQ(far()->state, state);
        EXPECT_TRUE(before.expired()) << (moves ? "of what moves" : "of what rests");
        EXPECT_FALSE(meshOf(*far()).expired());
    }
}

// A view follows what has changed when it is asked for: until then it holds what was there before.
TEST(ShadowStore, NoMeshStaysForAViewThatNobodyAsksFor) {
    for (const bool switchedOff : {false, true}) {
        SCOPED_TRACE(switchedOff ? "no light has shadows any more" : "all look from elsewhere");
        SunnyStage stage;
        stage.scene.box({0, -1.6, 0}, {400, 0.2, 400});
        stage.follow();
        TestCamera there = stage.camera;
        there.view.position += Vec3d(60, 0, 0);
        RenderAction here(CullerKind::kFrustum), away(CullerKind::kFrustum);
        const auto look = [&](RenderAction& action, const TestCamera& camera) {
            stage.all.beginFrame();
            return action.run(stage.all, camera.camera(), camera.tile(), nullptr).casters;
        };
        std::weak_ptr<const DrawMesh> mesh;
        for (const DrawItem& item : itemsOf(*look(here, stage.camera)->near))
            if (item.geometry == stage.shape) mesh = item.mesh;
        if (switchedOff) setField<&DirectionalLight::shadows>(stage.scene.edit, stage.sun, false);
        setField<&Geometry::positions>(stage.scene.edit, stage.shape, makeBox({0.6, 0.5, 0.5}).toArrays().positions);
        stage.follow();
        EXPECT_EQ(look(away, there) == nullptr, switchedOff);
        ASSERT_FALSE(mesh.expired()) << "who comes back finds the view";
        int looks = 0;
        for (; looks < 400 && !mesh.expired(); ++looks) static_cast<void>(look(away, there));
        EXPECT_TRUE(mesh.expired());
        EXPECT_GT(looks, 250);
    }
}

TEST(ShadowStore, APointLightHasSixViewsThatSeeAllAround) {
    TestScene scene;
    const ObjectId lamp = scene.create(typeOf<PointLight>());
    setField<&PointLight::shadows>(scene.edit, lamp, true);
    scene.node(lamp);
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-3.0, 3.0}) scene.box(sign * Vec3d::Unit(axis), {1, 1, 1});
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    RenderAction action(CullerKind::kFrustum);
    const TestCamera camera;
    const auto casters = action.run(all, camera.camera(), camera.tile(), nullptr).casters;
    ASSERT_EQ(casters->views.size(), kCubeViews);
    EXPECT_EQ(casters->countOf(0), kCubeViews);
    for (const auto& view : casters->views) EXPECT_EQ(itemsOf(*view).size(), 1u);
}

}  // namespace
}  // namespace tessera
