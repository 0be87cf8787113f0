#include <algorithm>
#include <cstring>
#include <limits>

#include "common/math/Compose.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/tree/TreeStorage.h"
#include "tests/support/words/Words.h"
#include "tests/unit/collision/BruteForce.h"
#include "tests/unit/tree/Meshes.h"

namespace tessera::trees {
namespace {

Affine3d poseOf(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const Quatd turn(normal(random), normal(random), normal(random), normal(random));
    const Vec3d way(normal(random), normal(random), normal(random));
    return composeTransform(0.5 * way, turn, Vec3d::Ones());
}

void expectAnswersOf(const TriangleTree& a, const TriangleTree& b, std::uint64_t seed) {
    SCOPED_TRACE("pose of seed " + std::to_string(seed));
    const Affine3d pose = poseOf(seed);
    const std::vector<FacePair> expected = bruteForce(a.mesh(), b.mesh(), pose);
    QueryWork work;
    EXPECT_EQ(allTouching(a, b, pose, work).pairs, expected);
    EXPECT_EQ(firstTouching(a, b, pose, work).touch, expected.empty() ? Touch::kNo : Touch::kYes);
}

TEST(TriangleTree, AnswersAlikeWithEveryVolumeAndEverySplit) {
    const TriangleMesh a = soup(160, 41).mesh(), b = field(10, 0.4).mesh();
    for (const VolumeKind kind : kKinds)
        for (const SplitRule rule : kRules) {
            SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)) + ", rule " +
                         std::to_string(static_cast<int>(rule)));
            const TreeOptions options{kind, rule};
            const TriangleTree treeA(a, options), treeB(b, options);
            for (std::uint64_t seed = 1; seed <= 6; ++seed) expectAnswersOf(treeA, treeB, seed);
        }
}

/// Twisted about y and blown up.
std::vector<Vec3d> twisted(const std::vector<Vec3d>& from, double by) {
    std::vector<Vec3d> out;
    for (const Vec3d& p : from) {
        const double angle = by * p.y();
        out.emplace_back((1 + by) * Vec3d(std::cos(angle) * p.x() - std::sin(angle) * p.z(), p.y(),
                                          std::sin(angle) * p.x() + std::cos(angle) * p.z()));
    }
    return out;
}

TEST(TriangleTree, FollowsADeformation) {
    const Arrays arrays = soup(200, 51), still = soup(100, 52);
    for (const VolumeKind kind : kKinds) {
        SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)));
        TriangleTree tree(arrays.mesh(), {.volume = kind});
        const TriangleTree other(still.mesh(), {.volume = kind});
        for (const double by : {0.3, 2.0, 0.0}) {
            ASSERT_TRUE(tree.refit(twisted(arrays.vertices(), by)));
            for (std::uint64_t seed = 11; seed <= 14; ++seed) expectAnswersOf(tree, other, seed);
        }
        const TriangleTree fresh(arrays.mesh(), {.volume = kind});
        ASSERT_EQ(tree.storage().volumes.size(), fresh.storage().volumes.size());
        for (std::size_t row = 0; row < fresh.storage().volumes.size(); ++row)
            for (unsigned lane = 0; lane < kernel::kWidth; ++lane)
                ASSERT_EQ(tree.storage().volumes[row].lane[lane], fresh.storage().volumes[row].lane[lane])
                    << "back where it was, row " << row;
        EXPECT_NEAR(tree.decay(), 1, 1e-12);
    }
}

/// Ranges of vertices move again and again: every answer, and how loose the volumes are said to be, as if all were
/// fitted.
TEST(TriangleTree, FollowsRangesOfVertices) {
    const Arrays arrays = field(40, 0.3), still = soup(120, 52);
    for (const VolumeKind kind : kKinds) {
        SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)));
        std::mt19937_64 random(7);
        const auto number = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        const auto mesh = std::make_shared<TriangleMesh>(arrays.mesh());
        TriangleTree tree(mesh, {.volume = kind});
        const TriangleTree other(still.mesh(), {.volume = kind});
        const std::vector<Vec3d> start = arrays.vertices();
        std::vector<Vec3d> now = start;
        int partly = 0;
        for (int step = 0; step < 40; ++step) {
            SCOPED_TRACE("step " + std::to_string(step));
            const std::size_t count = 1 + random() % 60, first = random() % (now.size() - count);
            // Now and then beyond the tree's coordinates, and back.
            const double reach = step % 13 == 12 ? 9 : 0.2;
            std::vector<Vec3d> moved;
            for (std::size_t i = 0; i < count; ++i) {
                now[first + i] =
                    start[first + i] + Vec3d(number(-reach, reach), number(-reach, reach), number(-reach, reach));
                if (step % 2 == 0) now[first + i] = now[first + i].cast<float>().cast<double>();
                moved.push_back(now[first + i]);
            }
            ASSERT_TRUE(mesh->move(first, moved));
            const Vec3d centre = tree.storage().centre;
            tree.refitted(first, count);
            partly += tree.storage().centre == centre;
            expectAnswersOf(tree, other, 100 + static_cast<std::uint64_t>(step));
            if (step % 8 != 7) continue;
            TriangleMesh witness = arrays.mesh();
            ASSERT_TRUE(witness.move(now));
            ASSERT_EQ(witness.bounds().lower, mesh->bounds().lower);
            ASSERT_EQ(witness.bounds().upper, mesh->bounds().upper);
            for (std::size_t i = 0; i < now.size(); ++i) ASSERT_EQ(Vec3d(mesh->positions()[i]), now[i]);
        }
        EXPECT_GT(partly, 20);
        // All anew where nothing has changed: the same volumes, where they are the same everywhere.
        const double decay = tree.decay();
        const std::vector<TreeStorage::VolumeRow> rows = tree.storage().volumes;
        const Vec3d centre = tree.storage().centre;
        tree.refitted();
        if (tree.storage().centre != centre) continue;
        EXPECT_NEAR(tree.decay(), decay, 1e-6 * decay);
        for (std::size_t row = 0; row < rows.size(); ++row)
            for (unsigned lane = 0; lane < kernel::kWidth; ++lane)
                ASSERT_EQ(tree.storage().volumes[row].lane[lane], rows[row].lane[lane]) << "row " << row;
    }
}

