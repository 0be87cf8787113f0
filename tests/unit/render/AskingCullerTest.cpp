// The cullers that ask the renderer, beside the oracle: scenes that change, heads that move, tiles in several parts.
#include <fmt/format.h>

#include <cstdlib>
#include <random>

#include "tests/support/words/Words.h"
#include "tests/unit/render/DepthFake.h"
#include "tests/unit/render/VisibilityOracle.h"

namespace tessera {
namespace {

std::vector<CullerKind> askingCullers() {
    std::vector<CullerKind> kinds;
    for (const CullerKind kind : kAllCullers)
        if (asksRenderer(kind)) kinds.push_back(kind);
    return kinds;
}

class AskingCuller : public testing::TestWithParam<CullerKind> {};

// A failing seed: unit_render --gtest_filter='*OracleSees*', TESSERA_SEED=seed.
TEST_P(AskingCuller, NeverHidesWhatTheOracleSees) {
    std::uint64_t hidden = 0, invisible = 0;
    const char* one = std::getenv("TESSERA_SEED");
    for (unsigned seed = one ? static_cast<unsigned>(std::atoi(one)) : 0, end = one ? seed + 1 : 8; seed < end;
         ++seed) {
        SCOPED_TRACE(fmt::format("{}: TESSERA_SEED={} build/bin/unit_render --gtest_filter='*OracleSees*'",
                                 nameOf(GetParam()), seed));
        std::mt19937 random(seed);
        const auto uniform = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        TestScene scene;
        const ObjectId glass = scene.material(0.5f), sheets = scene.material(1.0f);
        scene.edit.set(sheets, typeOf<Material>(), fieldId<&Material::doubleSided>, true);
        std::vector<ObjectId> cores, transforms;
        for (const ObjectId material : {ObjectId{}, sheets, glass}) {
            cores.push_back(scene.geometry(makeBox({1, 1, 1}), material));
            cores.push_back(scene.geometry(makeBox({2, 2, 0.1}), material));
            cores.push_back(scene.geometry(makeSphere(0.8, 10), material));
            cores.push_back(scene.geometry(makeTorus(0.8, 0.3, 12, 8), material));
        }
        const auto place = [&](ObjectId transform) {
            const Quatd rotation = random() % 3
                                       ? Quatd::Identity()
                                       : Quatd(uniform(0.1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
            scene.place(transform, {uniform(-5, 5), uniform(-2, 2), uniform(-14, 0.5)}, rotation.normalized(),
                        {uniform(0.2, 2.2), uniform(0.2, 2.2), (random() % 5 == 0 ? -1 : 1) * uniform(0.2, 2.2)});
        };
        for (int i = 0; i < 90; ++i) {
            transforms.push_back(scene.create(typeOf<Transform>()));
            place(transforms.back());
            scene.node(cores[random() % (i % 2 == 0 ? cores.size() : 2)], scene.node(transforms.back()));
        }
        // A wall in pieces whose corners do not meet: a slit may show at the junctions.
        for (int i = 0; i < 5; ++i) {
            const double at = uniform(-3, 3);
            scene.box({at - 1.5, uniform(-0.5, 0.5), -9}, {3, 3, 0.2});
            scene.box({at + 1.5, uniform(-0.5, 0.5), -9}, {3, uniform(1, 3), 0.2});
        }
        // One that hides a good deal, until it goes: all that was known is wrong then.
        const ObjectId curtain = scene.transform({uniform(-1, 1), uniform(-0.5, 0.5), -2});
        scene.node(scene.geometry(makeBox({uniform(0.5, 3), uniform(0.5, 2), 0.1})), scene.node(curtain));
        scene.apply();
        RenderScene all;
        all.update(scene.aspect, nullptr);
        TestCamera camera(75, 43, 2, 1);
        camera.user.position += Vec3d(uniform(-0.4, 0.4), uniform(-0.3, 0.3), uniform(-1, 1));
        // One for each eye, for all steps: what it remembers is often wrong, and must not matter.
        std::array<RenderAction, 2> actions{RenderAction(GetParam()), RenderAction(GetParam())};
        const int partPx = 20 + static_cast<int>(random() % 80);
        for (int step = 0; step < 6; ++step) {
            camera.user.position += Vec3d(uniform(-0.1, 0.1), uniform(-0.1, 0.1), uniform(-0.1, 0.1));
            if (step == 4) camera.user.position.z() -= 1;  // among the boxes
            if (step == 1 + static_cast<int>(seed % 3))
                scene.place(curtain, {0, 0, 50}, Quatd::Identity(), Vec3d::Ones());
            for (int moved = 0; moved < 6; ++moved) place(transforms[random() % transforms.size()]);
            const ChangeList list = scene.apply();
            all.update(scene.aspect, &list);
            for (const Eye eye : {Eye::kLeft, Eye::kRight}) {
                const ScreenCamera view = camera.camera(eye);
                const PixelRect tile = camera.tile(1, 0);
                DepthFake device(scene.aspect, partPx);
                CullCounts counts;
                const auto culled = actions[eye == Eye::kLeft ? 0 : 1].run(all, view, tile, &device, &counts);
                ASSERT_TRUE(culled) << culled.error().message;
                const DrawList whole = RenderAction(CullerKind::kFrustum).run(all, view, tile, nullptr);
                const std::set<ObjectId> visible = visibleNodes(scene.aspect, whole, view, tile);
                const std::vector<ObjectId> drawn = nodesOf(*culled);
                const std::set<ObjectId> kept(drawn.begin(), drawn.end());
                for (const ObjectId id : visible)
                    ASSERT_TRUE(kept.contains(id)) << "step " << step << " node " << id.value;
                ASSERT_TRUE(isSubsequence(drawn, nodesOf(whole)));
                EXPECT_EQ(counts.inFrustum, nodesOf(whole).size());
                EXPECT_EQ(counts.drawn, drawn.size());
                hidden += nodesOf(whole).size() - drawn.size();
                invisible += nodesOf(whole).size() - visible.size();
            }
        }
    }
    EXPECT_GT(hidden, invisible / 4);
}

TEST_P(AskingCuller, WhatTheRendererCannotDoIsHandedOnAndTheNextFrameIsRight) {
    TestScene scene;
    const ObjectId wall = scene.box({0, 0, -5}, {4, 4, 1});
    const ObjectId thing = scene.geometry(makeSphere(0.1, 14));
    for (int i = 0; i < 40; ++i) scene.put(thing, {0.1 * i - 2, 0, -20});
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const TestCamera camera;
    RenderAction action(GetParam());
    int failures = 0;
    for (int calls = 0; calls < 40; ++calls) {
        DepthFake device(scene.aspect);
        device.callsLeft = calls;
        const auto list = action.run(all, camera.camera(), camera.tile(), &device, nullptr);
        if (list) continue;
        ++failures;
        EXPECT_EQ(list.error().message, "the fake has given up");
    }
    EXPECT_GT(failures, 1);
    DepthFake device(scene.aspect);
    const auto list = action.run(all, camera.camera(), camera.tile(), &device, nullptr);
    ASSERT_TRUE(list);
    EXPECT_TRUE(draws(*list, wall));
    EXPECT_LT(nodesOf(*list).size(), 41u);
}

TEST_P(AskingCuller, WithoutARendererIsRefused) {
    TestScene scene;
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const TestCamera camera;
    const auto list = RenderAction(GetParam()).run(all, camera.camera(), camera.tile(), nullptr, nullptr);
    ASSERT_FALSE(list);
    EXPECT_EQ(list.error().code, ErrorCode::kUnsupported);
    EXPECT_WORDS(list.error().message);
}

INSTANTIATE_TEST_SUITE_P(All, AskingCuller, testing::ValuesIn(askingCullers()), [](const auto& culler) {
    std::string name(nameOf(culler.param));
    std::erase(name, '-');
    return name;
});

/// A street with many things behind its walls, seen again and again.
TEST(CoherentCuller, AsksLittleOfWhatItKnowsAndLessThanOneThatWaits) {
    TestScene scene;
    for (int i = -8; i < 8; ++i) scene.box({1.0 * i, 0, -5}, {1, 6, 0.5});
    const ObjectId thing = scene.geometry(makeSphere(0.1, 14));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> across(-8, 8), up(-2, 2), away(-40, -10);
    for (int i = 0; i < 1500; ++i) scene.put(thing, {across(random), up(random), away(random)});
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const TestCamera camera;
    RenderAction queries(CullerKind::kQueries), waiting(CullerKind::kQueriesWait);
    CullCounts known, each;
    DepthFake device(scene.aspect);
    ASSERT_TRUE(queries.run(all, camera.camera(), camera.tile(), &device, nullptr));
    std::uint64_t asked = 0, waited = 0;
    for (int frame = 0; frame < 40; ++frame) {
        ASSERT_TRUE(queries.run(all, camera.camera(), camera.tile(), &device, &known));
        asked += known.queries;
        waited += known.waits;
    }
    ASSERT_TRUE(waiting.run(all, camera.camera(), camera.tile(), &device, &each));
    EXPECT_LT(asked, 40 * each.queries / 2);
    EXPECT_LT(waited, 40 * 3);
    EXPECT_EQ(each.waits, each.queries);
    EXPECT_GE(known.drawn, each.drawn);
}

}  // namespace
}  // namespace tessera
