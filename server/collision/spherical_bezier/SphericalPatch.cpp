#include "server/collision/spherical_bezier/SphericalPatch.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace tessera {

Expected<SphericalTriangle> SphericalTriangle::make(const std::array<Vec3d, 3>& directions) {
    SphericalTriangle t;
    for (std::size_t i = 0; i < 3; ++i) {
        const double largest = directions[i].cwiseAbs().maxCoeff();
        if (!(directions[i].allFinite() && largest > 0))
            return fail(ErrorCode::kBadInput,
                        "corner " + std::to_string(i) + " of a spherical triangle is no direction");
        // First by the largest: squares of tiny and of huge numbers are none.
        t.corners_[i] = (directions[i] / largest).normalized();
    }
    Mat3d corners;
    for (int i = 0; i < 3; ++i) corners.col(i) = t.corners_[static_cast<std::size_t>(i)];
    const double volume = corners.determinant();
    if (!(std::abs(volume) > 1e-9))
        return fail(ErrorCode::kBadInput, "the corners of a spherical triangle lie in a plane through its centre");
    t.toCoordinates_ = corners.inverse();
    // n · corner is the same for all three: n is along the sum of the inverse's rows, and their sum at n / |…| is 1.
    const Vec3d sum = t.toCoordinates_.colwise().sum().transpose();
    t.height_ = std::min(1.0, 1 / sum.norm());
    t.axis_ = sum.normalized();
    return t;
}

bool SphericalTriangle::contains(const Vec3d& v, double margin) const {
    return coordinates(v).minCoeff() >= -margin * v.norm();
}

namespace {

/// One step of de Casteljau: from degree d to d - 1, in place.
void reduce(std::vector<double>& c, unsigned degree, const Vec3d& b) {
    for (unsigned row = 0; row < degree; ++row)
        for (unsigned place = 0; place <= row; ++place) {
            // c_ijk of degree - 1 from c_i+1 jk, c_i j+1 k, c_ij k+1: the same place in this row, and two in the next.
            const std::size_t here = row * (row + 1) / 2 + place, below = (row + 1) * (row + 2) / 2 + place;
            c[here] = b[0] * c[here] + b[1] * c[below] + b[2] * c[below + 1];
        }
}

}  // namespace

Expected<SphericalPatch> SphericalPatch::make(const SphericalTriangle& domain, unsigned degree,
                                              std::vector<double> coefficients) {
    if (degree > kMostDegree)
        return fail(ErrorCode::kBadInput, "a spherical patch of degree " + std::to_string(degree) + ", at most " +
                                              std::to_string(kMostDegree));
    if (coefficients.size() != coefficientCount(degree))
        return fail(ErrorCode::kBadInput,
                    std::to_string(coefficients.size()) + " coefficients for degree " + std::to_string(degree));
    for (const double c : coefficients)
        if (!std::isfinite(c)) return fail(ErrorCode::kBadInput, "a coefficient of a spherical patch is not finite");
    return SphericalPatch(domain, degree, std::move(coefficients));
}

double SphericalPatch::evaluate(const Vec3d& v) const {
    const Vec3d b = domain_.coordinates(v);
    std::vector<double> c = coefficients_;
    for (unsigned d = degree_; d > 0; --d) reduce(c, d, b);
    return c[0];
}

double SphericalPatch::blossom(const std::vector<Vec3d>& arguments) const {
    std::vector<double> c = coefficients_;
    for (unsigned d = degree_; d > 0; --d) reduce(c, d, domain_.coordinates(arguments[degree_ - d]));
    return c[0];
}

SphericalPatch SphericalPatch::over(const SphericalTriangle& domain) const {
    std::vector<double> c(coefficients_.size());
    std::vector<Vec3d> arguments(degree_);
    for (unsigned i = 0; i <= degree_; ++i)
        for (unsigned j = 0; i + j <= degree_; ++j) {
            for (unsigned n = 0; n < degree_; ++n) arguments[n] = domain.corner(n < i ? 0 : n < i + j ? 1 : 2);
            c[place(degree_, i, j)] = blossom(arguments);
        }
    return {domain, degree_, std::move(c)};
}

std::array<SphericalTriangle, 4> splitAtEdges(const SphericalTriangle& t) {
    const Vec3d &a = t.corner(0), &b = t.corner(1), &c = t.corner(2);
    const Vec3d ab = a + b, bc = b + c, ca = c + a;
    // A triangle smaller than half the sphere has no opposite corners, so its edges have middles; parts of it are
    // smaller.
    const auto part = [](const Vec3d& x, const Vec3d& y, const Vec3d& z) {
        return SphericalTriangle::make({x, y, z}).value();
    };
    return {part(a, ab, ca), part(ab, b, bc), part(ca, bc, c), part(bc, ca, ab)};
}

std::array<SphericalPatch, 4> SphericalPatch::split() const {
    const std::array<SphericalTriangle, 4> parts = splitAtEdges(domain_);
    return {over(parts[0]), over(parts[1]), over(parts[2]), over(parts[3])};
}

RadialRange SphericalPatch::range() const {
    const auto [least, most] = std::minmax_element(coefficients_.begin(), coefficients_.end());
    // Rounding: the height is right to some 1e-15 / height, the factor to as much times the degree.
    const double factor = std::pow(domain_.height(), -static_cast<double>(degree_)) * (1 + 1e-9);
    return {std::min(*least, *least * factor), std::max(*most, *most * factor)};
}

RadialRange SphericalPatch::range(unsigned splits) const {
    RadialRange whole = range();
    if (splits == 0) return whole;
    RadialRange parts{whole.upper, whole.lower};
    for (const SphericalPatch& part : split()) {
        const RadialRange one = part.range(splits - 1);
        parts.lower = std::min(parts.lower, one.lower);
        parts.upper = std::max(parts.upper, one.upper);
    }
    // Both hold p.
    return {std::max(whole.lower, parts.lower), std::min(whole.upper, parts.upper)};
}

}  // namespace tessera
