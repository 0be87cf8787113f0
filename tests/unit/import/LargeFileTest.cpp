// What a scene may hold may also be written down by hand.
#include <fmt/format.h>

#include "common/cores/Transform.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

TEST(LargeFile, OfMoreThanEightMillionWordsAndAMillionNodesIsRead) {
    constexpr int kGroups = 1100, kNodes = 1000;
    std::string text;
    for (int group = 0; group < kGroups; ++group) {
        text += fmt::format("node {{ name: \"group {}\"\n", group);
        for (int node = 0; node < kNodes; ++node)
            text += fmt::format("  node {{ name: \"{}, {}\" transform {{ translation {{ x: {} y: {} z: 1 }} }} }}\n",
                                group, node, group, node + 1);
        text += "}\n";
    }
    ASSERT_GT(text.size(), std::size_t{80} << 20);
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write("large.tsct", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->nodes, std::uint64_t{kGroups} * (kNodes + 1));
    const ImportedAspect aspect(std::move(*scene));
    const auto* pose = aspect.core<Transform>("/group 7/7, 9");
    ASSERT_NE(pose, nullptr);
    EXPECT_EQ(pose->translation, Vec3d(7, 10, 1));
}

}  // namespace
}  // namespace tessera
