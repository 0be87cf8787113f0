// What each mode of an interest tells.
#include <gtest/gtest.h>

#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// Two unit boxes, 3 apart along x; the first one's motions are only watched.
struct TwoBoxes : SceneMaker {
    Body a = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    Body b = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(4, 0, 0));

    ObjectId watch(std::int64_t mode, std::int64_t detail = Interest::kAllFaces, double threshold = 0) {
        Interest fields;
        fields.object = a.node;
        fields.against = b.node;
        fields.response = Interest::kReport;
        fields.mode = mode;
        fields.detail = detail;
        fields.threshold = threshold;
        return interest(fields);
    }
    StepResult to(double x) { return frame({{.transform = a.transform, .translation = Vec3d(x, 0, 0)}}); }
};

TEST(Modes, StaticTellsWhatMeetsAndNothingOfBeginnings) {
    TwoBoxes scene;
    const ObjectId interest = scene.watch(Interest::kStatic);
    EXPECT_TRUE(scene.to(1).contacts.empty());
    for (int frame = 0; frame < 3; ++frame) {
        const StepResult result = scene.to(3.5);
        ASSERT_FALSE(result.contacts.empty());
        EXPECT_EQ(result.contacts.front().interest, interest);
        EXPECT_EQ(result.contacts.front().objectA, scene.a.shape);
        EXPECT_EQ(result.contacts.front().objectB, scene.b.shape);
        EXPECT_TRUE(result.events.empty());
    }
}

TEST(Modes, PseudoDynamicTellsBeginStayAndEnd) {
    TwoBoxes scene;
    const ObjectId interest = scene.watch(Interest::kPseudoDynamic);
    EXPECT_TRUE(scene.to(1).events.empty());
    const auto phase = [&](const StepResult& result) {
        EXPECT_EQ(result.events.size(), 1u);
        EXPECT_EQ(result.events.front().interest, interest);
        EXPECT_EQ(result.events.front().objectA, scene.a.node);
        EXPECT_EQ(result.events.front().objectB, scene.b.shape)
            << "no CollisionObject: a geometry is an object by itself";
        return result.events.front().phase;
    };
    EXPECT_EQ(phase(scene.to(3.5)), Phase::kBegan);
    EXPECT_EQ(phase(scene.to(3.6)), Phase::kStays);
    EXPECT_EQ(phase(scene.frame()), Phase::kStays) << "at rest too";
    EXPECT_EQ(phase(scene.to(1)), Phase::kEnded);
    EXPECT_TRUE(scene.to(0.5).events.empty());
}

TEST(Modes, AnEndIsToldWhenAnObjectIsDeletedHiddenOrNoLongerOfInterest) {
    for (int how = 0; how < 3; ++how) {
        TwoBoxes scene;
        const ObjectId hide = scene.switchCore(Switch::kAll);
        const ObjectId holder = scene.node(kRootNode, hide);
        ChangeListBuilder b;
        b.place(scene.b.node, holder);
        scene.apply(b);
        const ObjectId interest = scene.watch(Interest::kPseudoDynamic);
        EXPECT_EQ(scene.to(3.5).events.size(), 1u);
        if (how == 0) {
            scene.set<Node>(scene.b.shape, fieldId<&Node::core>, ObjectId{});
        } else if (how == 1) {
            scene.setChoice(hide, Switch::kNone);
        } else {
            scene.set<Interest>(interest, fieldId<&Interest::enabled>, false);
        }
        const StepResult result = scene.frame();
        ASSERT_EQ(result.events.size(), 1u) << how;
        EXPECT_EQ(result.events.front().phase, Phase::kEnded);
        EXPECT_TRUE(scene.frame().events.empty());
    }
}

TEST(Modes, DynamicTellsWhenAndWhereWithinTheFrame) {
    TwoBoxes scene;
    scene.watch(Interest::kDynamic);
    // The gap of 3 is closed after three quarters of the way.
    const StepResult result = scene.to(4);
    ASSERT_EQ(result.events.size(), 1u);
    const PairEvent& event = result.events.front();
    EXPECT_EQ(event.phase, Phase::kBegan);
    EXPECT_NEAR(event.firstTime, 0.75, 1e-3);
    EXPECT_LE(event.firstTime, 0.75);
    EXPECT_NEAR(event.point.x(), 3.5, 1e-2);
    EXPECT_NEAR((event.normal - Vec3d::UnitX()).norm(), 0, 1e-6);
}

