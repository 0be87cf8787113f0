#include "server/collision/volume/Realignment.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// A vector's octant and the order of its sizes, as a number: no branch depends on the vector, since processors cannot
/// foresee which way it would go.
struct Cell {
    double size[3];   ///< of x, y, z
    unsigned order;   ///< bits: |x| < |y|, |y| < |z|, |x| < |z|
    unsigned octant;  ///< bits: signs of x, y, z
};

Cell cellOf(const Vec3d& p) {
    Cell cell{{std::abs(p.x()), std::abs(p.y()), std::abs(p.z())}, 0, 0};
    const double x = cell.size[0], y = cell.size[1], z = cell.size[2];
    cell.order = unsigned{x < y} | unsigned{y < z} << 1 | unsigned{x < z} << 2;
    cell.octant =
        unsigned{std::signbit(p.x())} | unsigned{std::signbit(p.y())} << 1 | unsigned{std::signbit(p.z())} << 2;
    return cell;
}

using Triple = std::array<std::uint8_t, 3>;

/// The axes from the largest size to the least: each goes behind those that are larger. (Two of the eight orders
/// contradict themselves and never come up.)
std::array<Triple, 8> axesByOrder() {
    std::array<Triple, 8> all{};
    for (unsigned order = 0; order < 8; ++order) {
        const unsigned xy = order & 1, yz = order >> 1 & 1, xz = order >> 2;
        all[order][xy + xz] = 0;
        all[order][1 - xy + yz] = 1;
        all[order][2 - yz - xz] = 2;
    }
    return all;
}

/// The half-planes for every cell; k18 has a second choice, where the largest is less than the sum of the others.
struct PlaneTable {
    std::array<std::array<std::array<Triple, 8>, 8>, 2> planes{};  ///< [choice][order][octant]
};

const std::array<Triple, 8>& axes() {
    static const std::array<Triple, 8> all = axesByOrder();
    return all;
}

PlaneTable planesOf(DirectionSet set, PlaneChoice choice) {
    const std::span<const Vec3d> all = directions(set);
    const auto planeOf = [&](const Vec3d& direction) {
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (all[i] == direction) return static_cast<std::uint8_t>(i);
            if (all[i] == -direction) return static_cast<std::uint8_t>(i + all.size());
        }
        return std::uint8_t{0};
    };
    PlaneTable table;
    for (unsigned order = 0; order < 8; ++order)
        for (unsigned octant = 0; octant < 8; ++octant) {
            std::array<Vec3d, 3> signedAxes;
            for (unsigned i = 0; i < 3; ++i) {
                const unsigned axis = axes()[order][i];
                signedAxes[i] = (octant >> axis & 1 ? -1 : 1) * Vec3d::Unit(axis);
            }
            const auto& [a, b, c] = signedAxes;
            std::array<std::array<Vec3d, 3>, 2> chosen;
            chosen.fill({a, b, c});
            if (choice == PlaneChoice::kThreePlanes) {
                if (set == DirectionSet::k14) chosen.fill({a, a + b + c, a + b - c});
                if (set == DirectionSet::k18) chosen = {{{a, a + b, a + c}, {a + b, a + c, b + c}}};
                if (set == DirectionSet::k26) chosen.fill({a, a + b, a + b + c});
            }
            for (unsigned k = 0; k < 2; ++k)
                for (unsigned i = 0; i < 3; ++i) table.planes[k][order][octant][i] = planeOf(chosen[k][i]);
        }
    return table;
}

const PlaneTable& planeTable(DirectionSet set, PlaneChoice choice) {
    static const std::array<std::array<PlaneTable, 2>, 4> tables = [] {
        std::array<std::array<PlaneTable, 2>, 4> all;
        for (std::size_t s = 0; s < 4; ++s)
            for (std::size_t c = 0; c < 2; ++c)
                all[s][c] = planesOf(static_cast<DirectionSet>(s), static_cast<PlaneChoice>(c));
        return all;
    }();
    return tables[static_cast<std::size_t>(set)][static_cast<std::size_t>(choice)];
}

