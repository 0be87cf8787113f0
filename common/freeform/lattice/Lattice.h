/// Freeform deformation: whatever is inside a volume follows a lattice of control points (T. W. Sederberg, S. R. Parry:
/// Free-form deformation of solid geometric models, SIGGRAPH 1986).
///
/// A point has parameters s, t, u in the volume, 0 to 1 along its three axes. Where it goes is the sum of all control
/// points, each with the product of three basis functions, one per axis. The functions are B-splines over evenly spaced
/// knots whose end knots are repeated (C. de Boor 1972). With as many points as the degree and one they are Bernstein's
/// polynomials, the paper's own: then every control point moves everything inside. With more points each moves what is
/// within degree + 1 knot intervals around it.
///
/// What holds: control points at rest move nothing (to rounding); control points under an affine map move all that is
/// inside by that map; a deformed point is in the convex hull of the control points that reach it. Points outside of
/// the volume stay where they are, so the deformation is continuous where the outer layers of control points stay at
/// rest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Box.h"

namespace tessera {

/// origin + s · axes.col(0) + t · axes.col(1) + u · axes.col(2).
struct LatticeVolume {
    Vec3d origin = Vec3d::Zero();
    Mat3d axes = Mat3d::Identity();

    [[nodiscard]] static LatticeVolume of(const Box& box) { return {box.lower, box.size().asDiagonal()}; }
};

struct LatticeAxis {
    unsigned degree = 3;
    unsigned points = 4;  ///< at least degree + 1
};

/// Any number of threads may evaluate it, none while control points are set.
class Lattice {
public:
    static constexpr unsigned kMostDegree = 10;
    static constexpr unsigned kMostPoints = 64;  ///< along one axis

    /// Control points at rest. kBadInput: a degree of 0 or above kMostDegree, too few or too many points, a volume that
    /// is flat (its axes' determinant at most 1e-12 of the product of their lengths), not finite, or beyond 1e50.
    [[nodiscard]] static Expected<Lattice> make(const LatticeVolume& volume, const std::array<LatticeAxis, 3>& axes);

    [[nodiscard]] const LatticeVolume& volume() const { return volume_; }
    [[nodiscard]] const std::array<LatticeAxis, 3>& axes() const { return axes_; }

    // Control points, in the coordinates of what is deformed: the first axis' index runs fastest.
    [[nodiscard]] std::size_t index(unsigned i, unsigned j, unsigned k) const {
        return i + axes_[0].points * (j + std::size_t{axes_[1].points} * k);
    }
    [[nodiscard]] std::span<const Vec3d> controlPoints() const { return controlPoints_; }
    /// Where one is that moves nothing.
    [[nodiscard]] Vec3d atRest(std::size_t control) const;
    /// kBadInput, and nothing is changed: another number of points than there is room for from `first` on, or one that
    /// is not finite or beyond 1e50.
    Expected<void> setControlPoints(std::size_t first, std::span<const Vec3d> points);

    /// s, t, u.
    [[nodiscard]] Vec3d parameters(const Vec3d& x) const { return toParameters_ * (x - volume_.origin); }
    /// On the volume's faces, too, and beyond them by what rounding may do: 1e-9 of the axes.
    [[nodiscard]] bool contains(const Vec3d& x) const;

    [[nodiscard]] Vec3d deformed(const Vec3d& x) const;
    struct Place {
        Vec3d point = Vec3d::Zero();
        Mat3d jacobian = Mat3d::Identity();  ///< of the deformed point by x
    };
    [[nodiscard]] Place place(const Vec3d& x) const;
    /// Positions, xyz each, from `from` to `to`, which are as long and may be the same.
    void deform(std::span<const float> from, std::span<float> to) const;
    /// Normals, too; of unit length where they are not zero.
    void deform(std::span<const float> from, std::span<const float> normalsFrom, std::span<float> to,
                std::span<float> normalsTo) const;

    /// Holds wherever anything in `box` goes: the hull of the control points, of the part of the volume that the box is
    /// in.
    [[nodiscard]] Box bounds(const Box& box) const;
    /// The part of the volume that this control point moves, in parameters: all of it for Bernstein's polynomials.
    [[nodiscard]] Box support(std::size_t control) const;

private:
    struct Basis;

    Lattice() = default;
    [[nodiscard]] double knot(std::size_t axis, int i) const;
    [[nodiscard]] unsigned spanOf(std::size_t axis, double parameter) const;
    [[nodiscard]] Basis basis(std::size_t axis, double parameter, bool derivatives) const;
    [[nodiscard]] Vec3d combine(const std::array<Basis, 3>& bases) const;

    LatticeVolume volume_;
    Mat3d toParameters_ = Mat3d::Identity();
    std::array<LatticeAxis, 3> axes_;
    std::vector<Vec3d> controlPoints_;
};

/// The normal n of a surface at a place with this Jacobian J: along the inverse transpose of J times n, of unit length.
/// It stays on the side of the surface that it was on; where the deformation mirrors (a negative determinant), the
/// triangles' winding turns over and n does not. Where J is singular, the limit from the mirrored side's opposite; zero
/// where there is none.
[[nodiscard]] Vec3d deformedNormal(const Mat3d& jacobian, const Vec3d& normal);

}  // namespace tessera
