#include <algorithm>

#include "server/collision/tree/TreeTopology.h"
#include "tests/unit/tree/Meshes.h"

namespace tessera::trees {
namespace {

using kernel::kLeafFaces;
using kernel::kWidth;

std::size_t depthOf(const TreeStorage& tree, std::uint32_t node) {
    std::size_t below = 0;
    for (std::uint32_t slot = node * kWidth; slot < (node + 1) * kWidth; ++slot) {
        const kernel::ChildRef ref = tree.children[slot];
        if (ref == kernel::kNoChild) continue;
        below = std::max(below, (ref & kernel::kLeafBit) != 0 ? std::size_t{1} : 1 + depthOf(tree, ref));
    }
    return below;
}

void expectSound(const TreeStorage& tree) {
    const std::size_t faces = tree.mesh->faceCount();
    ASSERT_EQ(tree.children.size() % kWidth, 0U);
    std::vector<int> seen(faces);
    for (std::size_t slot = 0; slot < tree.children.size(); ++slot) {
        const kernel::ChildRef ref = tree.children[slot];
        if (ref == kernel::kNoChild) continue;
        ASSERT_TRUE(slot == 0 || slot >= kWidth) << "the first node has one child";
        if ((ref & kernel::kLeafBit) == 0) continue;
        const std::size_t leaf = (ref & ~kernel::kLeafBit) >> 2;
        ASSERT_LT(leaf, tree.leafCount());
        for (unsigned i = 0; i < kLeafFaces; ++i) {
            const std::uint32_t face = tree.leafFaces[leaf * kLeafFaces + i];
            ASSERT_EQ(face != TreeStorage::kNoFace, i <= (ref & 3)) << "leaf " << leaf;
            if (face == TreeStorage::kNoFace) continue;
            ASSERT_LT(face, faces);
            ++seen[face];
        }
    }
    for (std::size_t face = 0; face < faces; ++face) ASSERT_EQ(seen[face], 1) << "face " << face;
    const auto [first, end] = forSlots(tree, 0, [](std::uint32_t, std::uint32_t, std::uint32_t) {});
    EXPECT_EQ(first, 0U);
    EXPECT_EQ(end, tree.leafCount());
    EXPECT_EQ(tree.depth, depthOf(tree, 0));
    EXPECT_LE(tree.depth, 40U);
}

TEST(TreeTopology, EveryTriangleIsInOneLeaf) {
    for (const NamedMesh& mesh : hardMeshes())
        for (const SplitRule rule : kRules) {
            SCOPED_TRACE(mesh.name + ", rule " + std::to_string(static_cast<int>(rule)));
            const TriangleTree tree(mesh.arrays.mesh(), {.split = rule});
            expectSound(tree.storage());
            if (HasFatalFailure()) return;
        }
}

TEST(TreeTopology, AnEmptyMeshHasNoNodes) {
    const TriangleTree tree{TriangleMesh()};
    EXPECT_TRUE(tree.storage().empty());
    EXPECT_EQ(tree.depth(), 0U);
    EXPECT_EQ(tree.decay(), 1);
    std::vector<Vec3d> none;
    TriangleTree again{TriangleMesh()};
    EXPECT_TRUE(again.refit(none));
    again.rebuild();
}

TEST(TreeTopology, OneLeafNeedsNoNodeOfItsOwn) {
    const TriangleTree tree(soup(4, 1).mesh());
    EXPECT_EQ(tree.storage().nodeCount(), 1U);
    EXPECT_EQ(tree.storage().leafCount(), 1U);
    EXPECT_EQ(TriangleTree(soup(64, 1).mesh()).storage().nodeCount(), 2U) << "a lowest node and the first";
}

TEST(TreeTopology, IsTheSameOnEveryProcessorAndEveryTime) {
    for (const NamedMesh& mesh : hardMeshes())
        for (const SplitRule rule : kRules) {
            SCOPED_TRACE(mesh.name + ", rule " + std::to_string(static_cast<int>(rule)));
            const TriangleTree tree(mesh.arrays.mesh(), {.split = rule});
            const TreeStorage& s = tree.storage();
            for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
                if (set > instructionSet()) continue;
                const TreeTopology other = divide(ownPositions(s), s.mesh->indices(), rule, set);
                ASSERT_EQ(other.children, s.children) << name(set);
                ASSERT_EQ(other.leafFaces, s.leafFaces) << name(set);
            }
        }
}

TEST(TreeTopology, NodesAndLeavesAreWellFilledAndMemoryIsBounded) {
    // A smaller brother of the ten million triangles of server/collision/tree/README.md.
    const TriangleMesh mesh = field(500, 0.1).mesh();
    const TriangleTree tree(mesh);
    const TreeStorage& s = tree.storage();
    const std::size_t used = s.children.size() - static_cast<std::size_t>(std::count(
                                                     s.children.begin(), s.children.end(), kernel::kNoChild));
    EXPECT_GE(static_cast<double>(used), 0.7 * static_cast<double>(s.children.size()));
    EXPECT_GE(static_cast<double>(mesh.faceCount()), 0.95 * static_cast<double>(kLeafFaces * s.leafCount()));
    EXPECT_LT(static_cast<double>(tree.memoryBytes()), 95.0 * static_cast<double>(mesh.faceCount()));
    EXPECT_LE(tree.depth(), 7U);
    // Triangles all over each other, the other extreme.
    EXPECT_LT(static_cast<double>(TriangleTree(soup(100000, 9).mesh()).memoryBytes()), 170.0 * 100000);
}

}  // namespace
}  // namespace tessera::trees
