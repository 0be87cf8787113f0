/// Where parts are: moves, tentative poses, versions, boxes.
#include <limits>

#include "common/cores/Material.h"
#include "common/math/Compose.h"
#include "common/scene/Action.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {
namespace {

struct Moving : ObjectScene {
    Thing carrier = thing(kRootNode, Vec3d(1, 0, 0));
    Thing load = thing(carrier.node, Vec3d(0, 2, 0));
    Thing other = thing(kRootNode, Vec3d(9, 9, 9));
    ObjectId interestId = interest({.object = carrier.node});

    Moving() { (void)handler.takeMoved(); }
    [[nodiscard]] const Part& of(const Thing& thing) const { return handler.parts()[part(thing.shape)]; }
    [[nodiscard]] std::vector<std::uint32_t> numbers(std::initializer_list<Thing> things) const {
        std::vector<std::uint32_t> out;
        for (const Thing& t : things) out.push_back(part(t.shape));
        std::sort(out.begin(), out.end());
        return out;
    }
};

TEST(Poses, AMovedTransformMovesWhatIsBelowItAndNothingElse) {
    Moving scene;
    const std::uint64_t generation = scene.handler.generation();
    const std::uint64_t before = scene.of(scene.other).poseVersion, load = scene.of(scene.load).poseVersion;
    scene.move(scene.carrier.transform, Vec3d(5, 0, 0));
    EXPECT_EQ(scene.of(scene.load).world.translation(), Vec3d(5, 2, 0));
    EXPECT_EQ(scene.of(scene.load).worldBox.center(), Vec3d(5, 2, 0));
    EXPECT_NE(scene.of(scene.load).poseVersion, load);
    EXPECT_EQ(scene.of(scene.other).poseVersion, before);
    EXPECT_EQ(scene.handler.takeMoved(), scene.numbers({scene.carrier, scene.load}));
    EXPECT_TRUE(scene.handler.takeMoved().empty());
    EXPECT_EQ(scene.handler.generation(), generation);
}

TEST(Poses, ATransformInTwoPlacesMovesBoth) {
    Moving scene;
    const ObjectId twin = scene.node(kRootNode, scene.load.transform);
    const ObjectId shape = scene.node(twin, scene.load.geometry);
    EXPECT_EQ(scene.handler.placesOf(scene.load.transform).size(), 2u);
    scene.move(scene.load.transform, Vec3d(0, 4, 0));
    EXPECT_EQ(scene.of(scene.load).world.translation(), Vec3d(1, 4, 0));
    EXPECT_EQ(scene.handler.parts()[scene.part(shape)].world.translation(), Vec3d(0, 4, 0));
}

TEST(Poses, ATransformBelowItselfIsComposedTwice) {
    Moving scene;
    const ObjectId inner = scene.node(scene.carrier.node, scene.carrier.transform);
    const ObjectId shape = scene.node(inner, scene.load.geometry);
    scene.move(scene.carrier.transform, Vec3d(3, 0, 0));
    EXPECT_EQ(scene.handler.parts()[scene.part(shape)].world.translation(), Vec3d(6, 0, 0));
    Affine3d local = Affine3d::Identity();
    local.translation() = Vec3d(0, 1, 0);
    scene.handler.overlay(scene.carrier.transform, local);
    EXPECT_EQ(scene.handler.parts()[scene.part(shape)].world.translation(), Vec3d(0, 2, 0));
}

TEST(Poses, WhatConcernsNobodyChangesNothing) {
    Moving scene;
    ChangeListBuilder b;
    const ObjectId material = scene.fresh(), camera = ObjectId(material.value + 1), idle = ObjectId(material.value + 2);
    b.create(material, typeOf<Material>());
    b.create(camera, typeOf<Camera>());
    b.create(idle, typeOf<Geometry>());
    b.set(scene.carrier.geometry, typeOf<Geometry>(), fieldId<&Geometry::material>, toValue(material));
    b.set(scene.carrier.node, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("crane")));
    b.set(material, typeOf<Material>(), fieldId<&Material::roughness>, toValue(0.5f));
    b.set(idle, typeOf<Geometry>(), fieldId<&Geometry::positions>, boxSoup(Vec3d::Ones()).positionBlob());
    b.set(scene.interestId, typeOf<Interest>(), fieldId<&Interest::threshold>, toValue(4.0));
    b.set(scene.interestId, typeOf<Interest>(), fieldId<&Interest::response>, toValue(Interest::kSlide));
    const std::uint64_t generation = scene.handler.generation();
    scene.apply(b);
    EXPECT_EQ(scene.handler.generation(), generation);
    EXPECT_TRUE(scene.handler.takeMoved().empty());
    EXPECT_EQ(scene.handler.interests()[0].threshold, 4);
    EXPECT_EQ(scene.relation(scene.carrier.shape, scene.other.shape).response, Interest::kSlide);
}

