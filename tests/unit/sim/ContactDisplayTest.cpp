/// Marks appear, follow and vanish; nobody else notices.
#include "common/cores/CollisionObject.h"
#include "common/cores/Material.h"
#include "common/math/Compose.h"
#include "server/sim/display/ContactDisplay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "common/geometry/Mesh.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;

/// Two boxes, /a and /b, an interest that wants `show` drawn, and a display that is told of contacts by hand.
class ContactDisplayTest : public testing::Test {
protected:
    explicit ContactDisplayTest(std::int64_t show = 7) {
        ListMaker make;
        const ObjectId a = make.node("a", kRootNode, make.transform(Vec3d::Zero()));
        make.node("shape", a, make.box(Vec3d::Ones()));
        const ObjectId b = make.node("b", kRootNode, make.transform(Vec3d(1, 0, 0)));
        make.node("shape", b, make.box(Vec3d(1, 4, 4)));
        const ObjectId interest = make.create<Interest>();
        make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, a);
        make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::show>, show);
        make.node("interest", kRootNode, interest);
        const Expected<Committer::Applied> applied = committer_.apply(make.builder.take());
        EXPECT_TRUE(applied) << applied.error().message;
        display_.sceneChanged(scene(), nullptr);
        (void)committer_.closeFrame();
        interest_ = scene().get<Node>(findNode(scene(), "/interest").value())->core;
    }
    [[nodiscard]] const Aspect& scene() const { return committer_.scene(); }
    [[nodiscard]] ObjectId at(const std::string& path) const { return findNode(scene(), path).value(); }
    [[nodiscard]] bool has(const std::string& path) const { return findNode(scene(), path).has_value(); }

    void apply(ChangeList list) {
        const Expected<Committer::Applied> applied = committer_.apply(std::move(list));
        ASSERT_TRUE(applied) << applied.error().message;
        display_.sceneChanged(scene(), nullptr);
    }
    void show(std::int64_t bits) {
        ChangeListBuilder builder;
        builder.set(interest_, typeOf<Interest>(), fieldId<&Interest::show>, bits);
        apply(builder.take());
    }
    [[nodiscard]] Contact contact(std::uint32_t faceA = 0, std::uint32_t faceB = 0,
                                  const Vec3d& point = Vec3d(0.5, 0, 0)) const {
        return {.objectA = at("/a/shape"),
                .objectB = at("/b/shape"),
                .faceA = faceA,
                .faceB = faceB,
                .point = point,
                .normal = Vec3d::UnitX(),
                .interest = interest_};
    }
    /// One frame with these contacts; the list that it took.
    CommittedFrame frame(std::vector<Contact> contacts) {
        StepResult step;
        step.contacts = std::move(contacts);
        if (const ChangeListPtr list = display_.commit(committer_, step)) display_.sceneChanged(scene(), list.get());
        return committer_.closeFrame();
    }
    /// Places of the marks of a kind that can be seen.
    [[nodiscard]] std::vector<Affine3d> seen(const std::string& kind) const {
        std::vector<Affine3d> places;
        const Expected<ObjectId> group = findNode(scene(), "/contacts/" + kind);
        if (!group) return places;
        Action action;
        action.on<Geometry>([&](const Visit& visit, const Geometry&) {
            if (std::abs(visit.world_T_node.linear().determinant()) > 0) places.push_back(visit.world_T_node);
            return Descend::kInto;
        });
        action.run(scene(), *group);
        return places;
    }

    Committer committer_;
    ContactDisplay display_;
    ObjectId interest_;
};

class NothingShown : public ContactDisplayTest {
protected:
    NothingShown() : ContactDisplayTest(0) {}
};

TEST_F(NothingShown, IsMadeForNobody) {
    const StateHash before = scene().stateHash();
    EXPECT_EQ(frame({contact()}).list, nullptr);
    EXPECT_EQ(scene().stateHash(), before);
}

TEST_F(ContactDisplayTest, IsNotThereBeforeTheFirstContact) {
    EXPECT_EQ(frame({}).list, nullptr);
    EXPECT_FALSE(has("/contacts"));
}

