// What assimp reads without normals: edges stay edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/cores/Geometry.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

TEST(AssimpNormals, OfACubeWithSharedVerticesHaveEdges) {
    const Scratch scratch;
    const std::string file = scratch.write("cube.off",
                                           "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                                           "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
    const Expected<ImportedScene> scene = importScene(file, kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    const ImportedAspect aspect{ImportedScene(*scene)};
    const std::vector<const Geometry*> all = allOf<Geometry>(aspect);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0]->positions.sizeBytes() / 12, 24u) << "three normals at each corner of the cube";
    const auto normals = all[0]->normals.as<float>();
    for (std::size_t at = 0; at + 2 < normals.size(); at += 3) {
        std::array<float, 3> sizes = {std::abs(normals[at]), std::abs(normals[at + 1]), std::abs(normals[at + 2])};
        std::ranges::sort(sizes);
        EXPECT_NEAR(sizes[2], 1, 1e-6);
        EXPECT_NEAR(sizes[1], 0, 1e-6);
    }
}

}  // namespace
}  // namespace tessera
