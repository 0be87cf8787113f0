#include "common/cores/Geometry.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/rays/IntersectAction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

void setGeometry(ChangeListBuilder& list, ObjectId id, const MeshData& mesh) {
    const MeshArrays arrays = mesh.toArrays();
    setField<&Geometry::positions>(list, id, arrays.positions);
    setField<&Geometry::texcoords>(list, id, arrays.texcoords);
    setField<&Geometry::indices>(list, id, arrays.indices);
    if (mesh.primitive == Primitive::kPoints) setField<&Geometry::primitive>(list, id, Geometry::kPoints);
    setField<&Geometry::pointRadius>(list, id, mesh.pointRadius);
}

/// A scene under change, and an action that follows it.
struct Followed {
    Aspect aspect;
    IntersectAction action;
    std::uint64_t next = 100;

    Followed() { action.lookAnew(aspect); }
    void apply(ChangeListBuilder& list) {
        const ChangeList taken = list.take();
        const Expected<void> applied = aspect.apply(taken);
        ASSERT_TRUE(applied) << applied.error().message;
        action.follow(aspect, taken);
    }
    ObjectId make(ChangeListBuilder& list, ObjectType type) {
        list.create(ObjectId(next), type);
        return ObjectId(next++);
    }
    ObjectId node(ChangeListBuilder& list, ObjectId parent, ObjectId core = {}) {
        const ObjectId id = make(list, typeOf<Node>());
        if (core) setField<&Node::core>(list, id, core);
        list.place(id, parent);
        return id;
    }
    ObjectId placed(ChangeListBuilder& list, ObjectId parent, const Vec3d& at) {
        const ObjectId core = make(list, typeOf<Transform>());
        setField<&Transform::translation>(list, core, at);
        return node(list, parent, core);
    }
};

TEST(IntersectAction, TellsAllOfTheNearest) {
    Followed scene;
    ChangeListBuilder list;
    const ObjectId mesh = scene.make(list, typeOf<Geometry>());
    MeshData wall;
    wall.positions = {0, 0, 0, 2, 0, 0, 0, 2, 0};
    wall.texcoords = {0, 0, 1, 0, 0, 1};
    wall.indices = {0, 1, 2};
    setGeometry(list, mesh, wall);
    const ObjectId far = scene.node(list, scene.placed(list, kRootNode, Vec3d(0, 0, -5)), mesh);
    const ObjectId near = scene.node(list, scene.placed(list, kRootNode, Vec3d(0, 0, -3)), mesh);
    scene.apply(list);
    const Ray ray{Vec3d(0.5, 1, 0), Vec3d(0, 0, -2)};
    const auto hit = scene.action.nearest(scene.aspect, ray);
    ASSERT_TRUE(hit && *hit);
    EXPECT_EQ((*hit)->node, near);
    EXPECT_EQ((*hit)->t, 1.5);
    EXPECT_EQ((*hit)->face, 0u);
    EXPECT_TRUE((*hit)->point.isApprox(Vec3d(0.5, 1, -3)));
    EXPECT_TRUE((*hit)->normal.isApprox(Vec3d(0, 0, 1)));
    EXPECT_TRUE((*hit)->weights.isApprox(Vec3d(0.25, 0.25, 0.5)));
    ASSERT_TRUE((*hit)->texcoord);
    EXPECT_TRUE((*hit)->texcoord->isApprox(Vec2d(0.25, 0.5)));
    const auto all = scene.action.all(scene.aspect, ray);
    ASSERT_EQ(all->size(), 2u);
    EXPECT_EQ((*all)[1].node, far);
    EXPECT_EQ(scene.action.all(scene.aspect, ray, 2)->size(), 1u);
    EXPECT_EQ(scene.action.all(scene.aspect, ray, 10, 1)->front().node, near);
    EXPECT_TRUE(*scene.action.any(scene.aspect, ray, 1.5));
    EXPECT_FALSE(*scene.action.any(scene.aspect, ray, 1.4));
    EXPECT_FALSE(*scene.action.nearest(scene.aspect, {Vec3d(0.5, 1, 0), Vec3d(0, 0, 1)}));
    EXPECT_EQ(scene.action.work().treesMade, 1u) << "both show one mesh";
}