TEST(TriangleTree, TakesNoRangesThatAreNone) {
    TriangleMesh mesh = field(4, 0.3).mesh();
    const Box before = mesh.bounds();
    const std::vector<Vec3d> two(2, Vec3d::Zero()), bad{Vec3d(0, std::numeric_limits<double>::infinity(), 0)};
    EXPECT_FALSE(mesh.move(mesh.vertexCount() - 1, two));
    EXPECT_FALSE(mesh.move(mesh.vertexCount() + 1, {}));
    const auto refused = mesh.move(3, bad);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    EXPECT_EQ(mesh.bounds().lower, before.lower);
    EXPECT_TRUE(mesh.move(mesh.vertexCount(), {}));
}

TEST(TriangleTree, TellsItsDecayAndARebuildMendsIt) {
    const Arrays arrays = field(40, 0.2);
    std::vector<Vec3d> torn = arrays.vertices();
    // Every vertex somewhere else: the worst that can happen to a division.
    std::shuffle(torn.begin(), torn.end(), std::mt19937_64(3));
    std::vector<Vec3d> blown = arrays.vertices();
    for (Vec3d& p : blown) p *= 1.9;
    for (const VolumeKind kind : kKinds) {
        SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)));
        TriangleTree tree(arrays.mesh(), {.volume = kind});
        EXPECT_EQ(tree.decay(), 1);
        ASSERT_TRUE(tree.refit(blown));
        EXPECT_NEAR(tree.decay(), 1, 1e-3) << "the same body, larger";
        ASSERT_TRUE(tree.refit(twisted(arrays.vertices(), 0.2)));
        EXPECT_LT(tree.decay(), TriangleTree::kRebuildAbove);
        ASSERT_TRUE(tree.refit(torn));
        EXPECT_GT(tree.decay(), TriangleTree::kRebuildAbove);
        ASSERT_TRUE(tree.refit(twisted(arrays.vertices(), 3)));
        tree.rebuild();
        EXPECT_EQ(tree.decay(), 1);
        Arrays moved = arrays;
        for (std::size_t v = 0; v < tree.mesh().vertexCount(); ++v)
            std::copy_n(tree.mesh().positions()[v].data(), 3, &moved.positions[3 * v]);
        const TriangleTree fresh(moved.mesh(), {.volume = kind});
        EXPECT_EQ(tree.storage().children, fresh.storage().children);
        EXPECT_EQ(tree.storage().leafFaces, fresh.storage().leafFaces);
    }
}

TEST(TriangleTree, RefusesABadDeformationAndStaysAsItWas) {
    const Arrays arrays = soup(150, 61);
    TriangleTree tree(arrays.mesh());
    const TreeStorage before = tree.storage();
    const TriangleMesh meshBefore = tree.mesh();
    const auto refused = [&](const std::vector<Vec3d>& positions) {
        const Expected<void> result = tree.refit(positions);
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::kBadInput);
        EXPECT_FALSE(result.error().message.empty());
        const TreeStorage& after = tree.storage();
        EXPECT_TRUE(
            std::equal(after.mesh->positions().begin(), after.mesh->positions().end(), meshBefore.positions().begin()));
        EXPECT_EQ(after.mesh->bounds().lower, meshBefore.bounds().lower);
        EXPECT_EQ(after.children, before.children);
        EXPECT_EQ(after.cost, before.cost);
        EXPECT_EQ(after.centre, before.centre);
        EXPECT_EQ(
            std::memcmp(after.volumes.data(), before.volumes.data(), before.volumes.size() * sizeof before.volumes[0]),
            0);
        EXPECT_EQ(
            std::memcmp(after.corners.data(), before.corners.data(), before.corners.size() * sizeof before.corners[0]),
            0);
    };
    std::vector<Vec3d> moved = twisted(arrays.vertices(), 0.5);
    moved.pop_back();
    refused(moved);
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1e51}) {
        for (const std::size_t at : {std::size_t{0}, arrays.vertices().size() / 2, arrays.vertices().size() - 1}) {
            moved = twisted(arrays.vertices(), 0.5);
            moved[at][static_cast<int>(at % 3)] = bad;
            refused(moved);
        }
    }
    ASSERT_TRUE(tree.refit(twisted(arrays.vertices(), 0.5)));
}

TEST(TriangleMesh, KnowsItsBoxBeforeAndAfterAMove) {
    // With and without a vertex that no triangle uses.
    for (const bool unused : {false, true})
        for (const std::size_t faces : {1, 2, 7}) {
            Arrays arrays = soup(faces, faces);
            if (unused) arrays.positions.insert(arrays.positions.end(), {9, 9, 9});
            TriangleMesh mesh = arrays.mesh();
            const auto expectBox = [&] {
                Box box;
                for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
                    for (unsigned i = 0; i < 3; ++i) box.extend(mesh.corner(f, i));
                EXPECT_EQ(mesh.bounds().lower, box.lower);
                EXPECT_EQ(mesh.bounds().upper, box.upper);
            };
            expectBox();
            ASSERT_TRUE(mesh.move(twisted(arrays.vertices(), -0.7)));
            expectBox();
        }
}

}  // namespace
}  // namespace tessera::trees
