#include "server/collision/mesh/TriangleContact.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

const Triangle kFloor{Vec3d(-4, -4, 0), Vec3d(4, -4, 0), Vec3d(0, 8, 0)};  // looks up

void expectOn(const Triangle& t, const Vec3d& p, double tolerance) {
    const NearestPoints near = nearestPoints(t, {p, p, p});
    EXPECT_LT(near.distance, tolerance) << p.transpose();
}

/// However far one corner is, in whatever place of the triangle: a normal is of unit length.
TEST(TriangleContact, HasANormalAlsoWhereACornerIsFarBeyondAllOthers) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> u(-3, 3);
    const auto any = [&] { return Vec3d(u(random), u(random), u(random)); };
    int met = 0;
    for (int trial = 0; trial < 40'000; ++trial) {
        const Triangle a{any(), any(), any()};
        Triangle b{any(), any(), any()};
        b[random() % 3] *= std::pow(10.0, trial % 31);
        if (!trianglesIntersect(a, b)) continue;
        ++met;
        ASSERT_NEAR(contactOf(a, b).normal.norm(), 1, 1e-9) << "trial " << trial;
        ASSERT_NEAR(contactOf(b, a).normal.norm(), 1, 1e-9) << "trial " << trial;
    }
    EXPECT_GT(met, 5000);
}

TEST(TriangleContact, ACornerPokedThroughAFloorPointsUp) {
    // A stands on its head, its point 0.1 below the floor B.
    const Triangle spike{Vec3d(0, 0, -0.1), Vec3d(1, 0, 3), Vec3d(-1, 0.2, 3)};
    const TriangleContact c = contactOf(spike, kFloor);
    EXPECT_NEAR(c.point.z(), 0, 1e-12);
    EXPECT_NEAR((c.normal + Vec3d::UnitZ()).norm(), 0, 1e-12) << "the floor has to go down";
    EXPECT_NEAR((c.from - c.to).norm(), 2 * 0.1 / 3.1, 0.01);
    EXPECT_NEAR((contactOf(kFloor, spike).normal - Vec3d::UnitZ()).norm(), 0, 1e-12);
}

TEST(TriangleContact, AFloorPokedFromBelowPointsUpToo) {
    const Triangle spike{Vec3d(0, 0, 0.1), Vec3d(-1, 0, -3), Vec3d(1, 0.2, -3)};
    EXPECT_NEAR((contactOf(kFloor, spike).normal - Vec3d::UnitZ()).norm(), 0, 1e-12)
        << "one sided: B's nearest way off the floor's outside is up";
}

TEST(TriangleContact, TheDiagonalOfAWallIsNoRidge) {
    // A vertical face stands in the floor exactly on the edge that two floor triangles share.
    const Triangle half{Vec3d(-4, -4, 0), Vec3d(4, -4, 0), Vec3d(4, 4, 0)};
    const Triangle face{Vec3d(1, 1, -0.01), Vec3d(1, 1, 2), Vec3d(-1, 1, -0.01)};
    EXPECT_NEAR((contactOf(face, half).normal + Vec3d::UnitZ()).norm(), 0, 1e-12);
}

TEST(TriangleContact, CoplanarFacesShareTheMiddleOfTheirOverlap) {
    const Triangle up{Vec3d(0, 0, 0), Vec3d(2, 0, 0), Vec3d(0, 2, 0)};
    const Triangle down{Vec3d(1, 0, 0), Vec3d(1, 1, 0), Vec3d(3, 0, 0)};
    const TriangleContact c = contactOf(up, down);
    EXPECT_EQ(c.normal, Vec3d::UnitZ()) << "the faces look at each other";
    // The overlap is the triangle (1,0) (2,0) (1,1).
    EXPECT_NEAR((c.from - c.to).norm(), std::sqrt(2.0), 1e-12);
    expectOn(up, c.point, 1e-12);
    expectOn(down, c.point, 1e-12);
    EXPECT_EQ(contactOf(down, up).normal, -Vec3d::UnitZ());
}

