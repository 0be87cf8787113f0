#include "server/collision/tree/TreeStorage.h"

#include <immintrin.h>

namespace tessera {

kernel::Shape shapeOf(VolumeKind kind) {
    switch (kind) {
        case VolumeKind::kSphere: return kernel::Shape::kSphere;
        case VolumeKind::kObb: return kernel::Shape::kObb;
        case VolumeKind::kAabb:
        case VolumeKind::kDop6: return kernel::Shape::kDop6;
        case VolumeKind::kDop14: return kernel::Shape::kDop14;
        case VolumeKind::kDop18: return kernel::Shape::kDop18;
        case VolumeKind::kDop26: return kernel::Shape::kDop26;
    }
    return kernel::Shape::kObb;
}

unsigned rowsOf(VolumeKind kind) {
    constexpr unsigned rows[kernel::kShapes] = {4, 15, 6, 14, 18, 26};
    return rows[static_cast<std::size_t>(shapeOf(kind))];
}

std::vector<OwnPosition> ownPositions(const TreeStorage& tree) {
    const MeshPositions from = tree.mesh.positions();
    std::vector<OwnPosition> out(from.size());
    const __m128d centre = _mm_set_pd(tree.centre.y(), tree.centre.x()), centreZ = _mm_set_sd(tree.centre.z()), unit = _mm_set1_pd(tree.unit);
    // Vertices that no triangle uses may be too far away for a float: infinite, and never looked at.
    const auto put = [&](OwnPosition& to, __m128d xy, __m128d z0) {
        const __m128d ownXy = _mm_mul_pd(_mm_sub_pd(xy, centre), unit), ownZ0 = _mm_mul_pd(_mm_sub_pd(z0, centreZ), unit);
        _mm_store_ps(to.xyz0, _mm_movelh_ps(_mm_cvtpd_ps(ownXy), _mm_cvtpd_ps(ownZ0)));
    };
    if (const float* p = from.floats()) {
        for (OwnPosition& to : out) {
            put(to, _mm_set_pd(static_cast<double>(p[1]), static_cast<double>(p[0])), _mm_set_sd(static_cast<double>(p[2])));
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

}  // namespace tessera
