// How far two bodies are apart, beside CGAL's exact arithmetic.
#include <random>

#include "server/collision/query/DistanceQuery.h"
#include "tests/truth/CgalOracle.h"
#include "tests/truth/RealPairs.h"

namespace tessera {
namespace {

constexpr double kExact = 1e-12;

class DistanceTruth : public testing::TestWithParam<ModelPair> {
protected:
    void SetUp() override {
        if (!cgal::available()) GTEST_SKIP() << "CGAL's headers are missing (deploy/set-up unpacks them)";
        a = realModel(GetParam().a);
        b = realModel(GetParam().b);
        if (HasFailure()) return;
        if (a == nullptr || b == nullptr)
            GTEST_SKIP() << "no test data at " << testDataFolder() << " (set TESSERA_TEST_DATA)";
    }

    /// Value, faces and points of an answer. CGAL is told ours as a bound: one too low leaves it without any pair, one
    /// too high without reason.
    void check(const Distance& found, const Affine3d& a_T_b) const {
        ASSERT_TRUE(found.complete);
        ASSERT_FALSE(found.farther);
        const double truth = cgal::distance(*a, *b, a_T_b, found.distance);
        ASSERT_NEAR(found.distance, truth, kExact);
        if (truth == 0) {
            EXPECT_EQ(found.distance, 0) << "bodies that meet are not apart by rounding";
            EXPECT_TRUE(trianglesIntersect(a->triangle(found.faces.a), transformed(a_T_b, b->triangle(found.faces.b))));
        } else {
            EXPECT_GT(found.distance, 0) << "bodies that do not meet are apart";
        }
        EXPECT_NEAR((found.onA - found.onB).norm(), found.distance, kExact);
        EXPECT_LE(cgal::distance(found.onA, a->triangle(found.faces.a)), kExact);
        EXPECT_LE(cgal::distance(found.onB, transformed(a_T_b, b->triangle(found.faces.b))), kExact);
    }

    const TriangleMesh* a = nullptr;
    const TriangleMesh* b = nullptr;
};

using SmallPairs = DistanceTruth;

TEST_P(SmallPairs, AreAsFarApartAsCgalSaysInEveryPose) {
    const TriangleTree treeA(*a), treeB(*b);
    std::mt19937 random(static_cast<unsigned>(GetParam().seed));
    for (const TestPose& pose : makePoses(fclOracle(*a, *b), 200, GetParam().seed)) {
        SCOPED_TRACE(describe(pose));
        const Affine3d a_T_b = pose.a_T_b.matrix();
        QueryWork work;
        const Distance cold = distanceBetween(treeA, treeB, a_T_b, work);
        ASSERT_NO_FATAL_FAILURE(check(cold, a_T_b));
        // A hint, the best or any other, changes no answer.
        const FacePair anywhere{static_cast<std::uint32_t>(random() % a->faceCount()),
                                static_cast<std::uint32_t>(random() % b->faceCount())};
        for (const FacePair& start : {cold.faces, anywhere})
            ASSERT_NEAR(distanceBetween(treeA, treeB, a_T_b, work, {.start = start}).distance, cold.distance, kExact);
        if (cold.distance == 0) continue;
        // With a bound above the answer nothing changes; with one below there is nothing nearer.
        ASSERT_NEAR(distanceBetween(treeA, treeB, a_T_b, work, {.upperBound = 1.01 * cold.distance}).distance,
                    cold.distance, kExact);
        ASSERT_TRUE(distanceBetween(treeA, treeB, a_T_b, work, {.upperBound = 0.99 * cold.distance}).farther);
        // A tolerance makes it larger by no more than that, never smaller.
        const double loose = distanceBetween(treeA, treeB, a_T_b, work, {.tolerance = 0.01}).distance;
        ASSERT_GE(loose, cold.distance - kExact);
        ASSERT_LE(loose, cold.distance + 0.01);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Data, SmallPairs,
    testing::Values(ModelPair{"collision/fcl_env.obj", "collision/fcl_rob.obj", 21},
                    ModelPair{"meshes/spot/spot_low_resolution.obj", "meshes/fish/fish_low_resolution.obj", 22},
                    ModelPair{"cad/octagonal_pocket.stl", "cad/testplate.glb", 23},
                    ModelPair{"plant/Material.obj", "plant/Sight_glass_gasket.obj", 24},
                    ModelPair{"made/knot", "made/gear", 25}, ModelPair{"made/plate", "made/terrain", 26}),
    nameOf);

using VolumesOfAPair = DistanceTruth;

TEST_P(VolumesOfAPair, AreAsFarApartAsCgalSays) {
    std::vector<std::pair<TriangleTree, TriangleTree>> kinds;
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kObb, VolumeKind::kDop6,
                                  VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26})
        kinds.emplace_back(TriangleTree(*a, {.volume = kind}), TriangleTree(*b, {.volume = kind}));
    for (const TestPose& pose : makePoses(fclOracle(*a, *b), 40, GetParam().seed)) {
        const Affine3d a_T_b = pose.a_T_b.matrix();
        for (const auto& [treeA, treeB] : kinds) {
            SCOPED_TRACE(describe(pose) + ", volume kind " + std::to_string(static_cast<int>(treeA.options().volume)));
            QueryWork work;
            ASSERT_NO_FATAL_FAILURE(check(distanceBetween(treeA, treeB, a_T_b, work), a_T_b));
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Data, VolumesOfAPair,
                         testing::Values(ModelPair{"meshes/hand/hand_lowres.obj", "meshes/sphere/sphere.obj", 31},
                                         ModelPair{"made/gear", "made/plate", 32}),
                         nameOf);

/// Far apart a brute force on large meshes takes too long; nearly touching it does not, and that is the harder case.
using LargePairsNearby = DistanceTruth;

TEST_P(LargePairsNearby, AreAsFarApartAsCgalSays) {
    const TriangleTree treeA(*a), treeB(*b);
    int checked = 0;
    for (const TestPose& pose : makePoses(fclOracle(*a, *b), 40, GetParam().seed)) {
        if (pose.closeness == Closeness::kSeparated || pose.closeness == Closeness::kDeep) continue;
        SCOPED_TRACE(describe(pose));
        QueryWork work;
        ASSERT_NO_FATAL_FAILURE(check(distanceBetween(treeA, treeB, pose.a_T_b.matrix(), work), pose.a_T_b.matrix()));
        ++checked;
    }
    EXPECT_EQ(checked, 20);
}

INSTANTIATE_TEST_SUITE_P(Data, LargePairsNearby,
                         testing::Values(ModelPair{"scan/stanford_bun_zipper.ply", "scan/stanford_bun_zipper.ply", 41},
                                         ModelPair{"plant/EZ_Control_valve.obj", "plant/Brass.obj", 42},
                                         ModelPair{"made/knot", "made/terrain", 43}),
                         nameOf);

}  // namespace
}  // namespace tessera
