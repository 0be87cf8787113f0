#include <random>

#include "common/cores/Glyphs.h"
#include "common/cores/ParticleEmitter.h"
#include "common/cores/PointLight.h"
#include "common/cores/Switch.h"
#include "tests/support/words/Words.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

const CullerKind kNone = CullerKind::kNone;

bool sameItem(const DrawItem& a, const DrawItem& b) {
    return a.node == b.node && a.geometry == b.geometry && a.material == b.material && a.mirrored == b.mirrored &&
           a.kind == b.kind && a.lineWidth == b.lineWidth && a.pointRadius == b.pointRadius &&
           a.world_T_item.matrix() == b.world_T_item.matrix();
}

void expectSameList(const DrawList& a, const DrawList& b) {
    ASSERT_EQ(nodesOf(a.opaque), nodesOf(b.opaque));
    ASSERT_EQ(nodesOf(a.transparent), nodesOf(b.transparent));
    for (std::size_t i = 0; i < a.opaque.size(); ++i) ASSERT_TRUE(sameItem(a.opaque[i], b.opaque[i]));
    for (std::size_t i = 0; i < a.transparent.size(); ++i) ASSERT_TRUE(sameItem(a.transparent[i], b.transparent[i]));
    ASSERT_EQ(a.lights.size(), b.lights.size());
    for (std::size_t i = 0; i < a.lights.size(); ++i) {
        ASSERT_EQ(a.lights[i].position, b.lights[i].position);
        ASSERT_EQ(a.lights[i].direction, b.lights[i].direction);
        ASSERT_EQ(a.lights[i].radiance, b.lights[i].radiance);
    }
    ASSERT_EQ(a.environment.sky, b.environment.sky);
}

TEST(RenderScene, AnEmptySceneHasNoItemsNoBoundsAndTheDefaultLight) {
    TestScene scene;
    RenderScene all;
    all.update(scene.aspect, nullptr);
    EXPECT_TRUE(all.bounds().empty());
    for (const CullerKind kind : kAllCullers) {
        CullCounts counts;
        const DrawList list = cull(scene, kind, TestCamera(), &counts);
        EXPECT_TRUE(nodesOf(list).empty());
        EXPECT_FALSE(list.lights.empty());
        EXPECT_EQ(counts.drawn, 0u);
    }
}

TEST(RenderScene, EveryNodeOfASharedCoreIsAnItemAtItsPlace) {
    TestScene scene;
    const ObjectId shared = scene.geometry(makeBox({2, 2, 2}));
    const ObjectId outer = scene.node(scene.transform({0, 0, -10}));
    const ObjectId left = scene.put(shared, {-3, 0, 0}, Quatd::Identity(), Vec3d::Ones(), outer);
    const ObjectId right = scene.put(shared, {3, 0, 0}, Quatd::Identity(), Vec3d(1, 2, 1), outer);
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    EXPECT_EQ(all.bounds().lower, Vec3d(-4, -2, -11));
    EXPECT_EQ(all.bounds().upper, Vec3d(4, 2, -9));
    const DrawList list = cull(scene, kNone, TestCamera());
    EXPECT_EQ(nodesOf(list.opaque), (std::vector<ObjectId>{left, right}));
    EXPECT_EQ(list.opaque[0].geometry, shared);
    EXPECT_EQ(list.opaque[1].world_T_item.translation(), Vec3d(3, 0, -10));
}

/// So nothing that looks for what is seen has to be made anew while it plays.
TEST(RenderScene, AStreamOfParticlesHasTheBoundsOfAllOfItsTime) {
    TestScene scene;
    const ParticleEmitter emitter{.time = 1};
    const ObjectId core = scene.create(typeOf<ParticleEmitter>());
    setAllFields(scene.edit, core, Object::of(emitter));
    scene.node(core);
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const Box bounds = all.bounds();
    EXPECT_NEAR(bounds.upper.y(), emitter.pace * emitter.life + emitter.beginSize / 2, 1e-4);
    for (const double time : {1.5, 2.0, 20.0}) {
        setField<&ParticleEmitter::time>(scene.edit, core, time);
        const ChangeList list = scene.edit.take();
        ASSERT_TRUE(scene.aspect.apply(list));
        all.update(scene.aspect, &list);
        EXPECT_EQ(all.bounds().lower, bounds.lower);
        EXPECT_EQ(all.bounds().upper, bounds.upper);
    }
}

