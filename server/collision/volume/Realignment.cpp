#include "server/collision/volume/Realignment.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// Half-planes by the signs of their directions: 13 + x + 3y + 9z for components of -1, 0, 1.
using PlaneBySigns = std::array<std::uint8_t, 27>;
constexpr int kStep[] = {1, 3, 9};
constexpr int kZero = 13;

PlaneBySigns planesOf(DirectionSet set) {
    PlaneBySigns planes{};
    const std::span<const Vec3d> all = directions(set);
    for (std::size_t i = 0; i < all.size(); ++i) {
        int code = 0;
        for (int axis = 0; axis < 3; ++axis) code += kStep[axis] * static_cast<int>(all[i][axis]);
        planes[static_cast<std::size_t>(kZero + code)] = static_cast<std::uint8_t>(i);
        planes[static_cast<std::size_t>(kZero - code)] = static_cast<std::uint8_t>(i + all.size());
    }
    return planes;
}

const PlaneBySigns& planesBySigns(DirectionSet set) {
    static const std::array<PlaneBySigns, 4> tables = {planesOf(DirectionSet::k6), planesOf(DirectionSet::k14),
                                                       planesOf(DirectionSet::k18), planesOf(DirectionSet::k26)};
    return tables[static_cast<std::size_t>(set)];
}

/// An axis, its sign as a step in the table's code, and how long p is along it.
struct SignedAxis {
    double size;
    int code;
};

WeightedPlanes weighted(DirectionSet source, const PlaneBySigns& at, const Vec3d& p) {
    std::array<SignedAxis, 3> axes;
    for (int i = 0; i < 3; ++i)
        axes[static_cast<std::size_t>(i)] = {std::abs(p[i]), std::signbit(p[i]) ? -kStep[i] : kStep[i]};
    if (axes[0].size < axes[1].size) std::swap(axes[0], axes[1]);
    if (axes[1].size < axes[2].size) std::swap(axes[1], axes[2]);
    if (axes[0].size < axes[1].size) std::swap(axes[0], axes[1]);
    const double a = axes[0].size, b = axes[1].size, c = axes[2].size;
    const auto plane = [&at](int code) { return at[static_cast<std::size_t>(kZero + code)]; };
    const int x = axes[0].code, y = axes[1].code, z = axes[2].code;
    switch (source) {
        case DirectionSet::k6:
            break;
        case DirectionSet::k14:
            return {{plane(x), plane(x + y + z), plane(x + y - z)}, {a - b, 0.5 * (b + c), 0.5 * (b - c)}};
        case DirectionSet::k18:
            if (a >= b + c) return {{plane(x), plane(x + y), plane(x + z)}, {std::max(0.0, a - b - c), b, c}};
            return {{plane(x + y), plane(x + z), plane(y + z)},
                    {0.5 * (a + b - c), 0.5 * (a + c - b), std::max(0.0, 0.5 * (b + c - a))}};
        case DirectionSet::k26:
            return {{plane(x), plane(x + y), plane(x + y + z)}, {a - b, b - c, c}};
    }
    return {{plane(x), plane(y), plane(z)}, {a, b, c}};
}

/// x, y and z are the first planes of every set, so a set's own table serves its box too.
DirectionSet chosenPlanes(DirectionSet source, PlaneChoice choice) {
    return choice == PlaneChoice::kBoxEnclosure ? DirectionSet::k6 : source;
}

/// At least |x| + |y| + |z| of every point inside and every right-hand side.
double extent(const KDop& whole) {
    double most = whole.magnitude(0) + whole.magnitude(1) + whole.magnitude(2);
    for (std::size_t i = 3; i < whole.count(); ++i) most = std::max(most, whole.magnitude(i));
    return most;
}

}  // namespace

WeightedPlanes weightedPlanes(DirectionSet source, const Vec3d& p, PlaneChoice choice) {
    return weighted(chosenPlanes(source, choice), planesBySigns(source), p);
}

