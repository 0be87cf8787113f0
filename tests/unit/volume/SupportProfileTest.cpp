#include <gtest/gtest.h>

#include <numbers>

#include "server/collision/volume/SupportProfile.h"
#include "tests/unit/volume/Clouds.h"
#include "tests/unit/volume/Realigned.h"

namespace tessera {
namespace {

using namespace clouds;

const ProfileShape kShapes[] = {{DirectionSet::k6, 4, 8},   {DirectionSet::k14, 1, 8}, {DirectionSet::k14, 8, 8},
                                {DirectionSet::k18, 4, 8},  {DirectionSet::k18, 3, 1}, {DirectionSet::k26, 8, 8},
                                {DirectionSet::k26, 4, 32}, {DirectionSet::k18, 16, 5}};

std::string text(const ProfileShape& s, int cloud, int map, std::uint64_t seed) {
    return std::to_string(2 * directionCount(s.directions)) + " directions, " + std::to_string(s.sectors) +
           " sectors, " + std::to_string(s.bins) + " bins, " + kKindNames[cloud] + ", " + kMapNames[map] +
           ", repeat with seed " + std::to_string(seed);
}

/// Every shape, kind of cloud and of map; a target set in turn.
template <typename Check>
void forAllSettings(std::uint64_t firstSeed, int seeds, const Check& check) {
    std::uint64_t seed = firstSeed;
    for (const ProfileShape& shape : kShapes)
        for (int cloud = 0; cloud < kKinds; ++cloud)
            for (int m = 0; m < kMaps; ++m)
                for (int i = 0; i < seeds; ++i) {
                    ++seed;
                    check(shape, kSets[seed % 4], cloud, m, seed);
                    if (testing::Test::HasFatalFailure()) return;
                }
}

TEST(SupportProfile, HoldsEveryMappedPoint) {
    forAllSettings(0, 6,
                   [](const ProfileShape& shape, DirectionSet target, int cloudKind, int mapKind, std::uint64_t seed) {
                       Random random(seed);
                       const Cloud cloud = make(cloudKind, random);
                       const Affine3d a_T_b = map(mapKind, random);
                       const KDop seen =
                           realigned(ProfileLookup::make(shape, target, a_T_b), SupportProfile::around(shape, cloud));
                       for (std::size_t i = 0; i < seen.count(); ++i)
                           for (const Vec3d& x : cloud) {
                               const long double at = along(directions(target)[i], a_T_b, x);
                               ASSERT_LE(at, seen.upper[i]) << text(shape, cloudKind, mapKind, seed);
                               ASSERT_GE(at, seen.lower[i]) << text(shape, cloudKind, mapKind, seed);
                               const Projections computed = project(target, a_T_b * x);
                               ASSERT_LE(computed[i], seen.upper[i]) << text(shape, cloudKind, mapKind, seed);
                               ASSERT_GE(computed[i], seen.lower[i]) << text(shape, cloudKind, mapKind, seed);
                           }
                   });
}

TEST(SupportProfile, HoldsEveryMappedPointInFloat) {
    forAllSettings(
        1'000'000, 6,
        [](const ProfileShape& shape, DirectionSet target, int cloudKind, int mapKind, std::uint64_t seed) {
            Random random(seed);
            const Cloud cloud = make(cloudKind, random);
            Cloud all = cloud;
            const Cloud others = make(static_cast<int>(random() % kKinds), random);
            if (random() % 2) all.insert(all.end(), others.begin(), others.end());
            const Affine3d a_T_b = map(mapKind, random);
            const SupportProfile profile = SupportProfile::around(shape, cloud);
            const FloatProfileLookup w =
                forKernels(ProfileLookup::make(shape, target, a_T_b), KDop::around(DirectionSet::k6, all));
            const std::size_t m = directionCount(target);
            for (std::size_t i = 0; i < 2 * m; ++i) {
                const Vec3f& c = profile.center;
                const float* p = w.vector[i];
                const volatile float reach = profile.step * static_cast<float>(profile.table[w.entry[i]]);
                const volatile float x = p[0] * c.x(), y = p[1] * c.y(), z = p[2] * c.z(), out = w.length[i] * reach;
                const volatile float xy = x + y, xyz = xy + z, all4 = xyz + out;
                const float fused =
                    std::fma(p[0], c.x(),
                             std::fma(p[1], c.y(), std::fma(p[2], c.z(), std::fma(w.length[i], reach, w.offset[i]))));
                for (const float sum : {all4 + w.offset[i], fused})
                    for (const Vec3d& point : cloud) {
                        const Vec3d d = i < m ? Vec3d(directions(target)[i]) : Vec3d(-directions(target)[i - m]);
                        ASSERT_LE(along(d, a_T_b, point), sum) << text(shape, cloudKind, mapKind, seed);
                    }
            }
        });
}

TEST(SupportProfile, HoldsUnderRotationsOntoTheEdgesOfItsEntries) {
    // Directions exactly on, and a rounding beside, the boundaries of bins and sectors and between half-directions.
    Random random(41);
    for (const ProfileShape& shape : kShapes)
        for (int round = 0; round < 300; ++round) {
            const Cloud cloud = make(round % kKinds, random);
            const SupportProfile profile = SupportProfile::around(shape, cloud);
            const std::span<const Vec3d> d = directions(shape.directions);
            const Vec3d from = d[random() % d.size()].normalized();
            Vec3d to = d[random() % d.size()].normalized();
            if (from.cross(to).norm() < 0.1) to = from.unitOrthogonal();
            const double angle =
                coveringAngle(shape.directions) * static_cast<double>(random() % (2u * shape.bins + 1)) / shape.bins;
            const Vec3d axis = random() % 2 ? Vec3d(from.cross(to).normalized()) : from.unitOrthogonal();
            Affine3d m = Affine3d::Identity();
            // The first row of M is the direction sought in the source.
            m.linear() = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)).toRotationMatrix() *
                          Quatd::FromTwoVectors(Vec3d::UnitX(), from).toRotationMatrix())
                             .transpose();
            const KDop seen = realigned(ProfileLookup::make(shape, DirectionSet::k26, m), profile);
            for (std::size_t i = 0; i < seen.count(); ++i)
                for (const Vec3d& x : cloud) {
                    const long double at = along(directions(DirectionSet::k26)[i], m, x);
                    ASSERT_LE(at, seen.upper[i]) << "round " << round;
                    ASSERT_GE(at, seen.lower[i]) << "round " << round;
                }
        }
}

