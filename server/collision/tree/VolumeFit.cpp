#include "server/collision/tree/VolumeFit.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace tessera {
namespace {

using kernel::kLeafFaces;
using kernel::kLeafRows;

/// A leaf's triangle, or its first.
std::uint32_t some(const std::uint32_t* faces, unsigned i) {
    return faces[i] == TreeStorage::kNoFace ? faces[0] : faces[i];
}

void fillCorners(TreeStorage& tree, std::span<const OwnPosition> positions) {
    const std::size_t leaves = tree.leafCount();
    const std::uint32_t* const indices = tree.mesh->indices().data();
    tree.corners.resize(leaves * kLeafRows);
    __m128 farthest = _mm_setzero_ps();
    for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
        const std::uint32_t* const faces = &tree.leafFaces[leaf * kLeafFaces];
        const std::uint32_t* corner[kLeafFaces];
        for (unsigned i = 0; i < kLeafFaces; ++i) corner[i] = indices + 3 * std::size_t{some(faces, i)};
        float* row = tree.corners[leaf * kLeafRows].lane;
        for (unsigned c = 0; c < 3; ++c, row += 3 * kLeafFaces) {
            __m128 x = _mm_load_ps(positions[corner[0][c]].xyz0), y = _mm_load_ps(positions[corner[1][c]].xyz0),
                   z = _mm_load_ps(positions[corner[2][c]].xyz0), rest = _mm_load_ps(positions[corner[3][c]].xyz0);
            _MM_TRANSPOSE4_PS(x, y, z, rest);
            _mm_store_ps(row, x);
            _mm_store_ps(row + kLeafFaces, y);
            _mm_store_ps(row + 2 * kLeafFaces, z);
            farthest =
                _mm_max_ps(farthest, _mm_add_ps(_mm_add_ps(_mm_mul_ps(x, x), _mm_mul_ps(y, y)), _mm_mul_ps(z, z)));
        }
    }
    alignas(16) float lane[4];
    _mm_store_ps(lane, farthest);
    // Five roundings to float, halved by the root but for the position's own.
    tree.radius = std::sqrt(static_cast<double>(*std::max_element(lane, lane + 4))) * (1 + 0x1p-21);
}

}  // namespace

void fitVolumes(TreeStorage& tree, std::span<const OwnPosition> positions, InstructionSet set) {
    tree.radius = tree.cost = 0;
    if (tree.empty()) return;
    fillCorners(tree, positions);
    tree.volumes.resize(tree.nodeCount() * rowsOf(tree.options.volume));
    std::vector<kernel::FitNode> own;
    std::vector<kernel::FitNode>& nodes = tree.refits ? tree.refits->nodes : own;
    nodes.resize(tree.nodeCount());
    kernel::FitJob job{tree.volumes.data()->lane,
                       tree.children.data(),
                       tree.corners.data()->lane,
                       static_cast<std::uint32_t>(tree.nodeCount()),
                       nodes.data(),
                       0,
                       0};
    kernel::treeKernels(set).fit[static_cast<std::size_t>(shapeOf(tree.options.volume))](job);
    tree.surfaces = job.cost;
    tree.cost = job.whole > 0 ? job.cost / job.whole : 1;
}