TEST(RenderScene, WhatASwitchHidesIsNoItem) {
    TestScene scene;
    const ObjectId choice = scene.create(typeOf<Switch>());
    const ObjectId parent = scene.node(choice);
    const ObjectId core = scene.geometry(makeBox({1, 1, 1}));
    std::vector<ObjectId> shown;
    for (int i = 0; i < 3; ++i) shown.push_back(scene.node(core, parent));
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    for (const std::int64_t value : {std::int64_t{1}, Switch::kNone, Switch::kAll, std::int64_t{7}, std::int64_t{0}}) {
        scene.edit.set(choice, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(value));
        const ChangeList list = scene.apply();
        all.update(scene.aspect, &list);
        const DrawList drawn = RenderAction(kNone).run(all, TestCamera().camera(), TestCamera().tile(), nullptr);
        std::vector<ObjectId> expected;
        if (value == Switch::kAll) expected = shown;
        if (value == 0 || value == 1) expected = {shown[static_cast<std::size_t>(value)]};
        EXPECT_EQ(nodesOf(drawn.opaque), expected) << value;
    }
}

TEST(RenderScene, AnOddNumberOfReflectionsMirrors) {
    TestScene scene;
    const ObjectId core = scene.geometry(makeBox({1, 1, 1}));
    const ObjectId outer = scene.node(scene.transform({0, 0, 0}, Quatd::Identity(), {-1, 1, 1}));
    const ObjectId once = scene.put(core, {0, 0, -5}, Quatd::Identity(), Vec3d::Ones(), outer);
    const ObjectId twice = scene.put(core, {0, 0, -6}, Quatd::Identity(), Vec3d(1, -1, 1), outer);
    scene.apply();
    const DrawList list = cull(scene, kNone, TestCamera());
    ASSERT_EQ(nodesOf(list.opaque), (std::vector<ObjectId>{once, twice}));
    EXPECT_TRUE(list.opaque[0].mirrored);
    EXPECT_FALSE(list.opaque[1].mirrored);
}

TEST(RenderScene, LightsComeInDocumentOrderWithTheirNodesPlace) {
    TestScene scene;
    const Quatd turned(Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitY()));
    for (int i = 0; i < 20; ++i) {
        const ObjectId lamp = scene.create(i == 0 ? typeOf<DirectionalLight>() : typeOf<PointLight>());
        const ObjectType type = i == 0 ? typeOf<DirectionalLight>() : typeOf<PointLight>();
        scene.edit.set(lamp, type, fieldId<&PointLight::intensity>, toValue(static_cast<float>(i + 1)));
        scene.node(lamp, scene.node(scene.transform({1.0 * i, 2, 3}, turned)));
    }
    scene.apply();
    const DrawList list = cull(scene, kNone, TestCamera());
    ASSERT_EQ(list.lights.size(), 20u);
    EXPECT_EQ(list.lights[0].kind, LightItem::Kind::kDirectional);
    // Along -Z of the node: turned about +Y by a quarter that is the world's -X.
    EXPECT_TRUE(list.lights[0].direction.isApprox(-Vec3d::UnitX(), 1e-12));
    EXPECT_EQ(list.lights[5].kind, LightItem::Kind::kPoint);
    EXPECT_EQ(list.lights[5].position, Vec3d(5, 2, 3));
    EXPECT_EQ(list.lights[5].radiance, Vec3f::Constant(6));
}

TEST(RenderScene, LightsBeyondTheMostThatCanBeDrawnAreCounted) {
    TestScene scene;
    const ObjectId lamp = scene.create(typeOf<PointLight>());
    for (std::size_t i = 0; i < DrawList::kMaxLights + 3; ++i) scene.node(lamp);
    scene.apply();
    const DrawList list = cull(scene, kNone, TestCamera());
    EXPECT_EQ(list.lights.size(), DrawList::kMaxLights);
    EXPECT_EQ(list.lightsLeftOut, 3u);
}

TEST(RenderScene, LightsThatAreSwitchedOffLeaveTheSceneDarkInsteadOfDefaultLit) {
    TestScene scene;
    const ObjectId choice = scene.create(typeOf<Switch>());
    scene.node(scene.create(typeOf<PointLight>()), scene.node(choice));
    scene.edit.set(choice, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(Switch::kNone));
    scene.apply();
    EXPECT_TRUE(cull(scene, kNone, TestCamera()).lights.empty());
}

TEST(RenderScene, LightsAreNumbersHoweverBrightTheirFactors) {
    TestScene scene;
    const ObjectId lamp = scene.create(typeOf<PointLight>());
    scene.edit.set(lamp, typeOf<PointLight>(), fieldId<&PointLight::intensity>, toValue(1e30f));
    scene.edit.set(lamp, typeOf<PointLight>(), fieldId<&PointLight::color>, toValue(Vec3f(1e30f, 0, 1)));
    scene.node(lamp);
    scene.apply();
    const DrawList list = cull(scene, CullerKind::kNone, TestCamera());
    ASSERT_EQ(list.lights.size(), 1u);
    EXPECT_EQ(list.lights[0].radiance, Vec3f(1e18f, 0, 1e18f));
}

