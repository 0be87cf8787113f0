#include "server/collision/rigid_bodies/MassProperties.h"

#include <algorithm>
#include <cmath>

namespace tessera::rigid {

VolumeMoments momentsOf(const TriangleMesh& mesh) {
    VolumeMoments sum;
    if (mesh.faceCount() == 0) return sum;
    // From the middle of the bounds: small numbers, little cancellation.
    const Vec3d origin = mesh.bounds().center();
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        const Vec3d a = mesh.corner(face, 0) - origin, b = mesh.corner(face, 1) - origin,
                    c = mesh.corner(face, 2) - origin;
        const double six = a.dot(b.cross(c));
        const Vec3d s = a + b + c;
        sum.volume += six / 6;
        sum.first += six / 24 * s;
        sum.second += six / 120 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
    }
    Affine3d back = Affine3d::Identity();
    back.translation() = origin;
    VolumeMoments out;
    out.volume = sum.volume;
    out.first = sum.first + sum.volume * origin;
    out.second = sum.second + sum.first * origin.transpose() + origin * sum.first.transpose() +
                 sum.volume * origin * origin.transpose();
    return out;
}

VolumeMoments momentsOf(const Box& box) {
    VolumeMoments out;
    if (box.empty()) return out;
    Vec3d side = box.size();
    side = side.cwiseMax(0.01 * side.maxCoeff());
    const Vec3d c = box.center();
    out.volume = side.prod();
    out.first = out.volume * c;
    const Vec3d spread = out.volume / 12 * side.cwiseAbs2();
    out.second = out.volume * c * c.transpose();
    out.second.diagonal() += spread;
    return out;
}

VolumeMoments transformed(const Affine3d& m, const VolumeMoments& from) {
    const Mat3d& l = m.linear();
    const Vec3d t = m.translation();
    const double grown = (from.volume < 0 ? -1 : 1) * std::abs(l.determinant());
    VolumeMoments out;
    const Vec3d first = l * from.first;
    const Mat3d second = l * from.second * l.transpose();
    out.volume = grown * from.volume;
    out.first = grown * (first + from.volume * t);
    out.second = grown * (second + first * t.transpose() + t * first.transpose() + from.volume * t * t.transpose());
    return out;
}

MassProperties massProperties(const VolumeMoments& moments, double mass, double size, const Vec3d& middle) {
    MassProperties out;
    out.mass = mass;
    out.centre = middle;
    Mat3d spread = Mat3d::Zero();
    if (moments.volume > 1e-12 * size * size * size) {
        const Vec3d centre = moments.first / moments.volume;
        const Mat3d about = moments.second / moments.volume - centre * centre.transpose();
        if (centre.allFinite() && about.allFinite() && (centre - middle).norm() <= size) {
            out.centre = centre;
            spread = 0.5 * (about + about.transpose());
        }
    }
    // A solid ball's, where nothing is known.
    if (!(spread.trace() > 1e-9 * size * size)) spread = Mat3d::Identity() * (size * size / 60);
    out.inertia = mass * (spread.trace() * Mat3d::Identity() - spread);
    const double third = out.inertia.trace() / 3;
    if (!(out.inertia.determinant() > 1e-5 * third * third * third)) out.inertia.diagonal().array() += 0.02 * third;
    out.inverseInertia = out.inertia.inverse();
    if (!out.inverseInertia.allFinite()) {
        const double like = std::max(mass * size * size / 10, 1e-300);
        out.inertia = Mat3d::Identity() * like;
        out.inverseInertia = Mat3d::Identity() / like;
    }
    return out;
}

}  // namespace tessera::rigid