TEST_F(ContactDisplayTest, DrawsPointNormalAndBothFaces) {
    (void)frame({contact()});
    const std::vector<Affine3d> points = seen("points"), normals = seen("normals"), faces = seen("faces");
    ASSERT_EQ(points.size(), 1u);
    EXPECT_TRUE(points[0].translation().isApprox(Vec3d(0.5, 0, 0)));
    ASSERT_EQ(normals.size(), 1u);
    const Vec3d arrow = normals[0].linear() * Vec3d::UnitZ();
    EXPECT_TRUE(arrow.normalized().isApprox(Vec3d::UnitX())) << "from A to B";
    EXPECT_TRUE((normals[0] * Vec3d(0, 0, 0.5)).isApprox(Vec3d(0.5, 0, 0))) << "its middle is the point";
    EXPECT_NEAR(arrow.norm(), 0.3 * std::sqrt(33.0), 1e-12) << "of the larger object, a box of 1 x 4 x 4";
    ASSERT_EQ(faces.size(), 2u);
    EXPECT_EQ(display_.counts().drawn, (std::array<std::uint64_t, kMarkKinds>{1, 1, 2, 0, 0}));
}

TEST_F(ContactDisplayTest, AFaceOfPointsIsOneOfThePointsOctahedron) {
    const ObjectId shape = scene().get<Node>(at("/a/shape"))->core;
    const std::vector<float> places = {0, 0, 0, -1, 0, 0};
    ChangeListBuilder builder;
    const ObjectType type = typeOf<Geometry>();
    builder.set(shape, type, fieldId<&Geometry::positions>, Blob::of(std::span<const float>(places)));
    builder.set(shape, type, fieldId<&Geometry::normals>, Blob());
    builder.set(shape, type, fieldId<&Geometry::indices>, Blob());
    builder.set(shape, type, fieldId<&Geometry::primitive>, toValue(Geometry::kPoints));
    builder.set(shape, type, fieldId<&Geometry::pointRadius>, toValue(0.25));
    apply(builder.take());
    (void)frame({contact(8 + 6, 3)});  // of the second point: the octant +X, -Y, -Z
    const std::vector<Affine3d> faces = seen("faces");
    ASSERT_EQ(faces.size(), 2u);
    const Vec3d middle = faces[0] * Vec3d(1.0 / 3, 1.0 / 3, 0);
    EXPECT_TRUE(middle.isApprox(Vec3d(-1, 0, 0) + 0.25 / 3 * Vec3d(1, -1, -1), 0.02)) << middle.transpose();
}

TEST_F(ContactDisplayTest, FacesLieAHairAboveTheTrianglesThatTheyShow) {
    apply(test::moveTo(scene().get<Node>(at("/a"))->core, Vec3d(3, -2, 5)));
    (void)frame({contact(7, 3)});
    const std::vector<Affine3d> faces = seen("faces");
    ASSERT_EQ(faces.size(), 2u);
    const std::vector<std::pair<std::string, std::uint32_t>> wanted{{"/a/shape", 7}, {"/b/shape", 3}};
    for (std::size_t i = 0; i < 2; ++i) {
        const Geometry& geometry = *scene().coreOf<Geometry>(*scene().get<Node>(at(wanted[i].first)));
        const auto positions = geometry.positions.as<float>();
        const auto indices = geometry.indices.as<std::uint32_t>();
        const Affine3d place = worldTransform(scene(), at(wanted[i].first));
        std::array<Vec3d, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t vertex = std::size_t{3} * indices[3 * wanted[i].second + k];
            corners[k] = place * Vec3d(positions[vertex], positions[vertex + 1], positions[vertex + 2]);
        }
        const Vec3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
        const std::array<Vec3d, 3> unit{Vec3d::Zero(), Vec3d::UnitX(), Vec3d::UnitY()};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d lift = faces[i] * unit[k] - corners[k];
            EXPECT_LT(lift.cross(normal).norm(), 1e-12) << i << " " << k;
            EXPECT_GT(lift.dot(normal), 1e-4);
            EXPECT_LT(lift.dot(normal), 2e-2);
        }
        EXPECT_GT((faces[i].linear() * Vec3d::UnitZ()).dot(normal), 0) << "seen from outside";
    }
}

