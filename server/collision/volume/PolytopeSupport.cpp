#include "server/collision/volume/PolytopeSupport.h"

#include <array>
#include <cmath>
#include <limits>

#include "server/collision/volume/Realignment.h"

namespace tessera {

namespace {

Vec3d normalOf(const KDop& dop, std::size_t plane) {
    const std::span<const Vec3d> d = directions(dop.set);
    return plane < d.size() ? d[plane] : Vec3d(-d[plane - d.size()]);
}

}  // namespace

double polytopeSupport(const KDop& dop, const Vec3d& p) {
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
