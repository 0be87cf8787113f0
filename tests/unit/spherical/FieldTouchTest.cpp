// What a field answers is what trees answer, and what every pair of triangles one by one says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "server/collision/spherical/FieldTouch.h"
#include "tests/unit/spherical/FieldScenes.h"

namespace tessera {
namespace {

std::vector<FacePair> pairByPair(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b) {
    std::vector<FacePair> out;
    for (std::uint32_t i = 0; i < a.faceCount(); ++i)
        for (std::uint32_t j = 0; j < b.faceCount(); ++j)
            if (trianglesIntersect(a.triangle(i), transformed(a_T_b, b.triangle(j)))) out.push_back({i, j});
    return out;
}

std::string repeat(std::uint64_t seed) {
    return "seed " + std::to_string(seed) + ": TESSERA_SEED=" + std::to_string(seed) +
           " build/bin/unit_spherical --gtest_filter=FieldTouch.Names*";
}

void compare(std::uint64_t seed, std::size_t& meeting) {
    FieldRandom random(seed);
    const auto kindA = static_cast<unsigned>(seed % kFieldMeshKinds),
               kindB = static_cast<unsigned>(seed / kFieldMeshKinds % kFieldMeshKinds);
    const TriangleMesh a = fieldMesh(kindA, random), b = fieldMesh(kindB, random);
    const TriangleTree treeA(a), treeB(b);
    // Levels and centres that nobody would choose, too.
    const SphericalField fieldA(treeA, {.level = static_cast<int>(random.below(6)) - 1, .centres = random.below(4)});
    const SphericalField fieldB(treeB, {.level = static_cast<int>(random.below(6)) - 1, .centres = random.below(4)});
    for (unsigned kind = 0; kind < kFieldMaps; ++kind) {
        const Affine3d a_T_b = fieldMap(static_cast<FieldMap>(kind), random);
        const std::string story = repeat(seed) + ", meshes " + std::to_string(kindA) + " and " + std::to_string(kindB) +
                                  ", map " + std::to_string(kind);
        QueryWork ofTrees, ofFields;
        const std::vector<FacePair> truth = allTouching(treeA, treeB, a_T_b, ofTrees).pairs;
        const FacePairs found = allTouching(fieldA, fieldB, a_T_b, ofFields);
        ASSERT_TRUE(found.complete);
        ASSERT_EQ(found.pairs, truth) << story;
        ASSERT_EQ(allTouching(fieldA, treeB, a_T_b, ofFields).pairs, truth) << story << ", B's tree in A's field";
        ASSERT_EQ(allTouching(treeA, fieldB, a_T_b, ofFields).pairs, truth) << story << ", A's tree in B's field";
        const TouchedPair any = firstTouching(fieldA, fieldB, a_T_b, ofFields);
        ASSERT_EQ(any.touch == Touch::kYes, !truth.empty()) << story;
        if (any.touch == Touch::kYes) {
            ASSERT_TRUE(std::binary_search(truth.begin(), truth.end(), any.faces)) << story;
        }
        if (seed % 40 == 0) {
            ASSERT_EQ(truth, pairByPair(a, b, a_T_b)) << story;
        }
        meeting += truth.size();
    }
}

TEST(FieldTouch, NamesThePairsThatTreesName) {
    std::size_t meeting = 0;
    if (const char* only = std::getenv("TESSERA_SEED")) return compare(std::strtoull(only, nullptr, 10), meeting);
    for (std::uint64_t seed = 0; seed < 400 && !HasFatalFailure(); ++seed) compare(seed, meeting);
    EXPECT_GT(meeting, 100'000U);  // or there was nothing to miss
}

TEST(FieldTouch, DoesNotDependOnTheInstructionSet) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        FieldRandom random(seed);
        const TriangleTree a(fieldMesh(static_cast<unsigned>(seed), random)),
            b(fieldMesh(static_cast<unsigned>(seed + 1), random));
        const SphericalField fieldA(a), fieldB(b);
        const Affine3d a_T_b = fieldMap(FieldMap::kRigid, random);
        QueryWork work;
        const FacePairs slow = allTouching(fieldA, fieldB, a_T_b, work, {.instructions = InstructionSet::kSse41});
        EXPECT_EQ(slow.pairs, allTouching(fieldA, fieldB, a_T_b, work).pairs) << "seed " << seed;
    }
}

TEST(FieldTouch, TakesMapsThatCannotBeTurnedRound) {
    FieldRandom random(7);
    const TriangleTree a(fieldMesh(0, random)), b(fieldMesh(1, random));
    const SphericalField fieldA(a), fieldB(b);
    std::vector<Affine3d> maps(5, Affine3d::Identity());
    maps[0].linear().setZero();
    maps[1].linear() = Vec3d(1, 1, 0).asDiagonal();
    maps[2].linear() = Vec3d(1, 1, 1e-30).asDiagonal();
    maps[3].linear() *= 1e30;
    maps[4].translation() = Vec3d(1e300, 0, 0);
    for (std::size_t i = 0; i < maps.size(); ++i) {
        QueryWork work;
        EXPECT_EQ(allTouching(fieldA, fieldB, maps[i], work).pairs, allTouching(a, b, maps[i], work).pairs)
            << "map " << i;
    }
}

TEST(FieldTouch, AnEmptyMeshMeetsNothing) {
    FieldRandom random(3);
    const TriangleTree nothing{TriangleMesh{}}, ball(fieldMesh(0, random));
    const SphericalField empty(nothing), field(ball);
    EXPECT_EQ(empty.centreCount(), 0U);
    QueryWork work;
    EXPECT_EQ(firstTouching(empty, field, Affine3d::Identity(), work).touch, Touch::kNo);
    EXPECT_TRUE(allTouching(field, empty, Affine3d::Identity(), work).pairs.empty());
}

TEST(FieldTouch, SaysWhenTheWorkIsExhausted) {
    FieldRandom random(5);
    const TriangleTree a(fieldMesh(0, random)), b(fieldMesh(1, random));
    const SphericalField fieldA(a), fieldB(b);
    const std::size_t all = [&] {
        QueryWork work;
        return allTouching(fieldA, fieldB, Affine3d::Identity(), work).pairs.size();
    }();
    ASSERT_GT(all, 0U);
    bool stopped = false;
    for (std::uint64_t limit = 0; limit < 400; limit += 7) {
        QueryWork work{0, 0, limit}, other{0, 0, limit};
        const FacePairs some = allTouching(fieldA, fieldB, Affine3d::Identity(), work);
        stopped = stopped || !some.complete;
        if (some.complete) {
            EXPECT_EQ(some.pairs.size(), all);
        }
        const Touch any = firstTouching(fieldA, fieldB, Affine3d::Identity(), other).touch;
        EXPECT_NE(any, Touch::kNo) << "limit " << limit;
    }
    EXPECT_TRUE(stopped);
}

TEST(FieldTouch, FollowsARefit) {
    FieldRandom random(11);
    const TriangleMesh mesh = fieldMesh(0, random);
    TriangleTree a(mesh);
    const TriangleTree b(fieldMesh(5, random));
    SphericalField fieldA(a);
    const SphericalField fieldB(b);
    for (int frame = 1; frame < 5; ++frame) {
        std::vector<Vec3d> moved(mesh.positions().begin(), mesh.positions().end());
        for (Vec3d& p : moved) p[0] *= 1 + 0.5 * frame;
        ASSERT_TRUE(a.refit(moved));
        fieldA.rebuild();
        QueryWork work;
        EXPECT_EQ(allTouching(fieldA, fieldB, Affine3d::Identity(), work).pairs,
                  allTouching(a, b, Affine3d::Identity(), work).pairs);
    }
}

}  // namespace
}  // namespace tessera