TEST(SupportProfile, IsNoLooserThanItsEntriesAreWide) {
    // An entry is the support of some direction of its bin and sector, so not farther than their width lets it be.
    Random random(42);
    for (const ProfileShape& shape : kShapes) {
        const double theta = coveringAngle(shape.directions);
        const double width =
            std::min(2 * theta, theta / shape.bins + 2 * std::numbers::pi / shape.sectors * std::sin(theta));
        for (int round = 0; round < 200; ++round) {
            const Cloud cloud = anisotropic(random, 30);
            const SupportProfile profile = SupportProfile::around(shape, cloud);
            const Affine3d m = map(0, random);
            const KDop seen = realigned(ProfileLookup::make(shape, DirectionSet::k6, m), profile);
            const double far = radius(cloud, profile.center.cast<double>());
            for (std::size_t i = 0; i < 3; ++i) {
                double true_ = -std::numeric_limits<double>::infinity();
                for (const Vec3d& x : cloud) true_ = std::max(true_, (m * x)[static_cast<int>(i)]);
                EXPECT_LE(seen.upper[i] - true_, far * (width + 2.0 / 255));
            }
        }
    }
}

TEST(SupportProfile, IsNeverLooserWithMoreSectorsOrBins) {
    Random random(43);
    for (const DirectionSet set : kSets)
        for (int round = 0; round < 200; ++round) {
            const Cloud cloud = make(round % kKinds, random);
            const Affine3d m = map(round % kMaps, random);
            const auto seen = [&](std::uint8_t sectors, std::uint8_t bins) {
                const ProfileShape shape{set, sectors, bins};
                return realigned(ProfileLookup::make(shape, DirectionSet::k18, m),
                                 SupportProfile::around(shape, cloud));
            };
            const KDop rings = seen(1, 8), four = seen(4, 8), eight = seen(8, 8), fine = seen(8, 16);
            for (std::size_t i = 0; i < 9; ++i) {
                EXPECT_LE(four.upper[i], rings.upper[i]);
                EXPECT_LE(eight.upper[i], four.upper[i]);
                EXPECT_LE(fine.upper[i], eight.upper[i]);
                EXPECT_GE(four.lower[i], rings.lower[i]);
                EXPECT_GE(eight.lower[i], four.lower[i]);
                EXPECT_GE(fine.lower[i], eight.lower[i]);
            }
        }
}

TEST(SupportProfile, OfOnePointIsThatPointInFloat) {
    const Cloud point = {Vec3d(1e6, -2e6, 3.1)};
    const ProfileShape shape;
    const SupportProfile profile = SupportProfile::around(shape, point);
    Random random(44);
    const Affine3d m = map(0, random);
    const KDop seen = realigned(ProfileLookup::make(shape, DirectionSet::k6, m), profile);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(seen.upper[static_cast<std::size_t>(i)], (m * point[0])[i], 0.5);
        EXPECT_NEAR(seen.lower[static_cast<std::size_t>(i)], (m * point[0])[i], 0.5);
    }
}

TEST(SupportProfile, TakesAByteForEachEntry) {
    EXPECT_EQ((ProfileShape{DirectionSet::k18, 4, 8}.size()), 576u);
    EXPECT_EQ((ProfileShape{DirectionSet::k26, 8, 8}.size()), 1664u);
    Random random(45);
    EXPECT_EQ(SupportProfile::around({DirectionSet::k14, 8, 8}, anisotropic(random, 9)).table.size(), 896u);
}

}  // namespace
}  // namespace tessera
