// The default scene: what the wall, the tests and its visitor rely on.

#include <filesystem>
#include <vector>

#include "common/cores/Camera.h"
#include "common/cores/Geometry.h"
#include "common/cores/Motion.h"
#include "common/cores/PointLight.h"
#include "common/cores/Transform.h"
#include "common/math/Box.h"
#include "common/scene/Action.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

TEST(EngineHall, LoadsWithEnginesThatShareTheirMeshes) {
    if (!std::filesystem::exists(kEngine)) GTEST_SKIP() << kEngine << " is missing (Debian package assimp-testmodels)";
    Expected<ImportedScene> scene =
        importScene(std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/engine-hall.tsct", kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    EXPECT_GT(scene->triangles, 12u * 121'496u);
    EXPECT_LT(scene->trianglesStored, 75'730u + 20'000u);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_NE(aspect.core<Transform>("/hall/crane"), nullptr);
    EXPECT_NE(aspect.core<Camera>("/hall/camera/camera"), nullptr);
    std::size_t cameras = 0, lights = 0, engines = 0;
    Action action;
    action.on<Camera>([&](const Visit&, const Camera& camera) {
        cameras += camera.enabled != 0 ? 1 : 0;
        return Descend::kInto;
    });
    action.on<PointLight>([&](const Visit&, const PointLight&) {
        ++lights;
        return Descend::kInto;
    });
    action.onNode([&](const Visit& visit) {
        if (visit.node.name == "engine") ++engines;
        return Descend::kInto;
    });
    action.run(*aspect);
    EXPECT_EQ(cameras, 1u);
    EXPECT_GE(lights, 4u);
    EXPECT_GE(engines, 12u);
}

TEST(EngineHall, KeepsTheVisitorsEyeClearOfEverything) {
    if (!std::filesystem::exists(kEngine)) GTEST_SKIP() << kEngine << " is missing (Debian package assimp-testmodels)";
    Expected<ImportedScene> scene =
        importScene(std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/engine-hall.tsct", kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* walk = aspect.core<Motion>("/hall/camera/walk");
    const auto* camera = aspect.core<Camera>("/hall/camera/camera");
    ASSERT_TRUE(walk != nullptr && camera != nullptr);
    // The eye of the shipped walls' user, between the keys of the walk.
    std::vector<Vec3d> eyes;
    const auto keys = walk->keys.as<double>();
    for (std::size_t k = 0; k + 22 <= keys.size(); k += 11)
        for (double t = 0; t <= 1; t += 0.1) {
            const auto at = [&](std::size_t i) { return (1 - t) * keys[k + i] + t * keys[k + 11 + i]; };
            const Quatd turn = Quatd(at(4), at(5), at(6), at(7)).normalized();
            eyes.push_back(Vec3d(at(1), at(2), at(3)) + turn * (camera->worldUnitsPerMetre * Vec3d(0, 1.7, 2.4)));
        }
    ASSERT_GT(eyes.size(), 20u);
    Action action;
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        Box local;
        const auto positions = geometry.positions.as<float>();
        for (std::size_t i = 0; i + 3 <= positions.size(); i += 3)
            local.extend(Vec3d(positions[i], positions[i + 1], positions[i + 2]));
        Box box = local.transformed(visit.world_T_node);
        box.lower -= Vec3d::Constant(0.3);
        box.upper += Vec3d::Constant(0.3);
        for (const Vec3d& eye : eyes)
            EXPECT_FALSE(box.contains(eye)) << pathOf(*aspect, visit.nodeId) << " at " << eye.transpose();
        return Descend::kInto;
    });
    action.run(*aspect);
}

}  // namespace
}  // namespace tessera
