#include "server/collision/tree/TreeStorage.h"

#include <immintrin.h>

#include <algorithm>

namespace tessera {

kernel::Shape shapeOf(VolumeKind kind) {
    switch (kind) {
        case VolumeKind::kSphere:
            return kernel::Shape::kSphere;
        case VolumeKind::kObb:
            return kernel::Shape::kObb;
        case VolumeKind::kAabb:
        case VolumeKind::kDop6:
            return kernel::Shape::kDop6;
        case VolumeKind::kDop14:
            return kernel::Shape::kDop14;
        case VolumeKind::kDop18:
            return kernel::Shape::kDop18;
        case VolumeKind::kDop26:
            return kernel::Shape::kDop26;
    }
    return kernel::Shape::kObb;
}

unsigned rowsOf(VolumeKind kind) {
    constexpr unsigned rows[kernel::kShapes] = {4, 15, 6, 14, 18, 26};
    return rows[static_cast<std::size_t>(shapeOf(kind))];
}

std::vector<OwnPosition> ownPositions(const TreeStorage& tree) {
    const MeshPositions from = tree.mesh->positions();
    std::vector<OwnPosition> out(from.size());
    const __m128d centre = _mm_set_pd(tree.centre.y(), tree.centre.x()), centreZ = _mm_set_sd(tree.centre.z()),
                  unit = _mm_set1_pd(tree.unit);
    // Vertices that no triangle uses may be too far away for a float: infinite, and never looked at.
    const auto put = [&](OwnPosition& to, __m128d xy, __m128d z0) {
        const __m128d ownXy = _mm_mul_pd(_mm_sub_pd(xy, centre), unit),
                      ownZ0 = _mm_mul_pd(_mm_sub_pd(z0, centreZ), unit);
        _mm_store_ps(to.xyz0, _mm_movelh_ps(_mm_cvtpd_ps(ownXy), _mm_cvtpd_ps(ownZ0)));
    };
    if (const float* p = from.floats()) {
        for (OwnPosition& to : out) {
            put(to, _mm_set_pd(static_cast<double>(p[1]), static_cast<double>(p[0])),
                _mm_set_sd(static_cast<double>(p[2])));
            p += 3;
        }
    } else if (const double* q = from.doubles()) {
        for (OwnPosition& to : out) {
            put(to, _mm_loadu_pd(q), _mm_load_sd(q + 2));
            q += 3;
        }
    }
    return out;
}

bool hasManyPlates(const TreeStorage& tree) {
    const unsigned rows = rowsOf(tree.options.volume), half = rows / 2;
    if (tree.empty() || shapeOf(tree.options.volume) < kernel::Shape::kDop6) return false;
    // A plate is sixteen times as wide as it is thick, and a quarter of them are many: of a surface that is turned
    // every way, less than a twentieth lies so close along some direction. A thousand volumes are enough to tell.
    constexpr std::size_t kNodes = 64;
    constexpr float kWide = 16;
    std::size_t all = 0, plates = 0;
    const std::size_t step = (tree.nodeCount() + kNodes - 1) / kNodes;
    for (std::size_t node = 0; node < tree.nodeCount(); node += step)
        for (unsigned lane = 0; lane < kernel::kWidth; ++lane) {
            if (tree.children[node * kernel::kWidth + lane] == kernel::kNoChild) continue;
            const TreeStorage::VolumeRow* const row = &tree.volumes[node * rows];
            float least = 3e38f, most = 0;
            for (unsigned i = 0; i < half; ++i) {
                // Directions beyond the third are longer than 1; by how much matters little.
                const float width = row[i].lane[lane] + row[i + half].lane[lane];
                least = std::min(least, width);
                most = std::max(most, width);
            }
            ++all;
            plates += least * kWide < most;
        }
    return 4 * plates > all;
}

}  // namespace tessera
