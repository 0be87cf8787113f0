/// Two bodies bounded by spherical Bézier patches, and no hierarchy: what the rejection leaves is compared face by
/// face. The thesis' method as it stands alone, for tests and for what it costs; the pipeline asks triangle trees
/// instead.
#pragma once

#include <algorithm>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/spherical_bezier/SphericalBezierTouch.h"

namespace tessera::patches {

struct FaceBox {
    Vec3d lower, upper;
    std::uint32_t face;
};

inline void sortUnique(std::vector<std::uint32_t>& v) {
    std::sort(v.begin(), v.end());
    v.erase(std::unique(v.begin(), v.end()), v.end());
}

/// Of these faces of a mesh, mapped, those whose boxes meet `region`.
inline std::vector<FaceBox> boxesOf(const TriangleMesh& mesh, const std::vector<std::uint32_t>& faces,
                                    const Affine3d* map, const Box& region) {
    std::vector<FaceBox> out;
    for (const std::uint32_t face : faces) {
        Triangle t = mesh.triangle(face);
        // As the predicate maps them: boxes of the very numbers that it looks at need no slack.
        if (map != nullptr) t = transformed(*map, t);
        const Vec3d lower = t[0].cwiseMin(t[1]).cwiseMin(t[2]), upper = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
        if ((lower.array() > region.upper.array()).any() || (upper.array() < region.lower.array()).any()) continue;
        out.push_back({lower, upper, face});
    }
    std::sort(out.begin(), out.end(), [](const FaceBox& x, const FaceBox& y) {
        return x.lower.x() != y.lower.x() ? x.lower.x() < y.lower.x() : x.face < y.face;
    });
    return out;
}

inline Box boxAround(const std::vector<FaceBox>& boxes) {
    Box box;
    for (const FaceBox& b : boxes) {
        box.extend(b.lower);
        box.extend(b.upper);
    }
    return box;
}

/// trianglesIntersect's answer: faces on the lists of what is left, by their boxes along one axis, sorted.
inline TouchedPair firstTouching(const SphericalBezierBound& a, const SphericalBezierBound& b, const Affine3d& a_T_b,
                                 QueryWork& work) {
    const std::vector<PatchPair> left = patchesThatMayMeet(a, b, a_T_b, work);
    if (left.empty()) return {};
    std::vector<std::uint32_t> patchesA, patchesB, facesA, facesB;
    for (const PatchPair& pair : left) {
        patchesA.push_back(pair.a);
        patchesB.push_back(pair.b);
    }
    sortUnique(patchesA);
    sortUnique(patchesB);
    for (const std::uint32_t p : patchesA)
        facesA.insert(facesA.end(), a.patches()[p].faces.begin(), a.patches()[p].faces.end());
    for (const std::uint32_t q : patchesB)
        facesB.insert(facesB.end(), b.patches()[q].faces.begin(), b.patches()[q].faces.end());
    sortUnique(facesA);
    sortUnique(facesB);
    const std::vector<FaceBox> ofB = boxesOf(b.mesh(), facesB, &a_T_b, a.mesh().bounds());
    const std::vector<FaceBox> ofA = boxesOf(a.mesh(), facesA, nullptr, boxAround(ofB));
    const auto meet = [&](const FaceBox& x, const FaceBox& y) {
        ++work.boxTests;
        if (x.lower.y() > y.upper.y() || y.lower.y() > x.upper.y() || x.lower.z() > y.upper.z() ||
            y.lower.z() > x.upper.z())
            return false;
        ++work.triangleTests;
        return trianglesIntersect(a.mesh().triangle(x.face), transformed(a_T_b, b.mesh().triangle(y.face)));
    };
    // Sorted by where they begin: of two that overlap along x one begins within the other.
    for (std::size_t i = 0, j = 0; i < ofA.size() && j < ofB.size();) {
        if (work.exhausted()) return {Touch::kUnknown, {}};
        if (ofA[i].lower.x() <= ofB[j].lower.x()) {
            for (std::size_t k = j; k < ofB.size() && ofB[k].lower.x() <= ofA[i].upper.x(); ++k)
                if (meet(ofA[i], ofB[k])) return {Touch::kYes, {ofA[i].face, ofB[k].face}};
            ++i;
        } else {
            for (std::size_t k = i; k < ofA.size() && ofA[k].lower.x() <= ofB[j].upper.x(); ++k)
                if (meet(ofA[k], ofB[j])) return {Touch::kYes, {ofA[k].face, ofB[j].face}};
            ++j;
        }
    }
    return {};
}

}  // namespace tessera::patches