TEST(Poses, AnOverlayIsTriedAndDropped) {
    Moving scene;
    const Affine3d home = scene.of(scene.load).world;
    Affine3d local = Affine3d::Identity();
    local.translation() = Vec3d(7, 0, 0);
    scene.handler.overlay(scene.carrier.transform, local);
    EXPECT_EQ(scene.of(scene.load).world.translation(), Vec3d(7, 2, 0));
    EXPECT_EQ(scene.handler.takeMoved(), scene.numbers({scene.carrier, scene.load}));
    scene.handler.dropOverlay(scene.aspect);
    EXPECT_EQ(scene.of(scene.load).world.matrix(), home.matrix());
    EXPECT_EQ(scene.handler.takeMoved(), scene.numbers({scene.carrier, scene.load}));
    scene.handler.overlay(ObjectId{99999}, local);
    EXPECT_TRUE(scene.handler.takeMoved().empty()) << "no such transform";
}

TEST(Poses, AnOverlayThatIsCommittedHasMovedNothing) {
    Moving scene;
    const Quatd turned(Eigen::AngleAxisd(0.3, Vec3d(1, 2, 3).normalized()));
    scene.handler.overlay(scene.carrier.transform, composeTransform(Vec3d(7, 1, 2), turned, Vec3d(1, 2, 1)));
    const std::uint64_t version = scene.of(scene.load).poseVersion;
    (void)scene.handler.takeMoved();
    scene.move(scene.carrier.transform, Vec3d(7, 1, 2), turned, Vec3d(1, 2, 1));
    EXPECT_EQ(scene.of(scene.load).poseVersion, version);
    EXPECT_TRUE(scene.handler.takeMoved().empty());
    scene.handler.dropOverlay(scene.aspect);
    EXPECT_EQ(scene.of(scene.load).poseVersion, version) << "there is none left";
}

TEST(Poses, AnOverlayThatIsRefusedIsGoneAfterTheNextList) {
    Moving scene;
    const Affine3d home = scene.of(scene.load).world;
    scene.handler.overlay(scene.carrier.transform, composeTransform(Vec3d(7, 1, 2), Quatd::Identity(), Vec3d::Ones()));
    scene.move(scene.other.transform, Vec3d(8, 8, 8));
    EXPECT_EQ(scene.of(scene.load).world.matrix(), home.matrix());
}

TEST(Poses, VersionsOutliveNewTablesWherePoseAndShapeStay) {
    Moving scene;
    scene.handler.overlay(scene.carrier.transform, composeTransform(Vec3d(7, 1, 2), Quatd::Identity(), Vec3d::Ones()));
    const std::uint64_t carrier = scene.of(scene.carrier).poseVersion, other = scene.of(scene.other).poseVersion;
    const std::uint64_t generation = scene.handler.generation();
    // One list with new structure and the accepted pose.
    ChangeListBuilder b;
    const ObjectId added = scene.fresh();
    b.create(added, typeOf<Node>());
    b.place(added, kRootNode, 0);
    b.set(scene.carrier.transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(7, 1, 2)));
    scene.apply(b);
    EXPECT_EQ(scene.handler.generation(), generation) << "a node more is no reason to begin anew";
    EXPECT_EQ(scene.of(scene.carrier).poseVersion, carrier);
    EXPECT_EQ(scene.of(scene.other).poseVersion, other);
    scene.handler.update(scene.aspect, nullptr);
    EXPECT_EQ(scene.of(scene.carrier).poseVersion, carrier);
    EXPECT_EQ(scene.handler.takeMoved().size(), scene.handler.parts().size()) << "new numbers";
    scene.set<Geometry>(scene.other.geometry, fieldId<&Geometry::positions>, boxSoup(Vec3d(2, 2, 2)).positionBlob());
    EXPECT_NE(scene.of(scene.other).poseVersion, other);
}

