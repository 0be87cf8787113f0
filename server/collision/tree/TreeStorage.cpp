#include "server/collision/tree/TreeStorage.h"

#include <emmintrin.h>

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
    const std::span<const Vec3d> from = tree.mesh.positions();
    std::vector<OwnPosition> out(from.size());
    const __m128d centre = _mm_set_pd(tree.centre.y(), tree.centre.x()), centreZ = _mm_set_sd(tree.centre.z()), unit = _mm_set1_pd(tree.unit);
    for (std::size_t i = 0; i < from.size(); ++i) {
        // Vertices that no triangle uses may be too far away for a float: infinite, and never looked at.
        const __m128d xy = _mm_mul_pd(_mm_sub_pd(_mm_loadu_pd(from[i].data()), centre), unit);
        const __m128d z0 = _mm_mul_pd(_mm_sub_pd(_mm_load_sd(from[i].data() + 2), centreZ), unit);
        _mm_store_ps(out[i].xyz0, _mm_movelh_ps(_mm_cvtpd_ps(xy), _mm_cvtpd_ps(z0)));
    }
    return out;
}

}  // namespace tessera