TEST(Modes, DynamicSeesWhatPassesThroughWithinOneFrame) {
    TwoBoxes scene;
    scene.watch(Interest::kDynamic);
    const StepResult result = scene.to(8);
    EXPECT_TRUE(result.contacts.empty());
    ASSERT_EQ(result.events.size(), 1u);
    EXPECT_TRUE(result.events.front().through);
    EXPECT_EQ(result.events.front().phase, Phase::kEnded);
    EXPECT_NEAR(result.events.front().firstTime, 3.0 / 8, 1e-3);
}

TEST(Modes, DynamicLetsAllObjectsMoveAtOnce) {
    // They swap places crosswise and meet in the middle, though neither meets the other's start or end.
    TwoBoxes scene;
    scene.watch(Interest::kDynamic);
    const StepResult result = scene.frame({{.transform = scene.a.transform, .translation = Vec3d(4, 0, 0)},
                                           {.transform = scene.b.transform, .translation = Vec3d(0, 0, 0)}});
    ASSERT_EQ(result.events.size(), 1u);
    EXPECT_NEAR(result.events.front().firstTime, 3.0 / 8, 1e-3);
    // Side by side at the same pace they never meet.
    TwoBoxes convoy;
    convoy.watch(Interest::kDynamic);
    EXPECT_TRUE(convoy
                    .frame({{.transform = convoy.a.transform, .translation = Vec3d(100, 0, 0)},
                            {.transform = convoy.b.transform, .translation = Vec3d(104, 0, 0)}})
                    .events.empty());
}

TEST(Modes, DistanceTellsHowFarAndWhereUpToItsThreshold) {
    TwoBoxes scene;
    const ObjectId interest = scene.watch(Interest::kDistance, Interest::kAllFaces, 1.0);
    EXPECT_TRUE(scene.to(1.5).distances.empty()) << "1.5 apart";
    const StepResult near = scene.to(2.25);
    ASSERT_EQ(near.distances.size(), 1u);
    const PairDistance& d = near.distances.front();
    EXPECT_EQ(d.interest, interest);
    EXPECT_EQ(d.phase, Phase::kBegan);
    EXPECT_DOUBLE_EQ(d.distance, 0.75);
    EXPECT_DOUBLE_EQ(d.pointA.x(), 2.75);
    EXPECT_DOUBLE_EQ(d.pointB.x(), 3.5);
    EXPECT_EQ(d.nodeA, scene.a.shape);
    EXPECT_EQ(d.nodeB, scene.b.shape);
    EXPECT_EQ(scene.to(2.5).distances.front().phase, Phase::kStays);
    EXPECT_DOUBLE_EQ(scene.to(3.5).distances.front().distance, 0) << "they touch";
    EXPECT_EQ(scene.to(1).distances.front().phase, Phase::kEnded);
    EXPECT_TRUE(scene.frame().distances.empty());
}

TEST(Modes, DistancesAreTheWorldsUnderAnyScale) {
    for (const Vec3d& scale : {Vec3d(2, 2, 2), Vec3d(1, 3, 1), Vec3d(0.5, 2, -1)}) {
        TwoBoxes scene;
        scene.watch(Interest::kDistance, Interest::kAllFaces, 10);
        scene.commit({.transform = scene.b.transform, .translation = Vec3d(4, 0, 0), .scale = scale});
        scene.commit({.transform = scene.a.transform, .scale = Vec3d(1, 1.5, 1)});
        const StepResult result = scene.frame();
        ASSERT_EQ(result.distances.size(), 1u);
        EXPECT_NEAR(result.distances.front().distance, 4 - 0.5 - 0.5 * std::abs(scale.x()), 1e-12);
    }
}

