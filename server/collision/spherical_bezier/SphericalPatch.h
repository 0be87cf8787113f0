/// Bernstein-Bézier polynomials on a spherical triangle: homogeneous polynomials in space, looked at on the sphere.
///
/// p(v) = sum over i + j + k = d of c_ijk · d! / (i! j! k!) · b0^i b1^j b2^k with v's spherical barycentric coordinates
/// b. Since b is linear in v, p is a homogeneous polynomial of degree d, and evaluation and subdivision are the
/// plane's.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/spherical_bezier/SphericalTriangle.h"

namespace tessera {

struct RadialRange {
    double lower = 0, upper = 0;
};

class SphericalPatch {
public:
    static constexpr unsigned kMostDegree = 12;

    [[nodiscard]] static constexpr std::size_t coefficientCount(unsigned degree) {
        return (degree + 1) * (degree + 2) / 2;
    }
    /// Of c_ijk, k = degree - i - j: rows of equal i, the largest i first, in each the largest j first.
    [[nodiscard]] static constexpr std::size_t place(unsigned degree, unsigned i, unsigned j) {
        const std::size_t row = degree - i;
        return row * (row + 1) / 2 + (row - j);
    }

    /// kBadInput where the degree is above kMostDegree, or for another number of coefficients, or one that is not
    /// finite.
    [[nodiscard]] static Expected<SphericalPatch> make(const SphericalTriangle& domain, unsigned degree,
                                                       std::vector<double> coefficients);

    [[nodiscard]] const SphericalTriangle& domain() const { return domain_; }
    [[nodiscard]] unsigned degree() const { return degree_; }
    [[nodiscard]] const std::vector<double>& coefficients() const { return coefficients_; }

    /// De Casteljau's algorithm. Any v: outside of the triangle, and of any length, it is the polynomial's
    /// continuation.
    [[nodiscard]] double evaluate(const Vec3d& v) const;
    /// The symmetric function, linear in each of its `degree` arguments, that is p(v) where all are v (the polar form).
    [[nodiscard]] double blossom(const std::vector<Vec3d>& arguments) const;
    /// The same polynomial over another triangle: its coefficient ijk is the polar form at i times corner 0, j times
    /// corner 1 and k times corner 2.
    [[nodiscard]] SphericalPatch over(const SphericalTriangle& domain) const;
    /// Into four at the middles of the edges; the last is the inner one.
    [[nodiscard]] std::array<SphericalPatch, 4> split() const;

    /// Holds p on the triangle. The basis functions are not negative there and sum to s^degree, s the sum of the
    /// coordinates, which is not 1 as in the plane but anything from 1 to 1 / height: so p lies between the least
    /// coefficient times that and the largest times that. For small triangles the height is near 1 and the range near
    /// the plane's.
    [[nodiscard]] RadialRange range() const;
    /// Tighter: of all parts after so many splits.
    [[nodiscard]] RadialRange range(unsigned splits) const;

private:
    SphericalPatch(const SphericalTriangle& domain, unsigned degree, std::vector<double> coefficients)
        : domain_(domain), degree_(degree), coefficients_(std::move(coefficients)) {}

    SphericalTriangle domain_;
    unsigned degree_ = 0;
    std::vector<double> coefficients_;
};

/// The four triangles that `split` makes: at corner 0, 1, 2, and the inner one.
[[nodiscard]] std::array<SphericalTriangle, 4> splitAtEdges(const SphericalTriangle& triangle);

}  // namespace tessera