TEST(RenderScene, TheFirstEnvironmentInDocumentOrderIsUsed) {
    TestScene scene;
    for (const float value : {0.25f, 0.75f}) {
        const ObjectId core = scene.create(typeOf<Environment>());
        scene.edit.set(core, typeOf<Environment>(), fieldId<&Environment::sky>, toValue(Vec3f(Vec3f::Constant(value))));
        scene.node(core);
    }
    scene.apply();
    EXPECT_EQ(cull(scene, kNone, TestCamera()).environment.sky, Vec3f::Constant(0.25f));
}

TEST(RenderScene, AMaterialThatTurnsTransparentTakesItsItemsAlong) {
    TestScene scene;
    const ObjectId material = scene.material(1.0f);
    const ObjectId core = scene.geometry(makeBox({1, 1, 1}), material);
    const ObjectId near = scene.put(core, {0, 0, -5});
    const ObjectId far = scene.put(core, {0, 0, -9});
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    scene.edit.set(material, typeOf<Material>(), fieldId<&Material::baseColor>, toValue(Vec4f(1, 1, 1, 0.5f)));
    const ChangeList list = scene.apply();
    all.update(scene.aspect, &list);
    const DrawList drawn = RenderAction(kNone).run(all, TestCamera().camera(), TestCamera().tile(), nullptr);
    EXPECT_TRUE(drawn.opaque.empty());
    EXPECT_EQ(nodesOf(drawn.transparent), (std::vector<ObjectId>{far, near}));
}

TEST(RenderScene, MeshesThatCannotBeDrawnAreLeftOut) {
    TestScene scene;
    MeshData broken = makeBox({1, 1, 1});
    broken.indices[4] = 4711;
    scene.put(scene.geometry(broken), {0, 0, -5});
    scene.put(scene.geometry(MeshData{}), {0, 0, -5});
    MeshData endless = makeBox({1, 1, 1});
    endless.positions[2] = std::numeric_limits<float>::infinity();
    scene.put(scene.geometry(endless), {0, 0, -5});
    const ObjectId absent = scene.create(typeOf<Geometry>());
    const Blob positions = makeBox({1, 1, 1}).toArrays().positions;
    scene.edit.set(absent, typeOf<Geometry>(), fieldId<&Geometry::positions>,
                   toValue(Blob::absent(positions.id(), positions.sizeBytes())));
    scene.edit.set(absent, typeOf<Geometry>(), fieldId<&Geometry::indices>,
                   toValue(makeBox({1, 1, 1}).toArrays().indices));
    scene.node(absent);
    // Beyond anything a float can hold once it is scaled.
    scene.put(scene.geometry(makeBox({1, 1, 1})), {0, 0, -5}, Quatd::Identity(), Vec3d::Constant(1e200));
    const ObjectId whole = scene.box({0, 0, -5}, {1, 1, 1});
    scene.apply();
    for (const CullerKind kind : kAllCullers)
        EXPECT_EQ(nodesOf(cull(scene, kind, TestCamera())), std::vector<ObjectId>{whole});
}

// Whatever is shown and not drawn is named, with the vertex that is at fault, as long as it is so.
TEST(RenderScene, AGlyphBeyondAllMeasureIsNamed) {
    TestScene scene;
    Glyphs glyphs;
    glyphs.positions = Blob::of(std::span<const float>(std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 3e18f, 0}));
    glyphs.shape = Glyphs::kBox;
    const ObjectId core = scene.create(typeOf<Glyphs>());
    setAllFields(scene.edit, core, Object::of(glyphs));
    const ObjectId thing = scene.put(core, {0, 0, 0});
    scene.apply();
    RenderScene drawn;
    drawn.update(scene.aspect, nullptr);
    EXPECT_TRUE(drawn.undrawn().contains(thing));
    EXPECT_WORDS(whyNotDrawn(scene.aspect, thing));
}

TEST(RenderScene, WhatIsBeyondAllMeasureIsNamed) {
    for (const double scale : {1e9, 0.9e18, 1.1e18, 1e30, 1e38, 1e200, 1e300}) {
        TestScene scene;
        MeshData mesh = makeBox({1, 1, 1});
        mesh.positions[9 * 3] = 2;  // the farthest
        const ObjectId pose = scene.transform({0, 0, -5}, Quatd::Identity(), Vec3d::Constant(scale / 2));
        const ObjectId place = scene.node(pose), thing = scene.node(scene.geometry(mesh), place);
        scene.apply();
        RenderScene followed;
        followed.update(scene.aspect, nullptr);
        const bool drawn = scale < 1e18;
        EXPECT_EQ(followed.undrawn(), drawn ? std::set<ObjectId>() : std::set<ObjectId>{thing}) << scale;
        if (!drawn) {
            EXPECT_WORDS(whyNotDrawn(scene.aspect, thing));
        }
        scene.edit.set(pose, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1)));
        ChangeList list = scene.edit.take();
        ASSERT_TRUE(scene.aspect.apply(list));
        followed.update(scene.aspect, &list);
        EXPECT_TRUE(followed.undrawn().empty());
    }
    for (const float coordinate :
         {1e9f, 0.99e18f, 1.1e18f, 1e30f, std::numeric_limits<float>::max(), std::numeric_limits<float>::infinity()}) {
        TestScene scene;
        MeshData mesh = makeBox({1, 1, 1});
        mesh.positions[5 * 3 + 1] = -coordinate;
        const ObjectId thing = scene.put(scene.geometry(mesh), {0, 0, 0});
        scene.apply();
        RenderScene drawn;
        drawn.update(scene.aspect, nullptr);
        EXPECT_EQ(drawn.undrawn().contains(thing), coordinate > 1e18f) << coordinate;
        if (coordinate > 1e18f) {
            EXPECT_WORDS(whyNotDrawn(scene.aspect, thing));
        }
    }
}

