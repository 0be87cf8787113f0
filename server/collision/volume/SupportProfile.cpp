#include "server/collision/volume/SupportProfile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera {

namespace {

/// What rounding of angles, on either side, may shift a look-up by, as a share of the radius: an entry changes by no
/// more than the radius times the angle.
constexpr double kAngleMargin = 1e-6;
constexpr double kSteps = 255;

float roundedUp(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) < x ? std::nextafterf(f, std::numeric_limits<float>::infinity()) : f;
}

/// A half-direction of unit length and two beside it, from which azimuths are counted. The opposite half-direction has
/// all three negated: -p has the azimuth there that p has here.
struct HalfDirection {
    Vec3d along, first, second;
};

HalfDirection halfDirection(DirectionSet set, std::size_t plane) {
    const std::span<const Vec3d> all = directions(set);
    const Vec3d d = all[plane % all.size()].normalized();
    int least = 0;
    d.cwiseAbs().minCoeff(&least);
    const Vec3d axis = Vec3d::Unit(least);
    HalfDirection half;
    half.along = d;
    half.first = (axis - d[least] * d).normalized();
    half.second = d.cross(half.first);
    if (plane < all.size()) return half;
    return {-half.along, -half.first, -half.second};
}

std::vector<HalfDirection> halfDirections(DirectionSet set) {
    std::vector<HalfDirection> all;
    for (std::size_t i = 0; i < 2 * directionCount(set); ++i) all.push_back(halfDirection(set, i));
    return all;
}

Vec2d at(double angle) {
    return {std::cos(angle), std::sin(angle)};
}

/// max of t·(cos φ, sin φ) over the azimuths φ between two edges less than half a turn apart.
double beside(const Vec2d& t, const Vec2d& from, const Vec2d& to) {
    const bool inside = from.x() * t.y() - from.y() * t.x() >= 0 && t.x() * to.y() - t.y() * to.x() >= 0;
    return inside ? t.norm() : std::max(t.dot(from), t.dot(to));
}

/// max of a cos β + b sin β over β between two edges: the same question.
double height(double a, double b, const Vec2d& from, const Vec2d& to) {
    return beside({a, b}, from, to);
}

std::vector<Vec2d> edges(std::size_t count, double range) {
    std::vector<Vec2d> all;
    for (std::size_t i = 0; i <= count; ++i)
        all.push_back(at(range * static_cast<double>(i) / static_cast<double>(count)));
    return all;
}

}  // namespace

SupportProfile SupportProfile::around(const ProfileShape& shape, std::span<const Vec3d> points) {
    Vec3d mean = Vec3d::Zero();
    for (const Vec3d& x : points) mean += x;
    mean /= static_cast<double>(points.size());
    SupportProfile profile{.shape = shape, .center = mean.cast<float>(), .step = 0, .table = {}};
    const Vec3d center = profile.center.cast<double>();
    double radius = 0, farthest = 0;
    for (const Vec3d& x : points) {
        radius = std::max(radius, (x - center).norm());
        farthest = std::max(farthest, x.lpNorm<1>());
    }
    const double margin = kAngleMargin * radius + 0x1p-50 * farthest;
    profile.step = std::max(roundedUp((radius + 2 * margin) / kSteps), std::numeric_limits<float>::min());

    const std::vector<Vec2d> sectors = edges(shape.sectors, 2 * std::numbers::pi);
    const std::vector<Vec2d> bins = edges(shape.bins, coveringAngle(shape.directions));
    const std::vector<HalfDirection> halves = halfDirections(shape.directions);
    std::vector<double> reach(shape.size(), 0.0);
    for (const Vec3d& point : points) {
        const Vec3d x = point - center;
        for (std::size_t plane = 0; plane < halves.size(); ++plane) {
            const HalfDirection& half = halves[plane];
            const double a = x.dot(half.along);
            const Vec2d t(x.dot(half.first), x.dot(half.second));
            for (std::size_t sector = 0; sector < shape.sectors; ++sector) {
                const double b = shape.sectors == 1 ? t.norm() : beside(t, sectors[sector], sectors[sector + 1]);
                double* entry = reach.data() + shape.entry(plane, sector, 0);
                for (std::size_t bin = 0; bin < shape.bins; ++bin)
                    entry[bin] = std::max(entry[bin], height(a, b, bins[bin], bins[bin + 1]));
            }
        }
    }
    profile.table.reserve(reach.size());
    for (const double value : reach)
        profile.table.push_back(static_cast<std::uint8_t>(
            std::min(kSteps, std::ceil((value + margin) / static_cast<double>(profile.step)))));
    return profile;
}

