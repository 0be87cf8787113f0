// What a scene may hold may also be written down by hand.
#include <fmt/format.h>

#include <memory>

#include "common/cores/Transform.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

TEST(LargeFile, OfMoreThanAMillionNodesIsRead) {
    constexpr int kGroups = 1010, kNodes = 1000;
    std::string text;
    for (int group = 0; group < kGroups; ++group) {
        text += fmt::format("node {{ name: \"group {}\"\n", group);
        for (int node = 0; node < kNodes; ++node) text += fmt::format("  node {{ name: \"{}, {}\" }}\n", group, node);
        text += "}\n";
    }
    const Scratch scratch;
    const Expected<ImportedScene> scene = importScene(scratch.write("nodes.tsct", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->nodes, std::uint64_t{kGroups} * (kNodes + 1));
}

TEST(LargeFile, OfMoreThanEightMillionWordsAnd80MegabytesIsRead) {
    constexpr int kGroups = 450, kNodes = 1000;  // some 20 words and 190 bytes each
    std::string text;
    for (int group = 0; group < kGroups; ++group) {
        text += fmt::format("node {{ name: \"group {}\"\n", group);
        for (int node = 0; node < kNodes; ++node)
            text += fmt::format(
                "  node {{ name: \"{}, {}\" transform {{ translation {{ x: {}.000000000000001 y: {}.000000000000001 z: "
                "1.000000000000001 }} "
                "scale {{ x: 1.000000000000001 y: 1.000000000000001 z: 1.000000000000001 }} }} }}\n",
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
    EXPECT_NEAR((pose->translation - Vec3d(7, 10, 1)).norm(), 0, 1e-9);
}

/// Nobody waits for a list that nobody wants.
TEST(LargeFile, IsLeftWhereItsListIsMadeOnceItIsCancelled) {
    std::string text;
    for (int node = 0; node < 20'000; ++node) text += fmt::format("node {{ name: \"{}\" }}\n", node);
    const Scratch scratch;
    ImportOptions options = importOptions();
    for (const bool cancels : {false, true}) {
        options.watch = std::make_shared<ImportWatch>();
        std::vector<double> shares;
        options.watch->tell = [&, watch = options.watch.get()](const ImportWatch::Progress& progress) {
            if (progress.stage != ImportWatch::Stage::kBuilding) return;
            shares.push_back(progress.part);
            if (cancels) watch->cancel({ErrorCode::kFailed, "cancelled by ada"});
        };
        const Expected<ImportedScene> scene = importScene(scratch.write("wide.tsct", text), kRootNode, options);
        ASSERT_EQ(scene.has_value(), !cancels) << messageOf(scene);
        if (cancels) EXPECT_TRUE(messageOf(scene).ends_with("wide.tsct: cancelled by ada")) << messageOf(scene);
        if (!cancels) EXPECT_GT(shares.back(), 0.8);
        options.watch->tell = {};
    }
}

}  // namespace
}  // namespace tessera
