#include "server/collision/volume/PolytopeVolume.h"

#include <gtest/gtest.h>

#include "server/collision/volume/Realignment.h"
#include "tests/unit/volume/Clouds.h"

namespace tessera {
namespace {

using namespace clouds;

/// Axis slabs from -1 to 1, all others as wide as is said.
KDop slabs(DirectionSet set, double other) {
    KDop dop(set);
    for (std::size_t i = 0; i < dop.count(); ++i) {
        dop.upper[i] = i < 3 ? 1 : other;
        dop.lower[i] = -dop.upper[i];
    }
    return dop;
}

TEST(PolytopeVolume, IsThatOfKnownPolytopes) {
    EXPECT_NEAR(polytopeVolume(slabs(DirectionSet::k6, 0)), 8, 1e-12) << "a cube";
    EXPECT_NEAR(polytopeVolume(slabs(DirectionSet::k14, 1)), 4.0 / 3, 1e-12)
        << "an octahedron: the axis slabs only touch it";
    EXPECT_NEAR(polytopeVolume(slabs(DirectionSet::k14, 2)), 8 - 8.0 / 6, 1e-12) << "a cube without its corners";
    EXPECT_NEAR(polytopeVolume(slabs(DirectionSet::k18, 1)), 2, 1e-12) << "a rhombic dodecahedron";
    EXPECT_NEAR(polytopeVolume(slabs(DirectionSet::k26, 100)), 8, 1e-12) << "what nothing needs does not count";
}

TEST(PolytopeVolume, OfWhatIsFlatOrEmptyIsNothing) {
    EXPECT_EQ(polytopeVolume(KDop(DirectionSet::k18)), 0);
    for (const DirectionSet set : kSets) {
        const Vec3d points[] = {{1, 2, 3}, {2, 2, 3}, {1, 3, 3}};
        EXPECT_NEAR(polytopeVolume(KDop::around(set, points)), 0, 1e-15);
        EXPECT_NEAR(polytopeVolume(KDop::around(set, std::span(points, 1))), 0, 1e-15);
    }
}

TEST(PolytopeVolume, IsWhatChanceFindsAndDependsOnNoPlaceOrUnit) {
    Random random(1);
    std::uniform_real_distribution<double> share(0, 1);
    for (const DirectionSet set : kSets)
        for (int i = 0; i < 5; ++i) {
            std::vector<Vec3d> points;
            for (int k = 0; k < 12; ++k) points.push_back(normal(random));
            const KDop dop = KDop::around(set, points);
            const double volume = polytopeVolume(dop);
            const Vec3d low(dop.lower[0], dop.lower[1], dop.lower[2]), high(dop.upper[0], dop.upper[1], dop.upper[2]);
            int inside = 0;
            constexpr int kTries = 20'000;
            for (int t = 0; t < kTries; ++t) {
                const Vec3d at = low + (high - low).cwiseProduct(Vec3d(share(random), share(random), share(random)));
                const Projections p = project(set, at);
                bool isIn = true;
                for (std::size_t k = 0; k < dop.count(); ++k)
                    isIn = isIn && p[k] >= dop.lower[k] && p[k] <= dop.upper[k];
                inside += isIn ? 1 : 0;
            }
            EXPECT_NEAR(volume, (high - low).prod() * inside / kTries, 0.02 * (high - low).prod());
            for (Vec3d& p : points) p = 1e3 * p + Vec3d(1e5, -1e5, 3e5);
            EXPECT_NEAR(polytopeVolume(KDop::around(set, points)), 1e9 * volume, 1e9 * volume * 1e-6);
        }
}

}  // namespace
}  // namespace tessera
