#include <set>

#include "common/cores/Geometry.h"
#include "common/scene/Action.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

TEST(GltfImport, KeepsTheEnginesHierarchyAndSharesItsMeshes) {
    if (!std::filesystem::exists(kEngine)) GTEST_SKIP() << kEngine << " is missing (Debian package assimp-testmodels)";
    Expected<ImportedScene> scene = importScene(kEngine, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 34u);
    EXPECT_EQ(scene->trianglesStored, 75'730u);
    EXPECT_EQ(scene->triangles, 121'496u);
    EXPECT_TRUE(scene->hasCamera);

    const ImportedAspect aspect(std::move(*scene));
    std::set<ObjectId> meshNodes, cores;
    std::uint64_t triangles = 0;
    Action action;
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        meshNodes.insert(visit.node.parent);
        cores.insert(visit.node.core);
        triangles += geometry.indices.sizeBytes() / 12;
        EXPECT_TRUE(geometry.positions.resident());
        return Descend::kInto;
    });
    action.run(*aspect);
    EXPECT_EQ(meshNodes.size(), 67u);
    EXPECT_EQ(cores.size(), 34u);
    EXPECT_EQ(triangles, 121'496u);
    EXPECT_TRUE(findNode(*aspect, "/2CylinderEngine"));
}

}  // namespace
}  // namespace tessera
