#include <gtest/gtest.h>

#include <cmath>

#include "common/base/Workers.h"
#include "common/math/Compose.h"
#include "server/collision/query/TouchFront.h"
#include "server/collision/query/TouchQuery.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

std::string seedOf(std::uint64_t seed) {
    return "seed " + std::to_string(seed);
}

/// Both queries, both ways round, on every instruction set.
void expectTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                    const std::vector<FacePair>& truth, const std::string& story,
                    Realignment realignment = Realignment::kThreePlanes) {
    for (const InstructionSet set : instructionSets()) {
        TouchOptions options;
        options.realignment = realignment;
        options.instructions = set;
        QueryWork work;
        const FacePairs all = allTouching(a, b, a_T_b, work, options);
        EXPECT_TRUE(all.complete) << story;
        EXPECT_EQ(all.pairs, truth) << story << ", " << name(set);
        EXPECT_EQ(firstTouching(a, b, a_T_b, work, options).touch, truth.empty() ? Touch::kNo : Touch::kYes)
            << story << ", " << name(set);
        const TouchedPair first = firstTouching(a, b, a_T_b, work, options);
        EXPECT_TRUE(first.touch == Touch::kNo || std::binary_search(truth.begin(), truth.end(), first.faces)) << story;
    }
}

TEST(Touching, EveryVolumeAndSplitFindsWhatBruteForceFindsUnderEveryMap) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Random random(seed);
        const TriangleMesh ma = seed % 2 ? bumpy(random, 9, 12) : strewn(random, 180, 0.3), mb = bumpy(random, 7, 10);
        for (const NamedMap& m : everyKindOfMap(random)) {
            const std::vector<FacePair> truth = bruteForce(ma, mb, m.map);
            for (const VolumeKind volume : kVolumes) {
                const SplitRule split = kSplits[(seed + static_cast<std::uint64_t>(volume)) % 4];
                const TriangleTree ta(ma, {volume, split}), tb(mb, {volume, split});
                expectTouching(ta, tb, m.map, truth,
                               seedOf(seed) + ", " + kVolumeNames[static_cast<int>(volume)] + ", " + m.name);
                expectTouching(ta, tb, m.map, truth, seedOf(seed) + ", box enclosure, " + m.name,
                               Realignment::kBoxEnclosure);
            }
        }
    }
}

TriangleMesh moved(const TriangleMesh& mesh, const Affine3d& map) {
    std::vector<double> positions;
    for (const Vec3d p : mesh.positions()) {
        const Vec3d there = map * p;
        positions.insert(positions.end(), {there.x(), there.y(), there.z()});
    }
    return *TriangleMesh::make(std::span<const double>(positions), mesh.indices());
}

/// Sheets that lie on each other, nearly or quite: of their leaves, which are flat, none is taken for apart that is
/// not.
TEST(Touching, FlatLeavesThatLieOnEachOtherAreToldApartRightly) {
    std::size_t touching = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Random random(seed);
        const double height = seed % 2 ? 0 : 2e-6 * static_cast<double>(seed);
        const TriangleMesh ma = roughGround(random, 14, 0.3, height), mb = roughGround(random, 11, 0.35, height);
        const Affine3d turn = composeTransform(inCube(random, 2), anyRotation(random), Vec3d::Ones());
        for (const double lift : {0.0, 1e-7, 1e-5, 1e-3})
            for (const double tilt : {0.0, 1e-6}) {
                const Affine3d above =
                    composeTransform({0.05, lift, -0.1}, Quatd(Eigen::AngleAxisd(tilt, Vec3d::UnitX())), Vec3d::Ones());
                // Flat against the axes, and not.
                for (const bool turned : {false, true}) {
                    const TriangleMesh inA = turned ? moved(ma, turn) : ma, inB = turned ? moved(mb, turn) : mb;
                    const Affine3d map = turned ? Affine3d(turn * above * turn.inverse()) : above;
                    const std::vector<FacePair> truth = bruteForce(inA, inB, map);
                    touching += truth.size();
                    for (const VolumeKind volume : {VolumeKind::kObb, VolumeKind::kDop18})
                        expectTouching(
                            TriangleTree(inA, {volume}), TriangleTree(inB, {volume}), map, truth,
                            seedOf(seed) + ", lift " + std::to_string(lift) + ", tilt " + std::to_string(tilt));
                }
            }
    }
    EXPECT_GT(touching, 5'000u);
}