TEST(IntersectAction, PointsAreMetAndLinesAreNot) {
    Followed scene;
    ChangeListBuilder list;
    const ObjectId points = scene.make(list, typeOf<Geometry>()), lines = scene.make(list, typeOf<Geometry>());
    MeshData scan;
    scan.primitive = Primitive::kPoints;
    scan.positions = {0, 0, -4};
    scan.pointRadius = 0.5;
    setGeometry(list, points, scan);
    const float ends[] = {-1, 0, -2, 1, 0, -2};
    const std::uint32_t line[] = {0, 1};
    const auto bytes = [](const auto& values) {
        const auto all = std::as_bytes(std::span(values));
        return Blob(Bytes(all.begin(), all.end()));
    };
    setField<&Geometry::primitive>(list, lines, Geometry::kLines);
    setField<&Geometry::positions>(list, lines, bytes(ends));
    setField<&Geometry::indices>(list, lines, bytes(line));
    const ObjectId ball = scene.node(list, kRootNode, points);
    scene.node(list, kRootNode, lines);
    scene.apply(list);
    const auto hit = scene.action.nearest(scene.aspect, {Vec3d(0.01, 0.02, 0), Vec3d(0, 0, -1)});
    ASSERT_TRUE(hit && *hit);
    EXPECT_EQ((*hit)->node, ball);
    EXPECT_LT((*hit)->face, 8u);
    EXPECT_NEAR((*hit)->t, 3.5, 0.05);
    EXPECT_FALSE((*hit)->texcoord);
}

TEST(IntersectAction, RefusesRaysThatAreNone) {
    Followed scene;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Ray& ray : {Ray{Vec3d(nan, 0, 0), Vec3d::UnitX()}, Ray{Vec3d::Zero(), Vec3d(0, HUGE_VAL, 0)},
                           Ray{Vec3d::Zero(), Vec3d::Zero()}}) {
        EXPECT_EQ(scene.action.nearest(scene.aspect, ray).error().code, ErrorCode::kUsage);
        EXPECT_FALSE(scene.action.any(scene.aspect, ray));
        EXPECT_FALSE(scene.action.all(scene.aspect, ray));
    }
    EXPECT_EQ(scene.action.nearest(scene.aspect, Ray(), nan).error().code, ErrorCode::kUsage);
    EXPECT_EQ(scene.action.nearest(scene.aspect, Ray(), -1).error().message, "a ray that ends before it begins");
}

/// Changes of every kind that matters, several in a list.
struct RandomEdits {
    Followed& scene;
    Random& random;
    std::vector<ObjectId> nodes{kRootNode}, meshes, transforms, switches;

    RandomEdits(Followed& followed, Random& from) : scene(followed), random(from) {}
    ObjectId any(const std::vector<ObjectId>& from) { return from[below(random, from.size())]; }
    Vec3d place() {
        const auto at = [&] { return static_cast<double>(below(random, 9)) - 4; };
        return {at(), at(), at()};
    }
    MeshData shape() {
        MeshData mesh = makeBox(Vec3d(1 + static_cast<double>(below(random, 3)), 1, 1));
        if (!oneIn(random, 4)) return mesh;
        MeshData points;
        points.primitive = Primitive::kPoints;
        points.positions = mesh.positions;
        points.pointRadius = 0.3;
        return points;
    }
    [[nodiscard]] bool isBelow(ObjectId node, ObjectId top) const {
        for (; node; node = scene.aspect.get<Node>(node)->parent)
            if (node == top) return true;
        return false;
    }
    void edit() {
        ChangeListBuilder list;
        std::vector<ObjectId> fresh;
        for (std::size_t i = 1 + below(random, 3); i > 0; --i) {
            const ObjectId core = oneIn(random, 3)   ? scene.make(list, typeOf<Geometry>())
                                  : oneIn(random, 2) ? scene.make(list, typeOf<Transform>())
                                                     : scene.make(list, typeOf<Switch>());
            fresh.push_back(core);
        }
        for (const ObjectId core : fresh) {
            const ObjectId node = scene.node(list, any(nodes), core);
            fresh_.push_back({node, core});
        }
        if (!meshes.empty() && oneIn(random, 2))
            fresh_.push_back({scene.node(list, any(nodes), any(meshes)), {}});  // shared
        scene.apply(list);
        for (const auto& [node, core] : fresh_) {
            nodes.push_back(node);
            const Object object = core ? scene.aspect.find(core) : Object();
            if (object.is<Geometry>()) meshes.push_back(core);
            if (object.is<Transform>()) transforms.push_back(core);
            if (object.is<Switch>()) switches.push_back(core);
        }
        fresh_.clear();
        if (!transforms.empty()) {
            setField<&Transform::translation>(list, any(transforms), place());
            if (oneIn(random, 4))
                setField<&Transform::scale>(list, any(transforms), Vec3d(1, oneIn(random, 3) ? 1e-30 : 2, -1));
        }
        if (!switches.empty() && oneIn(random, 2))
            setField<&Switch::choice>(list, any(switches), static_cast<std::int64_t>(below(random, 4)) - 2);
        if (!meshes.empty() && oneIn(random, 2)) setGeometry(list, any(meshes), shape());
        if (oneIn(random, 3)) {
            const ObjectId node = any(nodes);
            std::vector<ObjectId> cores{ObjectId()};
            for (const auto* some : {&meshes, &transforms, &switches})
                cores.insert(cores.end(), some->begin(), some->end());
            if (node != kRootNode) setField<&Node::core>(list, node, any(cores));
        }
        const ObjectId node = any(nodes), parent = any(nodes);
        if (node != kRootNode && !isBelow(parent, node))
            list.place(node, oneIn(random, 6) ? ObjectId() : parent, oneIn(random, 2) ? 0 : Placement::kLast);
        if (const ObjectId gone = any(nodes); gone != kRootNode && gone != node && gone != parent &&
                                              scene.aspect.get<Node>(gone)->children.empty() && oneIn(random, 3)) {
            list.detach(gone);
            list.destroy(gone);
            std::erase(nodes, gone);
        }
        if (!list.empty()) scene.apply(list);
    }

private:
    std::vector<std::pair<ObjectId, ObjectId>> fresh_;
};