/// `weights`: the set whose formula applies.
WeightedPlanes weighted(DirectionSet weights, const PlaneTable& table, const Vec3d& p) {
    const Cell cell = cellOf(p);
    const Triple& rank = axes()[cell.order];
    const double a = cell.size[rank[0]], b = cell.size[rank[1]], c = cell.size[rank[2]];
    const auto& planes = table.planes[0][cell.order][cell.octant];
    switch (weights) {
        case DirectionSet::k6:
            break;
        case DirectionSet::k14:
            return {planes, {a - b, 0.5 * (b + c), 0.5 * (b - c)}};
        case DirectionSet::k18: {
            const bool inner = a < b + c;
            const double rest =
                std::abs(a - b - c);  // of the sign that `inner` says but for rounding, which counts as such
            return {table.planes[inner][cell.order][cell.octant],
                    {inner ? 0.5 * (a + b - c) : rest, inner ? 0.5 * (a + c - b) : b, inner ? 0.5 * rest : c}};
        }
        case DirectionSet::k26:
            return {planes, {a - b, b - c, c}};
    }
    return {planes, {a, b, c}};
}

DirectionSet formula(DirectionSet source, PlaneChoice choice) {
    return choice == PlaneChoice::kBoxEnclosure ? DirectionSet::k6 : source;
}

/// At least |x| + |y| + |z| of every point inside and every right-hand side.
double extent(const KDop& whole) {
    double most = whole.magnitude(0) + whole.magnitude(1) + whole.magnitude(2);
    for (std::size_t i = 3; i < whole.count(); ++i) most = std::max(most, whole.magnitude(i));
    return most;
}

}  // namespace

PlaneWeights PlaneWeights::make(DirectionSet source, DirectionSet target, const Affine3d& a_T_b, PlaneChoice choice) {
    PlaneWeights w{.source = source, .target = target, .planes = {}, .offset = {}, .map = a_T_b};
    const PlaneTable& table = planeTable(source, choice);
    const DirectionSet weights = formula(source, choice);
    const Mat3d rows = a_T_b.linear();
    const Vec3d t = a_T_b.translation();
    // Mᵀd is a signed sum of M's rows, as d·x is of coordinates.
    std::array<Projections, 4> sums;
    for (int column = 0; column < 3; ++column)
        sums[static_cast<std::size_t>(column)] = project(target, rows.col(column));
    sums[3] = project(target, t);
    for (std::size_t i = 0; i < directionCount(target); ++i) {
        w.planes[i] = weighted(weights, table, Vec3d(sums[0][i], sums[1][i], sums[2][i]));
        w.offset[i] = sums[3][i];
    }
    return w;
}

double PlaneWeights::rounding(const KDop& whole) const {
    // With u = 2^-53, s = Σ|M| · extent and t = Σ|T|, which bound those along any d: p 2us, weights 6us (three, of two
    // roundings each, times |x·d_i| ≤ extent), h 2us, the sum 4u(s+t), T·d 2ut, the mapped points 4u(s+t), their
    // projections 2u(s+t), those of the other body's points 2u(s+t). That is 22us + 14ut; 2^-48 is 32u. 2^-1000 is for
    // numbers that underflow.
    return 0x1p-48 * (map.linear().cwiseAbs().sum() * extent(whole) + map.translation().lpNorm<1>()) + 0x1p-1000;
}

FloatPlaneWeights forKernels(const PlaneWeights& weights, const KDop& whole) {
    FloatPlaneWeights out{};
    if (whole.empty()) return out;
    const std::size_t n = whole.count(), m = directionCount(weights.target);
    const double constant = weights.rounding(whole) + 0x1p-120 * (1 + extent(whole));
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
        const double slack = 7 * 0x1p-24 * reach + constant;
        out.offset[i] = static_cast<float>(weights.offset[i] + slack);
        out.offset[i + m] = static_cast<float>(slack - weights.offset[i]);
    }
    return out;
}

}  // namespace tessera