ProfileLookup ProfileLookup::make(const ProfileShape& shape, DirectionSet target, const Affine3d& a_T_b) {
    ProfileLookup lookup{
        .shape = shape, .target = target, .entry = {}, .vector = {}, .length = {}, .offset = {}, .map = a_T_b};
    const std::span<const Vec3d> source = directions(shape.directions), all = directions(target);
    const std::size_t n = source.size(), m = all.size();
    const Projections offset = project(target, a_T_b.translation());
    for (std::size_t i = 0; i < m; ++i) {
        const Vec3d p = a_T_b.linear().transpose() * all[i];
        std::size_t plane = 0;
        double nearest = -1;
        for (std::size_t k = 0; k < n; ++k) {
            const double cosine = p.dot(source[k]) / source[k].norm();
            if (std::abs(cosine) <= nearest) continue;
            nearest = std::abs(cosine);
            plane = cosine < 0 ? k + n : k;
        }
        const HalfDirection half = halfDirection(shape.directions, plane);
        const Vec2d side(p.dot(half.first), p.dot(half.second));
        const double angle = std::atan2(side.norm(), p.dot(half.along)) / coveringAngle(shape.directions);
        const double turn = std::atan2(side.y(), side.x()) / (2 * std::numbers::pi);
        const auto place = [](double share, std::size_t count) {
            return std::min(count - 1, static_cast<std::size_t>(std::max(0.0, share * static_cast<double>(count))));
        };
        const std::size_t bin = place(angle, shape.bins), sector = place(turn < 0 ? turn + 1 : turn, shape.sectors);
        lookup.entry[i] = static_cast<std::uint16_t>(shape.entry(plane, sector, bin));
        lookup.entry[i + m] = static_cast<std::uint16_t>(shape.entry(plane < n ? plane + n : plane - n, sector, bin));
        lookup.vector[i] = p;
        lookup.length[i] = p.norm() * (1 + 0x1p-50);
        lookup.offset[i] = offset[i];
    }
    return lookup;
}

double ProfileLookup::rounding(double extent) const {
    // As for planes: p, the sum, the mapped points and the projections are less than 2^-48 of this.
    return 0x1p-48 * (map.linear().cwiseAbs().sum() * extent + map.translation().lpNorm<1>()) + 0x1p-1000;
}

FloatProfileLookup forKernels(const ProfileLookup& lookup, const KDop& whole) {
    FloatProfileLookup out{};
    if (whole.empty()) return out;
    const std::size_t m = directionCount(lookup.target);
    const Vec3d extents(whole.magnitude(0), whole.magnitude(1), whole.magnitude(2));
    const double diagonal =
        Vec3d(whole.upper[0] - whole.lower[0], whole.upper[1] - whole.lower[1], whole.upper[2] - whole.lower[2]).norm();
    // A centre is a float: it may lie outside by its rounding, and its points that much farther from it.
    const double rounding = lookup.rounding(2 * (extents.sum() + 3 * diagonal));
    const double least = 0x1p-120 * (1 + extents.sum());
    for (std::size_t i = 0; i < m; ++i) {
        const Vec3d& p = lookup.vector[i];
        const double reach = p.cwiseAbs().dot(extents) + lookup.length[i] * (diagonal + 0x1p-20 * extents.sum()) +
                             std::abs(lookup.offset[i]);
        const double slack = 10 * 0x1p-24 * reach + rounding + least * (1 + lookup.length[i]);
        for (int j = 0; j < 3; ++j) {
            out.vector[i][j] = static_cast<float>(p[j]);
            out.vector[i + m][j] = -out.vector[i][j];
        }
        out.entry[i] = lookup.entry[i];
        out.entry[i + m] = lookup.entry[i + m];
        out.length[i] = out.length[i + m] = roundedUp(lookup.length[i]);
        out.offset[i] = roundedUp(lookup.offset[i] + slack);
        out.offset[i + m] = roundedUp(slack - lookup.offset[i]);
    }
    return out;
}

}  // namespace tessera
