#include "common/freeform/lattice/Lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

namespace tessera {
namespace {

class Source {
public:
    explicit Source(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high) {
        return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
    }
    unsigned below(unsigned n) { return static_cast<unsigned>(engine_() % n); }
    Vec3d inCube(double half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }

private:
    std::mt19937_64 engine_;
};

std::vector<std::uint64_t> seeds(std::uint64_t count) {
    if (const char* only = std::getenv("TESSERA_SEED")) return {std::strtoull(only, nullptr, 10)};
    std::vector<std::uint64_t> all(count);
    for (std::uint64_t i = 0; i < count; ++i) all[i] = i;
    return all;
}
std::string repeat(std::uint64_t seed, const char* test) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_lattice --gtest_filter=Lattice." + test;
}

/// Any degrees, any number of points, any parallelepiped that is not too thin.
Lattice someLattice(Source& random) {
    std::array<LatticeAxis, 3> axes;
    for (LatticeAxis& axis : axes) {
        axis.degree = 1 + random.below(5);
        axis.points = axis.degree + 1 + (random.below(2) == 0 ? 0 : random.below(5));
    }
    LatticeVolume volume{.origin = random.inCube(3), .axes = Mat3d::Identity()};
    for (int k = 0; k < 3; ++k) volume.axes.col(k) = random.uniform(0.5, 3) * (Vec3d::Unit(k) + random.inCube(0.3));
    return Lattice::make(volume, axes).value();
}
void shake(Lattice& lattice, double by, Source& random) {
    std::vector<Vec3d> points(lattice.controlPoints().begin(), lattice.controlPoints().end());
    for (Vec3d& p : points) p += random.inCube(by);
    ASSERT_TRUE(lattice.setControlPoints(0, points));
}
/// Inside; on a face or a knot now and then.
Vec3d inside(const Lattice& lattice, Source& random) {
    Vec3d p;
    for (int k = 0; k < 3; ++k) {
        const LatticeAxis& axis = lattice.axes()[static_cast<std::size_t>(k)];
        const unsigned intervals = axis.points - axis.degree;
        p[k] =
            random.below(4) == 0 ? static_cast<double>(random.below(intervals + 1)) / intervals : random.uniform(0, 1);
    }
    return lattice.volume().origin + lattice.volume().axes * p;
}
double sizeOf(const Lattice& lattice) {
    return lattice.volume().axes.norm() + lattice.volume().origin.norm();
}

TEST(Lattice, AtRestMovesNothing) {
    for (const std::uint64_t seed : seeds(200)) {
        SCOPED_TRACE(repeat(seed, "AtRestMovesNothing"));
        Source random(seed);
        const Lattice lattice = someLattice(random);
        for (int i = 0; i < 20; ++i) {
            const Vec3d x = i % 5 == 0 ? random.inCube(10) : inside(lattice, random);
            ASSERT_LT((lattice.deformed(x) - x).norm(), 1e-13 * sizeOf(lattice));
            ASSERT_LT((lattice.place(x).jacobian - Mat3d::Identity()).norm(), 1e-10);
        }
    }
}

TEST(Lattice, OfAnAffineMapIsThatMap) {
    for (const std::uint64_t seed : seeds(200)) {
        SCOPED_TRACE(repeat(seed, "OfAnAffineMapIsThatMap"));
        Source random(seed);
        Lattice lattice = someLattice(random);
        Affine3d map = Affine3d::Identity();
        for (int k = 0; k < 3; ++k) map.linear().col(k) = random.inCube(2);
        map.translation() = random.inCube(5);
        std::vector<Vec3d> points;
        for (const Vec3d& p : lattice.controlPoints()) points.push_back(map * p);
        ASSERT_TRUE(lattice.setControlPoints(0, points));
        for (int i = 0; i < 20; ++i) {
            const Vec3d x = inside(lattice, random);
            const Lattice::Place place = lattice.place(x);
            ASSERT_LT((place.point - map * x).norm(), 1e-12 * (sizeOf(lattice) + 10));
            ASSERT_LT((place.jacobian - map.linear()).norm(), 1e-10);
        }
    }
}

TEST(Lattice, WithTheFewestPointsIsBernsteins) {
    Source random(1);
    for (unsigned degree = 1; degree <= 6; ++degree) {
        const LatticeAxis axis{degree, degree + 1};
        Lattice lattice = Lattice::make({}, {axis, axis, axis}).value();
        shake(lattice, 1, random);
        const auto bernstein = [&](unsigned i, double t) {
            return std::tgamma(degree + 1.0) / std::tgamma(i + 1.0) / std::tgamma(degree - i + 1.0) * std::pow(t, i) *
                   std::pow(1 - t, degree - i);
        };
        for (int n = 0; n < 10; ++n) {
            const Vec3d x(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1));
            Vec3d sum = Vec3d::Zero();
            for (unsigned k = 0; k <= degree; ++k)
                for (unsigned j = 0; j <= degree; ++j)
                    for (unsigned i = 0; i <= degree; ++i)
                        sum += bernstein(i, x[0]) * bernstein(j, x[1]) * bernstein(k, x[2]) *
                               lattice.controlPoints()[lattice.index(i, j, k)];
            EXPECT_LT((lattice.deformed(x) - sum).norm(), 1e-13);
        }
    }
}

