/// Deforming bodies: where their vertices were, and where they are about to be.
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {
namespace {

struct Cloth : ObjectScene {
    Thing thing1 = thing(kRootNode);
    Thing wall = thing(kRootNode);
    ObjectId core = object({.node = thing1.node, .kind = CollisionObject::kDeforming});
    ObjectId interestId = interest({.object = kRootNode});

    Cloth() { (void)handler.takeMoved(); }
    [[nodiscard]] const Part& cloth() const { return handler.parts()[part(thing1.shape)]; }
    void bend(const Vec3d& size) {
        set<Geometry>(thing1.geometry, fieldId<&Geometry::positions>, boxSoup(size).positionBlob());
    }
    [[nodiscard]] Vec3d sizeOfShape() const { return cloth().shape->mesh().bounds().size(); }
};

TEST(Deformation, WaitsUntilItIsSettled) {
    Cloth scene;
    const std::uint64_t version = scene.cloth().poseVersion, generation = scene.handler.generation();
    const CollisionShape* shape = scene.cloth().shape.get();
    scene.bend(Vec3d(2, 1, 1));
    ASSERT_EQ(scene.handler.deformations().size(), 1u);
    const PartDeformation& deformation = scene.handler.deformations()[0];
    EXPECT_EQ(scene.handler.parts()[deformation.part].node, scene.thing1.shape);
    ASSERT_EQ(deformation.end.size(), 8u);
    EXPECT_EQ(deformation.end[1], Vec3d(1, -0.5, -0.5));
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(1, 1, 1)) << "still as it was";
    EXPECT_EQ(scene.cloth().poseVersion, version);
    EXPECT_TRUE(scene.handler.takeMoved().empty());

    scene.handler.settleDeformations();
    EXPECT_TRUE(scene.handler.deformations().empty());
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(2, 1, 1));
    EXPECT_EQ(scene.cloth().shape.get(), shape);
    EXPECT_NE(scene.cloth().poseVersion, version);
    EXPECT_NEAR(scene.cloth().worldBox.size().x(), 2, 1e-9);
    EXPECT_EQ(scene.handler.takeMoved(), std::vector<std::uint32_t>{scene.part(scene.thing1.shape)});
    EXPECT_EQ(scene.handler.generation(), generation);
}

TEST(Deformation, AgainAndAgainMakesAShapeFollowByGroups) {
    Cloth scene;
    for (std::size_t edit = 1; edit <= 2 * CollisionShape::kMovesBeforeGroups; ++edit) {
        const double length = 1 + 0.1 * static_cast<double>(edit);
        scene.bend(Vec3d(length, 1, 1));
        scene.handler.settleDeformations();
        EXPECT_EQ(scene.cloth().shape->followsByGroups(), edit >= CollisionShape::kMovesBeforeGroups) << edit;
        if (!scene.cloth().shape->followsByGroups()) continue;
        EXPECT_NEAR(scene.cloth().shape->groups().bounds().size().x(), length, 1e-5);
    }
}

TEST(Deformation, OfARangeIsThatRange) {
    Cloth scene;
    const auto edit = [&](std::uint64_t vertex, const Vec3f& to) {
        ChangeListBuilder b;
        b.setRange(scene.thing1.geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>, vertex * 3 * sizeof(float),
                   Blob::of(std::span<const float>(to.data(), 3)));
        scene.apply(b);
    };
    edit(7, Vec3f(3, 0.5f, 0.5f));
    ASSERT_EQ(scene.handler.deformations().size(), 1u);
    EXPECT_EQ(scene.handler.deformations()[0].first, 7u);
    ASSERT_EQ(scene.handler.deformations()[0].end.size(), 1u);
    EXPECT_EQ(scene.handler.deformations()[0].end[0], Vec3d(3, 0.5, 0.5));
    // Two before it settles: from the first to the last of both, and what was there before the first is the start.
    edit(5, Vec3f(2, 0, 0));
    ASSERT_EQ(scene.handler.deformations().size(), 1u);
    EXPECT_EQ(scene.handler.deformations()[0].first, 5u);
    EXPECT_EQ(scene.handler.deformations()[0].end.size(), 3u);
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(1, 1, 1));
    scene.handler.settleDeformations();
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(3.5, 1, 1));
    EXPECT_NEAR(scene.cloth().worldBox.size().x(), 3.5, 1e-9);
    edit(7, Vec3f(0.5f, 0.5f, 0.5f));
    scene.handler.settleDeformations();
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(2.5, 1, 1)) << "the box shrinks";
}

