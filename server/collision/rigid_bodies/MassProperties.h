/// How matter is spread in a body: volume, centre, inertia.
#pragma once

#include "common/math/Box.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera::rigid {

/// ∫ dV, ∫ x dV, ∫ x xᵀ dV over a solid of density 1.
struct VolumeMoments {
    double volume = 0;
    Vec3d first = Vec3d::Zero();
    Mat3d second = Mat3d::Zero();

    VolumeMoments& operator+=(const VolumeMoments& o) {
        volume += o.volume;
        first += o.first;
        second += o.second;
        return *this;
    }
};

/// What a closed surface encloses, in its own frame, exact to rounding: signed tetrahedra from one point (B. Mirtich,
/// "Fast and Accurate Computation of Polyhedral Mass Properties", 1996, does the same by faces). Turned inside out:
/// negative.
[[nodiscard]] VolumeMoments momentsOf(const TriangleMesh& mesh);
/// Of a solid box; sides without length count as a hundredth of the longest.
[[nodiscard]] VolumeMoments momentsOf(const Box& box);
/// The same solid seen in another frame; always of positive volume.
[[nodiscard]] VolumeMoments transformed(const Affine3d& m, const VolumeMoments& moments);

struct MassProperties {
    Vec3d centre = Vec3d::Zero();
    double mass = 1;
    Mat3d inertia = Mat3d::Identity(), inverseInertia = Mat3d::Identity();  ///< about the centre
};

/// Spread evenly over the volume. Positive definite whatever the moments are: directions without extent get a little.
/// `size`: of the body, where there is no volume to go by.
[[nodiscard]] MassProperties massProperties(const VolumeMoments& moments, double mass, double size,
                                            const Vec3d& middle);

}  // namespace tessera::rigid