namespace {

/// But for the nodes, which a fit of all leaves behind.
RefitIndex makeIndex(const TreeStorage& tree) {
    RefitIndex out;
    const std::span<const std::uint32_t> indices = tree.mesh->indices();
    const auto eachUse = [&](auto&& use) {
        for (std::uint32_t leaf = 0; leaf < tree.leafCount(); ++leaf)
            for (unsigned i = 0; i < kLeafFaces; ++i) {
                const std::uint32_t face = tree.leafFaces[leaf * kLeafFaces + i];
                if (face == TreeStorage::kNoFace) continue;
                for (unsigned c = 0; c < 3; ++c) use(indices[3 * std::size_t{face} + c], leaf);
            }
    };
    out.leafStart.resize(tree.mesh->vertexCount() + 1);
    eachUse([&](std::uint32_t vertex, std::uint32_t) { ++out.leafStart[vertex + 1]; });
    for (std::size_t i = 1; i < out.leafStart.size(); ++i) out.leafStart[i] += out.leafStart[i - 1];
    out.leaves.resize(out.leafStart.back());
    std::vector<std::uint32_t> next(out.leafStart.begin(), out.leafStart.end() - 1);
    eachUse([&](std::uint32_t vertex, std::uint32_t leaf) { out.leaves[next[vertex]++] = leaf; });
    out.nodeOfLeaf.resize(tree.leafCount());
    out.parent.resize(tree.nodeCount());
    for (std::uint32_t node = 0; node < tree.nodeCount(); ++node)
        for (unsigned lane = 0; lane < kernel::kWidth; ++lane) {
            const kernel::ChildRef child = tree.children[std::size_t{node} * kernel::kWidth + lane];
            if (child == kernel::kNoChild) continue;
            if ((child & kernel::kLeafBit) != 0)
                out.nodeOfLeaf[(child & ~kernel::kLeafBit) >> 2] = node;
            else
                out.parent[child] = node;
        }
    return out;
}

void sortOnce(std::vector<std::uint32_t>& numbers) {
    std::ranges::sort(numbers);
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace

bool fitSome(TreeStorage& tree, std::size_t first, std::size_t count, InstructionSet set) {
    if (tree.empty() || count == 0) return true;
    // An eighth of all that is above costs about what all does.
    constexpr std::size_t kFew = 8;
    if (tree.options.profiles || count > tree.mesh->vertexCount() / kFew) return false;
    if (!tree.refits) {
        tree.refits = makeIndex(tree);
        return false;
    }
    RefitIndex& index = *tree.refits;
    std::vector<std::uint32_t> leaves(index.leaves.begin() + index.leafStart[first],
                                      index.leaves.begin() + index.leafStart[first + count]);
    sortOnce(leaves);
    if (leaves.size() > tree.leafCount() / kFew) return false;

    // As ownPositions makes them.
    const auto own = [&](std::uint32_t vertex) {
        const Vec3d p = (tree.mesh->positions()[vertex] - tree.centre) * tree.unit;
        return Vec3f(p.cast<float>());
    };
    double farthest = 0;
    for (std::size_t vertex = first; vertex < first + count; ++vertex)
        if (index.leafStart[vertex] != index.leafStart[vertex + 1])
            farthest = std::max(farthest, own(static_cast<std::uint32_t>(vertex)).cast<double>().norm());
    if (!(farthest * (1 + 0x1p-21) <= 1)) return false;
    tree.radius = std::max(tree.radius, farthest * (1 + 0x1p-21));

    std::vector<std::uint32_t> nodes;
    for (const std::uint32_t leaf : leaves) {
        const std::uint32_t* const faces = &tree.leafFaces[leaf * kLeafFaces];
        TreeStorage::LeafRow* const rows = &tree.corners[leaf * kLeafRows];
        for (unsigned i = 0; i < kLeafFaces; ++i)
            for (unsigned c = 0; c < 3; ++c) {
                const Vec3f p = own(tree.mesh->vertexOf(some(faces, i), c));
                for (unsigned k = 0; k < 3; ++k) rows[3 * c + k].lane[i] = p[static_cast<int>(k)];
            }
        nodes.push_back(index.nodeOfLeaf[leaf]);
    }
    sortOnce(nodes);
    // Children come after their node, so that all above come before.
    for (std::size_t begin = 0; begin < nodes.size();) {
        const std::size_t end = nodes.size();
        for (std::size_t i = begin; i < end; ++i)
            if (nodes[i] != 0) nodes.push_back(index.parent[nodes[i]]);
        std::sort(nodes.begin() + static_cast<std::ptrdiff_t>(end), nodes.end());
        nodes.erase(std::unique(nodes.begin() + static_cast<std::ptrdiff_t>(end), nodes.end()), nodes.end());
        begin = end;
    }
    sortOnce(nodes);
    kernel::FitJob job{tree.volumes.data()->lane,
                       tree.children.data(),
                       tree.corners.data()->lane,
                       static_cast<std::uint32_t>(tree.nodeCount()),
                       index.nodes.data(),
                       tree.surfaces,
                       0,
                       nodes.data(),
                       static_cast<std::uint32_t>(nodes.size())};
    kernel::treeKernels(set).fit[static_cast<std::size_t>(shapeOf(tree.options.volume))](job);
    tree.surfaces = job.cost;
    tree.cost = job.whole > 0 ? job.cost / job.whole : 1;
    return true;
}

}  // namespace tessera
