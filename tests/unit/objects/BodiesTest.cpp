/// Which geometry belongs to which body.
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {
namespace {

/// Somebody at the root's end is interested in everything.
struct Watched : ObjectScene {
    Thing watcher = thing(kRootNode, Vec3d(0, 0, 100));
    ObjectId group = node(kRootNode);
    ObjectId interestId = interest({.object = watcher.node});
};

TEST(Bodies, AnInterestsObjectIsOneBodyAndOtherGeometryIsEachItsOwn) {
    ObjectScene scene;
    const ObjectId engine = scene.node(kRootNode, scene.transform());
    const auto crank = scene.thing(engine), rod = scene.thing(engine);
    const auto wall = scene.thing(kRootNode), floor = scene.thing(kRootNode);
    EXPECT_EQ(scene.handler.partCount(), 0u) << "nobody is interested";
    scene.interest({.object = engine});
    ASSERT_EQ(scene.handler.partCount(), 4u);
    ASSERT_EQ(scene.handler.bodyCount(), 3u);
    EXPECT_EQ(scene.body(crank.shape).node, engine);
    EXPECT_EQ(scene.body(rod.shape).node, engine);
    EXPECT_EQ(scene.body(wall.shape).node, wall.shape);
    EXPECT_EQ(scene.body(floor.shape).node, floor.shape);
    EXPECT_FALSE(scene.body(crank.shape).core);
    EXPECT_EQ(scene.body(wall.shape).layers, 1);
    EXPECT_EQ(scene.handler.bodies()[0].parts, (std::vector<std::uint32_t>{0, 1}));
}

TEST(Bodies, ACollisionObjectIsItsNodeAndAllBelow) {
    Watched scene;
    const auto a = scene.thing(scene.group), b = scene.thing(a.node);
    const ObjectId core =
        scene.object({.node = scene.group, .layers = 6, .restitution = 0.5, .friction = 0.25, .velocity = {1, 2, 3}});
    for (const auto& part : {a, b}) {
        EXPECT_EQ(scene.body(part.shape).node, scene.group);
        EXPECT_EQ(scene.body(part.shape).core, core);
    }
    const Body& body = scene.body(a.shape);
    EXPECT_EQ(body.kind, CollisionObject::kRigid);
    EXPECT_EQ(body.layers, 6);
    EXPECT_EQ(body.restitution, 0.5);
    EXPECT_EQ(body.friction, 0.25);
    EXPECT_EQ(body.velocity, Vec3d(1, 2, 3));
    EXPECT_EQ(body.mass, 0);
}

TEST(Bodies, ADeeperCollisionObjectTakesWhatIsItsOwn) {
    Watched scene;
    const auto outer = scene.thing(scene.group), inner = scene.thing(outer.node), innermost = scene.thing(inner.node);
    scene.object({.node = scene.group});
    const ObjectId core = scene.object({.node = inner.node});
    EXPECT_EQ(scene.body(outer.shape).node, scene.group);
    EXPECT_EQ(scene.body(inner.shape).node, inner.node);
    EXPECT_EQ(scene.body(innermost.shape).node, inner.node);
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::node>, ObjectId{});
    EXPECT_EQ(scene.body(inner.shape).node, scene.group) << "a core without a node means nothing";
}

TEST(Bodies, OfTwoCoresForOneNodeTheLowestIdCounts) {
    Watched scene;
    const auto a = scene.thing(scene.group);
    const ObjectId first = scene.object({.node = a.node, .layers = 2});
    const ObjectId second = scene.object({.node = a.node, .layers = 4});
    EXPECT_EQ(scene.body(a.shape).core, first);
    scene.set<CollisionObject>(first, fieldId<&CollisionObject::node>, scene.group);
    EXPECT_EQ(scene.body(a.shape).core, second);
}

TEST(Bodies, AGroupIsDividedByChildrenOrByGeometries) {
    Watched scene;
    const ObjectId core = scene.object({.node = scene.group, .division = CollisionObject::kEachChild});
    const auto a = scene.thing(scene.group), below = scene.thing(a.node), b = scene.thing(scene.group);
    EXPECT_EQ(scene.body(a.shape).node, a.node);
    EXPECT_EQ(scene.body(below.shape).node, a.node);
    EXPECT_EQ(scene.body(b.shape).node, b.node);
    EXPECT_EQ(scene.body(a.shape).core, core);
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::division>, CollisionObject::kEachGeometry);
    for (const auto& part : {a, below, b}) EXPECT_EQ(scene.body(part.shape).node, part.shape);
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::division>, CollisionObject::kWhole);
    for (const auto& part : {a, below, b}) EXPECT_EQ(scene.body(part.shape).node, scene.group);
}

