// Input that nobody should give: a defined outcome, and the frame goes on.
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct Mixed : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 3, 0));
    Body other = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(3, 3, 0));
    Body floor = body(kRootNode, shapes::box(Vec3d(20, 1, 20)), Vec3d(0, -0.5, 0));
    ObjectId core;

    explicit Mixed(std::int64_t response = Interest::kBounce, double mass = 1, CollisionLimits limits = {})
        : SceneMaker(limits) {
        gravity(Vec3d(0, -10, 0));
        CollisionObject object;
        object.node = box.node;
        object.mass = mass;
        core = this->object(object);
        object.node = other.node;
        this->object(object);
        Interest fields;
        fields.object = kRootNode;
        fields.against = kRootNode;
        fields.response = response;
        interest(fields);
    }
    bool sane() {
        const Transform& t = at(box.transform);
        return t.translation.allFinite() && t.rotation.coeffs().allFinite() && t.translation.norm() < 1e4;
    }
};

TEST(BadInput, FreeBodiesThatOverlapAtTheStartAreParted) {
    Mixed scene;
    scene.commit({.transform = scene.other.transform, .translation = Vec3d(0.1, 3.1, 0.05)});
    for (int frame = 0; frame < 300; ++frame) scene.frame();
    ASSERT_TRUE(scene.sane());
    const Vec3d apart = scene.at(scene.box.transform).translation - scene.at(scene.other.transform).translation;
    EXPECT_GT(apart.cwiseAbs().maxCoeff(), 0.95);
    EXPECT_LT(apart.norm(), 5) << "not blown away";
}

TEST(BadInput, BodiesInOneAndTheSamePlace) {
    Mixed scene;
    scene.commit({.transform = scene.other.transform, .translation = Vec3d(0, 3, 0)});
    for (int frame = 0; frame < 200; ++frame) scene.frame();
    EXPECT_TRUE(scene.sane());
}

TEST(BadInput, ATeleportIntoTheFloorIsNotTheEndOfTheWorld) {
    Mixed scene;
    scene.commit({.transform = scene.box.transform, .translation = Vec3d(0, -0.4, 0)});
    for (int frame = 0; frame < 300; ++frame) scene.frame();
    EXPECT_TRUE(scene.sane());
}

TEST(BadInput, WishesThatAreNoNumbersAreRefused) {
    Mixed scene(Interest::kStop, 0);
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const Transform before = scene.at(scene.box.transform);
    for (const double bad : {nan, infinity, -infinity}) {
        for (int field = 0; field < 3; ++field) {
            TentativeTransform wish{.transform = scene.box.transform, .translation = before.translation};
            if (field == 0) wish.translation.y() = bad;
            if (field == 1) wish.rotation = Quatd(bad, 0, 0, 1);
            if (field == 2) wish.scale.z() = bad;
            const StepResult result = scene.frame({wish});
            EXPECT_EQ(result.stopped, std::vector{scene.box.transform});
            EXPECT_EQ(scene.at(scene.box.transform).translation, before.translation);
        }
    }
    const StepResult zero =
        scene.frame({{.transform = scene.box.transform, .translation = Vec3d(0, 9, 0), .scale = Vec3d(1, 0, 1)}});
    EXPECT_EQ(zero.stopped.size(), 1u);
    const StepResult nobody = scene.frame({{.transform = ObjectId{123456}}});
    EXPECT_EQ(nobody.stopped, std::vector{ObjectId{123456}});
}

TEST(BadInput, AZeroScaleInTheSceneTakesTheBodyOut) {
    Mixed scene;
    scene.commit({.transform = scene.box.transform, .translation = Vec3d(0, 3, 0), .scale = Vec3d(1, 0, 1)});
    const StepResult result = scene.frame();
    EXPECT_EQ(result.counters.skipped, 1u);
    EXPECT_EQ(scene.at(scene.box.transform).translation, Vec3d(0, 3, 0)) << "it does not even fall";
    scene.commit({.transform = scene.box.transform, .translation = Vec3d(0, 3, 0)});
    scene.frame();
    EXPECT_LT(scene.at(scene.box.transform).translation.y(), 3);
}

