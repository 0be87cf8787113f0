#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "server/collision/mesh/TreeQueries.h"
#include "tests/unit/collision/BruteForce.h"
#include "tests/unit/collision/Shapes.h"

namespace tessera {
namespace {

std::filesystem::path dataFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data";
}

/// `v` and `f` lines of a Wavefront OBJ, polygons fanned.
shapes::Soup readObj(const std::filesystem::path& file) {
    shapes::Soup soup;
    std::ifstream in(file);
    std::string line, word;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        words >> word;
        if (word == "v") {
            float x, y, z;
            words >> x >> y >> z;
            soup.positions.insert(soup.positions.end(), {x, y, z});
        } else if (word == "f") {
            std::vector<std::uint32_t> corners;
            while (words >> word) corners.push_back(static_cast<std::uint32_t>(std::stoul(word) - 1));
            for (std::size_t i = 2; i < corners.size(); ++i)
                soup.indices.insert(soup.indices.end(), {corners[0], corners[i - 1], corners[i]});
        }
        word.clear();
    }
    return soup;
}

struct Pair {
    const char* a;
    const char* b;
    int poses;
};

void PrintTo(const Pair& p, std::ostream* out) {
    *out << p.a << " and " << p.b;
}

class RealMeshes : public testing::TestWithParam<Pair> {};

TEST_P(RealMeshes, TreesFindWhatBruteForceFinds) {
    const auto fileA = dataFolder() / GetParam().a, fileB = dataFolder() / GetParam().b;
    if (!std::filesystem::exists(fileA) || !std::filesystem::exists(fileB))
        GTEST_SKIP() << "no test data at " << dataFolder() << " (set TESSERA_TEST_DATA)";
    const AabbTree a = readObj(fileA).tree(), b = readObj(fileB).tree();
    ASSERT_GT(a.mesh().faceCount(), 40u);
    std::mt19937 random(21);
    std::normal_distribution<double> n;
    const double reach = 0.35 * (a.mesh().bounds().size().norm() + b.mesh().bounds().size().norm());
    std::uniform_real_distribution<double> far(0, reach);
    int met = 0;
    std::size_t pairs = 0;
    for (int pose = 0; pose < GetParam().poses; ++pose) {
        const Vec3d direction = Vec3d(n(random), n(random), n(random)).normalized();
        const Quatd turn = Quatd(n(random), n(random), n(random), n(random)).normalized();
        // B's middle, turned, at some distance of A's middle.
        const Affine3d a_T_b = Eigen::Translation3d(a.mesh().bounds().center() + far(random) * direction) * turn *
                               Eigen::Translation3d(-b.mesh().bounds().center());
        const std::vector<FacePair> truth = bruteForce(a.mesh(), b.mesh(), a_T_b);
        QueryWork work;
        ASSERT_EQ(allTouching(a, b, a_T_b, work).pairs, truth);
        ASSERT_EQ(anyTouching(a, b, a_T_b, work), truth.empty() ? Touch::kNo : Touch::kYes);
        met += !truth.empty();
        pairs += truth.size();
    }
    EXPECT_GT(met, GetParam().poses / 4);
    EXPECT_GT(pairs, 100u);
}

INSTANTIATE_TEST_SUITE_P(Data, RealMeshes,
                         testing::Values(Pair{"collision/fcl_env.obj", "collision/fcl_rob.obj", 60},
                                         Pair{"meshes/spot/spot_low_resolution.obj", "meshes/hand/hand_lowres.obj", 25},
                                         Pair{"meshes/fish/fish_low_resolution.obj",
                                              "meshes/fish/fish_low_resolution.obj", 20},
                                         Pair{"meshes/cube/cube.obj", "meshes/cube/cube_no_bottom.obj", 100}),
                         [](const auto& test) {
                             return std::filesystem::path(test.param.a).stem().string() + "_" +
                                    std::to_string(test.index);
                         });

TEST(RealMeshes, AModelOnTopOfItselfTouchesEverywhere) {
    const auto file = dataFolder() / "meshes/spot/spot_low_resolution.obj";
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << dataFolder() << " (set TESSERA_TEST_DATA)";
    const AabbTree spot = readObj(file).tree();
    QueryWork work;
    const FacePairs pairs = allTouching(spot, spot, Affine3d::Identity(), work);
    EXPECT_EQ(pairs.pairs, bruteForce(spot.mesh(), spot.mesh(), Affine3d::Identity()));
    std::size_t own = 0;
    for (const FacePair& p : pairs.pairs) own += p.a == p.b;
    EXPECT_EQ(own, spot.mesh().faceCount()) << "each face lies on itself";
}

}  // namespace
}  // namespace tessera
