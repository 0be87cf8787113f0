#include "server/import/reader/DxfCurves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace tessera {
namespace {

using std::numbers::pi;

constexpr std::size_t kMostDegree = 11;

/// De Boor's algorithm in homogeneous coordinates, `t` within the span from knot `k`.
Vec3d splineAt(const DxfSpline& spline, std::size_t k, double t) {
    std::array<Vec4d, kMostDegree + 1> d;
    const std::size_t p = spline.degree;
    for (std::size_t j = 0; j <= p; ++j) {
        const std::size_t i = j + k - p;
        const double w = spline.weights.empty() ? 1 : spline.weights[i];
        d[j] << spline.points[i] * w, w;
    }
    for (std::size_t r = 1; r <= p; ++r)
        for (std::size_t j = p; j >= r; --j) {
            const double from = spline.knots[j + k - p], to = spline.knots[j + 1 + k - r];
            const double share = to > from ? (t - from) / (to - from) : 0;
            d[j] = (1 - share) * d[j - 1] + share * d[j];
        }
    return d[p].head<3>() / d[p].w();
}

/// Through all points, tangents along their neighbours (Catmull and Rom).
DxfPath pathThrough(const DxfSpline& spline, int chords) {
    const std::vector<Vec3d>& all = spline.through;
    if (all.size() < 3) return all;
    const std::size_t spans = spline.closed ? all.size() : all.size() - 1;
    const auto at = [&](std::ptrdiff_t i) -> Vec3d {
        const auto count = static_cast<std::ptrdiff_t>(all.size());
        if (spline.closed) return all[static_cast<std::size_t>((i + count) % count)];
        if (i < 0) return 2 * all[0] - all[1];
        if (i >= count) return 2 * all.back() - all[all.size() - 2];
        return all[static_cast<std::size_t>(i)];
    };
    DxfPath path{all.front()};
    for (std::size_t s = 0; s < spans; ++s) {
        const auto i = static_cast<std::ptrdiff_t>(s);
        const Vec3d a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
        for (int chord = 1; chord <= chords; ++chord) {
            const double t = double{1} * chord / chords;
            path.emplace_back(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t +
                                     (3 * b - a - 3 * c + d) * t * t * t));
        }
    }
    return path;
}

}  // namespace

Mat3d dxfFrame(const Vec3d& extrusion) {
    const double length = extrusion.norm();
    if (!(length > 1e-12) || !std::isfinite(length)) return Mat3d::Identity();
    const Vec3d z = extrusion / length;
    constexpr double kNearZ = 1.0 / 64;
    const bool nearZ = std::abs(z.x()) < kNearZ && std::abs(z.y()) < kNearZ;
    Mat3d frame;
    frame.col(0) = (nearZ ? Vec3d::UnitY() : Vec3d::UnitZ()).cross(z).normalized();
    frame.col(1) = z.cross(frame.col(0)).normalized();
    frame.col(2) = z;
    return frame;
}

double dxfSweep(double start, double end) {
    // Files round: 6.2832 is a whole turn, and no arc of 1.5e-5.
    constexpr double kRounded = 1e-4;
    const double sweep = std::remainder(end - start, 2 * pi);
    const bool whole = sweep > 0 && sweep < kRounded && end - start > pi;
    if (whole) return 2 * pi;
    return sweep > 1e-12 ? sweep : sweep + 2 * pi;
}

void addDxfEllipse(DxfPath& path, const Vec3d& center, const Vec3d& major, const Vec3d& minor, double start,
                   double sweep, const DxfChords& chords) {
    const double wanted = std::ceil(std::abs(sweep) / (2 * pi) * chords.perTurn - 1e-9);
    const int count = static_cast<int>(std::clamp<double>(wanted, chords.fewest, chords.perTurn));
    for (int i = 0; i <= count; ++i) {
        const double t = start + sweep * i / count;
        path.emplace_back(center + std::cos(t) * major + std::sin(t) * minor);
    }
}

void addDxfBulge(DxfPath& path, const Vec3d& to, double bulge, const DxfChords& chords) {
    const Vec3d from = path.back(), chord = to - from;
    if (!(std::abs(bulge) > 1e-9) || !(std::abs(bulge) < 1e9) || !(chord.head<2>().norm() > 0)) {
        path.push_back(to);
        return;
    }
    // Half of the chord is tan(sweep / 2) times the way from its middle to the centre.
    const double sweep = 4 * std::atan(bulge), away = (1 - bulge * bulge) / (4 * bulge);
    const Vec3d center = from + 0.5 * chord + away * Vec3d(-chord.y(), chord.x(), 0);
    const Vec3d radius = from - center;
    path.pop_back();
    addDxfEllipse(path, center, radius, Vec3d(-radius.y(), radius.x(), 0), 0, sweep, chords);
    path.back() = to;
}

DxfPath dxfSplinePath(const DxfSpline& spline, const DxfChords& chords) {
    if (spline.points.empty()) return pathThrough(spline, chords.perSpan);
    const std::size_t p = spline.degree, n = spline.points.size();
    const bool sound = p >= 1 && p <= kMostDegree && n > p && spline.knots.size() == n + p + 1 &&
                       std::ranges::is_sorted(spline.knots) && std::isfinite(spline.knots.front()) &&
                       std::isfinite(spline.knots.back()) &&
                       (spline.weights.empty() ||
                        (spline.weights.size() == n &&
                         std::ranges::all_of(spline.weights, [](double w) { return w > 1e-12 && w < 1e12; })));
    if (!sound) return {};
    if (p == 1) return spline.points;
    DxfPath path;
    for (std::size_t k = p; k < n; ++k) {
        const double from = spline.knots[k], to = spline.knots[k + 1];
        if (!(to > from)) continue;
        if (path.empty()) path.push_back(splineAt(spline, k, from));
        for (int chord = 1; chord <= chords.perSpan; ++chord)
            path.push_back(splineAt(spline, k, from + (to - from) * chord / chords.perSpan));
    }
    return path;
}

}  // namespace tessera
