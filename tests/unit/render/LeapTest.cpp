// A camera that leaps: what was hidden a moment ago stands before everything now. Culling must not be taken in by what
// it remembers. TESSERA_LEAPS=SEED repeats one way.
#include <cstdlib>
#include <memory>
#include <random>

#include "tests/unit/render/VisibilityOracle.h"

namespace tessera {
namespace {

/// Houses in rows along streets, small things on the pavements: of 1,000 and more, next to nothing is seen.
void fillCity(TestScene& scene, std::mt19937& random) {
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    const ObjectId box = scene.geometry(makeBox({1, 1, 1}));
    for (int x = -6; x < 6; ++x) {
        for (int z = -6; z < 6; ++z) {
            const Vec3d corner(24.0 * x + 12, 0, 24.0 * z + 12);
            const double height = uniform(12, 40);
            scene.put(box, corner + Vec3d(0, height / 2, 0), Quatd::Identity(), {16, height, 16});
            for (int i = 0; i < 10; ++i) {
                const double along = uniform(-8, 8), off = (random() % 2 ? 1 : -1) * uniform(9, 10.5);
                scene.put(box, corner + Vec3d(i % 2 ? along : off, uniform(0.3, 3), i % 2 ? off : along),
                          Quatd(Eigen::AngleAxisd(uniform(0, 6), Vec3d::UnitY())), Vec3d::Constant(uniform(0.4, 1)));
            }
        }
    }
}

TEST(Masked, ACameraThatLeapsIsShownFewThingsThatItDoesNotSeeAndAllThatItSees) {
    const char* only = std::getenv("TESSERA_LEAPS");
    for (unsigned seed = only ? static_cast<unsigned>(std::atoi(only)) : 0; seed < 6; ++seed) {
        SCOPED_TRACE("TESSERA_LEAPS=" + std::to_string(seed) +
                     " build/bin/unit_render --gtest_filter='Masked.ACameraThatLeaps*'");
        std::mt19937 random(seed);
        const auto uniform = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        TestScene scene;
        fillCity(scene, random);
        scene.apply();
        RenderScene all;
        all.update(scene.aspect, nullptr);
        RenderAction frustum(CullerKind::kFrustum);
        // One per tile, as hosts have them.
        std::vector<std::unique_ptr<RenderAction>> masked;
        for (int tile = 0; tile < 2; ++tile) masked.push_back(std::make_unique<RenderAction>(CullerKind::kMasked));
        std::size_t drawn = 0, visible = 0, inFrustum = 0;
        Vec3d eye(uniform(-2, 2), 2, 130);
        double yaw = 0.5;
        for (int leap = 0; leap < 12; ++leap) {
            TestCamera camera(120, 100, 2, 1);
            camera.view.orientation = Quatd(Eigen::AngleAxisd(yaw, Vec3d::UnitY()));
            camera.view.position = eye - camera.view.orientation * camera.user.position;
            const ScreenCamera view = camera.camera();
            for (int tile = 0; tile < 2; ++tile) {
                CullCounts counts;
                const DrawList culled =
                    masked[static_cast<std::size_t>(tile)]->run(all, view, camera.tile(tile), &counts);
                const std::set<ObjectId> seen = visibleNodes(
                    scene.aspect, frustum.run(all, view, camera.tile(tile), nullptr), view, camera.tile(tile));
                const std::vector<ObjectId> nodes = nodesOf(culled);
                const std::set<ObjectId> kept(nodes.begin(), nodes.end());
                for (const ObjectId id : seen) EXPECT_TRUE(kept.contains(id)) << "leap " << leap << " tile " << tile;
                drawn += counts.drawn;
                visible += seen.size();
                inFrustum += counts.inFrustum;
            }
            // About a house further, looking about; now and then back to the start.
            eye.z() = leap == 7 ? 130 : eye.z() - uniform(15, 32);
            yaw = std::clamp(yaw + uniform(-0.25, 0.25), -0.7, 0.7);
        }
        EXPECT_GT(inFrustum, 8 * visible);
        // 1.2 to 1.4 times, pixels being coarse. A single sight without its best occluders shows some hundred more.
        EXPECT_LE(drawn, 8 * visible / 5) << visible << " visible, " << inFrustum << " in the frustum";
        RecordProperty("drawn " + std::to_string(seed), std::to_string(drawn) + " of " + std::to_string(visible));
        if (only) break;
    }
}

}  // namespace
}  // namespace tessera
