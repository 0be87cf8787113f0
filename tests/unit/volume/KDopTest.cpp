#include <gtest/gtest.h>

#include <numbers>

#include "server/collision/volume/Realignment.h"
#include "tests/unit/volume/Clouds.h"
#include "tests/unit/volume/Realigned.h"

namespace tessera {
namespace {

using namespace clouds;

TEST(DirectionSets, HaveEachDirectionOnceAndNoOpposites) {
    for (const DirectionSet set : kSets) {
        const std::span<const Vec3d> d = directions(set);
        ASSERT_EQ(d.size(), directionCount(set));
        for (std::size_t i = 0; i < d.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) EXPECT_GT(d[i].cross(d[j]).norm(), 0.5);
    }
}

TEST(DirectionSets, ProjectAsTheDotProductDoes) {
    Random random(1);
    for (const DirectionSet set : kSets)
        for (int i = 0; i < 100; ++i) {
            const Vec3d x = normal(random);
            const Projections at = project(set, x);
            for (std::size_t k = 0; k < directionCount(set); ++k)
                EXPECT_LE(std::abs(static_cast<double>(at[k] - dot(directions(set)[k], x))), 0x1p-51 * x.lpNorm<1>());
            for (std::size_t k = directionCount(set); k < kMaxDirections; ++k) EXPECT_EQ(at[k], 0);
        }
}

TEST(DirectionSets, LeaveNoDirectionFartherThanTheirCoveringAngle) {
    const double known[] = {54.74, 36.21, 35.26, 27.57};  // degrees
    Random random(2);
    for (std::size_t s = 0; s < 4; ++s) {
        EXPECT_NEAR(coveringAngle(kSets[s]) * 180 / std::numbers::pi, known[s], 0.005);
        double farthest = 0;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d x = normal(random).normalized();
            double nearest = 0;
            for (const Vec3d& d : directions(kSets[s])) nearest = std::max(nearest, std::abs(x.dot(d)) / d.norm());
            farthest = std::max(farthest, std::acos(std::min(1.0, nearest)));
        }
        EXPECT_LE(farthest, coveringAngle(kSets[s]));
        EXPECT_GT(farthest, 0.95 * coveringAngle(kSets[s]));
    }
}

TEST(KDop, IsEmptyBeforeItHoldsAPoint) {
    KDop dop(DirectionSet::k18);
    EXPECT_TRUE(dop.empty());
    EXPECT_FALSE(dop.overlaps(dop));
    dop.extend(Vec3d(1, 2, 3));
    EXPECT_FALSE(dop.empty());
    EXPECT_TRUE(dop.overlaps(dop));
    EXPECT_EQ(dop.lower, dop.upper);
}

TEST(KDop, CutsTheEdgesThatABoxKeeps) {
    const Cloud diagonal = {Vec3d(0, 0, 0), Vec3d(1, 1, 0)}, beside = {Vec3d(0.9, 0, 0), Vec3d(1, 0.1, 0)};
    EXPECT_TRUE(KDop::around(DirectionSet::k6, diagonal).overlaps(KDop::around(DirectionSet::k6, beside)));
    EXPECT_FALSE(KDop::around(DirectionSet::k18, diagonal).overlaps(KDop::around(DirectionSet::k18, beside)));
}

TEST(KDop, OfPartsTogetherIsThatOfTheWhole) {
    Random random(3);
    const Cloud cloud = anisotropic(random, 30);
    for (const DirectionSet set : kSets) {
        KDop joined = KDop::around(set, std::span(cloud).first(11));
        joined.extend(KDop::around(set, std::span(cloud).subspan(11)));
        const KDop whole = KDop::around(set, cloud);
        EXPECT_EQ(joined.lower, whole.lower);
        EXPECT_EQ(joined.upper, whole.upper);
    }
}

/// The least Σ λ h over every three planes that can hold p: linear programming by trying everything.
double supportByTrying(const KDop& dop, const Vec3d& p) {
    const std::span<const Vec3d> d = directions(dop.set);
    const auto side = [&](std::size_t plane) {
        return plane < d.size() ? Vec3d(d[plane]) : Vec3d(-d[plane - d.size()]);
    };
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 2 * d.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            for (std::size_t k = 0; k < j; ++k) {
                Mat3d m;
                m << side(i), side(j), side(k);
                if (std::abs(m.determinant()) < 0.5) continue;
                const Vec3d weights = m.inverse() * p;
                if (weights.minCoeff() < -1e-12) continue;
                least = std::min(least, weights.dot(Vec3d(dop.halfPlane(i), dop.halfPlane(j), dop.halfPlane(k))));
            }
    return least;
}

TEST(PolytopeSupport, IsTheLeastOverAllTriplesOfPlanes) {
    Random random(4);
    for (const DirectionSet set : kSets)
        for (int kind = 0; kind < kKinds; ++kind)
            for (int i = 0; i < 6; ++i) {
                const Cloud cloud = make(kind, random);
                const KDop dop = KDop::around(set, cloud);
                const Vec3d p = i == 0 ? Vec3d(1, -1, 0) : normal(random);
                double size = 0;
                for (std::size_t k = 0; k < dop.count(); ++k) size = std::max(size, dop.magnitude(k));
                EXPECT_NEAR(polytopeSupport(dop, p), supportByTrying(dop, p), 1e-11 * size)
                    << kKindNames[kind] << ", " << 2 * dop.count() << " directions, round " << i;
            }
}

TEST(PolytopeSupport, OfABoxIsItsFarthestCorner) {
    const Cloud corners = {Vec3d(-1, -2, -3), Vec3d(4, 5, 6)};
    EXPECT_DOUBLE_EQ(polytopeSupport(KDop::around(DirectionSet::k6, corners), Vec3d(1, -1, 0.5)), 4 + 2 + 3);
}

TEST(PolytopeSupport, KnowsSlabsWithoutACommonPoint) {
    KDop dop = KDop::around(DirectionSet::k18, Cloud{Vec3d(0, 0, 0), Vec3d(1, 1, 1)});
    dop.lower[3] = 3;  // x + y ≥ 3 within the unit cube
    dop.upper[3] = 4;
    EXPECT_EQ(polytopeSupport(dop, Vec3d(1, 1, 0.1)), -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace tessera