TEST(Bodies, WithoutLayersNothingTakesPart) {
    Watched scene;
    const auto arrows = scene.thing(scene.group);
    EXPECT_TRUE(scene.takesPart(arrows.shape));
    const ObjectId core = scene.object({.node = scene.group, .layers = 0});
    EXPECT_FALSE(scene.takesPart(arrows.shape));
    EXPECT_TRUE(scene.takesPart(scene.watcher.shape));
    // Nor does it make a side one that has objects.
    scene.set<Interest>(scene.interestId, fieldId<&Interest::object>, kRootNode);
    EXPECT_EQ(scene.body(scene.watcher.shape).node, kRootNode);
    EXPECT_FALSE(scene.takesPart(arrows.shape));
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::layers>, std::int64_t{8});
    EXPECT_TRUE(scene.takesPart(arrows.shape));
}

TEST(Bodies, OfNestedObjectsOfInterestsTheDeeperCounts) {
    ObjectScene scene;
    const auto engine = scene.thing(kRootNode), piston = scene.thing(engine.node);
    scene.interest({.object = engine.node});
    EXPECT_EQ(scene.body(piston.shape).node, engine.node);
    scene.interest({.object = piston.node});
    EXPECT_EQ(scene.body(engine.shape).node, engine.node);
    EXPECT_EQ(scene.body(piston.shape).node, piston.node);
    EXPECT_TRUE(scene.related(engine.shape, piston.shape)) << "the second asks for it";
}

TEST(Bodies, ACollisionObjectThatIsHiddenOrWhoseBearerIsHiddenMeansNothing) {
    Watched scene;
    const ObjectId choice = scene.switchCore(Switch::kAll);
    const ObjectId hideable = scene.node(kRootNode, choice);
    const auto a = scene.thing(scene.group);
    ChangeListBuilder b;
    const ObjectId core = scene.fresh(), bearer = ObjectId(core.value + 1);
    b.create(core, typeOf<CollisionObject>());
    b.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(scene.group));
    b.create(bearer, typeOf<Node>());
    b.set(bearer, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
    b.place(bearer, hideable);
    scene.apply(b);
    EXPECT_EQ(scene.body(a.shape).node, scene.group);
    scene.set<Switch>(choice, fieldId<&Switch::choice>, Switch::kNone);
    EXPECT_EQ(scene.body(a.shape).node, a.shape);
}

TEST(Bodies, HullsAreSolidAndMadeOfTheirOwnFaces) {
    Watched scene;
    const auto a = scene.thing(scene.group), flat = scene.thing(scene.group, Vec3d::Zero(), sheetSoup());
    const ObjectId core = scene.object({.node = scene.group, .shape = CollisionObject::kHull});
    const Part& hull = scene.handler.parts()[scene.part(a.shape)];
    ASSERT_TRUE(hull.shape && hull.shape->hull());
    EXPECT_EQ(hull.shape->mesh().faceCount(), hull.shape->hull()->faces().size());
    EXPECT_EQ(hull.shape->mesh().vertexCount(), hull.shape->hull()->vertices().size());
    EXPECT_TRUE(hull.solid());
    EXPECT_FALSE(scene.handler.parts()[scene.part(flat.shape)].shape) << "no inside";
    EXPECT_EQ(scene.handler.partsSkipped(), 1u);
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::shape>, CollisionObject::kTriangles);
    EXPECT_FALSE(scene.handler.parts()[scene.part(a.shape)].shape->hull());
    EXPECT_EQ(scene.handler.partsSkipped(), 0u);
}

TEST(Bodies, EqualGeometryHasOneShape) {
    Watched scene;
    const auto a = scene.thing(scene.group), b = scene.thing(scene.group);
    EXPECT_EQ(scene.handler.parts()[scene.part(a.shape)].shape, scene.handler.parts()[scene.part(b.shape)].shape);
    EXPECT_EQ(scene.shapes->size(), 1u);
}

}  // namespace
}  // namespace tessera
