#include <gtest/gtest.h>

#include "server/collision/volume/Realignment.h"
#include "tests/unit/volume/Clouds.h"
#include "tests/unit/volume/Realigned.h"

namespace tessera {
namespace {

using namespace clouds;

const PlaneChoice kChoices[] = {PlaneChoice::kThreePlanes, PlaneChoice::kBoxEnclosure};

Vec3d direction(DirectionSet set, std::size_t plane) {
    const std::span<const Vec3d> d = directions(set);
    return plane < d.size() ? d[plane] : Vec3d(-d[plane - d.size()]);
}

TEST(WeightedPlanes, AddUpToTheVectorWithoutNegativeWeights) {
    Random random(11);
    for (const DirectionSet set : kSets)
        for (const PlaneChoice choice : kChoices)
            for (int i = 0; i < 5000; ++i) {
                Vec3d p = std::pow(10.0, uniform(random, -4, 4)) * normal(random);
                if (i % 5 == 0) p[static_cast<int>(random() % 3)] = 0;
                if (i % 7 == 0) p.y() = -p.x();
                if (i % 11 == 0) p.z() = p.x() - p.y();
                if (i == 0) p.setZero();
                const WeightedPlanes w = weightedPlanes(set, p, choice);
                Vec3d sum = Vec3d::Zero();
                for (std::size_t j = 0; j < 3; ++j) {
                    ASSERT_GE(w.weight[j], 0);
                    sum += w.weight[j] * direction(set, w.plane[j]);
                }
                ASSERT_LE((sum - p).norm(), 1e-15 * p.norm()) << p.transpose();
            }
}

TEST(WeightedPlanes, AreTheBestThatThereAreForABall) {
    Random random(12);
    for (const DirectionSet set : kSets) {
        KDop ball(set);
        for (std::size_t i = 0; i < ball.count(); ++i) {
            ball.upper[i] = direction(set, i).norm();
            ball.lower[i] = -ball.upper[i];
        }
        for (int i = 0; i < 3000; ++i) {
            const Vec3d p = normal(random);
            const WeightedPlanes w = weightedPlanes(set, p);
            double sum = 0;
            for (std::size_t j = 0; j < 3; ++j) sum += w.weight[j] * ball.halfPlane(w.plane[j]);
            ASSERT_NEAR(sum, polytopeSupport(ball, p), 1e-13 * p.norm());
        }
    }
}

TEST(WeightedPlanes, AreMirroredForTheOppositeVector) {
    Random random(13);
    for (const DirectionSet set : kSets)
        for (int i = 0; i < 1000; ++i) {
            const Vec3d p = normal(random);
            const std::size_t n = directionCount(set);
            const WeightedPlanes there = weightedPlanes(set, p), back = weightedPlanes(set, -p);
            EXPECT_EQ(there.weight, back.weight);
            for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ((there.plane[j] + n) % (2 * n), back.plane[j]);
        }
}

struct Setting {
    DirectionSet source, target;
    PlaneChoice choice;
    int cloudKind, mapKind;
    [[nodiscard]] std::string text(std::uint64_t seed) const {
        return std::string(kKindNames[cloudKind]) + ", " + kMapNames[mapKind] + ", " +
               std::to_string(2 * directionCount(source)) + " to " + std::to_string(2 * directionCount(target)) +
               (choice == PlaneChoice::kBoxEnclosure ? ", box" : ", planes") + ", repeat with seed " +
               std::to_string(seed);
    }
};

/// Every pair of sets, choice, kind of cloud and of map, each with seeds of its own.
template <typename Check>
void forAllSettings(int seeds, const Check& check) {
    std::uint64_t seed = 0;
    for (const DirectionSet source : kSets)
        for (const DirectionSet target : kSets)
            for (const PlaneChoice choice : kChoices)
                for (int cloud = 0; cloud < kKinds; ++cloud)
                    for (int map = 0; map < kMaps; ++map)
                        for (int i = 0; i < seeds; ++i) {
                            check(Setting{source, target, choice, cloud, map}, ++seed);
                            if (testing::Test::HasFatalFailure()) return;
                        }
}

TEST(Realignment, HoldsEveryMappedPoint) {
    forAllSettings(5, [](const Setting& s, std::uint64_t seed) {
        Random random(seed);
        const Cloud cloud = make(s.cloudKind, random);
        const Affine3d a_T_b = map(s.mapKind, random);
        const PlaneWeights weights = PlaneWeights::make(s.source, s.target, a_T_b, s.choice);
        const KDop seen = realigned(weights, KDop::around(s.source, cloud));
        const KDop mapped = [&] {
            KDop dop(s.target);
            for (const Vec3d& x : cloud) dop.extend(a_T_b * x);
            return dop;
        }();
        for (std::size_t i = 0; i < seen.count(); ++i) {
            // The true points, and the points and slabs as they are computed.
            ASSERT_LE(mapped.upper[i], seen.upper[i]) << s.text(seed);
            ASSERT_GE(mapped.lower[i], seen.lower[i]) << s.text(seed);
            for (const Vec3d& x : cloud) {
                const long double at = along(directions(s.target)[i], a_T_b, x);
                ASSERT_LE(at, seen.upper[i]) << s.text(seed);
                ASSERT_GE(at, seen.lower[i]) << s.text(seed);
            }
        }
    });
}

TEST(Realignment, HoldsTheWholePolytopeNotJustThePoints) {
    Random random(21);
    for (const DirectionSet set : kSets)
        for (int i = 0; i < 200; ++i) {
            const KDop dop = KDop::around(set, make(i % kKinds, random));
            const Affine3d m = map(i % kMaps, random);
            const KDop seen = realigned(PlaneWeights::make(set, DirectionSet::k26, m), dop);
            for (std::size_t k = 0; k < seen.count(); ++k) {
                const Vec3d d = directions(DirectionSet::k26)[k];
                const Vec3d p = m.linear().transpose() * d;
                // Simplex itself is right to rounding only.
                const double rounding = 1e-12 * (seen.magnitude(k) + p.norm() * dop.magnitude(0));
                EXPECT_LE(polytopeSupport(dop, p) + m.translation().dot(d), seen.upper[k] + rounding);
                EXPECT_GE(-polytopeSupport(dop, -p) + m.translation().dot(d), seen.lower[k] - rounding);
            }
        }
}

TEST(Realignment, WithEdgeDirectionsIsNeverLooserThanTheBox) {
    Random random(22);
    for (const DirectionSet set : {DirectionSet::k18, DirectionSet::k26})
        for (int i = 0; i < 3000; ++i) {
            const KDop dop = KDop::around(set, make(i % kKinds, random));
            const Affine3d m = map(i % kMaps, random);
            const PlaneWeights planes = PlaneWeights::make(set, DirectionSet::k26, m);
            const KDop byPlanes = realigned(planes, dop);
            const KDop byBox =
                realigned(PlaneWeights::make(set, DirectionSet::k26, m, PlaneChoice::kBoxEnclosure), dop);
            const double rounding = planes.rounding(dop);
            for (std::size_t k = 0; k < byBox.count(); ++k) {
                ASSERT_LE(byPlanes.upper[k], byBox.upper[k] + rounding) << kKindNames[i % kKinds];
                ASSERT_GE(byPlanes.lower[k], byBox.lower[k] - rounding) << kKindNames[i % kKinds];
            }
        }
}

TEST(Realignment, OfTheIdentityChangesNothingButRounding) {
    Random random(23);
    for (const DirectionSet set : kSets) {
        const KDop dop = KDop::around(set, anisotropic(random, 30));
        const PlaneWeights same = PlaneWeights::make(set, set, Affine3d::Identity());
        const KDop seen = realigned(same, dop);
        const double rounding = same.rounding(dop);
        for (std::size_t i = 0; i < dop.count(); ++i) {
            EXPECT_EQ(seen.upper[i], dop.upper[i] + rounding);
            EXPECT_EQ(seen.lower[i], dop.lower[i] - rounding);
        }
    }
}

TEST(Realignment, OfNothingIsNothing) {
    const PlaneWeights weights = PlaneWeights::make(DirectionSet::k18, DirectionSet::k14, Affine3d::Identity());
    EXPECT_TRUE(realigned(weights, KDop(DirectionSet::k18)).empty());
}

// ---- as the kernels do it ----------------------------------------------------------------------------------------

float up(double x) {
    const float f = static_cast<float>(x);
    return f < x ? std::nextafterf(f, std::numeric_limits<float>::infinity()) : f;
}

struct FloatDop {
    std::array<float, 2 * kMaxDirections> h;
    FloatDop(const KDop& dop) {
        for (std::size_t i = 0; i < 2 * dop.count(); ++i) h[i] = up(dop.halfPlane(i));
    }
    [[nodiscard]] KDop widened(DirectionSet set) const {
        KDop dop(set);
        for (std::size_t i = 0; i < dop.count(); ++i) {
            dop.upper[i] = h[i];
            dop.lower[i] = -h[i + dop.count()];
        }
        return dop;
    }
};

/// The sum in each order that a kernel may choose: products rounded or fused, the offset first or last.
std::array<float, 3> sums(const FloatPlaneWeights& w, std::size_t i, const FloatDop& dop) {
    const float a = w.weight[i][0], b = w.weight[i][1], c = w.weight[i][2], t = w.offset[i];
    const float x = dop.h[w.plane[i][0]], y = dop.h[w.plane[i][1]], z = dop.h[w.plane[i][2]];
    const volatile float ax = a * x, by = b * y, cz = c * z;  // volatile: the compiler must not fuse
    const volatile float axby = ax + by, axbycz = axby + cz;
    return {axbycz + t, std::fma(c, z, std::fma(b, y, std::fma(a, x, t))), (ax + t) + (by + cz)};
}

TEST(FloatRealignment, HoldsEveryMappedPoint) {
    forAllSettings(5, [](const Setting& s, std::uint64_t seed) {
        Random random(seed + 1'000'000);
        // A volume within a tree's, which says how much rounding there can be.
        const Cloud cloud = make(s.cloudKind, random);
        Cloud all = cloud;
        const Cloud others = make(static_cast<int>(random() % kKinds), random);
        all.insert(all.end(), others.begin(), others.end());
        const Affine3d a_T_b = map(s.mapKind, random);
        const PlaneWeights weights = PlaneWeights::make(s.source, s.target, a_T_b, s.choice);
        const FloatPlaneWeights kernel = forKernels(weights, FloatDop(KDop::around(s.source, all)).widened(s.source));
        const FloatDop dop(KDop::around(s.source, cloud));
        const std::size_t m = directionCount(s.target);
        for (std::size_t i = 0; i < 2 * m; ++i)
            for (const float sum : sums(kernel, i, dop))
                for (const Vec3d& x : cloud)
                    ASSERT_LE(along(direction(s.target, i), a_T_b, x), sum) << s.text(seed + 1'000'000);
    });
}

TEST(FloatRealignment, NeedsItsSlack) {
    // Were the slack dropped, float sums would miss points: the test above can fail.
    Random random(31);
    int missed = 0;
    for (int round = 0; round < 500; ++round) {
        const Cloud cloud = make(5, random);
        const Affine3d m = map(0, random);
        const PlaneWeights weights = PlaneWeights::make(DirectionSet::k18, DirectionSet::k18, m);
        const FloatDop dop(KDop::around(DirectionSet::k18, cloud));
        FloatPlaneWeights kernel = forKernels(weights, dop.widened(DirectionSet::k18));
        for (std::size_t i = 0; i < 18; ++i) {
            kernel.offset[i] = static_cast<float>(i < 9 ? weights.offset[i] : -weights.offset[i - 9]);
            missed += along(direction(DirectionSet::k18, i), m, cloud[0]) > sums(kernel, i, dop)[0];
        }
    }
    EXPECT_GT(missed, 100);
}

TEST(FloatRealignment, LosesLittleMoreThanFloatDoes) {
    Random random(32);
    for (int round = 0; round < 500; ++round) {
        const KDop dop = KDop::around(DirectionSet::k26, anisotropic(random, 20));
        const Affine3d m = map(0, random);
        const PlaneWeights weights = PlaneWeights::make(DirectionSet::k26, DirectionSet::k26, m);
        const FloatDop rounded(dop);
        const FloatPlaneWeights kernel = forKernels(weights, rounded.widened(DirectionSet::k26));
        const KDop exact = realigned(weights, dop);
        const double size = 10 + m.translation().lpNorm<1>();
        for (std::size_t i = 0; i < 26; ++i)
            EXPECT_LE(sums(kernel, i, rounded)[0] - exact.halfPlane(i), 20 * 0x1p-24 * size);
    }
}

}  // namespace
}  // namespace tessera
