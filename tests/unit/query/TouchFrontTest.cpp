#include "server/collision/query/TouchFront.h"

#include <gtest/gtest.h>

#include "common/math/Compose.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

/// A body that wanders about another, mostly near its surface.
class Walk {
public:
    explicit Walk(Random& random) : random_(random), turn_(anyRotation(random)), at_(inCube(random, 1.5)) {}
    Affine3d step() {
        at_ += inCube(random_, 0.04) - 0.01 * (at_.norm() - 1.8) * at_.normalized();
        turn_ = (turn_ * Quatd(Eigen::AngleAxisd(0.03, inCube(random_, 1).normalized()))).normalized();
        return composeTransform(at_, turn_, Vec3d::Ones());
    }

private:
    Random& random_;
    Quatd turn_;
    Vec3d at_;
};

void expectEqual(TouchFront& front, const TriangleTree& a, const TriangleTree& b, const Affine3d& pose,
                 const std::string& story) {
    QueryWork work, plain;
    const TouchedPair found = front.firstTouching(a, b, pose, work);
    ASSERT_EQ(found.touch, firstTouching(a, b, pose, plain).touch) << story;
    ASSERT_TRUE(found.touch == Touch::kNo || trianglesIntersect(a.mesh().triangle(found.faces.a),
                                                                transformed(pose, b.mesh().triangle(found.faces.b))))
        << story;
}

TEST(TouchFronts, AnswerAsFreshQueriesDoAllAlongAWalk) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Random random(seed);
        for (const VolumeKind volume : {VolumeKind::kObb, VolumeKind::kDop18, VolumeKind::kAabb}) {
            const TriangleTree a(bumpy(random, 24, 30), {volume}), b(bumpy(random, 24, 30), {volume});
            Walk walk(random);
            TouchFront front;
            for (int frame = 0; frame < 300; ++frame)
                expectEqual(front, a, b, walk.step(),
                            "seed " + std::to_string(seed) + ", frame " + std::to_string(frame));
        }
    }
}

TEST(TouchFronts, SurviveRefitRebuildAndOtherTrees) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Random random(seed);
        TriangleTree a(bumpy(random, 24, 30)), b(bumpy(random, 24, 30));
        const TriangleTree small(bumpy(random, 3, 4)), one(strewn(random, 1, 0.5)), none{TriangleMesh()};
        Walk walk(random);
        TouchFront front;
        for (int frame = 0; frame < 200; ++frame) {
            const std::string story = "seed " + std::to_string(seed) + ", frame " + std::to_string(frame);
            expectEqual(front, a, b, walk.step(), story);
            std::vector<Vec3d> positions;
            for (std::size_t i = 0; i < a.mesh().vertexCount(); ++i)
                positions.push_back(a.mesh().positions()[i] + inCube(random, 0.003));
            const bool moved = frame % 3 != 0 || a.refit(positions);
            ASSERT_TRUE(moved);
            if (frame % 7 == 0) a.rebuild();
            if (frame % 11 == 0) {
                const TriangleTree& other = frame % 3 == 0 ? small : frame % 3 == 1 ? one : none;
                expectEqual(front, a, other, walk.step(), story);
                expectEqual(front, other, b, walk.step(), story);
            }
        }
    }
}

TEST(TouchFronts, FindAContactThatLastsInOneTest) {
    Random random(2);
    const TriangleTree a(bumpy(random, 24, 30)), b(bumpy(random, 24, 30));
    const Affine3d pose = composeTransform(Vec3d(0.8, 0, 0), anyRotation(random), Vec3d::Ones());
    TouchFront front;
    QueryWork first, again;
    ASSERT_EQ(front.firstTouching(a, b, pose, first).touch, Touch::kYes);
    ASSERT_EQ(front.firstTouching(a, b, pose, again).touch, Touch::kYes);
    EXPECT_EQ(again.boxTests + again.triangleTests, 1U);
    front.forget();
    QueryWork fresh;
    ASSERT_EQ(front.firstTouching(a, b, pose, fresh).touch, Touch::kYes);
    EXPECT_EQ(fresh.boxTests, first.boxTests);
}

TEST(TouchFronts, GiveUpWhereTheWorkEnds) {
    Random random(2);
    const TriangleTree a(bumpy(random, 24, 30)), b(bumpy(random, 24, 30));
    for (std::uint64_t limit = 0; limit < 60; ++limit) {
        TouchFront front;
        QueryWork free;
        (void)front.firstTouching(a, b, composeTransform(Vec3d(1.1, 0, 0), Quatd::Identity(), Vec3d::Ones()), free)
            .touch;
        QueryWork work;
        work.limit = limit;
        const Affine3d apart = composeTransform(Vec3d(2.02, 0.6, 0), Quatd::Identity(), Vec3d::Ones());
        const Touch touch = front.firstTouching(a, b, apart, work).touch;
        QueryWork plain;
        EXPECT_TRUE(touch == Touch::kUnknown || touch == firstTouching(a, b, apart, plain).touch) << limit;
        EXPECT_TRUE(limit > 0 || touch == Touch::kUnknown);
    }
}

}  // namespace
}  // namespace tessera
