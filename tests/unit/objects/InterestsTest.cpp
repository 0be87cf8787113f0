/// What two parts are to each other.
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {
namespace {

/// Three things, and nobody interested yet.
struct Three : ObjectScene {
    explicit Three(HandlerLimits limits = {}) : ObjectScene(limits) {}
    Thing a = thing(kRootNode), b = thing(kRootNode), c = thing(kRootNode);
};

TEST(Interests, RelateTheirObjectToEverythingElse) {
    Three scene;
    scene.interest({.object = scene.b.node});
    EXPECT_TRUE(scene.related(scene.a.shape, scene.b.shape));
    EXPECT_TRUE(scene.related(scene.b.shape, scene.c.shape));
    EXPECT_FALSE(scene.related(scene.a.shape, scene.c.shape)) << "neither is the object";
    EXPECT_FALSE(scene.relation(scene.a.shape, scene.b.shape).firstIsObject);
    EXPECT_TRUE(scene.relation(scene.b.shape, scene.c.shape).firstIsObject);
    EXPECT_TRUE(scene.relation(scene.c.shape, scene.b.shape).firstIsObject) << "however one asks";
}

TEST(Interests, WithANodeAgainstAreAboutThatOnly) {
    Three scene;
    scene.interest({.object = scene.a.node, .against = scene.c.node});
    EXPECT_TRUE(scene.related(scene.a.shape, scene.c.shape));
    EXPECT_FALSE(scene.takesPart(scene.b.shape));
}

TEST(Interests, LetTheObjectsOfASetMeetEachOther) {
    Three scene;
    for (const auto& thing : {scene.a, scene.b}) scene.object({.node = thing.node});
    scene.interest({.object = kRootNode});
    EXPECT_TRUE(scene.related(scene.a.shape, scene.b.shape));
    EXPECT_TRUE(scene.relation(scene.a.shape, scene.b.shape).firstIsObject) << "either could be: the lower number is";
    EXPECT_TRUE(scene.related(scene.b.shape, scene.c.shape));
    EXPECT_TRUE(scene.related(scene.a.shape, scene.c.shape));
    EXPECT_FALSE(scene.relation(scene.c.shape, scene.a.shape).interests.empty());
}

TEST(Interests, NeverLetABodyMeetItself) {
    Three scene;
    const auto more = scene.thing(scene.a.node);
    scene.object({.node = scene.a.node});
    scene.object({.node = scene.b.node});
    scene.interest({.object = kRootNode});
    EXPECT_FALSE(scene.related(scene.a.shape, more.shape));
    EXPECT_TRUE(scene.related(scene.b.shape, more.shape));
}

TEST(Interests, ChooseByLayers) {
    Three scene;
    scene.object({.node = scene.a.node, .layers = 2});
    scene.object({.node = scene.b.node, .layers = 4 | 8});
    scene.interest({.object = kRootNode, .objectLayers = 2, .againstLayers = 8});
    EXPECT_TRUE(scene.related(scene.a.shape, scene.b.shape));
    EXPECT_TRUE(scene.relation(scene.a.shape, scene.b.shape).firstIsObject);
    EXPECT_FALSE(scene.takesPart(scene.c.shape)) << "other geometry is layer 1";
    scene.interest({.object = kRootNode, .objectLayers = 8, .againstLayers = 1});
    EXPECT_TRUE(scene.related(scene.b.shape, scene.c.shape));
    EXPECT_FALSE(scene.related(scene.a.shape, scene.c.shape));
}

TEST(Interests, TheFirstInDocumentOrderDecides) {
    Three scene;
    const ObjectId first = scene.interest({.object = scene.a.node, .response = Interest::kSlide});
    const ObjectId second = scene.interest({.object = scene.b.node, .response = Interest::kBounce});
    Relation relation = scene.relation(scene.a.shape, scene.b.shape);
    EXPECT_EQ(relation.response, Interest::kSlide);
    EXPECT_TRUE(relation.firstIsObject);
    ASSERT_EQ(relation.interests.size(), 2u);
    EXPECT_EQ(scene.handler.interests()[relation.interests[0]].core, first);
    EXPECT_EQ(scene.handler.interests()[relation.interests[1]].core, second);
    scene.set<Interest>(first, fieldId<&Interest::enabled>, false);
    relation = scene.relation(scene.a.shape, scene.b.shape);
    EXPECT_EQ(relation.response, Interest::kBounce);
    EXPECT_FALSE(relation.firstIsObject);
    EXPECT_EQ(relation.interests.size(), 1u);
}

TEST(Interests, AskTogetherForWhatEachAsksFor) {
    Three scene;
    scene.interest(
        {.object = scene.a.node, .mode = Interest::kDistance, .detail = Interest::kAllFaces, .threshold = 2});
    Relation relation = scene.relation(scene.a.shape, scene.b.shape);
    EXPECT_TRUE(relation.distance);
    EXPECT_FALSE(relation.contacts || relation.dynamic);
    EXPECT_EQ(relation.threshold, 2);
    EXPECT_EQ(relation.detail, Interest::kYesOrNo) << "asks for no faces";
    scene.interest({.object = scene.a.node, .mode = Interest::kStatic, .detail = 3, .threshold = 9});
    relation = scene.relation(scene.a.shape, scene.b.shape);
    EXPECT_TRUE(relation.distance && relation.contacts);
    EXPECT_EQ(relation.threshold, 2);
    EXPECT_EQ(relation.detail, 3);
    scene.interest({.object = scene.a.node, .mode = Interest::kDynamic, .detail = Interest::kYesOrNo});
    scene.interest({.object = scene.a.node, .mode = Interest::kDistance, .threshold = 5});
    relation = scene.relation(scene.a.shape, scene.b.shape);
    EXPECT_TRUE(relation.dynamic);
    EXPECT_EQ(relation.detail, 3);
    EXPECT_EQ(relation.threshold, 5);
    scene.interest({.object = scene.a.node, .detail = Interest::kAllFaces});
    EXPECT_EQ(scene.relation(scene.a.shape, scene.b.shape).detail, Interest::kAllFaces);
}

TEST(Interests, ThatIgnoreExcludeTheirPairsFromAllOthers) {
    Three scene;
    scene.interest({.object = scene.a.node});
    const ObjectId ignores =
        scene.interest({.object = scene.b.node, .against = scene.a.node, .mode = Interest::kIgnore});
    EXPECT_FALSE(scene.related(scene.a.shape, scene.b.shape));
    EXPECT_TRUE(scene.relation(scene.a.shape, scene.b.shape).interests.empty());
    EXPECT_TRUE(scene.related(scene.a.shape, scene.c.shape));
    scene.set<Interest>(ignores, fieldId<&Interest::mode>, Interest::kStatic);
    EXPECT_TRUE(scene.related(scene.a.shape, scene.b.shape));
}

TEST(Interests, ThatIgnoreGoByLayersToo) {
    Three scene;
    for (const auto& thing : {scene.a, scene.b, scene.c})
        scene.object({.node = thing.node, .layers = thing.node == scene.c.node ? 4 : 2});
    scene.interest({.object = kRootNode});
    scene.interest({.object = kRootNode, .mode = Interest::kIgnore, .objectLayers = 2, .againstLayers = 2});
    EXPECT_FALSE(scene.related(scene.a.shape, scene.b.shape));
    EXPECT_TRUE(scene.related(scene.a.shape, scene.c.shape));
}

TEST(Interests, AloneInIgnoringMakeNobodyTakePart) {
    Three scene;
    scene.interest({.object = scene.a.node, .mode = Interest::kIgnore});
    EXPECT_EQ(scene.handler.partCount(), 0u);
}

TEST(Interests, SleepWhileOneOfTheirNodesIsNotThere) {
    Three scene;
    const ObjectId choice = scene.switchCore(Switch::kAll);
    const ObjectId group = scene.node(kRootNode, choice);
    const auto d = scene.thing(group);
    const ObjectId interest = scene.interest({.object = scene.a.node, .against = d.node});
    EXPECT_TRUE(scene.related(scene.a.shape, d.shape));
    scene.set<Switch>(choice, fieldId<&Switch::choice>, Switch::kNone);
    EXPECT_EQ(scene.handler.partCount(), 0u);
    ASSERT_EQ(scene.handler.interests().size(), 1u) << "it is listed, and has no pairs";
    EXPECT_EQ(scene.handler.interests()[0].core, interest);
    scene.set<Switch>(choice, fieldId<&Switch::choice>, Switch::kAll);
    EXPECT_TRUE(scene.related(scene.a.shape, d.shape));
    scene.set<Interest>(interest, fieldId<&Interest::object>, ObjectId{});
    EXPECT_EQ(scene.handler.partCount(), 0u);
}

TEST(Interests, BeyondTheLimitAreCountedAndNotLookedAt) {
    Three scene({.maxInterests = 1});
    const ObjectId first = scene.interest({.object = scene.a.node, .against = scene.b.node});
    scene.interest({.object = scene.a.node, .against = scene.c.node});
    EXPECT_EQ(scene.handler.interests().size(), 1u);
    EXPECT_EQ(scene.handler.interestsLeftOut(), 1u);
    EXPECT_TRUE(scene.related(scene.a.shape, scene.b.shape));
    EXPECT_FALSE(scene.takesPart(scene.c.shape));
    scene.set<Interest>(first, fieldId<&Interest::enabled>, false);
    EXPECT_EQ(scene.handler.interestsLeftOut(), 0u);
    EXPECT_TRUE(scene.related(scene.a.shape, scene.c.shape));
}

TEST(Interests, ThatWouldMakeTooManyGroupsAreLeftOutFromThereOn) {
    ObjectScene scene({.maxGroups = 5});
    std::vector<ObjectScene::Thing> things;
    for (int i = 0; i < 9; ++i) things.push_back(scene.thing(kRootNode));
    for (const auto& thing : things) scene.interest({.object = thing.node});
    // Four objects and the rest make five groups.
    EXPECT_EQ(scene.handler.interests().size(), 4u);
    EXPECT_EQ(scene.handler.interestsLeftOut(), 5u);
    EXPECT_TRUE(scene.related(things[3].shape, things[8].shape));
    EXPECT_FALSE(scene.related(things[4].shape, things[8].shape));
    EXPECT_EQ(scene.handler.relations().size(), 5u);
}

TEST(Interests, ManyAlikeAreFewGroups) {
    ObjectScene scene;
    const ObjectId pile = scene.node(kRootNode);
    for (int i = 0; i < 200; ++i) scene.thing(pile);
    scene.object({.node = pile, .division = CollisionObject::kEachChild});
    const auto floor = scene.thing(kRootNode);
    scene.interest({.object = pile});
    EXPECT_EQ(scene.handler.bodyCount(), 201u);
    EXPECT_EQ(scene.handler.relations().size(), 2u);
    EXPECT_TRUE(scene.handler.relation(0, 199).relevant);
    EXPECT_TRUE(scene.handler.relation(7, scene.part(floor.shape)).relevant);
}

TEST(Interests, LeaveNoNeighboursWithinABodyOfManyParts) {
    ObjectScene scene;
    const ObjectId plant = scene.node(kRootNode);
    for (int i = 0; i < 100; ++i) scene.thing(plant);
    const auto a = scene.thing(kRootNode), b = scene.thing(kRootNode);
    for (const ObjectId node : {plant, a.node, b.node}) scene.object({.node = node});
    scene.interest({.object = kRootNode});
    EXPECT_FALSE(scene.handler.interactions().relevant(0, 99));
    EXPECT_TRUE(scene.handler.interactions().relevant(0, scene.part(a.shape)));
    EXPECT_TRUE(scene.handler.interactions().relevant(scene.part(a.shape), scene.part(b.shape)));
}

TEST(Interests, SharedByTwoNodesCountOnce) {
    Three scene;
    const ObjectId core = scene.interest({.object = scene.a.node});
    scene.node(kRootNode, core);
    EXPECT_EQ(scene.handler.interests().size(), 1u);
    EXPECT_EQ(scene.relation(scene.a.shape, scene.b.shape).interests.size(), 1u);
}

}  // namespace
}  // namespace tessera