TEST(Poses, WhatAListMovesThereAndBackHasNotMoved) {
    Moving scene;
    // Under a node that loses its Transform in the same list.
    const ObjectId inner = scene.node(scene.other.node, scene.transform(Vec3d(1, 0, 0)));
    (void)scene.handler.takeMoved();
    const std::uint64_t other = scene.of(scene.other).poseVersion, load = scene.of(scene.load).poseVersion;
    ChangeListBuilder b;
    b.place(scene.other.shape, inner);
    b.set(inner, typeOf<Node>(), fieldId<&Node::core>, toValue(ObjectId{}));
    scene.apply(b);
    EXPECT_EQ(scene.of(scene.other).world.translation(), Vec3d(9, 9, 9));
    EXPECT_EQ(scene.of(scene.other).poseVersion, other);
    EXPECT_TRUE(scene.handler.takeMoved().empty());
    // Under a new node, as far back as that one stands ahead.
    const ObjectId transform = scene.transform(Vec3d(1, 1, 0));
    ChangeListBuilder c;
    const ObjectId ahead = scene.fresh();
    c.create(ahead, typeOf<Node>());
    c.set(ahead, typeOf<Node>(), fieldId<&Node::core>, toValue(transform));
    c.place(ahead, kRootNode);
    c.place(scene.load.node, ahead);
    c.set(scene.load.transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(0, 1, 0)));
    scene.apply(c);
    EXPECT_EQ(scene.of(scene.load).world.translation(), Vec3d(1, 2, 0));
    EXPECT_EQ(scene.of(scene.load).poseVersion, load);
    EXPECT_TRUE(scene.handler.takeMoved().empty());
}

/// Whatever else of a list has changed above or below it, and in which order.
TEST(Poses, WhatIsPlacedAmongWhatMovesStandsWhereTheSceneHasIt) {
    Moving scene;
    // Above what is placed one moves; below it, old and new, two others do.
    const ObjectScene::Thing old = scene.thing(scene.load.node, Vec3d(0, 0, 4));
    const ObjectId stands = scene.transform(), shifted = scene.transform(Vec3d(0, 0, 1));
    ChangeListBuilder b;
    const ObjectId upper = scene.fresh(), lower = ObjectId(upper.value + 1), shape = ObjectId(upper.value + 2);
    const auto make = [&](ObjectId id, ObjectId parent, ObjectId core) {
        b.create(id, typeOf<Node>());
        b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        b.place(id, parent);
    };
    make(upper, scene.other.node, stands);  // it stands as a new place does: at the top's pose
    make(lower, upper, shifted);
    make(shape, lower, scene.other.geometry);
    b.place(scene.load.node, lower);
    const auto move = [&](ObjectId transform, const Vec3d& to) {
        b.set(transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(to));
    };
    move(scene.other.transform, Vec3d::Zero());
    move(shifted, Vec3d(0, 2, 0));
    move(old.transform, Vec3d(0, 0, 5));
    scene.apply(b);
    for (const ObjectId node : {scene.carrier.shape, scene.load.shape, scene.other.shape, old.shape, shape}) {
        const std::uint32_t place = scene.handler.placeOf(node);
        ASSERT_NE(place, Place::kNone);
        EXPECT_EQ(scene.handler.places()[place].world.matrix(), worldTransform(scene.aspect, node).matrix());
    }
}