/// Any triangle is what two transforms make of the one.
TEST(MarkOfTriangle, IsTheTriangleItself) {
    std::mt19937_64 random(1);
    const auto number = [&] { return 20 * (static_cast<double>(random() >> 11) * 0x1p-53) - 10; };
    for (int i = 0; i < 2000; ++i) {
        const Vec3d a(number(), number(), number());
        const Vec3d b = i % 5 == 0 ? Vec3d(a + Vec3d(1, 0, 0)) : Vec3d(number(), number(), number());
        const Vec3d c =
            i % 7 == 0 ? Vec3d(a + 1e-5 * Vec3d(number(), number(), number())) : Vec3d(number(), number(), number());
        const std::optional<Mark> mark = markOfTriangle(a, b, c, 0);
        ASSERT_TRUE(mark) << "seed 1, triangle " << i;
        const Affine3d place = composeTransform(mark->translation, mark->rotation, mark->scale) *
                               composeTransform(Vec3d::Zero(), mark->turn, Vec3d::Ones());
        const double size = std::max((b - a).norm(), (c - a).norm());
        EXPECT_LT((place * Vec3d::Zero() - a).norm(), 1e-12 * size) << "seed 1, triangle " << i;
        EXPECT_LT((place * Vec3d::UnitX() - b).norm(), 1e-12 * size) << "seed 1, triangle " << i;
        EXPECT_LT((place * Vec3d::UnitY() - c).norm(), 1e-12 * size) << "seed 1, triangle " << i;
        EXPECT_GT((place.linear() * Vec3d::UnitZ()).dot((b - a).cross(c - a)), 0);
        EXPECT_GT(mark->scale.minCoeff(), 0);
    }
    EXPECT_FALSE(markOfTriangle(Vec3d::Zero(), Vec3d::UnitX(), 2 * Vec3d::UnitX(), 0)) << "no area";
    EXPECT_FALSE(markOfTriangle(Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero(), 0));
}

TEST_F(ContactDisplayTest, OnlyValuesOfTransformsTravelOnceItStands) {
    (void)frame({contact(0, 0), contact(1, 1)});
    for (int i = 0; i < 20; ++i) {
        std::vector<Contact> contacts;
        for (int k = 0; k < i % 4; ++k)
            contacts.push_back(contact(static_cast<std::uint32_t>(k), 2, Vec3d(0.5, 0.01 * i, 0.1 * k)));
        const CommittedFrame made = frame(contacts);
        ASSERT_TRUE(made.list) << i;
        EXPECT_TRUE(made.list->creations.empty() && made.list->placements.empty() && made.list->destructions.empty())
            << i;
        for (const FieldColumn& column : made.list->columns) EXPECT_EQ(column.type, typeOf<Transform>()) << i;
        EXPECT_TRUE(made.sent->blobs.empty());
        EXPECT_EQ(seen("points").size(), contacts.size()) << i;
    }
    (void)frame({contact()});
    EXPECT_EQ(frame({contact()}).list, nullptr) << "what stays costs nothing";
}

TEST_F(ContactDisplayTest, ShowsWhatIsAskedForAndGoesWhenNobodyAsks) {
    const StateHash before = [&] {
        show(0);
        return scene().stateHash();
    }();
    show(Interest::kShowNormals);
    (void)frame({contact()});
    EXPECT_TRUE(seen("points").empty());
    EXPECT_EQ(seen("normals").size(), 1u);
    EXPECT_TRUE(seen("faces").empty());
    show(Interest::kShowPoints | Interest::kShowFaces);
    (void)frame({contact()});
    EXPECT_EQ(seen("points").size(), 1u);
    EXPECT_TRUE(seen("normals").empty());
    EXPECT_EQ(seen("faces").size(), 2u);
    (void)frame({});
    EXPECT_TRUE(has("/contacts")) << "somebody still asks";
    EXPECT_TRUE(seen("points").empty());
    show(0);
    (void)frame({contact()});
    EXPECT_FALSE(has("/contacts"));
    EXPECT_EQ(scene().stateHash(), before) << "not an object is left behind";
}

