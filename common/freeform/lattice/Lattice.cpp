#include "common/freeform/lattice/Lattice.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace tessera {

namespace {

/// How far beyond the volume, in parameters, a point still counts as on its face: a model's box is made of its own
/// points.
constexpr double kOnFace = 1e-9;
constexpr double kMostCoordinate = 1e50;

bool usable(const Vec3d& p) {
    return (p.cwiseAbs().array() <= kMostCoordinate).all();
}

}  // namespace

/// The functions of an axis that are not zero at a parameter: of points `first` to first + degree.
struct Lattice::Basis {
    unsigned first = 0, count = 0;
    std::array<double, kMostDegree + 1> value{}, derivative{};
};

double Lattice::knot(std::size_t axis, int i) const {
    // degree + 1 times 0, then even steps, degree + 1 times 1.
    const int degree = static_cast<int>(axes_[axis].degree), intervals = static_cast<int>(axes_[axis].points) - degree;
    return static_cast<double>(std::clamp(i - degree, 0, intervals)) / intervals;
}

unsigned Lattice::spanOf(std::size_t axis, double parameter) const {
    const unsigned intervals = axes_[axis].points - axes_[axis].degree;
    const double at = std::floor(parameter * intervals);
    return static_cast<unsigned>(std::clamp(at, 0.0, intervals - 1.0));
}

Lattice::Basis Lattice::basis(std::size_t axis, double x, bool derivatives) const {
    const unsigned degree = axes_[axis].degree;
    Basis b;
    b.first = spanOf(axis, x);
    b.count = degree + 1;
    const int span = static_cast<int>(b.first + degree);
    // Cox and de Boor's recurrence, degree by degree; the one before the last has the derivatives.
    std::array<double, kMostDegree + 1> lower{};
    b.value[0] = 1;
    for (unsigned d = 1; d <= degree; ++d) {
        if (d == degree) lower = b.value;
        double carried = 0;
        for (unsigned r = 0; r < d; ++r) {
            const double right = knot(axis, span + static_cast<int>(r) + 1),
                         left = knot(axis, span + 1 - static_cast<int>(d - r));
            const double share = b.value[r] / (right - left);
            b.value[r] = carried + (right - x) * share;
            carried = (x - left) * share;
        }
        b.value[d] = carried;
    }
    if (!derivatives) return b;
    // N' of function i = degree · (N_i of one degree less over its knots, less the next one's).
    for (unsigned r = 0; r <= degree; ++r) {
        double sum = 0;
        const int i = static_cast<int>(b.first + r);
        if (r > 0) sum += lower[r - 1] / (knot(axis, i + static_cast<int>(degree)) - knot(axis, i));
        if (r < degree) sum -= lower[r] / (knot(axis, i + static_cast<int>(degree) + 1) - knot(axis, i + 1));
        b.derivative[r] = degree * sum;
    }
    return b;
}

Expected<Lattice> Lattice::make(const LatticeVolume& volume, const std::array<LatticeAxis, 3>& axes) {
    Lattice lattice;
    for (std::size_t a = 0; a < 3; ++a) {
        const std::string name = "axis " + std::to_string(a) + " of a lattice: ";
        if (axes[a].degree == 0 || axes[a].degree > kMostDegree)
            return fail(ErrorCode::kBadInput, name + "degree " + std::to_string(axes[a].degree) + ", from 1 to " +
                                                  std::to_string(kMostDegree));
        if (axes[a].points <= axes[a].degree || axes[a].points > kMostPoints)
            return fail(ErrorCode::kBadInput, name + std::to_string(axes[a].points) + " points, from " +
                                                  std::to_string(axes[a].degree + 1) + " to " +
                                                  std::to_string(kMostPoints));
    }
    const Mat3d& m = volume.axes;
    if (!usable(volume.origin) || !usable(m.col(0)) || !usable(m.col(1)) || !usable(m.col(2)))
        return fail(ErrorCode::kBadInput, "the volume of a lattice is not finite, or too large");
    const Vec3d lengths(m.col(0).stableNorm(), m.col(1).stableNorm(), m.col(2).stableNorm());
    if (!(lengths.minCoeff() > 1e-50)) return fail(ErrorCode::kBadInput, "the volume of a lattice is flat");
    // Of unit axes, so that neither a product of three lengths nor a quotient leaves double.
    const Mat3d unit = m * lengths.cwiseInverse().asDiagonal();
    if (!(std::abs(unit.determinant()) > 1e-12)) return fail(ErrorCode::kBadInput, "the volume of a lattice is flat");
    lattice.volume_ = volume;
    lattice.toParameters_ = lengths.cwiseInverse().asDiagonal() * unit.inverse();
    lattice.axes_ = axes;
    lattice.controlPoints_.resize(std::size_t{axes[0].points} * axes[1].points * axes[2].points);
    for (std::size_t i = 0; i < lattice.controlPoints_.size(); ++i) lattice.controlPoints_[i] = lattice.atRest(i);
    return lattice;
}