/// No version is 0, with which nobody has seen anything.
TEST(Poses, WhatComesWithAListThatGoesBeyondTheLimitsHasAVersionOfItsOwn) {
    ObjectScene scene({.maxGroups = 5});
    std::vector<ObjectScene::Thing> things;
    for (int i = 0; i < 6; ++i) things.push_back(scene.thing(kRootNode));
    for (int i = 0; i < 3; ++i) scene.interest({.object = things[static_cast<std::size_t>(i)].node});
    ASSERT_EQ(scene.handler.interestsLeftOut(), 0u);
    const ObjectId malformed = scene.geometry(Soup{});
    ChangeListBuilder b;
    std::uint64_t next = scene.fresh().value;
    const auto place = [&](ObjectId core) {
        const ObjectId id{next++};
        b.create(id, typeOf<Node>());
        b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        b.place(id, kRootNode);
        return id;
    };
    const ObjectId shape = place(malformed);
    for (std::size_t i = 3; i < 5; ++i) {
        const ObjectId interest{next++};
        b.create(interest, typeOf<Interest>());
        b.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, toValue(things[i].node));
        (void)place(interest);
    }
    scene.apply(b);
    ASSERT_GT(scene.handler.interestsLeftOut(), 0u);
    ASSERT_TRUE(scene.takesPart(shape));
    const std::uint64_t version = scene.handler.parts()[scene.part(shape)].poseVersion;
    EXPECT_NE(version, 0u);
    scene.set<Geometry>(malformed, fieldId<&Geometry::indices>, boxSoup(Vec3d::Ones()).indexBlob());
    EXPECT_EQ(scene.handler.parts()[scene.part(shape)].poseVersion, version) << "it still has no positions";
}

TEST(Poses, NewArraysAreANewShapeAndNoNewTables) {
    Moving scene;
    const std::uint64_t generation = scene.handler.generation();
    scene.set<Geometry>(scene.other.geometry, fieldId<&Geometry::positions>, boxSoup(Vec3d(2, 4, 6)).positionBlob());
    EXPECT_NEAR((scene.of(scene.other).worldBox.size() - Vec3d(2, 4, 6)).norm(), 0, 1e-9);
    EXPECT_EQ(scene.handler.takeMoved(), scene.numbers({scene.other}));
    const std::vector<std::uint32_t> beyond{0, 1, 99}, ragged{0, 1};
    for (const auto& bad : {beyond, ragged, std::vector<std::uint32_t>{}}) {
        scene.set<Geometry>(scene.other.geometry, fieldId<&Geometry::indices>,
                            Blob::of(std::span<const std::uint32_t>(bad)));
        EXPECT_FALSE(scene.of(scene.other).solid());
        EXPECT_EQ(scene.handler.partsSkipped(), 1u);
    }
    scene.set<Geometry>(scene.other.geometry, fieldId<&Geometry::indices>, Blob::absent(BlobId{1, 2}, 36));
    EXPECT_FALSE(scene.of(scene.other).shape);
    scene.set<Geometry>(scene.other.geometry, fieldId<&Geometry::indices>, boxSoup(Vec3d::Ones()).indexBlob());
    EXPECT_TRUE(scene.of(scene.other).solid());
    EXPECT_EQ(scene.handler.generation(), generation);
}

TEST(Poses, FlattenedMirroredAndBoundlessPosesAreTold) {
    Moving scene;
    const ObjectId transform = scene.other.transform;
    scene.move(transform, Vec3d::Zero(), Quatd::Identity(), Vec3d(-2, 1, 1));
    EXPECT_TRUE(scene.of(scene.other).solid());
    for (const Vec3d& scale : {Vec3d(0, 1, 1), Vec3d(1e-200, 1, 1), Vec3d(1e60, 1, 1)}) {
        scene.move(transform, Vec3d::Zero(), Quatd::Identity(), scale);
        EXPECT_FALSE(scene.of(scene.other).solid()) << scale.transpose();
    }
    scene.move(transform, Vec3d::Zero());
    ASSERT_TRUE(scene.of(scene.other).solid());
    Affine3d nowhere = Affine3d::Identity();
    nowhere.translation().x() = std::numeric_limits<double>::quiet_NaN();
    scene.handler.overlay(transform, nowhere);
    EXPECT_FALSE(scene.of(scene.other).solid());
    const std::uint64_t version = scene.of(scene.other).poseVersion;
    scene.handler.overlay(transform, nowhere);
    EXPECT_EQ(scene.of(scene.other).poseVersion, version) << "the same nowhere";
    scene.handler.dropOverlay(scene.aspect);
    EXPECT_TRUE(scene.of(scene.other).solid());
}