TEST_F(ContactDisplayTest, IsNoConcernOfOtherInterests) {
    Contact foreign = contact();
    foreign.interest = ObjectId{4711};
    (void)frame({foreign, contact(1, 1)});
    EXPECT_EQ(seen("points").size(), 1u);
    ChangeListBuilder builder;
    builder.set(interest_, typeOf<Interest>(), fieldId<&Interest::enabled>, false);
    apply(builder.take());
    (void)frame({contact()});
    EXPECT_FALSE(has("/contacts")) << "an interest that is disabled asks for nothing";
}

TEST_F(ContactDisplayTest, TakesPartInNoCollision) {
    (void)frame({contact()});
    const Node& node = *scene().get<Node>(at("/contacts"));
    const CollisionObject* object = scene().coreOf<CollisionObject>(node);
    ASSERT_TRUE(object);
    EXPECT_EQ(object->node, at("/contacts"));
    EXPECT_EQ(object->layers, 0);
    EXPECT_EQ(scene().root().children.back(), at("/contacts"));
}

TEST_F(ContactDisplayTest, OfTooManyItDrawsSomeEverywhereAndCountsTheRest) {
    std::vector<Contact> contacts;
    for (std::uint32_t i = 0; i < 1000; ++i) contacts.push_back(contact(i % 12, i % 12, Vec3d(0.5, 0.001 * i, 0)));
    (void)frame(contacts);
    EXPECT_EQ(seen("points").size(), 200u);
    EXPECT_EQ(seen("normals").size(), 200u);
    EXPECT_EQ(seen("faces").size(), 24u) << "each face once";
    EXPECT_EQ(display_.counts().leftOut, (std::array<std::uint64_t, kMarkKinds>{800, 800, 0, 0, 0}));
    double highest = 0;
    for (const Affine3d& place : seen("points")) highest = std::max(highest, place.translation().y());
    EXPECT_GT(highest, 0.99) << "not the first ones only";
}