Vec3d Lattice::atRest(std::size_t control) const {
    // Greville's abscissae, the means of a function's inner knots: with these the functions sum to the parameter
    // itself.
    Vec3d parameter;
    for (std::size_t a = 0; a < 3; ++a) {
        const int i = static_cast<int>(control % axes_[a].points), degree = static_cast<int>(axes_[a].degree);
        control /= axes_[a].points;
        double sum = 0;
        for (int k = 1; k <= degree; ++k) sum += knot(a, i + k);
        parameter[static_cast<int>(a)] = sum / degree;
    }
    return volume_.origin + volume_.axes * parameter;
}

Expected<void> Lattice::setControlPoints(std::size_t first, std::span<const Vec3d> points) {
    if (first > controlPoints_.size() || points.size() > controlPoints_.size() - first)
        return fail(ErrorCode::kBadInput, std::to_string(points.size()) + " control points from " +
                                              std::to_string(first) + " on, of " +
                                              std::to_string(controlPoints_.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!usable(points[i]))
            return fail(ErrorCode::kBadInput,
                        "control point " + std::to_string(first + i) + " is not finite, or too large");
    std::copy(points.begin(), points.end(), controlPoints_.begin() + static_cast<std::ptrdiff_t>(first));
    return {};
}

bool Lattice::contains(const Vec3d& x) const {
    const Vec3d p = parameters(x);
    return p.minCoeff() >= -kOnFace && p.maxCoeff() <= 1 + kOnFace;
}

Vec3d Lattice::combine(const std::array<Basis, 3>& bases) const {
    Vec3d sum = Vec3d::Zero();
    for (unsigned k = 0; k < bases[2].count; ++k)
        for (unsigned j = 0; j < bases[1].count; ++j) {
            const double weight = bases[2].value[k] * bases[1].value[j];
            const Vec3d* const row =
                controlPoints_.data() + index(bases[0].first, bases[1].first + j, bases[2].first + k);
            for (unsigned i = 0; i < bases[0].count; ++i) sum += weight * bases[0].value[i] * row[i];
        }
    return sum;
}

Vec3d Lattice::deformed(const Vec3d& x) const {
    if (!contains(x)) return x;
    const Vec3d p = parameters(x);
    return combine({basis(0, p[0], false), basis(1, p[1], false), basis(2, p[2], false)});
}

Lattice::Place Lattice::place(const Vec3d& x) const {
    if (!contains(x)) return {x, Mat3d::Identity()};
    const Vec3d p = parameters(x);
    const std::array<Basis, 3> bases{basis(0, p[0], true), basis(1, p[1], true), basis(2, p[2], true)};
    Place out;
    out.point = combine(bases);
    Mat3d byParameters;
    for (std::size_t a = 0; a < 3; ++a) {
        std::array<Basis, 3> along = bases;
        along[a].value = along[a].derivative;
        byParameters.col(static_cast<int>(a)) = combine(along);
    }
    out.jacobian = byParameters * toParameters_;
    return out;
}

void Lattice::deform(std::span<const float> from, std::span<float> to) const {
    for (std::size_t i = 0; i + 2 < from.size(); i += 3) {
        const Vec3f moved = deformed(Vec3d(from[i], from[i + 1], from[i + 2])).cast<float>();
        for (int k = 0; k < 3; ++k) to[i + static_cast<std::size_t>(k)] = moved[k];
    }
}

void Lattice::deform(std::span<const float> from, std::span<const float> normalsFrom, std::span<float> to,
                     std::span<float> normalsTo) const {
    for (std::size_t i = 0; i + 2 < from.size(); i += 3) {
        const Place moved = place(Vec3d(from[i], from[i + 1], from[i + 2]));
        const Vec3d normal =
            deformedNormal(moved.jacobian, Vec3d(normalsFrom[i], normalsFrom[i + 1], normalsFrom[i + 2]));
        for (int k = 0; k < 3; ++k) {
            to[i + static_cast<std::size_t>(k)] = static_cast<float>(moved.point[k]);
            normalsTo[i + static_cast<std::size_t>(k)] = static_cast<float>(normal[k]);
        }
    }
}

Box Lattice::bounds(const Box& box) const {
    if (box.empty()) return {};
    Box out, inside;
    const Vec3d centre = parameters(box.center()), reach = toParameters_.cwiseAbs() * (0.5 * box.size());
    inside.lower = (centre - reach).array() - kOnFace;
    inside.upper = (centre + reach).array() + kOnFace;
    // What is outside stays where it is.
    const bool allInside = inside.lower.minCoeff() >= -2 * kOnFace && inside.upper.maxCoeff() <= 1 + 2 * kOnFace;
    if (!allInside) out = box;
    if ((inside.upper.array() < -kOnFace).any() || (inside.lower.array() > 1 + kOnFace).any()) return out;
    std::array<unsigned, 3> first{}, end{};
    for (std::size_t a = 0; a < 3; ++a) {
        const int k = static_cast<int>(a);
        first[a] = spanOf(a, std::clamp(inside.lower[k], 0.0, 1.0));
        end[a] = spanOf(a, std::clamp(inside.upper[k], 0.0, 1.0)) + axes_[a].degree + 1;
    }
    Box hull;
    for (unsigned k = first[2]; k < end[2]; ++k)
        for (unsigned j = first[1]; j < end[1]; ++j)
            for (unsigned i = first[0]; i < end[0]; ++i) hull.extend(controlPoints_[index(i, j, k)]);
    // Beyond a face by 1e-9 a value leaves the hull by at most that times the derivative: degree · intervals · the
    // hull's size, for each axis. And sums are rounded, by less than 1e-13 of the largest.
    double steepness = 0;
    for (const LatticeAxis& axis : axes_) steepness += axis.degree * static_cast<double>(axis.points - axis.degree);
    const Vec3d slack =
        2 * kOnFace * steepness * hull.size() + 1e-13 * hull.lower.cwiseAbs().cwiseMax(hull.upper.cwiseAbs());
    hull.lower -= slack;
    hull.upper += slack;
    out.extend(hull);
    return out;
}

Box Lattice::support(std::size_t control) const {
    Box out;
    for (std::size_t a = 0; a < 3; ++a) {
        const int i = static_cast<int>(control % axes_[a].points), k = static_cast<int>(a);
        control /= axes_[a].points;
        out.lower[k] = knot(a, i);
        out.upper[k] = knot(a, i + static_cast<int>(axes_[a].degree) + 1);
    }
    return out;
}

Vec3d deformedNormal(const Mat3d& j, const Vec3d& normal) {
    // The cofactors are the inverse transpose times the determinant, and there where that is 0, too.
    const double size = j.cwiseAbs().maxCoeff(), length = normal.cwiseAbs().maxCoeff();
    if (!(size > 0 && length > 0 && std::isfinite(size) && std::isfinite(length))) return Vec3d::Zero();
    const Mat3d m = j / size;
    Mat3d cofactors;
    cofactors.col(0) = m.col(1).cross(m.col(2));
    cofactors.col(1) = m.col(2).cross(m.col(0));
    cofactors.col(2) = m.col(0).cross(m.col(1));
    const double side = m.col(0).dot(cofactors.col(0)) < 0 ? -1 : 1;
    const Vec3d turned = side * (cofactors * (normal / length));
    const double turnedLength = turned.norm();
    return turnedLength > 1e-30 ? Vec3d(turned / turnedLength) : Vec3d::Zero();
}

}  // namespace tessera