// The law that makes late joiners draw the same picture: following every change gives what starting anew gives, bit by
// bit.
TEST(RenderScene, FollowingChangesEqualsStartingAnew) {
    std::mt19937 random(7);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    const auto pick = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    const auto anyRotation = [&] { return Quatd(uniform(0.1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)); };

    TestScene scene;
    std::vector<ObjectId> transforms, parents{kRootNode}, switches, leaves;
    const ObjectId opaque = scene.material(1.0f);
    const std::vector<ObjectId> cores{scene.geometry(makeBox({1, 1, 1}), opaque), scene.geometry(makeSphere(1, 8)),
                                      scene.geometry(makeTorus(1, 0.3, 8, 6), opaque)};
    const ObjectId lampCore = scene.create(typeOf<PointLight>());
    const auto grow = [&] {
        const ObjectId core = scene.transform({uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)}, anyRotation(),
                                              {uniform(0.5, 1.2), uniform(-1.2, 1.2), uniform(0.5, 1.2)});
        transforms.push_back(core);
        const ObjectId parent = parents[pick(parents.size())];
        const ObjectId group = scene.node(core, parent);
        parents.push_back(group);
        // Two places of one transform core.
        if (pick(4) == 0) parents.push_back(scene.node(core, parent));
        for (std::size_t i = pick(3); i-- > 0;) leaves.push_back(scene.node(cores[pick(cores.size())], group));
        if (pick(5) == 0) leaves.push_back(scene.node(lampCore, group));
        if (pick(6) == 0) {
            const ObjectId choice = scene.create(typeOf<Switch>());
            switches.push_back(choice);
            parents.push_back(scene.node(choice, group));
        }
    };
    for (int i = 0; i < 60; ++i) grow();
    scene.apply();
    RenderScene followed;
    followed.update(scene.aspect, nullptr);

    const TestCamera camera;
    for (int step = 0; step < 60; ++step) {
        const std::size_t kind = pick(10);
        if (kind < 5) {
            for (std::size_t i = pick(kind == 0 ? 60 : 4) + 1; i-- > 0;)
                scene.place(transforms[pick(transforms.size())], {uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)},
                            anyRotation(), {uniform(0.5, 1.2), uniform(-1.2, 1.2), uniform(0.5, 1.2)});
        } else if (kind == 5) {
            grow();
        } else if (kind == 6 && !switches.empty()) {
            scene.edit.set(switches[pick(switches.size())], typeOf<Switch>(), fieldId<&Switch::choice>,
                           toValue(static_cast<std::int64_t>(pick(5)) - 2));
        } else if (kind == 7) {
            scene.edit.set(opaque, typeOf<Material>(), fieldId<&Material::baseColor>,
                           toValue(Vec4f(1, 1, 1, pick(2) ? 1.0f : 0.4f)));
        } else if (kind == 8) {
            scene.edit.set(lampCore, typeOf<PointLight>(), fieldId<&PointLight::intensity>,
                           toValue(static_cast<float>(uniform(0, 9))));
        } else {
            scene.edit.detach(leaves[pick(leaves.size())]);
        }
        const ChangeList list = scene.apply();
        followed.update(scene.aspect, &list);

        RenderScene anew;
        anew.update(scene.aspect, nullptr);
        EXPECT_EQ(followed.bounds().lower, anew.bounds().lower);
        EXPECT_EQ(followed.bounds().upper, anew.bounds().upper);
        for (const CullerKind culler : {CullerKind::kNone, CullerKind::kFrustum}) {
            const DrawList a = RenderAction(culler).run(followed, camera.camera(), camera.tile(), nullptr);
            const DrawList b = RenderAction(culler).run(anew, camera.camera(), camera.tile(), nullptr);
            expectSameList(a, b);
            if (HasFatalFailure()) return;
        }
    }
}

}  // namespace
}  // namespace tessera
