/// What k-DOPs are worth along foreign directions, in double: what the kernels of trees do in float is held against it.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "server/collision/volume/Realignment.h"
#include "server/collision/volume/SupportProfile.h"

namespace tessera {

/// The half-planes of `source` for one vector p that is a number, of any length.
inline WeightedPlanes weightedPlanes(DirectionSet source, const Vec3d& p,
                                     PlaneChoice choice = PlaneChoice::kThreePlanes) {
    Affine3d map = Affine3d::Identity();
    map.linear().row(0) = p.transpose();
    return PlaneWeights::make(source, DirectionSet::k6, map, choice).planes[0];
}

/// The volume seen from the target frame: of the target's directions, around the map of everything in `dop`, rounding
/// included. Empty stays empty.
inline KDop realigned(const PlaneWeights& weights, const KDop& dop) {
    KDop out(weights.target);
    if (dop.empty()) return out;
    const double slack = weights.rounding(dop);
    const std::size_t n = dop.count();
    for (std::size_t i = 0; i < out.count(); ++i) {
        const WeightedPlanes& planes = weights.planes[i];
        double upper = weights.offset[i], lower = upper;
        for (std::size_t j = 0; j < 3; ++j) {
            const std::size_t plane = planes.plane[j];
            upper += planes.weight[j] * dop.halfPlane(plane);
            lower -= planes.weight[j] * dop.halfPlane(plane < n ? plane + n : plane - n);
        }
        out.upper[i] = upper + slack;
        out.lower[i] = lower - slack;
    }
    return out;
}

/// The same by a table, which must have the look-up's shape.
inline KDop realigned(const ProfileLookup& lookup, const SupportProfile& profile) {
    KDop out(lookup.target);
    const Vec3d center = profile.center.cast<double>();
    const double step = profile.step;
    const double slack = lookup.rounding(center.lpNorm<1>() + 3 * 255 * step);
    const std::size_t m = out.count();
    for (std::size_t i = 0; i < m; ++i) {
        const double middle = lookup.vector[i].dot(center) + lookup.offset[i];
        const double unit = lookup.length[i] * step;
        out.upper[i] = middle + unit * profile.table[lookup.entry[i]] + slack;
        out.lower[i] = middle - unit * profile.table[lookup.entry[i + m]] - slack;
    }
    return out;
}

inline Vec3d normalOf(const KDop& dop, std::size_t plane) {
    const std::span<const Vec3d> d = directions(dop.set);
    return plane < d.size() ? d[plane] : Vec3d(-d[plane - d.size()]);
}

/// How far does a k-DOP itself reach? max x·p over the points of one that is not empty: a linear programme, solved by
/// the simplex method on its dual from the planes that Realignment.h would choose, so the result is never below the
/// maximum but by rounding, and never above theirs. -infinity where the slabs have no point in common.
inline double polytopeSupport(const KDop& dop, const Vec3d& p) {
    const WeightedPlanes first = weightedPlanes(dop.set, p);
    std::array<std::size_t, 3> basis = {first.plane[0], first.plane[1], first.plane[2]};
    double best = std::numeric_limits<double>::infinity();
    double size = 0;
    for (std::size_t i = 0; i < dop.count(); ++i) size = std::max(size, dop.magnitude(i));
    const double rounding = 1e-13 * size;
    const std::size_t planes = 2 * dop.count();
    // From Dantzig's rule to Bland's, which does not cycle; the bound holds wherever one stops.
    constexpr int kSteepest = 30, kMost = 300;
    for (int pivot = 0; pivot < kMost; ++pivot) {
        // Columns are small integers: the inverse is as good as exact.
        Mat3d normals;
        Vec3d sides;
        for (int j = 0; j < 3; ++j) {
            normals.col(j) = normalOf(dop, basis[static_cast<std::size_t>(j)]);
            sides[j] = dop.halfPlane(basis[static_cast<std::size_t>(j)]);
        }
        const Mat3d inverse = normals.inverse();
        const Vec3d weights = (inverse * p).cwiseMax(0.0);
        best = std::min(best, weights.dot(sides));
        const Vec3d corner = inverse.transpose() * sides;
        std::size_t entering = planes;
        double worst = -rounding;
        for (std::size_t i = 0; i < planes; ++i) {
            const double left = dop.halfPlane(i) - normalOf(dop, i).dot(corner);
            if (left >= worst) continue;
            entering = i;
            if (pivot >= kSteepest) break;
            worst = left;
        }
        if (entering == planes) break;  // the corner belongs to the polytope: optimal
        const Vec3d along = inverse * normalOf(dop, entering);
        int leaving = -1;
        double step = 0;
        for (int j = 0; j < 3; ++j) {
            if (along[j] <= 1e-9) continue;
            const double ratio = weights[j] / along[j];
            if (leaving < 0 || ratio < step ||
                (ratio == step && basis[static_cast<std::size_t>(j)] < basis[static_cast<std::size_t>(leaving)])) {
                leaving = j;
                step = ratio;
            }
        }
        if (leaving < 0) return -std::numeric_limits<double>::infinity();
        basis[static_cast<std::size_t>(leaving)] = entering;
    }
    return best;
}

}  // namespace tessera
