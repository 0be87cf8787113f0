#include "server/collision/representation/BlockImpactBody.h"

#include <cmath>

namespace tessera {

namespace {

/// As TriangleTree chooses its own coordinates.
double unitFor(const Box& bounds) {
    const double reach = 0.5 * bounds.size().norm();
    return reach > 0 ? std::ldexp(1.0, std::clamp(-std::ilogb(reach) - 1, -200, 200)) : 1;
}

}  // namespace

BlockImpactBody::BlockImpactBody(const NumberedParts& bodyParts, const Box& bounds, const BodyMotion& motion)
    : ImpactBody(motion, bounds.center(), unitFor(bounds), 0.5 * bounds.size().norm() * unitFor(bounds) * (1 + 1e-12)),
      parts(bodyParts) {}

void BlockImpactBody::Rows::set(const BlockImpactBody& body, unsigned i, const Box& box) {
    // Coordinates of at most 1 in size, rounded to float.
    constexpr float kPad = 0x1p-22f;
    for (unsigned k = 0; k < 3; ++k) {
        const int axis = static_cast<int>(k);
        lane[k * kernel::kWidth + i] = body.own(box.upper[axis], axis) + kPad;
        lane[(k + 3) * kernel::kWidth + i] = kPad - body.own(box.lower[axis], axis);
    }
}

BlockImpactBody::Leaf BlockImpactBody::leaf(std::uint32_t part) const {
    LeafFaces faces;
    parts.faces(part, faces);
    Leaf out;
    out.count = faces.count;
    for (unsigned i = 0; i < kernel::kLeafFaces; ++i) {
        // Where there are fewer, the first again.
        out.faces[i] = faces.face[i < faces.count ? i : 0];
        const Triangle t = parts.triangle(out.faces[i]);
        for (unsigned corner = 0; corner < 3; ++corner)
            for (unsigned k = 0; k < 3; ++k)
                out.corners[(3 * corner + k) * kernel::kLeafFaces + i] =
                    own(t[corner][static_cast<int>(k)], static_cast<int>(k));
    }
    return out;
}

Extent BlockImpactBody::extentAlong(const BodyMoment& moment, std::uint32_t part, const Vec3d& n) const {
    const Box box = parts.box(part);
    const Vec3d m = moment.linear.transpose() * n;
    const double middle = n.dot(moment.place(box.center())), half = m.cwiseAbs().dot(0.5 * box.size());
    return {middle - half, middle + half};
}

}  // namespace tessera
