#include <gtest/gtest.h>

#include "server/collision/volume/Realignment.h"
#include "server/collision/volume/SupportProfile.h"
#include "tests/unit/volume/Clusters.h"
#include "tests/unit/volume/Realigned.h"

namespace tessera {
namespace {

using namespace clouds;

class RealClusters : public testing::TestWithParam<const char*> {};

/// Leaves of a few triangles and parts of a hundred, a sample of each model's, turned and unevenly scaled.
TEST_P(RealClusters, AreHeldByEveryScheme) {
    const std::filesystem::path file = dataFolder() / GetParam();
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << dataFolder() << " (set TESSERA_TEST_DATA)";
    std::vector<Corners> triangles = readModel(file);
    ASSERT_GT(triangles.size(), 1000u);
    Random random(51);
    for (const std::size_t most : {1, 4, 100}) {
        std::vector<Cloud> clusters;
        divide(triangles, most, clusters);
        for (int round = 0; round < 300; ++round) {
            const Cloud& cloud = clusters[random() % clusters.size()];
            const Affine3d m = map(round % kMaps, random);
            for (const DirectionSet set : kSets) {
                const KDop dop = KDop::around(set, cloud);
                const ProfileShape shape{set, 4, 8};
                const KDop seen[] = {
                    realigned(PlaneWeights::make(set, set, m), dop),
                    realigned(PlaneWeights::make(set, set, m, PlaneChoice::kBoxEnclosure), dop),
                    realigned(ProfileLookup::make(shape, set, m), SupportProfile::around(shape, cloud)),
                };
                for (const KDop& s : seen)
                    for (std::size_t i = 0; i < s.count(); ++i)
                        for (const Vec3d& x : cloud) {
                            const long double at = along(directions(set)[i], m, x);
                            ASSERT_LE(at, s.upper[i]) << "scheme " << &s - seen << ", round " << round;
                            ASSERT_GE(at, s.lower[i]) << "scheme " << &s - seen << ", round " << round;
                        }
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Data, RealClusters,
                         testing::Values("scan/stanford_bun_zipper.ply", "plant/Plate.obj", "collision/fcl_env.obj",
                                         "meshes/spot/spot_low_resolution.obj"),
                         [](const auto& test) { return std::filesystem::path(test.param).stem().string(); });

}  // namespace
}  // namespace tessera
