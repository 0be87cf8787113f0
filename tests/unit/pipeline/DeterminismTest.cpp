// The same history gives the same results, for any number of threads and whatever order wishes come in.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "common/base/Workers.h"
#include "tests/unit/pipeline/SameResults.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// Free bodies, motions of every response, distances, and edits of the structure, all from a seed.
struct Bustle : SceneMaker {
    explicit Bustle(std::uint64_t seed, Workers* workers) : SceneMaker({}, workers), random(seed) {
        gravity(Vec3d(0, -9.81, 0));
        floor = body(kRootNode, shapes::box(Vec3d(12, 1, 12)), Vec3d(0, -0.5, 0));
        group = node(kRootNode);
        for (int i = 0; i < 40; ++i) {
            const Vec3d where(number(-4, 4), number(1, 8), number(-4, 4));
            const bool round = i % 3 == 0;
            const shapes::Soup soup =
                round ? shapes::sphere(0.4, 6, 8) : shapes::box(Vec3d(0.7, number(0.3, 0.8), 0.5));
            things.push_back(body(group, soup, where));
            CollisionObject object;
            object.node = things.back().node;
            object.shape = i % 4 == 0 ? CollisionObject::kTriangles : CollisionObject::kHull;
            object.mass = i % 5 == 0 ? 0 : number(0.5, 3);
            object.restitution = number(0, 0.8);
            this->object(object);
        }
        Interest fields;
        fields.object = group;
        fields.against = kRootNode;
        fields.response = Interest::kBounce;
        fields.mode = Interest::kDynamic;
        interest(fields);
        fields.response = Interest::kReport;
        fields.mode = Interest::kDistance;
        fields.threshold = 0.3;
        interest(fields);
    }
    double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

    StepResult next(bool shuffled) {
        std::vector<TentativeTransform> wishes;
        for (std::size_t i = 0; i < things.size(); i += 5) {
            const Vec3d now = at(things[i].transform).translation;
            wishes.push_back({.transform = things[i].transform,
                              .translation = now + Vec3d(number(-0.2, 0.2), number(-0.1, 0.1), number(-0.2, 0.2)),
                              .rotation = Quatd(1, number(-0.1, 0.1), 0, number(-0.1, 0.1)).normalized(),
                              .source = static_cast<int>(i % 2)});
        }
        if (shuffled) std::ranges::reverse(wishes);
        if (++frames % 20 == 0) setParent(things[frames / 20 % things.size()].node);
        return frame(wishes);
    }
    void setParent(ObjectId nodeId) {
        ChangeListBuilder b;
        b.place(nodeId, frames % 40 == 0 ? kRootNode : group);
        apply(b);
    }

    std::mt19937_64 random;
    Body floor;
    ObjectId group;
    std::vector<Body> things;
    std::size_t frames = 0;
};

class Determinism : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(Determinism, ThreadsAndTheOrderOfWishesChangeNothing) {
    SCOPED_TRACE("run it again: bin/unit_pipeline --gtest_filter=Seeds/Determinism." +
                 std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    Workers two(2), three(3);
    Bustle one(GetParam(), nullptr), other(GetParam(), &two), third(GetParam(), &three);
    for (int frame = 0; frame < 120 && !HasFailure(); ++frame) {
        const StepResult result = one.next(false);
        expectEqual(result, other.next(true));
        expectEqual(result, third.next(false));
        EXPECT_EQ(one.aspect.stateHash(), other.aspect.stateHash());
        EXPECT_EQ(one.aspect.stateHash(), third.aspect.stateHash());
    }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Determinism, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace tessera
