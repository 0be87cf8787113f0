#include "server/collision/representation/PartPairs.h"

namespace tessera {

PartPair::PartPair(const BodyParts& partsA, const BodyParts& partsB, const Affine3d& map)
    : a(partsA), b(partsB), a_T_b(map), reach(0) {
    PartBoxes boxes;
    for (const BodyParts* parts : {&a, &b}) {
        parts->whole(boxes);
        if (boxes.count > 0) reach = std::max(reach, reachOf(boxes.box(0)).maxCoeff());
    }
}

void PartPair::place(std::uint32_t leafA, std::uint32_t leafB, PlacedFaces& facesA, PlacedFaces& facesB) const {
    a.faces(leafA, facesA.faces);
    b.faces(leafB, facesB.faces);
    for (unsigned i = 0; i < facesA.faces.count; ++i) facesA.triangle[i] = a.triangle(facesA.faces.face[i]);
    for (unsigned i = 0; i < facesB.faces.count; ++i)
        facesB.triangle[i] = transformed(a_T_b, b.triangle(facesB.faces.face[i]));
    for (PlacedFaces* faces : {&facesA, &facesB})
        for (unsigned i = 0; i < faces->faces.count; ++i) {
            faces->box[i] = {};
            for (const Vec3d& p : faces->triangle[i]) faces->box[i].extend(p);
        }
}

double gapBetween(const Box& a, const Box& b) {
    const Vec3d gap = (b.lower - a.upper).cwiseMax(a.lower - b.upper).cwiseMax(0.0);
    const double length = gap.norm();
    return length < std::numeric_limits<double>::infinity() ? length : gap.maxCoeff();
}

double gapAlongMiddles(const Triangle& a, const Triangle& b) {
    const Vec3d u = (b[0] + b[1] + b[2]) - (a[0] + a[1] + a[2]);
    const double length = u.norm();
    if (!(length > 0)) return 0;
    const double low = std::min({u.dot(b[0]), u.dot(b[1]), u.dot(b[2])}),
                 high = std::max({u.dot(a[0]), u.dot(a[1]), u.dot(a[2])});
    return (low - high) / length;
}

}  // namespace tessera
