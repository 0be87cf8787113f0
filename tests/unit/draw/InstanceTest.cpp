/// Neighbours that share mesh and state are one call, and look as if each were drawn by itself.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

class InstanceTest : public RendererTest {};

enum class As { kShared, kApart, kLarge };

/// Things in random places, many of them in the very same place as another one of another colour. Shared: few cores;
/// apart: each node has a mesh of its own, which differs from the others' by a vertex that no triangle has; large: by
/// so many triangles of no area that it is given to GL otherwise.
Aspect randomThings(unsigned seed, As as) {
    std::mt19937 random(seed);
    const auto any = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
    TestScene scene;
    std::vector<std::pair<MeshData, ObjectId>> kinds;
    for (int i = 0; i < 5; ++i) {
        Material material;
        material.baseColor =
            Vec4f(static_cast<float>(any(0, 1)), static_cast<float>(any(0, 1)), 0.5f, i == 4 ? 0.5f : 1);
        material.doubleSided = i == 1;
        MeshData mesh = i % 2 ? makeBox({1, 1, 1}) : makeTorus(0.5, 0.2, 12, 8);
        if (i == 3) mesh.normals.clear();
        kinds.emplace_back(mesh, scene.add(material));
    }
    std::vector<ObjectId> shared;
    for (const auto& [mesh, material] : kinds) shared.push_back(scene.add(mesh, material));
    Vec3d at = Vec3d::Zero();
    for (int i = 0; i < 150; ++i) {
        if (i % 3) at = Vec3d(any(-2, 2), any(-2, 2), any(-6, 0));
        const std::size_t kind = random() % kinds.size();
        const Quatd turn = i % 3 ? Quatd(any(0.1, 1), any(-1, 1), any(-1, 1), any(-1, 1)) : Quatd::Identity();
        const double size = i % 4 ? any(0.2, 0.6) : -0.4;
        ObjectId core = shared[kind];
        if (as != As::kShared) {
            MeshData own = kinds[kind].first;
            own.positions.insert(own.positions.end(), {0, 0, static_cast<float>(i) / 1000});
            if (!own.normals.empty()) own.normals.insert(own.normals.end(), {0, 0, 1});
            if (!own.texcoords.empty()) own.texcoords.insert(own.texcoords.end(), {0, 0});
            if (as == As::kLarge) own.indices.resize(own.indices.size() + std::size_t{3} * 1100, 0u);
            core = scene.add(own, kinds[kind].second);
        } else {
            static_cast<void>(scene.add(makeBox({1, 1, 1})));  // so that ids of nodes are the same
        }
        scene.place(core, at, turn, {size, std::abs(size), std::abs(size)});
    }
    scene.addDirectionalLight({0.3, -0.6, -0.7}, Vec3f::Ones(), 1.5f);
    return scene.take();
}

// A failing seed: TESSERA_SEED=N build/bin/unit_draw --gtest_filter='InstanceTest.Look*'.
TEST_F(InstanceTest, LookAsIfEachWereDrawnByItself) {
    const char* one = std::getenv("TESSERA_SEED");
    const unsigned from = one ? static_cast<unsigned>(std::atoi(one)) : 0;
    for (unsigned seed = from; seed < from + (one ? 1 : 6); ++seed) {
        SCOPED_TRACE(seed);
        restart({.samples = seed % 2 ? 4 : 1});
        const ScreenCamera camera = cameraOf(300, 200);
        // One order for all: by depth, which looks at no state. That of meshes with another vertex has other boxes: by
        // hand.
        const auto listed = [&](const Aspect& aspect) {
            DrawList list = listOf(aspect, camera);
            std::sort(list.opaque.begin(), list.opaque.end(),
                      [](const DrawItem& a, const DrawItem& b) { return a.node < b.node; });
            std::erase_if(list.transparent, [](const DrawItem& item) { return item.sortedCount > 0; });
            std::sort(list.transparent.begin(), list.transparent.end(),
                      [](const DrawItem& a, const DrawItem& b) { return a.node < b.node; });
            return list;
        };
        const Aspect shared = randomThings(seed, As::kShared), apart = randomThings(seed, As::kApart),
                     large = randomThings(seed, As::kLarge);
        const auto draw = [&](const Aspect& aspect) {
            auto picture = renderer_->draw(aspect, listed(aspect), camera, whole(camera));
            EXPECT_TRUE(picture) << picture.error().message;
            return picture->rgb;
        };
        const auto expected = draw(apart);
        const std::uint64_t callsApart = renderer_->lastCounts().glCalls;
        EXPECT_TRUE(draw(shared) == expected);
        EXPECT_LT(renderer_->lastCounts().glCalls, callsApart);
        EXPECT_TRUE(draw(large) == expected);
        const auto ids = [&](const Aspect& aspect) {
            return renderer_->drawNodeIds(aspect, listed(aspect), camera, whole(camera)).value();
        };
        EXPECT_TRUE(ids(shared) == ids(apart));
    }
}

TEST_F(InstanceTest, ACrowdOfOneCoreIsOneCallInOneState) {
    TestScene scene;
    scene.setDark();
    const ObjectId core = scene.add(makeBox({0.1, 0.1, 0.1}), scene.add(unlit({0.5f, 0, 0})));
    for (int i = 0; i < 200; ++i) scene.place(core, {0.1 * (i % 20) - 1, 0.1 * (i / 20) - 0.5, -0.01 * i});
    const Aspect crowd = scene.take();
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    ASSERT_TRUE(renderer_->draw(crowd, listOf(crowd, camera), camera, whole(camera)));
    EXPECT_EQ(renderer_->lastCounts().glCalls, 1u);
    EXPECT_EQ(renderer_->lastCounts().states, 1u);
    EXPECT_EQ(renderer_->lastCounts().triangles, 200u * 12);
    // Two cores with the same arrays and two materials, at one distance in turns: two states, however they stand.
    TestScene two;
    two.setDark();
    const ObjectId a = two.add(makeBox({0.1, 0.1, 0.1}), two.add(unlit({0.5f, 0, 0})));
    const ObjectId b = two.add(makeBox({0.1, 0.1, 0.1}), two.add(unlit({0, 0.5f, 0})));
    for (int i = 0; i < 200; ++i) two.place(i % 2 ? a : b, {0.1 * (i % 20) - 1, 0.1 * (i / 20) - 0.5, 0});
    const Aspect mixed = two.take();
    ASSERT_TRUE(renderer_->draw(mixed, listOf(mixed, camera), camera, whole(camera)));
    EXPECT_EQ(renderer_->lastCounts().glCalls, 2u);
    EXPECT_EQ(renderer_->lastCounts().states, 2u);
}

}  // namespace
}  // namespace tessera
