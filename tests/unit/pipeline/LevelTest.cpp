// Levels of detail in a scene: balls that cover a surface, through modes, responses and reports; what stays exact.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "server/collision/objects/ShapeCache.h"
#include "server/collision/representation/BallCover.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct LevelScene : SceneMaker {
    ObjectId as(const Body& body, std::int64_t level, std::int64_t shape = CollisionObject::kTriangles,
                std::int64_t kind = CollisionObject::kRigid) {
        CollisionObject fields;
        fields.node = body.node;
        fields.level = level;
        fields.shape = shape;
        fields.kind = kind;
        return object(fields);
    }
    TentativeTransform to(const Body& body, const Vec3d& where) {
        TentativeTransform wish{.transform = body.transform, .translation = where};
        wish.rotation = at(body.transform).rotation;
        wish.scale = at(body.transform).scale;
        return wish;
    }
    void scale(const Body& body, double factor) {
        set<Transform>(body.transform, fieldId<&Transform::scale>, Vec3d(Vec3d::Constant(factor)));
    }
};

double errorOf(const shapes::Soup& soup, std::int64_t level) {
    return level > 0 ? 2 * coverRadius(soup.mesh().bounds(), static_cast<unsigned>(level)) : 0;
}

TEST(Level, AMotionStopsEarlierByTheErrorAtMost) {
    const shapes::Soup ball = shapes::sphere(1, 24, 48);
    for (const double scale : {1.0, 2.5}) {
        double exact = 0;
        for (std::int64_t level = 0; level <= 7; ++level) {
            SCOPED_TRACE("level " + std::to_string(level));
            LevelScene scene;
            const auto target = scene.body(kRootNode, ball, Vec3d(20, 0, 0), Quatd(0.9, 0.1, 0.3, -0.2).normalized());
            scene.scale(target, scale);
            const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0.9, 0));
            scene.as(target, level);
            scene.interest(box.node);
            const StepResult result = scene.frame({scene.to(box, Vec3d(30, 0.9, 0))});
            ASSERT_EQ(result.stopped.size(), 1u);
            EXPECT_TRUE(result.standIns.empty());
            const double stop = scene.at(box.transform).translation.x(), error = scale * errorOf(ball, level);
            if (level == 0) exact = stop;
            EXPECT_LE(stop, exact + 1e-3);
            // Seen along the way the gap of the first that meets may be larger than the gap itself: never twice.
            EXPECT_GE(stop, exact - 2 * error - 1e-3);
            EXPECT_TRUE(level != 1 || stop < exact - 0.1) << "balls this large are seen";
            ASSERT_FALSE(result.contacts.empty());
            for (const Contact& contact : result.contacts.all()) {
                EXPECT_NEAR(contact.error, error, 1e-12);
                const std::uint32_t face = contact.objectA == target.shape ? contact.faceA : contact.faceB;
                EXPECT_LT(face, ball.indices.size() / 3) << "a face that is drawn";
            }
        }
    }
}

TEST(Level, AnotherOneIsRightInTheNextFrame) {
    const shapes::Soup ball = shapes::sphere(1, 16, 32);
    LevelScene scene;
    const auto target = scene.body(kRootNode, ball, Vec3d::Zero());
    const auto other = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(1.55, 0, 0));  // 0.05 apart
    const ObjectId core = scene.as(target, 0);
    scene.interest(other.node, target.node, Interest::kReport);
    Interest distance;
    distance.object = other.node;
    distance.against = target.node;
    distance.mode = Interest::kDistance;
    distance.threshold = 10;
    scene.interest(distance);
    const double truth = scene.frame().distances.all().at(0).distance;
    EXPECT_NEAR(truth, 0.05, 0.01);
    int touching = 0;
    for (const std::int64_t level : {1, 0, 2, 6, 1, 7, 5, 0, 3}) {
        SCOPED_TRACE("level " + std::to_string(level));
        scene.set<CollisionObject>(core, fieldId<&CollisionObject::level>, level);
        const StepResult result = scene.frame();
        const double found = result.distances.all().at(0).distance, error = errorOf(ball, level);
        EXPECT_LE(found, truth + 1e-9);
        EXPECT_GE(found, truth - error - 1e-9);
        EXPECT_EQ(result.contacts.empty(), found > 0);
        EXPECT_TRUE(level != 0 || found == truth);
        EXPECT_TRUE(level > 2 || level == 0 || found < truth) << "balls this large are seen";
        touching += found == 0;
        EXPECT_LT(result.distances.all().at(0).faceA, 12u);
        EXPECT_LT(result.distances.all().at(0).faceB, ball.indices.size() / 3);
    }
    EXPECT_GT(touching, 0);
}