/// Whoever builds trees decides about their kinds one by one, and nobody keeps two of them from meeting.
TEST(Touching, TreesOfTwoKindsFindWhatBruteForceFinds) {
    Workers two(2);
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        Random random(seed);
        const TriangleMesh ma = bumpy(random, 6, 8), mb = seed == 1 ? bumpy(random, 5, 7) : bumpy(random, 7, 9);
        for (const NamedMap& m : everyKindOfMap(random)) {
            const std::vector<FacePair> truth = bruteForce(ma, mb, m.map);
            for (const VolumeKind volumeA : kVolumes)
                for (const VolumeKind volumeB : kVolumes) {
                    const TriangleTree ta(ma, {volumeA}), tb(mb, {volumeB});
                    const std::string story = seedOf(seed) + ", " + kVolumeNames[static_cast<int>(volumeA)] + " and " +
                                              kVolumeNames[static_cast<int>(volumeB)] + ", " + m.name;
                    expectTouching(ta, tb, m.map, truth, story);
                    QueryWork work;
                    EXPECT_EQ(allTouching(ta, tb, m.map, work, {.workers = &two}).pairs, truth) << story;
                    TouchFront front;
                    for (int again = 0; again < 2; ++again)
                        EXPECT_EQ(front.firstTouching(ta, tb, m.map, work).touch,
                                  truth.empty() ? Touch::kNo : Touch::kYes)
                            << story;
                }
        }
    }
}

TEST(Touching, SupportProfilesFindTheSameUnderEveryMap) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Random random(seed);
        const TriangleMesh ma = seed % 2 ? bumpy(random, 9, 12) : strewn(random, 180, 0.3), mb = bumpy(random, 12, 14);
        for (const VolumeKind volume : {VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26}) {
            TriangleTree ta(ma, {.volume = volume, .profiles = true}), tb(mb, {.volume = volume, .profiles = true});
            for (const NamedMap& m : everyKindOfMap(random))
                expectTouching(ta, tb, m.map, bruteForce(ma, mb, m.map), seedOf(seed) + ", " + m.name,
                               Realignment::kTable);
            std::vector<Vec3d> positions;
            for (const Vec3d& p : mb.positions()) positions.push_back(Vec3d(1.3 * p.x(), 0.6 * p.y(), p.z()));
            ASSERT_TRUE(tb.refit(positions));
            for (const NamedMap& m : everyKindOfMap(random))
                expectTouching(ta, tb, m.map, bruteForce(ma, tb.mesh(), m.map), seedOf(seed) + ", refitted, " + m.name,
                               Realignment::kTable);
        }
    }
}

TEST(Touching, LargerBodiesAgreeWithBruteForceInTheirThousandsOfPairs) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        Random random(seed);
        const TriangleMesh ma = bumpy(random, 40, 60), mb = bumpy(random, 40, 60);
        for (const double apart : {0.1, 1.4, 1.9, 2.6}) {
            const Affine3d pose =
                composeTransform(apart * inCube(random, 1).normalized(), anyRotation(random), Vec3d::Ones());
            const std::vector<FacePair> truth = bruteForce(ma, mb, pose);
            for (const VolumeKind volume : kVolumes) {
                const TriangleTree ta(ma, {volume}), tb(mb, {volume});
                expectTouching(ta, tb, pose, truth, seedOf(seed) + ", " + kVolumeNames[static_cast<int>(volume)]);
            }
        }
    }
}

TEST(Touching, FacesThatOnlyTouchAreFound) {
    // Unit boxes in a row share whole sides, edges or one corner.
    const TriangleMesh box = meshOf(shapes::box(Vec3d::Ones()));
    for (const Vec3d& shift : {Vec3d(1, 0, 0), Vec3d(1, 1, 0), Vec3d(1, 1, 1), Vec3d(1, 0.25, -0.5)}) {
        Affine3d pose = Affine3d::Identity();
        pose.translation() = shift;
        const std::vector<FacePair> truth = bruteForce(box, box, pose);
        ASSERT_FALSE(truth.empty());
        for (const VolumeKind volume : kVolumes) {
            const TriangleTree ta(box, {volume}), tb(box, {volume});
            expectTouching(ta, tb, pose, truth, kVolumeNames[static_cast<int>(volume)]);
            Affine3d beyond = pose;
            beyond.translation().x() = std::nextafter(1.0, 2.0);
            expectTouching(ta, tb, beyond, {}, std::string("just parted, ") + kVolumeNames[static_cast<int>(volume)]);
        }
    }
}