TEST(Poses, HiddenNodesAreNotThere) {
    Moving scene;
    const ObjectId choice = scene.switchCore(Switch::kAll);
    const ObjectId group = scene.node(kRootNode, choice);
    scene.place(scene.other.node, group);
    EXPECT_TRUE(scene.takesPart(scene.other.shape));
    for (const std::int64_t hides : {Switch::kNone, std::int64_t{1}, std::int64_t{7}}) {
        scene.set<Switch>(choice, fieldId<&Switch::choice>, hides);
        EXPECT_FALSE(scene.takesPart(scene.other.shape)) << hides;
        EXPECT_TRUE(scene.handler.placesOf(scene.other.transform).empty());
    }
    scene.set<Switch>(choice, fieldId<&Switch::choice>, std::int64_t{0});
    EXPECT_TRUE(scene.takesPart(scene.other.shape));
    scene.set<Switch>(choice, fieldId<&Switch::choice>, Switch::kMask);
    EXPECT_FALSE(scene.takesPart(scene.other.shape)) << "of a mask without any bit";
    scene.set<Switch>(choice, fieldId<&Switch::mask>, std::int64_t{5});
    EXPECT_TRUE(scene.takesPart(scene.other.shape));
    scene.place(scene.other.node, ObjectId{});
    EXPECT_FALSE(scene.takesPart(scene.other.shape));
    scene.place(scene.other.node, scene.load.node);
    EXPECT_EQ(scene.of(scene.other).world.translation(), Vec3d(10, 11, 9)) << "with its parent";
}

TEST(Poses, BoxAroundHoldsEveryVertexAsRoundingPutsIt) {
    std::srand(1);
    for (int round = 0; round < 2000; ++round) {
        Affine3d m = Affine3d::Identity();
        m.matrix().topRows<3>() = Eigen::Matrix<double, 3, 4>::Random() * std::pow(10.0, round % 13 - 6);
        Box box;
        for (int i = 0; i < 2; ++i) box.extend(Vec3d(Vec3d::Random() * std::pow(10.0, round % 7 - 3)));
        const Box around = boxAround(m, box);
        for (int corner = 0; corner < 8; ++corner)
            EXPECT_TRUE(around.contains(m * Vec3d(corner & 1 ? box.lower.x() : box.upper.x(),
                                                  corner & 2 ? box.lower.y() : box.upper.y(),
                                                  corner & 4 ? box.lower.z() : box.upper.z())))
                << "round " << round;
    }
    EXPECT_TRUE(boxAround(Affine3d::Identity(), Box{}).empty());
}

TEST(Poses, BoxAroundABallHoldsEveryPointOfItAsRoundingPutsIt) {
    std::srand(2);
    for (int round = 0; round < 2000; ++round) {
        Affine3d m = Affine3d::Identity();
        m.matrix().topRows<3>() = Eigen::Matrix<double, 3, 4>::Random() * std::pow(10.0, round % 13 - 6);
        const Vec3d centre = Vec3d::Random() * std::pow(10.0, round % 7 - 3);
        std::vector<Vec3d> points;
        Box box;
        double radius = 0;
        // Where the ball's image reaches farthest along each axis, and anywhere on the ball.
        for (int i = 0; i < 12; ++i) {
            const Vec3d way =
                i < 6 ? Vec3d((i % 2 ? 1 : -1) * m.linear().row(i / 2).transpose()) : Vec3d(Vec3d::Random());
            points.push_back(centre + 0.7 * way.normalized());
            box.extend(points.back());
            radius = std::max(radius, (points.back() - centre).norm());
        }
        const Box loose = boxAround(m, box);
        const Box tight = boxAround(m, box, centre, radius * (1 + 1e-14));
        for (const Vec3d& p : points) EXPECT_TRUE(tight.contains(m * p)) << "round " << round;
        EXPECT_TRUE(loose.contains(tight.lower) && loose.contains(tight.upper)) << "round " << round;
    }
}

}  // namespace
}  // namespace tessera