PlaneWeights PlaneWeights::make(DirectionSet source, DirectionSet target, const Affine3d& a_T_b, PlaneChoice choice) {
    PlaneWeights w{.source = source, .target = target, .planes = {}, .offset = {}, .map = a_T_b};
    const PlaneBySigns& at = planesBySigns(source);
    const DirectionSet chosen = chosenPlanes(source, choice);
    const Mat3d rows = a_T_b.linear();
    const Vec3d t = a_T_b.translation();
    // Mᵀd is a signed sum of M's rows, as d·x is of coordinates.
    std::array<Projections, 4> sums;
    for (int column = 0; column < 3; ++column)
        sums[static_cast<std::size_t>(column)] = project(target, rows.col(column));
    sums[3] = project(target, t);
    for (std::size_t i = 0; i < directionCount(target); ++i) {
        w.planes[i] = weighted(chosen, at, Vec3d(sums[0][i], sums[1][i], sums[2][i]));
        w.offset[i] = sums[3][i];
    }
    return w;
}

Projections PlaneWeights::rounding(const KDop& whole) const {
    // With u = 2^-53, s = Σ|d||M| · extent and t = Σ|d||T|: p 2us, weights 6us (three, of two roundings each, times
    // |x·d_i| ≤ extent), h 2us, the sum 4u(s+t), T·d 2ut, the mapped points 4u(s+t), their projections 2u(s+t), those
    // of the other body's points 2u(s+t). That is 22us + 14ut; 2^-48 is 32u. 2^-1000 is for numbers that underflow.
    const Mat3d linear = map.linear().cwiseAbs();
    const Vec3d reach = linear.rowwise().sum() * extent(whole) + map.translation().cwiseAbs();
    const std::span<const Vec3d> d = directions(target);
    Projections slack{};
    for (std::size_t i = 0; i < d.size(); ++i) slack[i] = 0x1p-48 * d[i].cwiseAbs().dot(reach) + 0x1p-1000;
    return slack;
}

KDop realigned(const PlaneWeights& weights, const KDop& dop) {
    KDop out(weights.target);
    if (dop.empty()) return out;
    const Projections slack = weights.rounding(dop);
    const std::size_t n = dop.count();
    for (std::size_t i = 0; i < out.count(); ++i) {
        const WeightedPlanes& planes = weights.planes[i];
        double upper = weights.offset[i], lower = upper;
        for (std::size_t j = 0; j < 3; ++j) {
            const std::size_t plane = planes.plane[j];
            upper += planes.weight[j] * dop.halfPlane(plane);
            lower -= planes.weight[j] * dop.halfPlane(plane < n ? plane + n : plane - n);
        }
        out.upper[i] = upper + slack[i];
        out.lower[i] = lower - slack[i];
    }
    return out;
}

namespace {

float roundedUp(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) < x ? std::nextafterf(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace

FloatPlaneWeights forKernels(const PlaneWeights& weights, const KDop& whole) {
    FloatPlaneWeights out{};
    if (whole.empty()) return out;
    const std::size_t n = whole.count(), m = directionCount(weights.target);
    const Projections rounding = weights.rounding(whole);
    const double least = 0x1p-120 * (1 + extent(whole));
    for (std::size_t i = 0; i < m; ++i) {
        const WeightedPlanes& planes = weights.planes[i];
        double reach = std::abs(weights.offset[i]);
        for (std::size_t j = 0; j < 3; ++j) {
            const std::size_t plane = planes.plane[j], opposite = plane < n ? plane + n : plane - n;
            reach += planes.weight[j] * whole.magnitude(plane < n ? plane : plane - n);
            out.plane[i][j] = static_cast<std::uint8_t>(plane);
            out.plane[i + m][j] = static_cast<std::uint8_t>(opposite);
            out.weight[i][j] = out.weight[i + m][j] = static_cast<float>(planes.weight[j]);
        }
        const double slack = 6 * 0x1p-24 * reach + rounding[i] + least;
        out.offset[i] = roundedUp(weights.offset[i] + slack);
        out.offset[i + m] = roundedUp(slack - weights.offset[i]);
    }
    return out;
}

}  // namespace tessera
