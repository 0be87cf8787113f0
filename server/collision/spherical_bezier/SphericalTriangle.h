/// Triangles on the unit sphere and their spherical barycentric coordinates (P. Alfeld, M. Neamtu, L. L. Schumaker:
/// Bernstein-Bézier polynomials on spheres and sphere-like surfaces, CAGD 13, 1996).
#pragma once

#include <array>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

/// Three directions that span space, in either orientation; what lies between them is smaller than half the sphere.
class SphericalTriangle {
public:
    /// Directions of any length. kBadInput where one is zero or not finite, or where the three lie (nearly, to 1e-9) in
    /// a plane through the centre.
    [[nodiscard]] static Expected<SphericalTriangle> make(const std::array<Vec3d, 3>& directions);

    [[nodiscard]] const Vec3d& corner(std::size_t i) const { return corners_[i]; }
    /// b with v = b0 corner0 + b1 corner1 + b2 corner2: by Cramer's rule det(v, v1, v2) / det(v0, v1, v2) and so on,
    /// linear in v. None is negative in the triangle. Inside, for |v| = 1, their sum is between 1 and 1 / height: with
    /// the unit normal n of the plane through the corners, n · corner = height for each, so n · v = height · sum; and n
    /// · v is at most 1, and at least height, since the sphere's part over the triangle lies beyond that plane.
    [[nodiscard]] Vec3d coordinates(const Vec3d& v) const { return toCoordinates_ * v; }
    [[nodiscard]] const Mat3d& toCoordinates() const { return toCoordinates_; }
    /// Distance of the plane through the corners from the centre, above 0 and at most 1.
    [[nodiscard]] double height() const { return height_; }
    /// n, towards the corners: no direction of the triangle is farther from it than its corners, and these are all
    /// alike far.
    [[nodiscard]] const Vec3d& axis() const { return axis_; }
    /// Whether v is in the cone, up to `margin` · |v|.
    [[nodiscard]] bool contains(const Vec3d& v, double margin = 0) const;

private:
    std::array<Vec3d, 3> corners_;
    Mat3d toCoordinates_;
    Vec3d axis_;
    double height_ = 1;
};

}  // namespace tessera