TEST_F(ContactDisplayTest, WhatCannotBeDrawnIsLeftOut) {
    Contact hull = contact(Contact::kNoFace, 12'345'678), nowhere = contact(), nan = contact(1, 1),
            flat = contact(2, 2);
    nowhere.objectA = nowhere.objectB = ObjectId{999'999};
    nan.point.x() = std::numeric_limits<double>::quiet_NaN();
    flat.normal = Vec3d::Zero();
    (void)frame({hull, nowhere, nan, flat});
    EXPECT_EQ(seen("points").size(), 2u);   // hull, flat
    EXPECT_EQ(seen("normals").size(), 1u);  // hull
    EXPECT_EQ(seen("faces").size(), 4u);    // nan, flat
}

TEST_F(ContactDisplayTest, PeopleCannotBreakIt) {
    (void)frame({contact()});
    // Moved: goes back.
    const ObjectId mark = scene().get<Node>(at("/contacts/points/mark"))->core;
    apply(test::moveTo(mark, Vec3d(100, 0, 0)));
    (void)frame({contact()});
    EXPECT_TRUE(seen("points").at(0).translation().isApprox(Vec3d(0.5, 0, 0)));
    // A part removed: all of it goes, and comes back.
    ChangeListBuilder removal;
    const ObjectId leaf = at("/contacts/points/mark/shape");
    removal.detach(leaf);
    removal.destroy(leaf);
    apply(removal.take());
    (void)frame({contact()});
    EXPECT_FALSE(has("/contacts"));
    (void)frame({contact()});
    EXPECT_EQ(seen("points").size(), 1u);
    // Somebody hangs a node of their own below it and uses its material: these stay, and what they need.
    ListMaker make;
    const ObjectId box = make.box(Vec3d::Ones());
    const ObjectId material =
        scene().coreOf<Geometry>(*scene().get<Node>(at("/contacts/faces/mark/turn/shape")))->material;
    make.builder.set(box, typeOf<Geometry>(), fieldId<&Geometry::material>, material);
    make.node("guest", at("/contacts/normals"), box);
    apply(make.builder.take());
    show(0);
    (void)frame({});
    EXPECT_TRUE(has("/contacts/normals/guest"));
    EXPECT_FALSE(has("/contacts/points"));
    EXPECT_TRUE(scene().get<Material>(material));
    show(7);
    (void)frame({contact()});
    EXPECT_EQ(scene().get<Node>(scene().root().children.back())->name, "contacts");
    EXPECT_EQ(frame({contact()}).list, nullptr) << "settled";
}

TEST_F(ContactDisplayTest, StaysBehindEveryonesPositions) {
    (void)frame({contact()});
    ListMaker make;
    make.node("late", kRootNode);
    const Expected<Committer::Applied> added = committer_.apply(make.builder.take());
    ASSERT_TRUE(added);
    (void)frame({contact()});
    EXPECT_EQ(scene().root().children.back(), at("/contacts"));
    // "late" is removed; the display goes; the removal is taken back, to a position that must still be there.
    ChangeListBuilder removal;
    removal.detach(at("/late"));
    removal.destroy(at("/late"));
    const Expected<Committer::Applied> removed = committer_.apply(removal.take(), Committer::Inverse::kMade);
    ASSERT_TRUE(removed);
    (void)frame({contact()});
    show(0);
    (void)frame({});
    EXPECT_FALSE(has("/contacts"));
    const Expected<Committer::Applied> back =
        committer_.applyInverse(std::make_shared<const ChangeList>(removed->inverse));
    EXPECT_TRUE(back) << back.error().message;
    EXPECT_TRUE(has("/late"));
}

TEST_F(ContactDisplayTest, ASceneThatIsFullHasNoDisplay) {
    Committer full(SceneLimits{.maxObjects = scene().objectCount() + 20});
    ASSERT_TRUE(full.applyInverse(std::make_shared<const ChangeList>(snapshot(scene()))));
    ContactDisplay display;
    display.sceneChanged(full.scene(), nullptr);
    StepResult step;
    step.contacts = std::vector<Contact>{contact()};
    const StateHash before = full.scene().stateHash();
    EXPECT_FALSE(display.commit(full, step));
    EXPECT_FALSE(display.commit(full, step));
    EXPECT_EQ(full.scene().stateHash(), before);
    EXPECT_EQ(display.counts(), ContactDisplay::Counts());
}

/// The interest asks how far apart /a and /b are.
class DistanceDisplayTest : public ContactDisplayTest {
protected:
    explicit DistanceDisplayTest(std::int64_t show = 7) : ContactDisplayTest(show) {
        ChangeListBuilder builder;
        builder.set(interest_, typeOf<Interest>(), fieldId<&Interest::mode>, toValue(Interest::kDistance));
        apply(builder.take());
        (void)committer_.closeFrame();
    }
    [[nodiscard]] PairDistance between(const Vec3d& from, const Vec3d& to) const {
        return {.interest = interest_,
                .objectA = at("/a"),
                .objectB = at("/b"),
                .phase = Phase::kStays,
                .distance = (to - from).norm(),
                .nodeA = at("/a/shape"),
                .nodeB = at("/b/shape"),
                .faceA = 7,
                .faceB = 3,
                .pointA = from,
                .pointB = to};
    }
    CommittedFrame frameOf(std::vector<PairDistance> distances) {
        StepResult step;
        step.distances = std::move(distances);
        if (const ChangeListPtr list = display_.commit(committer_, step)) display_.sceneChanged(scene(), list.get());
        return committer_.closeFrame();
    }
    /// The places of ticks along the line from `from` to `to`, as distances from there; ascending.
    [[nodiscard]] std::vector<double> ruler(const Vec3d& from, const Vec3d& to) const {
        std::vector<double> places;
        for (const Affine3d& tick : seen("ticks"))
            places.push_back((tick * Vec3d(0, 0, 0.5) - from).dot((to - from).normalized()));
        std::ranges::sort(places);
        return places;
    }
};

TEST_F(DistanceDisplayTest, DrawsBothEndsTheLineBetweenItsTicksAndTheNearestFaces) {
    const Vec3d from(0.5, 0.25, 0), to(0.5, 0.25, 0.37);
    (void)frameOf({between(from, to)});
    const std::vector<Affine3d> points = seen("points"), lines = seen("lines");
    ASSERT_EQ(points.size(), 2u);
    EXPECT_TRUE(points[0].translation().isApprox(from));
    EXPECT_TRUE(points[1].translation().isApprox(to));
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_TRUE((lines[0] * Vec3d::Zero()).isApprox(from));
    EXPECT_TRUE((lines[0] * Vec3d::UnitZ()).isApprox(to));
    EXPECT_TRUE(seen("normals").empty());
    EXPECT_EQ(seen("faces").size(), 2u);
    const std::vector<double> wanted{0.1, 0.2, 0.3, 0.31, 0.32, 0.33, 0.34, 0.35, 0.36, 0.37}, told = ruler(from, to);
    ASSERT_EQ(told.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(told[i], wanted[i], 1e-12);
    EXPECT_EQ(display_.counts().drawn, (std::array<std::uint64_t, kMarkKinds>{2, 0, 2, 1, 10}));
}

TEST_F(DistanceDisplayTest, TheBitsChooseWhatIsDrawn) {
    const std::vector<PairDistance> near{between(Vec3d::Zero(), Vec3d(0, 0, 2))};
    show(Interest::kShowPoints);
    (void)frameOf(near);
    EXPECT_EQ(seen("points").size(), 2u);
    EXPECT_TRUE(seen("lines").empty() && seen("ticks").empty() && seen("faces").empty());
    show(Interest::kShowNormals);
    (void)frameOf(near);
    EXPECT_TRUE(seen("points").empty() && seen("faces").empty());
    EXPECT_EQ(seen("lines").size(), 1u);
    EXPECT_EQ(seen("ticks").size(), 2u);
    show(0);
    (void)frameOf(near);
    EXPECT_FALSE(has("/contacts")) << "gone when nobody asks";
}

TEST_F(DistanceDisplayTest, FollowsByValuesOfTransformsAlone) {
    // Eighteen ticks, so that no later line needs more.
    (void)frameOf({between(Vec3d::Zero(), Vec3d(0, 0, 9.9))});
    std::mt19937_64 random(5);
    for (int i = 0; i < 50; ++i) {
        const auto number = [&] { return static_cast<double>(random() % 2000) / 1000 - 1; };
        const Vec3d from(number(), number(), number()), to(number(), number(), number());
        const CommittedFrame made = frameOf({between(from, to)});
        ASSERT_TRUE(made.list) << i;
        EXPECT_TRUE(made.list->creations.empty() && made.list->placements.empty() && made.list->destructions.empty())
            << i;
        EXPECT_TRUE(made.sent->blobs.empty());
        const std::vector<Affine3d> lines = seen("lines");
        ASSERT_EQ(lines.size(), 1u);
        EXPECT_TRUE((lines[0] * Vec3d::Zero()).isApprox(from)) << i;
        EXPECT_LT((lines[0] * Vec3d::UnitZ() - to).norm(), 1e-12) << i;
    }
    (void)frameOf({between(Vec3d::Zero(), Vec3d(0, 0, 1))});
    EXPECT_EQ(frameOf({between(Vec3d::Zero(), Vec3d(0, 0, 1))}).list, nullptr) << "what stays costs nothing";
}

TEST_F(DistanceDisplayTest, WhatEndedTouchesOrIsNoPlaceHasNoLine) {
    PairDistance ended = between(Vec3d::Zero(), Vec3d::UnitX());
    ended.phase = Phase::kEnded;
    PairDistance nowhere = between(Vec3d::Zero(), Vec3d::UnitX());
    nowhere.pointB.y() = std::numeric_limits<double>::quiet_NaN();
    PairDistance nobody = between(Vec3d::Zero(), Vec3d::UnitX());
    nobody.objectA = nobody.objectB = ObjectId{999'999};
    PairDistance foreign = between(Vec3d::Zero(), Vec3d::UnitX());
    foreign.interest = ObjectId{4711};
    EXPECT_EQ(frameOf({ended, nowhere, nobody, foreign}).list, nullptr);
    (void)frameOf({ended, between(Vec3d::Ones(), Vec3d::Ones()), nowhere});
    EXPECT_EQ(seen("points").size(), 1u) << "both ends are one place";
    EXPECT_TRUE(seen("lines").empty() && seen("ticks").empty());
}

TEST_F(DistanceDisplayTest, ContactsOfOthersAreDrawnBesideIt) {
    ListMaker make;
    const ObjectId other = make.create<Interest>();
    make.builder.set(other, typeOf<Interest>(), fieldId<&Interest::object>, at("/a"));
    make.builder.set(other, typeOf<Interest>(), fieldId<&Interest::show>, std::int64_t{7});
    make.node("other", kRootNode, other);
    apply(make.builder.take());
    StepResult step;
    step.distances = std::vector<PairDistance>{between(Vec3d::Zero(), Vec3d(0, 0, 0.5))};
    Contact touching = contact();
    touching.interest = scene().get<Node>(at("/other"))->core;
    step.contacts = std::vector<Contact>{touching};
    (void)display_.commit(committer_, step);
    EXPECT_EQ(seen("points").size(), 3u);
    EXPECT_EQ(seen("normals").size(), 1u);
    EXPECT_EQ(seen("lines").size(), 1u);
}

TEST_F(DistanceDisplayTest, OfTooManyItDrawsSomeEverywhereAndNoTicks) {
    std::vector<PairDistance> many;
    for (int i = 0; i < 1000; ++i) many.push_back(between(Vec3d(0.001 * i, 0, 0), Vec3d(0.001 * i, 0, 1)));
    (void)frameOf(many);
    EXPECT_EQ(seen("points").size(), 200u);
    EXPECT_EQ(seen("lines").size(), 100u);
    EXPECT_TRUE(seen("ticks").empty());
    EXPECT_EQ(display_.counts().leftOut, (std::array<std::uint64_t, kMarkKinds>{1800, 0, 0, 900, 0}));
    double farthest = 0;
    for (const Affine3d& place : seen("lines")) farthest = std::max(farthest, place.translation().x());
    EXPECT_GT(farthest, 0.98) << "not the first ones only";
    many.resize(kMostRulers);
    (void)frameOf(many);
    EXPECT_EQ(seen("ticks").size(), kMostRulers);
}

/// A root that turns and scales: the line still joins the two places in the world, and a tick is still a tenth of it.
TEST_F(DistanceDisplayTest, AScaledRootChangesNoPlaceInTheWorld) {
    ListMaker make;
    const ObjectId root = make.create<Transform>();
    make.builder.set(root, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(4, 4, 4)));
    make.builder.set(root, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(7, -3, 1)));
    make.builder.set(kRootNode, typeOf<Node>(), fieldId<&Node::core>, root);
    // As a journal of an earlier version may hold it: an edit cannot give the root a core.
    const ObjectId first = committer_.reserveIds(1);
    ASSERT_TRUE(committer_.applyReserved(make.builder.take(), first, 1, Committer::Inverse::kNone));
    display_.sceneChanged(scene(), nullptr);
    const Vec3d from(1, 2, 3), to(1, 2.6, 3.8);
    (void)frameOf({between(from, to)});
    const std::vector<Affine3d> lines = seen("lines");
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_LT((lines[0] * Vec3d::Zero() - from).norm(), 1e-12);
    EXPECT_LT((lines[0] * Vec3d::UnitZ() - to).norm(), 1e-12);
    const std::vector<double> told = ruler(from, to);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_NEAR(told[0], 1, 1e-12);
}

/// The two digits are those of the length, rounded down, for whatever length there may be.
TEST(RulerTicks, SayTwoDigits) {
    std::random_device device;
    const char* given = std::getenv("TESSERA_SEED");
    const std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : device();
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " unit_sim --gtest_filter=RulerTicks.*");
    std::mt19937_64 random(seed);
    std::vector<double> lengths{1, 0.1, 0.3, 0.7, 9.9, 9.999999999999, 10, 1e12, 1e-12, 1e-29, 1e29};
    std::uniform_real_distribution<double> digits(1, 10), powers(-29, 29);
    for (int i = 0; i < 20'000; ++i) lengths.push_back(digits(random) * std::pow(10, std::floor(powers(random))));
    for (const double length : lengths) {
        const RulerTicks ticks = ticksOf(length);
        ASSERT_GE(ticks.large, 1) << length;
        ASSERT_LE(ticks.large, 9) << length;
        ASSERT_GE(ticks.small, 0) << length;
        ASSERT_LE(ticks.small, 9) << length;
        const double power = std::log10(ticks.step);
        ASSERT_NEAR(power, std::round(power), 1e-9) << length;
        const double said = (ticks.large + 0.1 * ticks.small) * ticks.step;
        ASSERT_LE(said, length * (1 + 1e-8)) << length;
        ASSERT_GT(said + 0.1 * ticks.step, length * (1 - 1e-8)) << length;
    }
    EXPECT_EQ(ticksOf(1 - 1e-15).large, 1) << "one, not nine tenths and nine hundredths";
    for (const double none :
         {0.0, -1.0, 1e-300, 1e300, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
        EXPECT_EQ(ticksOf(none).large + ticksOf(none).small, 0) << none;
}

/// The same history, the same scene: ids, order, bits.
TEST(ContactDisplay, IsDeterministic) {
    const auto play = [] {
        Committer committer;
        ContactDisplay display;
        ListMaker make;
        const ObjectId a = make.node("a", kRootNode, make.transform(Vec3d::Zero()));
        make.node("shape", a, make.box(Vec3d::Ones()));
        const ObjectId interest = make.create<Interest>();
        make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, a);
        make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::show>, std::int64_t{7});
        make.node("interest", kRootNode, interest);
        EXPECT_TRUE(committer.apply(make.builder.take()));
        display.sceneChanged(committer.scene(), nullptr);
        std::vector<std::uint64_t> hashes;
        std::mt19937_64 random(3);
        for (int frame = 0; frame < 40; ++frame) {
            StepResult step;
            for (std::uint64_t i = random() % 60; i > 0; --i) {
                const double x = static_cast<double>(random() % 1000) / 100;
                step.contacts.push_back(
                    {.objectA = findNode(committer.scene(), "/a/shape").value(),
                     .objectB = findNode(committer.scene(), "/a/shape").value(),
                     .faceA = static_cast<std::uint32_t>(random() % 12),
                     .faceB = static_cast<std::uint32_t>(random() % 12),
                     .point = Vec3d(x, 1, 2),
                     .normal = Vec3d(x, 1, -x).normalized(),
                     .interest = committer.scene().get<Node>(findNode(committer.scene(), "/interest").value())->core});
            }
            if (const ChangeListPtr list = display.commit(committer, step))
                display.sceneChanged(committer.scene(), list.get());
            hashes.push_back(committer.closeFrame().sent->stateHash.value);
        }
        return hashes;
    };
    EXPECT_EQ(play(), play());
}

TEST(ContactDisplay, NamesAllItsArraysBeforehand) {
    const std::vector<Blob> blobs = ContactDisplay::blobs();
    std::size_t bytes = 0;
    for (const Blob& blob : blobs) bytes += blob.sizeBytes();
    EXPECT_GE(blobs.size(), 5u);
    EXPECT_LT(bytes, 10'000u) << "every host fetches them, whether or not they are shown";
    for (const MeshArrays& shape : markShapes()) EXPECT_TRUE(checkMesh(shape));
}

}  // namespace
}  // namespace tessera
