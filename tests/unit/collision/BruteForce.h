/// Every face against every face.
#pragma once

#include <algorithm>
#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

inline std::vector<FacePair> bruteForce(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b) {
    const auto boxOf = [](const Triangle& t) {
        Box box;
        for (const Vec3d& p : t) box.extend(p);
        return box;
    };
    std::vector<Triangle> ofA;
    std::vector<Box> boxes;
    for (std::uint32_t f = 0; f < a.faceCount(); ++f) {
        ofA.push_back(a.triangle(f));
        boxes.push_back(boxOf(ofA.back()));
    }
    std::vector<FacePair> pairs;
    for (std::uint32_t g = 0; g < b.faceCount(); ++g) {
        const Triangle t = transformed(a_T_b, b.triangle(g));
        const Box box = boxOf(t);
        // Boxes of exact vertices: sets that meet have overlapping boxes, so this leaves out nothing.
        for (std::uint32_t f = 0; f < ofA.size(); ++f)
            if (boxes[f].overlaps(box) && trianglesIntersect(ofA[f], t)) pairs.push_back({f, g});
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

}  // namespace tessera
