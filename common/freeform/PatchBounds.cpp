#include "common/freeform/PatchBounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

Vec3d place(const Vec4d& p) { return p.head<3>() / p.w(); }

bool isPolynomial(const BezierPatch& patch) {
    const double w = patch.points.front().w();
    return std::all_of(patch.points.begin(), patch.points.end(), [w](const Vec4d& p) { return p.w() == w; });
}

/// How fast points move from one control point to the next along u: vectors whose sums with weights not below 0 are all directions of du.
std::vector<Vec3d> directionsOf(const BezierPatch& patch, PatchAxis axis, bool polynomial) {
    const bool alongU = axis == PatchAxis::kU;
    const int n = alongU ? patch.degreeU : patch.degreeV, m = alongU ? patch.degreeV : patch.degreeU;
    const auto at = [&](int i, int j) -> const Vec4d& { return alongU ? patch.at(i, j) : patch.at(j, i); };
    std::vector<Vec3d> directions;
    double reach = 0;
    for (const Vec4d& p : patch.points) reach = std::max(reach, place(p).cwiseAbs().maxCoeff());
    const double nothing = 8 * std::numeric_limits<double>::epsilon() * reach;
    const auto add = [&](const Vec3d& d) {
        if (d.cwiseAbs().maxCoeff() > nothing) directions.push_back(d);
    };
    for (int i = 0; i < n; ++i) {
        if (polynomial) {
            for (int j = 0; j <= m; ++j) add(place(at(i + 1, j)) - place(at(i, j)));
            continue;
        }
        // At each v the surface is a rational curve along u, and its derivative a sum, not below 0, of the steps between its control points
        // (Sederberg and Wang 1987). Such a step is a polynomial of degree 2m in v over a positive one: these are its coefficients.
        for (int k = 0; k <= 2 * m; ++k) {
            Vec3d sum = Vec3d::Zero();
            double shares = 0;
            for (int j = std::max(0, k - m); j <= std::min(m, k); ++j) {
                double share = at(i + 1, j).w() * at(i, k - j).w();
                for (int c = 1; c <= j; ++c) share *= static_cast<double>(m - j + c) / c;
                for (int c = 1; c <= k - j; ++c) share *= static_cast<double>(m - k + j + c) / c;
                sum += share * (place(at(i + 1, j)) - place(at(i, k - j)));
                shares += share;
            }
            add(sum / shares);
        }
    }
    return directions;
}

Vec3d twistOf(const BezierPatch& patch) {
    return place(patch.at(0, 0)) - place(patch.at(patch.degreeU, 0)) - place(patch.at(0, patch.degreeV)) + place(patch.at(patch.degreeU, patch.degreeV));
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
    const Vec3d corner[4] = {place(patch.at(0, 0)), place(patch.at(n, 0)), place(patch.at(0, m)), place(patch.at(n, m))};
    double most = 0;
    if (isPolynomial(patch)) {
        // The bilinear patch has the control points of the evenly divided quad: the difference has the differences.
        for (int j = 0; j <= m; ++j)
            for (int i = 0; i <= n; ++i) {
                const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / m;
                const Vec3d even = (1 - v) * ((1 - u) * corner[0] + u * corner[1]) + v * ((1 - u) * corner[2] + u * corner[3]);
                most = std::max(most, (place(patch.at(i, j)) - even).norm());
            }
        return most;
    }
    // P / W − L = (P − W·L) / W. Above, a polynomial of one degree more, below its hull's least: each coefficient is the mean of four
    // differences of a control point and a corner, and W has such means of four weights.
    double least = std::numeric_limits<double>::infinity();
    for (int l = 0; l <= m + 1; ++l)
        for (int k = 0; k <= n + 1; ++k) {
            Vec3d sum = Vec3d::Zero();
            double weights = 0;
            for (int b = 0; b < 2; ++b)
                for (int a = 0; a < 2; ++a) {
                    const double share = static_cast<double>((a == 0 ? n + 1 - k : k) * (b == 0 ? m + 1 - l : l)) / ((n + 1) * (m + 1));
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

double facetDeviation(const BezierPatch& patch) {
    // A bilinear patch is off its triangles by v (1 − u) or u (1 − v) times its twist, where these are a quarter at most.
    return bilinearDeviation(patch) + 0.25 * twistOf(patch).norm();
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

std::optional<NormalCone> normalCone(const BezierPatch& patch) {
    const bool polynomial = isPolynomial(patch);
    const std::vector<Vec3d> alongU = directionsOf(patch, PatchAxis::kU, polynomial), alongV = directionsOf(patch, PatchAxis::kV, polynomial);
    // du × dv is a sum, not below 0, of all products of the two. A step's direction is off by the rounding of its ends over its length.
    double reach = 0;
    for (const Vec4d& p : patch.points) reach = std::max(reach, place(p).cwiseAbs().maxCoeff());
    const double rounding = 8 * std::numeric_limits<double>::epsilon() * reach;
    struct Direction {
        Vec3d normal;
        double off;
    };
    std::vector<Direction> normals;
    normals.reserve(alongU.size() * alongV.size());
    Vec3d sum = Vec3d::Zero();
    for (const Vec3d& u : alongU)
        for (const Vec3d& v : alongV) {
            const Vec3d across = u.cross(v);
            const double lengthU = u.norm(), lengthV = v.norm(), area = across.norm();
            const double off = area > 0 ? rounding * (lengthU + lengthV) / area : 1;
            if (!(off < 0.1)) return std::nullopt;
            normals.push_back({across / area, off});
            sum += normals.back().normal;
        }
    if (normals.empty() || !(sum.norm() > 1e-6 * static_cast<double>(normals.size()))) return std::nullopt;
    NormalCone cone{.axis = sum.normalized(), .halfAngle = 0};
    for (const Direction& d : normals) cone.halfAngle = std::max(cone.halfAngle, std::atan2(d.normal.cross(cone.axis).norm(), d.normal.dot(cone.axis)) + d.off);
    constexpr double kClearlyBelow = 1.57;
    if (!(cone.halfAngle < kClearlyBelow)) return std::nullopt;
    return cone;
}

}  // namespace tessera
