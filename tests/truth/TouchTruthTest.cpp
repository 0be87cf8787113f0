// Which triangles meet, beside CGAL's exact predicates and FCL, in 200 poses per pair (large ones: twice 100):
// separated, near, shallow, deep.
#include <array>

#include "server/collision/query/ContactQuery.h"
#include "tests/truth/CgalOracle.h"
#include "tests/truth/RealPairs.h"

namespace tessera {
namespace {

constexpr std::size_t kPoses = 200, kPosesOfLarge = 100;

class TouchTruth : public testing::TestWithParam<ModelPair> {
protected:
    void SetUp() override {
        if (!cgal::available()) GTEST_SKIP() << "CGAL's headers are missing (deploy/set-up unpacks them)";
        a = realModel(GetParam().a);
        b = realModel(GetParam().b);
        if (HasFailure()) return;
        if (a == nullptr || b == nullptr)
            GTEST_SKIP() << "no test data at " << testDataFolder() << " (set TESSERA_TEST_DATA)";
    }

    const TriangleMesh* a = nullptr;
    const TriangleMesh* b = nullptr;
};

/// The large pairs: the default tree, and FCL as the second witness.
class LargePairs : public TouchTruth {};

TEST_P(LargePairs, MeetWhereCgalSaysInEveryPose) {
    ASSERT_NE(a, nullptr);
    const PosedPair pair(*a, *b);
    std::array<int, 4> seen{}, touching{};
    std::size_t pairs = 0;
    const std::vector<TestPose> poses = makePoses(fclOracle(pair.fcl), kPosesOfLarge, GetParam().seed);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        SCOPED_TRACE(describe(poses[i]));
        const Affine3d a_T_b = poses[i].a_T_b.matrix();
        const std::vector<FacePair> truth = cgal::intersectingPairs(*a, *b, a_T_b);
        QueryWork work;
        ASSERT_EQ(allTouching(pair.a, pair.b, a_T_b, work).pairs, truth);
        ASSERT_EQ(firstTouching(pair.a, pair.b, a_T_b, work).touch, truth.empty() ? Touch::kNo : Touch::kYes);
        EXPECT_EQ(pair.fcl.any(a_T_b), !truth.empty()) << "FCL differs from CGAL";
        EXPECT_EQ(pair.fcl.all(a_T_b), truth.size()) << "FCL differs from CGAL";
        const auto k = static_cast<std::size_t>(poses[i].closeness);
        ++seen[k];
        touching[k] += !truth.empty();
        pairs += truth.size();
    }
    // The poses are what they are called.
    for (int k = 0; k < 4; ++k) EXPECT_EQ(seen[k], static_cast<int>(kPosesOfLarge) / 4);
    EXPECT_EQ(touching[0] + touching[1], 0);
    EXPECT_EQ(touching[2] + touching[3], static_cast<int>(kPosesOfLarge) / 2);
    RecordProperty("pairs", static_cast<int>(pairs));
}

INSTANTIATE_TEST_SUITE_P(Data, LargePairs,
                         testing::Values(ModelPair{"scan/stanford_bun_zipper.ply", "scan/stanford_bun_zipper.ply", 1},
                                         ModelPair{"plant/EZ_Control_valve.obj", "plant/Painted_gray.obj", 2},
                                         ModelPair{"cad/cycloidal.ply", "cad/gears.stl", 3},
                                         ModelPair{"plant/Gasket.obj", "meshes/cat/cat-low-resolution.obj", 4},
                                         ModelPair{"made/knot", "made/terrain", 5}),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(OtherPosesOf, LargePairs,
                         testing::Values(ModelPair{"scan/stanford_bun_zipper.ply", "scan/stanford_bun_zipper.ply", 11},
                                         ModelPair{"plant/EZ_Control_valve.obj", "plant/Painted_gray.obj", 12},
                                         ModelPair{"cad/cycloidal.ply", "cad/gears.stl", 13},
                                         ModelPair{"plant/Gasket.obj", "meshes/cat/cat-low-resolution.obj", 14},
                                         ModelPair{"made/knot", "made/terrain", 15}),
                         nameOf);

/// The smaller pairs: every kind of volume, and contacts.
class EveryVolume : public TouchTruth {
protected:
    /// A contact for each pair, on both triangles.
    void checkContacts(const PosedPair& pair, const Affine3d& a_T_b, const std::vector<FacePair>& truth) const {
        QueryWork work;
        const BodyContacts found = contactsBetween(pair.a, pair.b, a_T_b, work);
        ASSERT_TRUE(found.complete);
        ASSERT_EQ(found.contacts.size(), truth.size());
        for (std::size_t i = 0; i < truth.size(); ++i) {
            const BodyContact& c = found.contacts[i];
            ASSERT_EQ(c.faces, truth[i]);
            ASSERT_NEAR(c.contact.normal.norm(), 1, 1e-12);
            const Triangle ofA = a->triangle(c.faces.a), ofB = transformed(a_T_b, b->triangle(c.faces.b));
            for (const Vec3d& p : {c.contact.from, c.contact.to, c.contact.point}) {
                ASSERT_LE(cgal::distance(p, ofA), 1e-9);
                ASSERT_LE(cgal::distance(p, ofB), 1e-9);
            }
        }
    }
};

TEST_P(EveryVolume, MeetsWhereCgalSaysInEveryPose) {
    ASSERT_NE(a, nullptr);
    const PosedPair pair(*a, *b);
    std::vector<std::pair<TriangleTree, TriangleTree>> kinds;
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kObb, VolumeKind::kDop6,
                                  VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26})
        kinds.emplace_back(TriangleTree(*a, {.volume = kind}), TriangleTree(*b, {.volume = kind}));
    const std::vector<TestPose> poses = makePoses(fclOracle(pair.fcl), kPoses, GetParam().seed);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        SCOPED_TRACE(describe(poses[i]));
        const Affine3d a_T_b = poses[i].a_T_b.matrix();
        const std::vector<FacePair> truth = cgal::intersectingPairs(*a, *b, a_T_b);
        for (const auto& [treeA, treeB] : kinds) {
            QueryWork work;
            const auto kind = static_cast<int>(treeA.options().volume);
            ASSERT_EQ(allTouching(treeA, treeB, a_T_b, work).pairs, truth) << "volume kind " << kind;
            ASSERT_EQ(firstTouching(treeA, treeB, a_T_b, work).touch, truth.empty() ? Touch::kNo : Touch::kYes)
                << "volume kind " << kind;
        }
        ASSERT_NO_FATAL_FAILURE(checkContacts(pair, a_T_b, truth));
        EXPECT_EQ(pair.fcl.any(a_T_b), !truth.empty()) << "FCL differs from CGAL";
        EXPECT_EQ(pair.fcl.all(a_T_b), truth.size()) << "FCL differs from CGAL";
    }
}

INSTANTIATE_TEST_SUITE_P(
    Data, EveryVolume,
    testing::Values(ModelPair{"collision/fcl_env.obj", "collision/fcl_rob.obj", 11},
                    ModelPair{"meshes/spot/spot_low_resolution.obj", "meshes/fish/fish_low_resolution.obj", 12},
                    ModelPair{"cad/octagonal_pocket.stl", "cad/testplate.glb", 13},
                    ModelPair{"cad/ballA.off", "cad/ballB.off", 14},
                    ModelPair{"cad/featuretype.STL", "cad/torus.STL", 15},
                    ModelPair{"meshes/hand/hand_lowres.obj", "meshes/koala/koala_low_resolution.obj", 16},
                    ModelPair{"plant/Material.obj", "plant/Sight_glass_gasket.obj", 17},
                    ModelPair{"made/knot", "made/gear", 18}, ModelPair{"made/plate", "made/plate", 19}),
    nameOf);

}  // namespace
}  // namespace tessera
