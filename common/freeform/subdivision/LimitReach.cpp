#include "common/freeform/subdivision/LimitReach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/freeform/BezierTriangle.h"
#include "common/freeform/subdivision/PortableTrigonometry.h"
#include "common/freeform/subdivision/SampleTables.h"

namespace tessera {
namespace {

constexpr std::size_t kMostWeightsMeasured = std::size_t{1} << 25;

using Deviations = std::array<double, LimitPlan::kFinestLevel + 1>;

/// Rows of first and second derivatives at some places of a regular patch, by its spline's points.
struct BendingRows {
    struct Place {
        std::uint8_t sides = 0;  ///< bits, as LimitPlan::Face::rims
        bool isMiddle = false;
    };
    std::vector<Place> places;
    std::size_t columns = 0;
    std::vector<double> rows;  ///< places × (u, v, uu, uv, vv) × columns
};

BendingRows bicubicBending() {
    BendingRows out;
    out.columns = 16;
    struct Basis {
        std::array<std::array<double, 4>, 3> d;  ///< value, slope, second derivative
    };
    const auto basisAt = [](double t) {
        const CubicSplineBasis b(t);
        return Basis{{b.value, b.slope, {1 - t, 3 * t - 2, 1 - 3 * t, t}}};
    };
    for (const int j : {0, 1, 2, 3})
        for (const int i : {0, 1, 2, 3}) {
            out.places.push_back(
                {static_cast<std::uint8_t>((j == 0 ? 1 : 0) | (i == 3 ? 2 : 0) | (j == 3 ? 4 : 0) | (i == 0 ? 8 : 0)),
                 i == 1 && j == 1});
            const Basis u = basisAt(i / 3.0), v = basisAt(j / 3.0);
            for (const auto& [du, dv] : {std::pair{1U, 0U}, {0U, 1U}, {2U, 0U}, {1U, 1U}, {0U, 2U}})
                for (std::size_t y = 0; y < 4; ++y)
                    for (std::size_t x = 0; x < 4; ++x) out.rows.push_back(u.d[du][x] * v.d[dv][y]);
        }
    return out;
}

BendingRows boxBending() {
    BendingRows out;
    out.columns = 12;
    const std::array<std::array<double, 2>, 7> at{
        {{0, 0}, {0.5, 0}, {1, 0}, {0.5, 0.5}, {0, 1}, {0, 0.5}, {1.0 / 3, 1.0 / 3}}};
    constexpr std::array<std::uint8_t, 7> kSides{9, 1, 3, 2, 10, 8, 0};
    out.rows.resize(at.size() * 5 * 12);
    for (std::size_t p = 0; p < at.size(); ++p) out.places.push_back({kSides[p], p == 6});
    for (std::size_t first = 0; first < 12; first += 3) {
        std::array<Vec3d, 12> box;
        box.fill(Vec3d::Zero());
        for (std::size_t k = 0; k < 3; ++k) box[first + k][static_cast<int>(k)] = 1;
        const auto bezier = bezierOfBoxSpline(box);
        const BezierTriangle patch{.degree = 4, .points = {bezier.begin(), bezier.end()}};
        for (std::size_t p = 0; p < at.size(); ++p) {
            const auto derived = [&](double u, double v) { return evaluate(patch, u, v); };
            // Of a cubic, which the first derivative is, this difference is the derivative.
            constexpr double h = 0.125;
            const auto difference = [&](double du, double dv, bool ofV) {
                const auto slope = [&](double t) {
                    const SurfacePoint s = derived(at[p][0] + t * du, at[p][1] + t * dv);
                    return ofV ? s.dv : s.du;
                };
                return Vec3d((8 * (slope(h) - slope(-h)) - (slope(2 * h) - slope(-2 * h))) / (12 * h));
            };
            const SurfacePoint here = derived(at[p][0], at[p][1]);
            const std::array<Vec3d, 5> all{here.du, here.dv, difference(1, 0, false), difference(0, 1, false),
                                           difference(0, 1, true)};
            for (std::size_t row = 0; row < 5; ++row)
                for (int k = 0; k < 3; ++k)
                    out.rows[(5 * p + row) * 12 + first + static_cast<std::size_t>(k)] = all[row][k];
        }
    }
    return out;
}

const BendingRows& bendingOf(bool triangular) {
    static const BendingRows bicubic = bicubicBending(), box = boxBending();
    return triangular ? box : bicubic;
}

double ofThree(double uu, double uv, double vv, bool triangular) {
    const double along = std::abs(uu + vv + (triangular ? -2 : 2) * uv);
    uu = std::abs(uu), uv = std::abs(uv), vv = std::abs(vv);
    // Any triangle in a cell; and one whose circumcircle, as second derivatives measure lengths, is no larger than an
    // equilateral's.
    return std::min((uu + 2 * uv + vv) / 8, std::max({uu, vv, along}) / 6);
}

Deviations deviationsOfRegular(const LimitPlan::Face& face, std::span<const Vec3d> spline, bool triangular) {
    const BendingRows& bending = bendingOf(triangular);
    constexpr std::size_t kMost = 16;
    std::array<std::array<Vec3d, 5>, kMost> d;
    std::array<Vec3d, kMost> normal;
    std::size_t middle = 0;
    bool flat = true;
    for (std::size_t p = 0; p < bending.places.size(); ++p) {
        for (std::size_t row = 0; row < 5; ++row) {
            const double* weights = bending.rows.data() + (5 * p + row) * bending.columns;
            Vec3d sum = Vec3d::Zero();
            for (std::size_t k = 0; k < bending.columns; ++k) sum += weights[k] * spline[k];
            d[p][row] = sum;
        }
        const Vec3d across = d[p][0].cross(d[p][1]);
        const double area = across.squaredNorm();
        normal[p] = area > 1e-24 * d[p][0].squaredNorm() * d[p][1].squaredNorm() ? Vec3d(across / std::sqrt(area))
                                                                                 : Vec3d::Zero();
        flat = flat && !normal[p].isZero(0);
        if (bending.places[p].isMiddle) middle = p;
    }
    double across = 0, within = 0, turn = flat ? 0 : 1;
    for (std::size_t p = 0; p < bending.places.size(); ++p) {
        const Vec3d &uu = d[p][2], &uv = d[p][3], &vv = d[p][4], &n = normal[p];
        if (n.isZero(0)) {
            across = std::max(across, (uu.norm() + 2 * uv.norm() + vv.norm()) / 8);
            continue;
        }
        const double a = uu.dot(n), b = uv.dot(n), c = vv.dot(n);
        across = std::max(across, ofThree(a, b, c, triangular));
        within = std::max(within, ((uu - a * n).norm() + 2 * (uv - b * n).norm() + (vv - c * n).norm()) / 8);
        turn = std::max(turn, n.dot(normal[middle]) > 0 ? n.cross(normal[middle]).norm() : 1.0);
    }
    // Along rims: off the chord of a curve, in whatever direction that is.
    double rim = 0, alongRim = 0;
    for (unsigned side = 0; side < 4; ++side) {
        if (!(face.rims >> side & 1)) continue;
        for (std::size_t p = 0; p < bending.places.size(); ++p) {
            if (!(bending.places[p].sides >> side & 1)) continue;
            const bool hypotenuse = triangular && side == 1;
            const Vec3d along = hypotenuse ? Vec3d(d[p][1] - d[p][0]) : side % 2 == 0 ? d[p][0] : d[p][1];
            const Vec3d second = hypotenuse      ? Vec3d(d[p][2] - 2 * d[p][3] + d[p][4])
                                 : side % 2 == 0 ? d[p][2]
                                                 : d[p][4];
            const double length2 = along.squaredNorm();
            const Vec3d off = length2 > 0 ? Vec3d(second - second.dot(along) / length2 * along) : second;
            rim = std::max(rim, off.norm() / 8);
            alongRim = std::max(
                alongRim,
                length2 > 0 ? std::min(1.0, off.norm() / std::sqrt(length2)) * (second - off).norm() / 8 : 0.0);
        }
    }
    Deviations out;
    // Between the places it may bend a little more; and what is along the surface here is across it where that has
    // turned.
    constexpr double kBetween = 1.25, kTurned = 0.5;
    double quarter = 1, half = 1;
    for (double& level : out) {
        level = quarter * std::max(kBetween * across + kTurned * (turn < 1 ? half * turn : 1.0) * within,
                                   kBetween * rim + half * alongRim);
        quarter *= 0.25;
        half *= 0.5;
    }
    return out;
}

/// How a level's share of deviation compares to the one before it beside a vertex with so many edges: the largest
/// eigenvalue of the subdivision matrix that bends the surface, of frequency two (Ball and Storry, Conditions for
/// tangent plane continuity over recursively generated B-spline surfaces, 1988; Loop, Smooth subdivision surfaces based
/// on triangles, 1987), or what is regular beside it has.
double fallOffOf(std::uint32_t edges, bool triangular) {
    constexpr double kTurn = 6.283185307179586;
    const double c = edges < 5 ? -1 : portableCos(2 * kTurn / edges);
    const double bending = triangular ? 0.375 + 0.25 * c : (c + 5 + std::sqrt((c + 9) * (c + 1))) / 16;
    return std::clamp(1.1 * bending, 0.3, 0.7);
}

/// Of a point and a triangle, which may have no area.
double distanceTo(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto toEdge = [&p](const Vec3d& from, const Vec3d& to) {
        const Vec3d along = to - from;
        const double length2 = along.squaredNorm();
        return (p - from - (length2 > 0 ? std::clamp((p - from).dot(along) / length2, 0.0, 1.0) : 0.0) * along).norm();
    };
    const Vec3d normal = (b - a).cross(c - a);
    const double area = normal.norm();
    const bool inside = area > 0 && (b - a).cross(p - a).dot(normal) >= 0 && (c - b).cross(p - b).dot(normal) >= 0 &&
                        (a - c).cross(p - c).dot(normal) >= 0;
    return inside ? std::abs((p - a).dot(normal)) / area : std::min({toEdge(a, b), toEdge(b, c), toEdge(c, a)});
}

/// A face's grid of 2^log2 segments, evaluated.
struct MeasuredGrid {
    std::vector<Vec3d> points, normals;
    unsigned log2 = 0;
    bool triangular = false;