TEST(Deformation, OfTwoTheLaterIsTheEndAndTheStartStays) {
    Cloth scene;
    scene.bend(Vec3d(2, 1, 1));
    scene.bend(Vec3d(1, 3, 1));
    ASSERT_EQ(scene.handler.deformations().size(), 1u);
    EXPECT_EQ(scene.handler.deformations()[0].end[7], Vec3d(0.5, 1.5, 0.5));
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(1, 1, 1));
    scene.bend(Vec3d(1, 1, 1));
    EXPECT_TRUE(scene.handler.deformations().empty()) << "back where it was";
}

TEST(Deformation, OfPointsIsThatOfTheirOctahedra) {
    Cloth scene;
    const auto places = [&](const std::vector<float>& all) {
        scene.set<Geometry>(scene.thing1.geometry, fieldId<&Geometry::positions>,
                            Blob::of(std::span<const float>(all)));
    };
    ChangeListBuilder b;
    const ObjectType type = typeOf<Geometry>();
    b.set(scene.thing1.geometry, type, fieldId<&Geometry::indices>, Blob());
    b.set(scene.thing1.geometry, type, fieldId<&Geometry::primitive>, toValue(Geometry::kPoints));
    b.set(scene.thing1.geometry, type, fieldId<&Geometry::pointRadius>, toValue(0.25));
    scene.apply(b);
    scene.handler.settleDeformations();
    places({0, 0, 0, 1, 0, 0});
    scene.handler.settleDeformations();
    ASSERT_EQ(scene.cloth().shape->mesh().faceCount(), 16u);
    places({0, 0, 0, 1, 2, 0});
    ASSERT_EQ(scene.handler.deformations().size(), 1u) << "the same points elsewhere";
    ASSERT_EQ(scene.handler.deformations()[0].end.size(), 12u);
    EXPECT_EQ(scene.handler.deformations()[0].end[6], Vec3d(1.25, 2, 0));
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(1.5, 0.5, 0.5)) << "still as it was";
    scene.handler.settleDeformations();
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(1.5, 2.5, 0.5));
    scene.set<Geometry>(scene.thing1.geometry, fieldId<&Geometry::pointRadius>, 0.5);
    EXPECT_TRUE(scene.handler.deformations().empty()) << "another radius is another shape";
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(2, 3, 1));
}

TEST(Deformation, OutlivesNewTables) {
    Cloth scene;
    scene.bend(Vec3d(2, 1, 1));
    const std::uint64_t version = scene.cloth().poseVersion;
    ChangeListBuilder b;
    const ObjectId node = scene.fresh();
    b.create(node, typeOf<Node>());
    b.set(node, typeOf<Node>(), fieldId<&Node::core>, toValue(scene.wall.geometry));
    b.place(node, kRootNode, 0);
    scene.apply(b);
    ASSERT_EQ(scene.handler.deformations().size(), 1u);
    EXPECT_EQ(scene.handler.deformations()[0].part, scene.part(scene.thing1.shape));
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(1, 1, 1));
    EXPECT_EQ(scene.cloth().poseVersion, version);
    scene.handler.settleDeformations();
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(2, 1, 1));
}

TEST(Deformation, OtherArraysAreAnotherShapeAtOnce) {
    Cloth scene;
    const Soup sheet = sheetSoup();
    ChangeListBuilder b;
    b.set(scene.thing1.geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>, sheet.positionBlob());
    b.set(scene.thing1.geometry, typeOf<Geometry>(), fieldId<&Geometry::indices>, sheet.indexBlob());
    scene.apply(b);
    EXPECT_TRUE(scene.handler.deformations().empty());
    EXPECT_EQ(scene.cloth().shape->mesh().faceCount(), 2u);
}

TEST(Deformation, MalformedPositionsMakeItMeetNothingUntilGoodOnesCome) {
    Cloth scene;
    Soup bad = boxSoup(Vec3d::Ones());
    bad.positions[4] = std::numeric_limits<float>::quiet_NaN();
    Soup few = boxSoup(Vec3d::Ones());
    few.positions.resize(12);
    for (const Blob& positions : {bad.positionBlob(), few.positionBlob(), Blob{}, Blob::absent(BlobId{1, 2}, 96)}) {
        scene.set<Geometry>(scene.thing1.geometry, fieldId<&Geometry::positions>, positions);
        EXPECT_FALSE(scene.cloth().solid());
        EXPECT_TRUE(scene.handler.deformations().empty());
        scene.handler.settleDeformations();
        scene.bend(Vec3d(3, 1, 1));
        EXPECT_TRUE(scene.handler.deformations().empty()) << "from nowhere there is no way";
        EXPECT_EQ(scene.sizeOfShape(), Vec3d(3, 1, 1));
    }
}

