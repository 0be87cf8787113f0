#include "server/collision/tree/VolumeFit.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

using kernel::kLeafFaces;
using kernel::kLeafRows;

/// A leaf's triangle, or its first.
std::uint32_t some(const std::uint32_t* faces, unsigned i) { return faces[i] == TreeStorage::kNoFace ? faces[0] : faces[i]; }

void fillCorners(TreeStorage& tree, std::span<const OwnPosition> positions) {
    const std::size_t leaves = tree.leafCount();
    const std::uint32_t* const indices = tree.mesh->indices().data();
    tree.corners.resize(leaves * kLeafRows);
    __m128 farthest = _mm_setzero_ps();
    for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
        const std::uint32_t* const faces = &tree.leafFaces[leaf * kLeafFaces];
        const std::uint32_t* corner[kLeafFaces];
        for (unsigned i = 0; i < kLeafFaces; ++i)
            corner[i] = indices + 3 * std::size_t{some(faces, i)};
        float* row = tree.corners[leaf * kLeafRows].lane;
        for (unsigned c = 0; c < 3; ++c, row += 3 * kLeafFaces) {
            __m128 x = _mm_load_ps(positions[corner[0][c]].xyz0), y = _mm_load_ps(positions[corner[1][c]].xyz0),
                   z = _mm_load_ps(positions[corner[2][c]].xyz0), rest = _mm_load_ps(positions[corner[3][c]].xyz0);
            _MM_TRANSPOSE4_PS(x, y, z, rest);
            _mm_store_ps(row, x);
            _mm_store_ps(row + kLeafFaces, y);
            _mm_store_ps(row + 2 * kLeafFaces, z);
            farthest = _mm_max_ps(farthest, _mm_add_ps(_mm_add_ps(_mm_mul_ps(x, x), _mm_mul_ps(y, y)), _mm_mul_ps(z, z)));
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
    std::vector<kernel::FitNode> nodes(tree.nodeCount());
    kernel::FitJob job{tree.volumes.data()->lane, tree.children.data(), tree.corners.data()->lane,
                       static_cast<std::uint32_t>(tree.nodeCount()), nodes.data(), 0, 0};
    kernel::treeKernels(set).fit[static_cast<std::size_t>(shapeOf(tree.options.volume))](job);
    tree.cost = job.whole > 0 ? job.cost / job.whole : 1;
}

}  // namespace tessera