TEST(Modes, AGrownThresholdIsObeyedAtOnce) {
    TwoBoxes scene;
    const ObjectId interest = scene.watch(Interest::kDistance, Interest::kAllFaces, 1);
    EXPECT_TRUE(scene.frame().distances.empty());
    scene.set<Interest>(interest, fieldId<&Interest::threshold>, 5.0);
    EXPECT_EQ(scene.frame().distances.size(), 1u);
}

TEST(Modes, IgnoreTakesItsPairsFromEverybody) {
    TwoBoxes scene;
    scene.watch(Interest::kPseudoDynamic);
    EXPECT_FALSE(scene.to(3.5).contacts.empty());
    scene.watch(Interest::kIgnore);
    const StepResult result = scene.to(3.6);
    EXPECT_TRUE(result.contacts.empty());
    ASSERT_EQ(result.events.size(), 1u);
    EXPECT_EQ(result.events.front().phase, Phase::kEnded);
}

TEST(Modes, DetailSaysHowManyFacesAreListed) {
    for (const std::int64_t detail : {Interest::kAllFaces, Interest::kYesOrNo, std::int64_t{3}}) {
        TwoBoxes scene;
        scene.watch(Interest::kPseudoDynamic, detail);
        const StepResult result = scene.to(3.25);
        if (detail == Interest::kAllFaces)
            EXPECT_GT(result.contacts.size(), 3u);
        else
            EXPECT_EQ(result.contacts.size(), detail == Interest::kYesOrNo ? 1u : 3u);
        EXPECT_EQ(result.counters.contactsLeftOut, 0u) << "nobody asked for more";
    }
}

TEST(Modes, EachInterestIsToldOfItsOwnPairs) {
    // One watches all boxes against each other, one a single pair.
    SceneMaker scene;
    const ObjectId group = scene.node(kRootNode);
    std::vector<SceneMaker::Body> boxes;
    for (int i = 0; i < 4; ++i) {
        boxes.push_back(scene.body(group, shapes::box(Vec3d::Ones()), Vec3d(0.9 * i, 0, 0)));
        CollisionObject object;
        object.node = boxes.back().node;
        scene.object(object);
    }
    Interest all;
    all.object = group;
    all.against = group;
    all.response = Interest::kReport;
    const ObjectId everybody = scene.interest(all);
    Interest pair;
    pair.object = boxes[2].node;
    pair.against = boxes[3].node;
    pair.response = Interest::kReport;
    const ObjectId two = scene.interest(pair);
    const StepResult result = scene.frame();
    std::size_t ofAll = 0, ofTwo = 0;
    for (const PairEvent& event : result.events) (event.interest == everybody ? ofAll : ofTwo) += 1;
    EXPECT_EQ(ofAll, 3u);
    EXPECT_EQ(ofTwo, 1u);
    EXPECT_EQ(result.events.back().interest, two);
    EXPECT_EQ(result.contactsBegun, 3u) << "pairs, not tellings";
}

TEST(Modes, ContactsTellHowDeepAndWhereOnTheFaces) {
    TwoBoxes scene;
    scene.watch(Interest::kStatic);
    const StepResult result = scene.frame(
        {{.transform = scene.a.transform, .translation = Vec3d(3.35, 0.03, 0.04), .scale = Vec3d::Constant(0.5)}});
    ASSERT_FALSE(result.contacts.empty());
    for (const Contact& c : result.contacts) {
        EXPECT_NEAR(c.depth, 0.1, 1e-6);
        EXPECT_LT((c.normal - Vec3d::UnitX()).norm(), 1e-9) << "no arrow points sideways";
        EXPECT_TRUE(c.uvA.minCoeff() >= 0 && c.uvB.minCoeff() >= 0 && c.uvA.sum() <= 1 + 1e-12);
        EXPECT_EQ(c.error, 0);
    }
    TwoBoxes few;
    few.watch(Interest::kStatic, Interest::kYesOrNo);
    const StepResult one = few.to(3.25);
    ASSERT_EQ(one.contacts.size(), 1u);
    EXPECT_EQ(one.contacts.front().depth, Contact::kNoDepth) << "one pair of faces tells of no region";
}

}  // namespace
}  // namespace tessera