TEST(Deformation, AJumpIsNone) {
    Cloth scene;
    ChangeListBuilder b;
    b.set(scene.thing1.geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>,
          boxSoup(Vec3d(2, 1, 1)).positionBlob());
    const ChangeList list = b.take();
    ASSERT_TRUE(scene.aspect.apply(list));
    scene.handler.update(scene.aspect, nullptr);
    EXPECT_TRUE(scene.handler.deformations().empty());
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(2, 1, 1));
}

TEST(Deformation, ConcernsEveryPartThatShowsTheGeometryAndNoRigidOne) {
    Cloth scene;
    const ObjectId clone = scene.node(scene.thing1.node, scene.thing1.geometry);
    const ObjectId rigid = scene.node(kRootNode, scene.thing1.geometry);
    scene.bend(Vec3d(2, 1, 1));
    ASSERT_EQ(scene.handler.deformations().size(), 2u);
    EXPECT_EQ(scene.handler.deformations()[1].part, scene.part(clone));
    EXPECT_EQ(scene.handler.parts()[scene.part(rigid)].shape->mesh().bounds().size(), Vec3d(2, 1, 1));
    scene.handler.settleDeformations();
    EXPECT_EQ(scene.handler.parts()[scene.part(clone)].shape, scene.cloth().shape);
    EXPECT_EQ(scene.sizeOfShape(), Vec3d(2, 1, 1));
}

TEST(Deformation, OfARigidBodyIsANewShape) {
    Cloth scene;
    const auto before = scene.handler.parts()[scene.part(scene.wall.shape)].shape;
    scene.set<Geometry>(scene.wall.geometry, fieldId<&Geometry::positions>, boxSoup(Vec3d(2, 1, 1)).positionBlob());
    EXPECT_TRUE(scene.handler.deformations().empty());
    EXPECT_NE(scene.handler.parts()[scene.part(scene.wall.shape)].shape, before);
    EXPECT_EQ(before->mesh().bounds().size(), Vec3d(1, 1, 1)) << "shared shapes never change";
}

TEST(Deformation, TheTreeIsDividedAnewWhereItHasDecayed) {
    // A long strip whose vertices change places: the old division is as bad as can be.
    ObjectScene scene;
    Soup strip;
    constexpr int kQuads = 400;
    for (int i = 0; i <= kQuads; ++i) {
        strip.vertex(Vec3d(i, 0, 0));
        strip.vertex(Vec3d(i, 1, 0));
    }
    for (std::uint32_t i = 0; i < 2 * kQuads; i += 2)
        strip.indices.insert(strip.indices.end(), {i, i + 1, i + 2, i + 1, i + 3, i + 2});
    const auto thing = scene.thing(kRootNode, Vec3d::Zero(), strip);
    scene.object({.node = thing.node, .kind = CollisionObject::kDeforming});
    scene.interest({.object = kRootNode});
    Soup folded = strip;
    for (int i = 0; i <= kQuads; ++i)
        for (int k = 0; k < 2; ++k) folded.positions[3 * (2 * i + k)] = static_cast<float>(i * 173 % (kQuads + 1));
    scene.set<Geometry>(thing.geometry, fieldId<&Geometry::positions>, folded.positionBlob());
    scene.handler.settleDeformations();
    EXPECT_LE(scene.handler.parts()[0].shape->tree().decay(), TriangleTree::kRebuildAbove);
    Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const float>(strip.positions), strip.indices);
    TriangleTree witness(std::move(*mesh));
    std::vector<Vec3d> ends;
    for (std::size_t i = 0; i < folded.positions.size(); i += 3)
        ends.emplace_back(folded.positions[i], folded.positions[i + 1], folded.positions[i + 2]);
    ASSERT_TRUE(witness.refit(ends));
    EXPECT_GT(witness.decay(), TriangleTree::kRebuildAbove) << "or the test shows nothing";
}

}  // namespace
}  // namespace tessera
