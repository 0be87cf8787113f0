// The proof on the scene that comes with Tessera: inside the engine hall a good part of what is in the frustum is left
// away, and nobody can tell from the pictures.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <set>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "common/scene/Action.h"
#include "tests/golden/ShippedScene.h"
#include "tests/support/surface/PooledSurface.h"

namespace tessera::test {
namespace {

TEST(CullingInTheEngineHall, LeavesAwayAFifthAtLeastAndNothingThatIsVisible) {
    if (!std::filesystem::exists(std::string(kAssimpModels) + "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"))
        GTEST_SKIP() << "the engine is missing (Debian package assimp-testmodels)";
    const Expected<Aspect> hall = loadShipped("engine-hall");
    ASSERT_TRUE(hall) << hall.error().message;
    const auto surface = test::pooledSurface();
    const auto renderer = Renderer::create(*surface, {.samples = 4}).value();
    RenderScene all;
    all.update(*hall, nullptr);

    const Screen screen = flatScreen(2, 2, 480, 270);
    std::uint64_t inFrustum = 0;
    std::uint64_t drawn = 0;
    std::uint64_t trianglesOfFrustum = 0;
    std::uint64_t triangles = 0;
    // One action per tile, as a client has them; what it remembers from one view must not harm the next.
    std::map<std::pair<CullerKind, int>, RenderAction> actions;
    for (const CullerKind kind : kAllCullers)
        for (int tile = 0; tile < 4; ++tile) actions.try_emplace({kind, tile}, kind);
    const View start = cameraOfScene(*hall);
    for (const double turn : {0.0, 0.1, 0.6}) {
        View view = start;
        view.position += Vec3d(4 * turn, 0, 0);
        view.orientation = Quatd(Eigen::AngleAxisd(turn, Vec3d::UnitY())) * start.orientation;
        const ScreenCamera camera = screenCamera(screen, User(), Eye::kCenter, view);
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{tile % 2 * 480, tile / 2 * 270, 480, 270};
            CullCounts frustumCounts;
            const DrawList whole = RenderAction(CullerKind::kFrustum).run(all, camera, rect, &frustumCounts);
            const auto expected = renderer->draw(*hall, whole, camera, rect);
            const auto ids = renderer->drawNodeIds(*hall, whole, camera, rect);
            ASSERT_TRUE(expected && ids);
            for (const CullerKind kind : kAllCullers) {
                CullCounts counts;
                const auto list = actions.at({kind, tile}).run(all, camera, rect, &renderer->visibility(), &counts);
                ASSERT_TRUE(list) << list.error().message;
                const auto picture = renderer->draw(*hall, *list, camera, rect);
                ASSERT_TRUE(picture);
                EXPECT_TRUE(picture->rgb == expected->rgb)
                    << nameOf(kind) << ", tile " << tile << " turned by " << turn;
                std::set<std::uint64_t> kept{0};
                for (const DrawItem& item : list->opaque) kept.insert(item.node.value);
                for (const DrawItem& item : list->transparent) kept.insert(item.node.value);
                for (const std::uint64_t id : *ids)
                    ASSERT_TRUE(kept.contains(id))
                        << nameOf(kind) << ": " << pathOf(*hall, ObjectId{id}) << " is hidden";
                if (kind != CullerKind::kMasked) continue;
                inFrustum += counts.inFrustum;
                drawn += counts.drawn;
                trianglesOfFrustum += frustumCounts.trianglesDrawn;
                triangles += counts.trianglesDrawn;
            }
        }
    }
    EXPECT_LE(5 * drawn, 4 * inFrustum) << drawn << " of " << inFrustum << " items drawn";
    EXPECT_LE(5 * triangles, 4 * trianglesOfFrustum) << triangles << " of " << trianglesOfFrustum << " triangles drawn";
    RecordProperty("inFrustum", static_cast<int>(inFrustum));
    RecordProperty("drawn", static_cast<int>(drawn));
}

}  // namespace
}  // namespace tessera::test
