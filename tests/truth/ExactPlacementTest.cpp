// Bodies placed so that faces lie in one plane, share edges and corners, or just touch: where an answer hangs on the
// last bit. CGAL decides; FCL does not take part, its triangle test rounds.
#include <algorithm>
#include <array>

#include "tests/truth/CgalOracle.h"
#include "tests/truth/RealPairs.h"

namespace tessera {
namespace {

class ExactPlacement : public testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        if (!cgal::available()) GTEST_SKIP() << "CGAL's headers are missing (deploy/set-up unpacks them)";
        mesh = realModel(GetParam());
        if (HasFailure()) return;
        if (mesh == nullptr) GTEST_SKIP() << "no test data at " << testDataFolder() << " (set TESSERA_TEST_DATA)";
    }
    const TriangleMesh* mesh = nullptr;
};

/// Quarter turns about the axes, exact: 0, 1 and -1 alone. Mirrored ones too.
std::vector<Mat3d> axisMaps() {
    std::vector<Mat3d> maps;
    std::array<int, 3> axes{0, 1, 2};
    do {
        for (int signs = 0; signs < 8; ++signs) {
            Mat3d m = Mat3d::Zero();
            for (int i = 0; i < 3; ++i) m(i, axes[static_cast<std::size_t>(i)]) = (signs >> i & 1) != 0 ? -1 : 1;
            maps.push_back(m);
        }
    } while (std::next_permutation(axes.begin(), axes.end()));
    return maps;
}

TEST_P(ExactPlacement, MeetsItselfWhereCgalSays) {
    std::vector<TriangleTree> kinds;
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kObb, VolumeKind::kDop6,
                                  VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26})
        kinds.emplace_back(*mesh, TreeOptions{.volume = kind});
    const Vec3d size = mesh->bounds().size();
    // In place; side by side by exactly its size; by half of it; a corner at a corner.
    const std::vector<Vec3d> shifts{
        Vec3d::Zero(), {size.x(), 0, 0}, {0, -size.y(), 0}, {0, 0, size.z() / 2}, {size.x() / 2, size.y(), 0}, size};
    std::size_t pairs = 0, placements = 0;
    const std::vector<Mat3d> maps = axisMaps();
    for (std::size_t m = 0; m < maps.size(); m += 7) {
        for (const Vec3d& shift : shifts) {
            Affine3d a_T_b = Affine3d::Identity();
            a_T_b.linear() = maps[m];
            a_T_b.translation() = shift;
            const std::vector<FacePair> truth = cgal::intersectingPairs(*mesh, *mesh, a_T_b);
            pairs += truth.size();
            ++placements;
            for (const TriangleTree& tree : kinds) {
                SCOPED_TRACE(testing::Message() << "map " << m << ", shift " << shift.transpose() << ", volume kind "
                                                << static_cast<int>(tree.options().volume));
                QueryWork work;
                ASSERT_EQ(allTouching(tree, tree, a_T_b, work).pairs, truth);
                ASSERT_EQ(firstTouching(tree, tree, a_T_b, work).touch, truth.empty() ? Touch::kNo : Touch::kYes);
            }
        }
    }
    EXPECT_EQ(placements, 42u);
    // In place every face meets itself and its neighbours.
    EXPECT_GT(pairs, 4 * mesh->faceCount());
}

INSTANTIATE_TEST_SUITE_P(Data, ExactPlacement,
                         testing::Values("cad/7_8ths_cube.stl", "cad/testplate.glb", "cad/octagonal_pocket.stl",
                                         "meshes/cube/cube.obj", "meshes/sphere/sphere.obj", "plant/Material.obj",
                                         "made/gear", "made/plate"),
                         [](const testing::TestParamInfo<const char*>& model) {
                             std::string name = std::filesystem::path(model.param).stem().string();
                             std::replace(name.begin(), name.end(), '-', '_');
                             return "part_" + name;
                         });

}  // namespace
}  // namespace tessera