TEST(IntersectAction, FollowsAsAFreshLookSees) {
    std::size_t hits = 0;
    forSeeds(60, [&](Random& random) {
        Followed scene;
        RandomEdits edits(scene, random);
        for (int step = 0; step < 25; ++step) {
            edits.edit();
            if (testing::Test::HasFatalFailure()) return;
            IntersectAction fresh;
            fresh.lookAnew(scene.aspect);
            for (int i = 0; i < 12; ++i) {
                const Vec3d from = 1.7 * edits.place() + Vec3d(0.1, 0.23, 0.37);
                const Ray ray{from, edits.place() + Vec3d(0.01, 0.02, 0.03) - from};
                const auto is = scene.action.all(scene.aspect, ray), was = fresh.all(scene.aspect, ray);
                ASSERT_TRUE(is && was);
                ASSERT_EQ(is->size(), was->size());
                for (std::size_t k = 0; k < is->size(); ++k) {
                    EXPECT_EQ((*is)[k].node, (*was)[k].node);
                    EXPECT_EQ((*is)[k].face, (*was)[k].face);
                    EXPECT_EQ((*is)[k].t, (*was)[k].t);
                }
                const auto nearest = scene.action.nearest(scene.aspect, ray);
                ASSERT_EQ(nearest->has_value(), !was->empty());
                if (*nearest) {
                    EXPECT_EQ((*nearest)->t, was->front().t);
                    EXPECT_EQ((*nearest)->node, was->front().node);
                }
                hits += was->size();
            }
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(hits, 2000u);
}

/// `count` boxes in groups of ten, each with a Transform of its own.
void fill(Followed& scene, std::size_t count, std::vector<ObjectId>& transforms, std::vector<ObjectId>& groups) {
    ChangeListBuilder list;
    const ObjectId mesh = scene.make(list, typeOf<Geometry>());
    setGeometry(list, mesh, makeBox(Vec3d::Ones()));
    for (std::size_t i = 0; i < count; ++i) {
        if (i % 10 == 0) groups.push_back(scene.node(list, kRootNode));
        const ObjectId node = scene.placed(list, groups.back(), Vec3d(static_cast<double>(i), 0, 0));
        transforms.push_back(ObjectId(node.value - 1));
        scene.node(list, node, mesh);
    }
    scene.apply(list);
}

TEST(IntersectAction, WhatItCostsFollowsWhatChanged) {
    for (const std::size_t count : {1'000u, 100'000u}) {
        Followed scene;
        std::vector<ObjectId> transforms, groups;
        fill(scene, count, transforms, groups);
        auto work = [&, before = scene.action.work().nodesLookedAt]() mutable {
            return scene.action.work().nodesLookedAt - std::exchange(before, scene.action.work().nodesLookedAt);
        };
        (void)work();
        ChangeListBuilder list;
        setField<&Transform::translation>(list, transforms[count / 2], Vec3d(0, 5, 0));
        scene.apply(list);
        EXPECT_EQ(work(), 2u) << "the node that moved and the one below it";
        list.place(groups[7], groups[8]);
        scene.apply(list);
        EXPECT_EQ(work(), 21u);
        setField<&Node::name>(list, groups[7], std::string("renamed"));
        scene.apply(list);
        EXPECT_EQ(work(), 0u);
        const auto hit = scene.action.nearest(scene.aspect, {Vec3d(0, 5, 9), -Vec3d::UnitZ()});
        ASSERT_TRUE(hit && *hit);
        EXPECT_EQ((*hit)->t, 8.5);
        EXPECT_EQ(scene.action.work().treesMade, 1u);
    }
}

}  // namespace
}  // namespace tessera