TEST(Touching, SmallAndDegenerateMeshesHaveDefinedAnswers) {
    Random random(5);
    const TriangleMesh empty;
    const std::vector<double> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const TriangleMesh one = *TriangleMesh::make(std::span<const double>(corners), std::vector<std::uint32_t>{0, 1, 2});
    const TriangleMesh point =
        *TriangleMesh::make(std::span<const double>(corners), std::vector<std::uint32_t>{0, 0, 0});
    const TriangleMesh line =
        *TriangleMesh::make(std::span<const double>(corners), std::vector<std::uint32_t>{0, 1, 1});
    const TriangleMesh heap = *TriangleMesh::make(std::span<const double>(corners), std::vector<std::uint32_t>(300, 0));
    std::vector<std::uint32_t> twins;
    for (int i = 0; i < 100; ++i) twins.insert(twins.end(), {0, 1, 2});
    const TriangleMesh same = *TriangleMesh::make(std::span<const double>(corners), twins);
    const TriangleMesh* const all[] = {&empty, &one, &point, &line, &heap, &same};
    for (const VolumeKind volume : kVolumes)
        for (const TriangleMesh* ma : all)
            for (const TriangleMesh* mb : all) {
                const TriangleTree ta(*ma, {volume}), tb(*mb, {volume});
                for (const Affine3d& pose : {Affine3d(Affine3d::Identity()),
                                             composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d::Ones())})
                    expectTouching(ta, tb, pose, bruteForce(*ma, *mb, pose), kVolumeNames[static_cast<int>(volume)]);
            }
}

TEST(Touching, SwappingTheBodiesSwapsThePairs) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        Random random(seed);
        const TriangleMesh ma = bumpy(random, 12, 16), mb = bumpy(random, 10, 14);
        // A turn by a quarter and whole numbers: exact both ways, so the answers must be equal to the pair.
        Affine3d pose = Affine3d::Identity();
        pose.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
        pose.translation() = Vec3d(1, 0.5, -0.5);
        const TriangleTree ta(ma), tb(mb);
        QueryWork work;
        std::vector<FacePair> swapped;
        for (const FacePair& p : allTouching(tb, ta, pose.inverse(Eigen::Affine), work).pairs)
            swapped.push_back({p.b, p.a});
        std::sort(swapped.begin(), swapped.end());
        // Adding whole numbers to coordinates of floats is exact in double: no rounding on either side.
        EXPECT_EQ(allTouching(ta, tb, pose, work).pairs, swapped) << seedOf(seed);
        EXPECT_FALSE(swapped.empty());
    }
}

TEST(Touching, GivesUpWhereTheWorkEndsAndSaysSo) {
    Random random(9);
    const TriangleTree a(bumpy(random, 30, 40)), b(bumpy(random, 30, 40));
    const Affine3d pose = composeTransform(Vec3d(1.2, 0.1, 0), anyRotation(random), Vec3d::Ones());
    QueryWork whole;
    const FacePairs all = allTouching(a, b, pose, whole);
    ASSERT_TRUE(all.complete);
    const std::uint64_t needed = whole.boxTests + whole.triangleTests;
    for (std::uint64_t limit = 0; limit <= needed + 40; limit += 1 + needed / 37) {
        QueryWork work;
        work.limit = limit;
        const FacePairs some = allTouching(a, b, pose, work);
        EXPECT_LE(work.boxTests + work.triangleTests, limit + 600) << "one step past the limit at most";
        EXPECT_TRUE(std::includes(all.pairs.begin(), all.pairs.end(), some.pairs.begin(), some.pairs.end()));
        EXPECT_TRUE(!some.complete || some.pairs == all.pairs);
        EXPECT_TRUE(some.complete || limit <= needed);
        EXPECT_FALSE(some.complete && limit == 0);
        QueryWork once;
        once.limit = limit;
        const Touch touch = firstTouching(a, b, pose, once).touch;
        EXPECT_NE(touch, Touch::kNo);
        EXPECT_TRUE(touch == Touch::kUnknown || limit > 0);
    }
}