TEST(Level, OneThatCannotBeHadIsNamed) {
    LevelScene scene;
    const shapes::Soup ball = shapes::sphere(1, 8, 16);
    const auto hull = scene.body(kRootNode, ball, Vec3d(0, 0, 0)), fine = scene.body(kRootNode, ball, Vec3d(5, 0, 0)),
               cloth = scene.body(kRootNode, shapes::sheet(1, 1), Vec3d(10, 0, 0)),
               good = scene.body(kRootNode, ball, Vec3d(15, 0, 0)), any = scene.body(kRootNode, ball, Vec3d(20, 0, 0)),
               land = scene.body(kRootNode, shapes::sheet(1, 1), Vec3d(25, 0, 0)),
               points = scene.body(kRootNode, ball, Vec3d(30, 0, 0)),
               scan = scene.body(kRootNode, ball, Vec3d(35, 0, 0));
    const ObjectId scanned = scene.aspect.get<Node>(scan.shape)->core;
    scene.set<Geometry>(scanned, fieldId<&Geometry::indices>, Blob());
    scene.set<Geometry>(scanned, fieldId<&Geometry::primitive>, std::int64_t{Geometry::kPoints});
    scene.set<Geometry>(scanned, fieldId<&Geometry::pointRadius>, 0.1);
    scene.as(hull, 3, CollisionObject::kHull);
    const ObjectId core = scene.as(fine, 12);
    scene.as(cloth, 4, CollisionObject::kTriangles, CollisionObject::kDeforming);
    scene.as(good, 4);
    scene.as(any, 4, CollisionObject::kAutoShape);
    scene.as(land, 4, CollisionObject::kHeightField);
    scene.as(points, 4, CollisionObject::kPoints);
    scene.as(scan, 5, CollisionObject::kAutoShape);
    scene.interest(hull.node);
    StepResult result = scene.frame();
    std::map<ObjectId, std::pair<std::string, std::string>> named;
    for (const StandIn& s : result.standIns) named[s.node] = {std::string(s.asked), std::string(s.taken)};
    using Words = std::pair<std::string, std::string>;
    EXPECT_EQ(named.size(), 5u);
    EXPECT_EQ(result.counters.standIns, 5u);
    EXPECT_EQ(named[hull.shape], Words("level 3", "hull"));
    EXPECT_EQ(named[fine.shape], Words("level 12", "triangles"));
    EXPECT_EQ(named[cloth.shape], Words("level 4", "triangles"));
    EXPECT_EQ(named[points.shape], Words("points", "triangles"));
    EXPECT_EQ(named[scan.shape], Words("level 5", "points"));
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::level>, std::int64_t{5});
    result = scene.frame();
    EXPECT_EQ(result.standIns.size(), 4u);
}

/// Free bodies, and what runs into itself, have to do with the surface.
TEST(Level, FreeBodiesRestOnTheSurfaceItself) {
    std::vector<double> heights;
    for (const std::int64_t level : {0, 1, 3, 6}) {
        LevelScene scene;
        scene.gravity(Vec3d(0, -9.81, 0));
        const auto floor = scene.body(kRootNode, shapes::box(Vec3d(10, 1, 10)), Vec3d::Zero());
        const auto crate = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 1.2, 0));
        scene.as(floor, level);
        CollisionObject fields;
        fields.node = crate.node;
        fields.mass = 1;
        fields.level = level;
        scene.object(fields);
        scene.interest(crate.node, floor.node);
        for (int frame = 0; frame < 90; ++frame) scene.frame();
        heights.push_back(scene.at(crate.transform).translation.y());
    }
    EXPECT_NEAR(heights[0], 1, 0.02);
    for (const double height : heights) EXPECT_EQ(height, heights[0]);
}

TEST(Level, WhatRunsIntoItselfIsToldOfTheSurface) {
    shapes::Soup crossed = shapes::box(Vec3d::Ones());
    const shapes::Soup other = shapes::sheet(3, 0.2);
    for (const std::uint32_t i : other.indices) crossed.indices.push_back(8 + i);
    crossed.positions.insert(crossed.positions.end(), other.positions.begin(), other.positions.end());
    std::vector<Contact> truth;
    for (const std::int64_t level : {0, 2, 5}) {
        LevelScene scene;
        const auto body = scene.body(kRootNode, crossed, Vec3d(1, 2, 3));
        scene.as(body, level);
        Interest self;
        self.object = body.node;
        self.mode = Interest::kSelf;
        self.detail = Interest::kAllFaces;
        scene.interest(self);
        const std::vector<Contact> found = scene.frame().contacts.all();
        if (level == 0) truth = found;
        ASSERT_FALSE(found.empty());
        ASSERT_EQ(found.size(), truth.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
            EXPECT_EQ(found[i].faceA, truth[i].faceA);
            EXPECT_EQ(found[i].faceB, truth[i].faceB);
            EXPECT_EQ(found[i].point, truth[i].point);
            EXPECT_EQ(found[i].error, 0);
        }
    }
}

TEST(Level, EqualGeometriesOfOneLevelShareTheirShape) {
    const shapes::Soup ball = shapes::sphere(1, 8, 16);
    const MeshArrays arrays{.positions = Blob::of(std::span<const float>(ball.positions)),
                            .indices = Blob::of(std::span<const std::uint32_t>(ball.indices))};
    ShapeCache cache(0);
    const auto shape = [&](unsigned level, std::optional<Representation> as = Representation::kTriangles) {
        return cache.shape(arrays, {.representation = as, .level = level});
    };
    ASSERT_TRUE(shape(3));
    EXPECT_TRUE(shape(3)->isCover());
    EXPECT_EQ(shape(3), shape(3));
    EXPECT_NE(shape(3), shape(4));
    EXPECT_EQ(shape(2, Representation::kHull), shape(0, Representation::kHull)) << "a level means nothing to a hull";
    EXPECT_EQ(shape(12), shape(0)) << "too many balls";
    EXPECT_FALSE(shape(12)->isCover());
    EXPECT_GT(cache.size(), 0u);
    cache.forgetIdle();
    EXPECT_EQ(cache.size(), 0u);
}

}  // namespace
}  // namespace tessera