TEST(BadInput, AnInterestInADeletedNodeMeansNothing) {
    Mixed scene(Interest::kStop, 0);
    const ObjectId lonely = scene.node(kRootNode);
    Interest fields;
    fields.object = lonely;
    const ObjectId interest = scene.interest(fields);
    scene.frame();
    // A node that is named cannot be destroyed; it can be taken out of the tree.
    ChangeListBuilder b;
    b.detach(lonely);
    scene.apply(b);
    scene.frame();
    scene.set<Interest>(interest, fieldId<&Interest::object>, ObjectId{});
    scene.destroy(lonely);
    EXPECT_TRUE(scene.frame({{.transform = scene.box.transform, .translation = Vec3d(0, 4, 0)}}).stopped.empty());
}

TEST(BadInput, AMillionContactsAreCountedAndTheFirstOnesListed) {
    CollisionLimits limits;
    limits.maxContacts = 100;
    SceneMaker scene(limits);
    // Two combs of sheets across each other: 400 x 400 x 4 pairs of faces.
    const auto comb = [](bool across) {
        shapes::Soup soup;
        for (int i = 0; i < 400; ++i) {
            const double x = 0.01 * i;
            for (int k = 0; k < 4; ++k) {
                const double u = k & 1 ? 4 : -0.01, z = k & 2 ? 1 : 0;
                soup.vertex(across ? Vec3d(u, x, z) : Vec3d(x, u, z));
            }
            const auto v = static_cast<std::uint32_t>(4 * i);
            soup.indices.insert(soup.indices.end(), {v, v + 1, v + 3, v, v + 3, v + 2});
        }
        return soup;
    };
    const auto a = scene.body(kRootNode, comb(false), Vec3d::Zero());
    scene.body(kRootNode, comb(true), Vec3d(0, 0, 0.25));
    scene.interest(a.node, {}, Interest::kReport);
    const StepResult result = scene.frame();
    EXPECT_EQ(result.contacts.size(), 100u);
    EXPECT_GT(result.counters.contactsLeftOut, 200'000u);
    EXPECT_EQ(result.counters.notLookedAt, 0u);
    EXPECT_TRUE(
        std::ranges::is_sorted(result.contacts, {}, [](const Contact& c) { return std::pair(c.faceA, c.faceB); }));
}

TEST(BadInput, WhenTheWorkIsUsedUpItSaysWhatWasNotLookedAt) {
    CollisionLimits limits;
    limits.maxTests = 200;
    SceneMaker scene(limits);
    const auto a = scene.body(kRootNode, shapes::sphere(1, 40, 80), Vec3d::Zero());
    const auto b = scene.body(kRootNode, shapes::sphere(1, 40, 80), Vec3d(1.5, 0, 0));
    scene.interest(a.node, {}, Interest::kReport);
    const StepResult result = scene.frame();
    EXPECT_GE(result.counters.notLookedAt, 1u);
    ASSERT_EQ(result.notLookedAt.size(), 1u);
    EXPECT_EQ(result.notLookedAt.front().nodeA, a.shape);
    EXPECT_EQ(result.notLookedAt.front().nodeB, b.shape);
    EXPECT_LT(result.counters.boxTests + result.counters.triangleTests, 5'000u);
}

TEST(BadInput, ExtremeMassesAndSpeedsStayNumbers) {
    for (const double mass : {1e-12, 1e12}) {
        Mixed scene(Interest::kBounce, mass);
        scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::velocity>, Vec3d(1e6, -1e6, 1e6));
        scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::spin>, Vec3d(1e6, 1e6, -1e6));
        for (int frame = 0; frame < 50; ++frame) scene.frame();
        EXPECT_TRUE(scene.at(scene.box.transform).translation.allFinite());
        EXPECT_TRUE(scene.at(scene.other.transform).translation.allFinite());
    }
}

TEST(BadInput, AFloorThatMovesAndLosesItsShapeInOneFrameHoldsNobody) {
    Mixed scene;
    StepResult result;
    for (int frame = 0; frame < 400 && result.counters.asleep < 2; ++frame) result = scene.frame();
    ASSERT_EQ(result.counters.asleep, 2u);
    const double before = scene.at(scene.box.transform).translation.y();
    const ObjectId core = scene.aspect.get<Node>(scene.floor.shape)->core;
    scene.set<Geometry>(core, fieldId<&Geometry::indices>, Blob());
    scene.set<Geometry>(core, fieldId<&Geometry::positions>, Blob());
    scene.frame({{.transform = scene.floor.transform, .translation = Vec3d(0.01, -0.5, 0)}});
    for (int frame = 0; frame < 20; ++frame) scene.frame();
    EXPECT_LT(scene.at(scene.box.transform).translation.y(), before - 0.2);
}

}  // namespace
}  // namespace tessera