// A body in its own copy: planes on planes, which rounding does not tell apart. Each exact test takes as long as some
// thirty others. A step of 30 million such tests took 16 s.
TEST(Touching, ExactTestsCountForTheTimeTheyTake) {
    constexpr std::uint32_t kSide = 30;
    shapes::Soup soup;
    for (std::uint32_t i = 0; i <= kSide; ++i)
        for (std::uint32_t j = 0; j <= kSide; ++j) {
            soup.positions.insert(soup.positions.end(),
                                  {0.1F * static_cast<float>(i), 0, 0.1F * static_cast<float>(j)});
            const std::uint32_t at = i * (kSide + 1) + j;
            if (i < kSide && j < kSide)
                soup.indices.insert(soup.indices.end(),
                                    {at, at + 1, at + kSide + 1, at + 1, at + kSide + 2, at + kSide + 1});
        }
    const TriangleTree plate(meshOf(soup));
    QueryWork whole;
    const FacePairs all = allTouching(plate, plate, Affine3d::Identity(), whole);
    ASSERT_GT(all.pairs.size(), 20'000U);
    EXPECT_GT(whole.triangleTests, 8 * all.pairs.size());
    QueryWork work{.limit = whole.triangleTests / 2};
    EXPECT_FALSE(allTouching(plate, plate, Affine3d::Identity(), work).complete);
}

// Results, their order and the counters, for no worker, one, two and three, with every limit.
TEST(Touching, ThreadsChangeNothing) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        Random random(seed);
        const TriangleMesh ma = bumpy(random, 90, 120), mb = bumpy(random, 90, 120);
        for (const VolumeKind volume : {VolumeKind::kObb, VolumeKind::kDop18}) {
            const TriangleTree a(ma, {volume}), b(mb, {volume});
            const Affine3d pose =
                composeTransform(Vec3d(0.3 * static_cast<double>(seed), 0.1, 0), anyRotation(random), Vec3d::Ones());
            QueryWork whole;
            const FacePairs all = allTouching(a, b, pose, whole);
            const std::uint64_t needed = whole.boxTests + whole.triangleTests;
            ASSERT_GT(needed, 10'000U) << "large enough to be shared";
            for (const std::uint64_t limit : {~std::uint64_t{0}, needed + 1, needed, needed - 1, needed / 2, needed / 3,
                                              std::uint64_t{2000}, std::uint64_t{20}}) {
                QueryWork alone;
                alone.limit = limit;
                const FacePairs expected = allTouching(a, b, pose, alone);
                for (const unsigned threads : {1U, 2U, 3U}) {
                    Workers workers(threads);
                    TouchOptions options;
                    options.workers = &workers;
                    QueryWork work;
                    work.limit = limit;
                    const FacePairs found = allTouching(a, b, pose, work, options);
                    EXPECT_EQ(found.pairs, expected.pairs)
                        << seedOf(seed) << ", " << threads << " threads, limit " << limit;
                    EXPECT_EQ(found.complete, expected.complete) << threads << " threads, limit " << limit;
                    EXPECT_EQ(work.boxTests, alone.boxTests) << threads << " threads, limit " << limit;
                    EXPECT_EQ(work.triangleTests, alone.triangleTests) << threads << " threads, limit " << limit;
                    EXPECT_EQ(work.limit, limit);
                }
            }
        }
    }
}

TEST(Touching, RefittedAndRebuiltTreesSeeTheNewShape) {
    Random random(3);
    const TriangleMesh first = bumpy(random, 20, 30), other = bumpy(random, 20, 30);
    for (const VolumeKind volume : kVolumes) {
        TriangleTree a(first, {volume});
        const TriangleTree b(other, {volume});
        std::vector<Vec3d> positions;
        for (std::size_t i = 0; i < first.vertexCount(); ++i) positions.push_back(first.positions()[i]);
        for (int frame = 0; frame < 4; ++frame) {
            for (Vec3d& p : positions) p = Vec3d(p.x() * 1.3, p.y() * 0.9, p.z()) + inCube(random, 0.02);
            ASSERT_TRUE(a.refit(positions));
            if (frame == 2) a.rebuild();
            const Affine3d pose = composeTransform(inCube(random, 1.5), anyRotation(random), Vec3d::Ones());
            expectTouching(a, b, pose, bruteForce(a.mesh(), other, pose), kVolumeNames[static_cast<int>(volume)]);
        }
    }
}

// A stack of sheets seen from aside: in the other body's frame each looks as thick as it is wide.
TEST(Touching, KDopsOfPlatesAreNotFooledByTurning) {
    shapes::Soup soup;
    for (int layer = 0; layer < 64; ++layer)
        for (int i = 0; i < 16; ++i) {
            const Vec3d at(i % 4, static_cast<double>(i / 4), 0.06 * layer);
            const auto n = static_cast<std::uint32_t>(soup.positions.size() / 3);
            for (const Vec3d& corner : {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(1, 1, 0), Vec3d(0, 1, 0)})
                soup.vertex(at + corner);
            soup.indices.insert(soup.indices.end(), {n, n + 1, n + 2, n, n + 2, n + 3});
        }
    const TriangleMesh stack = meshOf(soup), ball = meshOf(shapes::sphere(0.02, 12, 16));
    const TriangleTree boxes(stack), ballInBoxes(ball), dops(stack, {VolumeKind::kDop18}),
        ballInDops(ball, {VolumeKind::kDop18});
    QueryWork byBoxes, byDops;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Random random(seed);
        // Between two sheets, touching none.
        const Affine3d stack_T_ball = composeTransform(
            Vec3d(between(random, 1, 3), between(random, 1, 3), 0.06 * 30 + 0.03), anyRotation(random), Vec3d::Ones());
        const Affine3d ball_T_stack = stack_T_ball.inverse(Eigen::Affine);
        EXPECT_EQ(firstTouching(ballInBoxes, boxes, ball_T_stack, byBoxes).touch, Touch::kNo);
        EXPECT_EQ(firstTouching(ballInDops, dops, ball_T_stack, byDops).touch, Touch::kNo);
    }
    EXPECT_LT(2 * (byDops.boxTests + byDops.triangleTests), 3 * (byBoxes.boxTests + byBoxes.triangleTests));
}

}  // namespace
}  // namespace tessera