TEST(Lattice, HasTheDerivativesThatDifferencesShow) {
    for (const std::uint64_t seed : seeds(200)) {
        SCOPED_TRACE(repeat(seed, "HasTheDerivativesThatDifferencesShow"));
        Source random(seed);
        Lattice lattice = someLattice(random);
        shake(lattice, 1, random);
        for (int i = 0; i < 10; ++i) {
            // Off knots and faces, where one-sided differences differ for low degrees.
            const Vec3d p(random.uniform(0.01, 0.99), random.uniform(0.01, 0.99), random.uniform(0.01, 0.99));
            const Vec3d x = lattice.volume().origin + lattice.volume().axes * p;
            const double h = 1e-6;
            bool crosses = false;
            Mat3d differences;
            for (int k = 0; k < 3; ++k) {
                differences.col(k) =
                    (lattice.deformed(x + h * Vec3d::Unit(k)) - lattice.deformed(x - h * Vec3d::Unit(k))) / (2 * h);
                const LatticeAxis& axis = lattice.axes()[static_cast<std::size_t>(k)];
                const double at = p[k] * (axis.points - axis.degree);
                crosses = crosses || std::abs(at - std::round(at)) < 1e-4;
            }
            if (crosses) continue;
            // Central differences: h² of the third derivative (degree 5, 5 intervals, control points 1 apart) and 1e-16
            // / h.
            ASSERT_LT((lattice.place(x).jacobian - differences).norm(), 1e-5 * (1 + differences.norm()));
        }
    }
}

TEST(Lattice, StaysInTheHullOfWhatReachesIt) {
    for (const std::uint64_t seed : seeds(300)) {
        SCOPED_TRACE(repeat(seed, "StaysInTheHullOfWhatReachesIt"));
        Source random(seed);
        Lattice lattice = someLattice(random);
        shake(lattice, std::pow(10, random.uniform(-2, 3)), random);
        Box whole;
        for (const Vec3d& p : lattice.controlPoints()) whole.extend(p);
        for (int i = 0; i < 10; ++i) {
            Box box;
            box.extend(inside(lattice, random));
            box.extend(i % 3 == 0   ? random.inCube(10)
                       : i % 3 == 1 ? Vec3d(box.lower + random.inCube(0.2))
                                    : inside(lattice, random));
            const Box bounds = lattice.bounds(box);
            for (int k = 0; k < 20; ++k) {
                Vec3d x;
                for (int a = 0; a < 3; ++a)
                    x[a] = random.below(3) == 0 ? (random.below(2) == 0 ? box.lower[a] : box.upper[a])
                                                : random.uniform(box.lower[a], box.upper[a]);
                ASSERT_TRUE(bounds.contains(lattice.deformed(x))) << "box " << i;
            }
            Box most = whole;
            most.extend(box);
            ASSERT_LT((bounds.size() - most.size()).maxCoeff(), 1e-6 * most.size().norm());
        }
    }
}

