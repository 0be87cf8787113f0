#include "common/freeform/PatchBounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

Vec3d place(const Vec4d& p) {
    return p.head<3>() / p.w();
}

bool isPolynomial(const BezierPatch& patch) {
    const double w = patch.points.front().w();
    return std::all_of(patch.points.begin(), patch.points.end(), [w](const Vec4d& p) { return p.w() == w; });
}

Vec3d twistOf(const BezierPatch& patch) {
    return place(patch.at(0, 0)) - place(patch.at(patch.degreeU, 0)) - place(patch.at(0, patch.degreeV)) +
           place(patch.at(patch.degreeU, patch.degreeV));
}

/// A bound of how far a rational curve is from its chord at the same parameter: as bilinearDeviation, of one parameter.
double chordDeviation(const Vec4d* points, int degree, std::size_t stride) {
    const auto at = [&](int i) -> const Vec4d& { return points[static_cast<std::size_t>(i) * stride]; };
    const Vec3d begin = place(at(0)), end = place(at(degree));
    double most = 0, least = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= degree + 1; ++k) {
        const double before = static_cast<double>(k) / (degree + 1);
        Vec3d sum = Vec3d::Zero();
        double weight = 0;
        if (k <= degree) {
            sum += (1 - before) * at(k).w() * (place(at(k)) - begin);
            weight += (1 - before) * at(k).w();
        }
        if (k > 0) {
            sum += before * at(k - 1).w() * (place(at(k - 1)) - end);
            weight += before * at(k - 1).w();
        }
        most = std::max(most, sum.norm());
        least = std::min(least, weight);
    }
    return most / least;
}

}  // namespace

double bilinearDeviation(const BezierPatch& patch) {
    const int n = patch.degreeU, m = patch.degreeV;
    const Vec3d corner[4] = {place(patch.at(0, 0)), place(patch.at(n, 0)), place(patch.at(0, m)),
                             place(patch.at(n, m))};
    double most = 0;
    if (isPolynomial(patch)) {
        // The bilinear patch has the control points of the evenly divided quad: the difference has the differences.
        for (int j = 0; j <= m; ++j)
            for (int i = 0; i <= n; ++i) {
                const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / m;
                const Vec3d even =
                    (1 - v) * ((1 - u) * corner[0] + u * corner[1]) + v * ((1 - u) * corner[2] + u * corner[3]);
                most = std::max(most, (place(patch.at(i, j)) - even).norm());
            }
        return most;
    }
    // P / W − L = (P − W·L) / W. Above, a polynomial of one degree more, below its hull's least: each coefficient is
    // the mean of four differences of a control point and a corner, and W has such means of four weights.
    double least = std::numeric_limits<double>::infinity();
    for (int l = 0; l <= m + 1; ++l)
        for (int k = 0; k <= n + 1; ++k) {
            Vec3d sum = Vec3d::Zero();
            double weights = 0;
            for (int b = 0; b < 2; ++b)
                for (int a = 0; a < 2; ++a) {
                    const double share =
                        static_cast<double>((a == 0 ? n + 1 - k : k) * (b == 0 ? m + 1 - l : l)) / ((n + 1) * (m + 1));
                    if (share == 0) continue;
                    const Vec4d& p = patch.at(k - a, l - b);
                    sum += share * p.w() * (place(p) - corner[2 * b + a]);
                    weights += share * p.w();
                }
            most = std::max(most, sum.norm());
            least = std::min(least, weights);
        }
    return most / least;
}

PatchAxis lessFlatAxis(const BezierPatch& patch) {
    const int n = patch.degreeU, m = patch.degreeV;
    double offU = 0, offV = 0, longU = 0, longV = 0;
    for (int j = 0; j <= m; ++j) {
        offU = std::max(offU, chordDeviation(&patch.at(0, j), n, 1));
        longU = std::max(longU, (place(patch.at(n, j)) - place(patch.at(0, j))).norm());
    }
    for (int i = 0; i <= n; ++i) {
        offV = std::max(offV, chordDeviation(&patch.at(i, 0), m, static_cast<std::size_t>(n) + 1));
        longV = std::max(longV, (place(patch.at(i, m)) - place(patch.at(i, 0))).norm());
    }
    // Halving a twist along either axis halves it.
    if (0.25 * twistOf(patch).norm() > std::max(offU, offV)) return longV > longU ? PatchAxis::kV : PatchAxis::kU;
    return offV > offU ? PatchAxis::kV : PatchAxis::kU;
}

}  // namespace tessera