TEST(TriangleContact, WithoutAreaThereIsStillAPointAndANormal) {
    const Triangle needle{Vec3d(0, 0, -1), Vec3d(0, 0, 1), Vec3d(0, 0, 0.3)};
    const TriangleContact pierced = contactOf(needle, kFloor);
    EXPECT_LT(pierced.point.norm(), 1e-12);
    EXPECT_NEAR((pierced.normal + Vec3d::UnitZ()).norm(), 0, 1e-12);
    const Triangle lying{Vec3d(-9, 0, 0), Vec3d(9, 0, 0), Vec3d(0, 0, 0)};
    EXPECT_NEAR(contactOf(kFloor, lying).point.norm(), 0, 1e-9);
    const Triangle point{Vec3d(1, 1, 0), Vec3d(1, 1, 0), Vec3d(1, 1, 0)};
    EXPECT_LT((contactOf(kFloor, point).point - point[0]).norm(), 1e-12);
    const TriangleContact both = contactOf(needle, lying);
    EXPECT_LT(both.point.norm(), 1e-12);
    EXPECT_NEAR(both.normal.norm(), 1, 1e-12);
    const TriangleContact points = contactOf(point, point);
    EXPECT_NEAR(points.normal.norm(), 1, 1e-12);
}

TEST(TriangleContact, OfNeighboursThatDoNotQuiteMeetLiesBetweenThem) {
    const Triangle above{Vec3d(0, 0, 0.5), Vec3d(0, 1, 2), Vec3d(1, 0, 2)};
    const TriangleContact c = contactOf(kFloor, above);
    EXPECT_NEAR((c.point - Vec3d(0, 0, 0.25)).norm(), 0, 1e-12);
    EXPECT_NEAR((c.normal - Vec3d::UnitZ()).norm(), 0, 1e-12);
}

TEST(TriangleContact, SegmentAndPointLieOnBothTriangles) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> u(-1, 1);
    int met = 0;
    for (int trial = 0; trial < 20'000; ++trial) {
        const auto next = [&] { return Vec3d(u(random), u(random), u(random)); };
        const Triangle a{next(), next(), next()}, b{next(), next(), next()};
        if (!trianglesIntersect(a, b)) continue;
        ++met;
        const TriangleContact c = contactOf(a, b);
        for (const Vec3d& p : {c.from, c.to, c.point}) {
            expectOn(a, p, 1e-9);
            expectOn(b, p, 1e-9);
        }
        EXPECT_NEAR(c.normal.norm(), 1, 1e-12);
        EXPECT_LT((contactOf(b, a).normal + c.normal).norm(), 1e-9) << trial;
        EXPECT_LT((contactOf(b, a).point - c.point).norm(), 1e-9);
    }
    EXPECT_GT(met, 1000);
}

TEST(TriangleContact, NearestPointsOfTrianglesApartAreNoFartherThanAnySample) {
    std::mt19937 random(13);
    std::uniform_real_distribution<double> u(-1, 1), w(0, 1);
    for (int trial = 0; trial < 300; ++trial) {
        const auto next = [&] { return Vec3d(u(random), u(random), u(random)); };
        const Triangle a{next(), next(), next()}, b{next(), next(), next()};
        if (trianglesIntersect(a, b)) continue;
        const NearestPoints near = nearestPoints(a, b);
        expectOn(a, near.onA, 1e-9);
        expectOn(b, near.onB, 1e-9);
        EXPECT_GT(near.distance, 0);
        for (int k = 0; k < 200; ++k) {
            const auto on = [&](const Triangle& t) {
                double s = w(random), r = w(random);
                if (s + r > 1) s = 1 - s, r = 1 - r;
                return Vec3d(t[0] + s * (t[1] - t[0]) + r * (t[2] - t[0]));
            };
            EXPECT_GE((on(a) - on(b)).norm(), near.distance - 1e-12);
        }
    }
}

}  // namespace
}  // namespace tessera