TEST(Lattice, TurnsNormalsWithTheirSurface) {
    for (const std::uint64_t seed : seeds(300)) {
        SCOPED_TRACE(repeat(seed, "TurnsNormalsWithTheirSurface"));
        Source random(seed);
        Mat3d j;
        for (int k = 0; k < 3; ++k) j.col(k) = random.inCube(2);
        const double scale = std::pow(10, random.uniform(-60, 60));
        const Vec3d u = random.inCube(1), v = random.inCube(1), n = u.cross(v), out = deformedNormal(scale * j, n);
        if (std::abs(j.determinant()) < 1e-3 || n.norm() < 1e-3) continue;
        ASSERT_NEAR(out.norm(), 1, 1e-12);
        ASSERT_NEAR(out.dot((j * u).normalized()), 0, 1e-9);
        ASSERT_NEAR(out.dot((j * v).normalized()), 0, 1e-9);
        // On its side: what was before the surface is before it.
        ASSERT_GT(out.dot(j * n), 0);
    }
    EXPECT_EQ(deformedNormal(Mat3d::Zero(), Vec3d::UnitX()), Vec3d::Zero());
    EXPECT_EQ(deformedNormal(Mat3d::Identity(), Vec3d::Zero()), Vec3d::Zero());
    // Flattened onto a plane: all that is left faces along z.
    EXPECT_EQ(deformedNormal(Vec3d(1, 1, 0).asDiagonal(), Vec3d(1, 0, 1)), Vec3d::UnitZ());
}

TEST(Lattice, MovesTheCornersOfAModelsOwnBox) {
    // The volume is the model's box; rounding must leave no corner behind.
    for (const std::uint64_t seed : seeds(200)) {
        SCOPED_TRACE(repeat(seed, "MovesTheCornersOfAModelsOwnBox"));
        Source random(seed);
        Box box;
        std::vector<Vec3d> corners;
        for (int i = 0; i < 8; ++i)
            corners.push_back(random.inCube(std::pow(10, random.uniform(-3, 3))).cast<float>().cast<double>());
        for (const Vec3d& p : corners) box.extend(p);
        Lattice lattice = Lattice::make(LatticeVolume::of(box), {}).value();
        std::vector<Vec3d> away;
        for (const Vec3d& p : lattice.controlPoints()) away.push_back(p + 5000 * Vec3d::UnitX());
        ASSERT_TRUE(lattice.setControlPoints(0, away));
        for (const Vec3d& p : corners) ASSERT_NEAR((lattice.deformed(p) - p).x(), 5000, 1e-8);
    }
}

TEST(Lattice, RefusesInWords) {
    const LatticeAxis good{3, 4};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(Lattice::make({}, {good, good, good}));
    EXPECT_FALSE(Lattice::make({}, {LatticeAxis{0, 1}, good, good}));
    EXPECT_FALSE(Lattice::make({}, {good, LatticeAxis{11, 12}, good}));
    EXPECT_FALSE(Lattice::make({}, {good, good, LatticeAxis{3, 3}}));
    EXPECT_FALSE(Lattice::make({}, {good, good, LatticeAxis{3, 65}}));
    EXPECT_FALSE(Lattice::make({.axes = Mat3d::Zero()}, {good, good, good}));
    EXPECT_FALSE(Lattice::make({.axes = Mat3d::Ones()}, {good, good, good}));
    EXPECT_FALSE(Lattice::make({.origin = Vec3d(nan, 0, 0)}, {good, good, good}));
    EXPECT_FALSE(Lattice::make({.axes = 1e60 * Mat3d::Identity()}, {good, good, good}));
    EXPECT_FALSE(Lattice::make(LatticeVolume::of(Box{}), {good, good, good}));
    Lattice lattice = Lattice::make({}, {good, good, good}).value();
    const std::vector<Vec3d> many(65, Vec3d::Zero()), bad(1, Vec3d(0, nan, 0));
    EXPECT_FALSE(lattice.setControlPoints(0, many));
    EXPECT_FALSE(lattice.setControlPoints(64, std::span<const Vec3d>(many).first(1)));
    EXPECT_FALSE(lattice.setControlPoints(3, bad));
    EXPECT_EQ(lattice.controlPoints()[3], lattice.atRest(3));
    EXPECT_TRUE(lattice.bounds(Box{}).empty());
}

}  // namespace
}  // namespace tessera