    void evaluate(const LimitPlan::Table& table, std::span<const Vec3d> own) {
        points.resize(gridSamples(std::size_t{1} << log2, triangular));
        normals.resize(points.size());
        for (std::size_t sample = 0; sample < points.size(); ++sample) {
            const double* weights = table.weights.data() + sample * 3 * own.size();
            Vec3d sums[3] = {Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero()};
            for (std::size_t row = 0; row < 3; ++row)
                for (std::size_t k = 0; k < own.size(); ++k) sums[row] += weights[row * own.size() + k] * own[k];
            points[sample] = sums[0];
            const Vec3d across = sums[1].cross(sums[2]);
            const double area = across.squaredNorm();
            normals[sample] = area > 1e-24 * sums[1].squaredNorm() * sums[2].squaredNorm()
                                  ? Vec3d(across / std::sqrt(area))
                                  : Vec3d::Zero();
        }
    }
    using Place = std::array<unsigned, 2>;
    [[nodiscard]] std::size_t at(const Place& p) const {
        return gridSample(p[0], p[1], std::size_t{1} << log2, triangular);
    }
    /// Of the samples in a triangle: a, b, c are its corners, b - a and c - b (Loop: c - a) along the grid's sides,
    /// `step` long. How far they are from it.
    [[nodiscard]] double farthestFrom(const Place& a, const Place& b, const Place& c, unsigned step,
                                      std::uint8_t rims) const {
        const Vec3d &pa = points[at(a)], &pb = points[at(b)], &pc = points[at(c)];
        const Vec3d plane = (pb - pa).cross(pc - pa);
        const double area = plane.norm();
        double most = 0;
        for (unsigned x = 0; x <= step; ++x)
            for (unsigned y = 0; x + y <= step; ++y) {
                if ((x == 0 && (y == 0 || y == step)) || x == step) continue;
                // a + x/step (b - a) + y/step (c - a), as the grid has it.
                const auto place = [&](std::size_t k) { return (a[k] * (step - x - y) + b[k] * x + c[k] * y) / step; };
                const Place here{place(0), place(1)};
                const std::size_t sample = at(here);
                const double u = static_cast<double>(x) / step, v = static_cast<double>(y) / step;
                const Vec3d off = points[sample] - (pa + u * (pb - pa) + v * (pc - pa)), &normal = normals[sample];
                const bool onRim = isOn(rims, here) && (x == 0 || y == 0 || x + y == step);
                if (onRim) {
                    const Vec3d along = x == 0 ? pc - pa : y == 0 ? pb - pa : pc - pb;
                    const double length2 = along.squaredNorm();
                    most = std::max(most, length2 > 0 ? (off - off.dot(along) / length2 * along).norm() : off.norm());
                } else if (normal.isZero(0) || area == 0) {
                    // What lies in the plane that one of them has left lies on triangles beside this one.
                    most = std::max(most, area > 0           ? std::abs(off.dot(plane)) / area
                                          : normal.isZero(0) ? distanceTo(points[sample], pa, pb, pc)
                                                             : std::abs(off.dot(normal)));
                } else {
                    // Where the surface stands askew to the triangle, what is along it takes the place of other
                    // triangles too.
                    const double across = off.dot(normal), askew = normal.cross(plane).norm() / area;
                    most = std::max({most, std::abs(across) + askew * (off - across * normal).norm(),
                                     std::abs(off.dot(plane)) / area});
                }
            }
        return most;
    }
    [[nodiscard]] bool isOn(std::uint8_t rims, const Place& p) const {
        const unsigned n = 1U << log2;
        return ((rims & 1) && p[1] == 0) || ((rims & 2) && (triangular ? p[0] + p[1] == n : p[0] == n)) ||
               ((rims & 4) && p[1] == n) || ((rims & 8) && p[0] == 0);
    }
};

Deviations deviationsOfMeasured(const LimitPlan::Face& face, const MeasuredGrid& grid, bool bilinear) {
    Deviations out{};
    const unsigned n = 1U << grid.log2;
    for (unsigned level = 0; level < grid.log2; ++level) {
        const unsigned step = n >> level;
        for (unsigned j = 0; j < n; j += step)
            for (unsigned i = 0; i + (grid.triangular ? j : 0) < n; i += step) {
                double& most = out[level];
                if (!grid.triangular) {
                    most =
                        std::max(most, grid.farthestFrom({i, j}, {i + step, j}, {i + step, j + step}, step, face.rims));
                    most =
                        std::max(most, grid.farthestFrom({i, j}, {i + step, j + step}, {i, j + step}, step, face.rims));
                } else {
                    most = std::max(most, grid.farthestFrom({i, j}, {i + step, j}, {i, j + step}, step, face.rims));
                    if (i + j + 2 * step <= n)
                        most = std::max(most, grid.farthestFrom({i + step, j}, {i + step, j + step}, {i, j + step},
                                                                step, face.rims));
                }
            }
    }
    const double fallOff = bilinear ? 0.25 : fallOffOf(face.most, grid.triangular);
    // A crease of sharpness s is smooth only beyond level s. What was measured lies between samples a little farther
    // off, and surface between them.
    constexpr double kBetween = 1.15, kOfOne = 1.7, kRest = 1.4, kOfCreases = 3;
    const bool late = face.sharpest + 1 > static_cast<float>(grid.log2);
    double rest = out[grid.log2 - 1] * (late ? kOfCreases : kRest * fallOff / (1 - fallOff));
    for (unsigned level = 0; level < grid.log2; ++level)
        out[level] = (level == 0 ? kOfOne : kBetween) * out[level] + std::min(rest, out[level]);
    for (unsigned level = grid.log2; level < out.size(); ++level) {
        out[level] = rest;
        if (static_cast<float>(level) > face.sharpest + 1) rest *= fallOff;
    }
    for (unsigned level = static_cast<unsigned>(out.size()) - 1; level-- > 0;)
        out[level] = std::max(out[level], out[level + 1]);
    return out;
}

}  // namespace

void measureReaches(const LimitPlan& plan, std::span<const std::uint32_t> faces, std::span<const float> points,
                    std::span<LimitReach> reaches) {
    const SubdivisionTopology& topology = plan.topology();
    const bool triangular = plan.triangular(), bilinear = topology.scheme() == SubdivisionScheme::kBilinear;
    LimitPlan::Tables tables(plan);
    // Where there are very many kinds their rows for finer grids would be too many.
    const bool many = plan.finestLevel(kMostWeightsMeasured) < 5;
    std::vector<Vec3d> own, spline;
    MeasuredGrid grid;
    grid.triangular = triangular;
    for (const std::uint32_t f : faces) {
        LimitReach& reach = reaches[f];
        reach = {};
        if (!topology.hasSurface(f)) continue;
        Vec3f lower = Vec3f::Constant(std::numeric_limits<float>::infinity()), upper = -lower;
        for (std::uint32_t p = topology.firstPtexOf(f); p < plan.faces().size() && topology.ptexFace(p).face == f;
             ++p) {
            const LimitPlan::Face& face = plan.faces()[p];
            const std::span<const std::uint32_t> named = plan.pointsOf(face);
            own.resize(named.size());
            for (std::size_t i = 0; i < named.size(); ++i) {
                const Vec3f at(points[3 * named[i]], points[3 * named[i] + 1], points[3 * named[i] + 2]);
                lower = lower.cwiseMin(at);
                upper = upper.cwiseMax(at);
                own[i] = at.cast<double>();
            }
            for (std::size_t i = own.size(); i-- > 0;) own[i] -= own[0];
            Deviations deviations;
            if (face.spline) {
                face.spline->apply(own, spline);
                deviations = deviationsOfRegular(face, spline, triangular);
            } else {
                grid.log2 = many || bilinear ? 2 : face.sharpest > 0 ? 4 : 3;
                grid.evaluate(*tables.of(face, grid.log2), own);
                deviations = deviationsOfMeasured(face, grid, bilinear);
            }
            // A part's first level is its polygon's second.
            for (std::size_t level = 0; level < deviations.size(); ++level)
                reach.deviation[level] = std::max(
                    reach.deviation[level],
                    static_cast<float>(deviations[face.isPart ? (level == 0 ? 0 : level - 1) : level] * (1 + 1e-6)));
        }
        for (std::size_t k = 0; k < 3; ++k) {
            reach.lower[k] = lower[static_cast<int>(k)];
            reach.upper[k] = upper[static_cast<int>(k)];
        }
    }
}

}  // namespace tessera
