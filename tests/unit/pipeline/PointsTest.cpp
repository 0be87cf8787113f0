// Scans in a scene: points as balls, through modes, responses and reports; stand-ins; tolerances.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/Compose.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct ScanScene : SceneMaker {
    Body points(const std::vector<Vec3f>& places, double radius, const Vec3d& where,
                const Vec3d& scale = Vec3d::Ones()) {
        ChangeListBuilder b;
        const auto core = ObjectId(aspect.nextFreeId());
        b.create(core, typeOf<Geometry>());
        std::vector<float> xyz;
        for (const Vec3f& p : places) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
        b.set(core, typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob::of(std::span<const float>(xyz)));
        b.set(core, typeOf<Geometry>(), fieldId<&Geometry::primitive>, toValue(std::int64_t{Geometry::kPoints}));
        b.set(core, typeOf<Geometry>(), fieldId<&Geometry::pointRadius>, toValue(radius));
        apply(b);
        Body out;
        out.transform = transform(where, Quatd::Identity(), scale);
        out.node = node(kRootNode, out.transform);
        out.shape = node(out.node, core);
        return out;
    }
    void as(const Body& body, std::int64_t shape, double tolerance = 0, std::int64_t kind = CollisionObject::kRigid) {
        CollisionObject fields;
        fields.node = body.node;
        fields.shape = shape;
        fields.kind = kind;
        fields.tolerance = tolerance;
        object(fields);
    }
    TentativeTransform to(const Body& body, const Vec3d& where) {
        TentativeTransform wish{.transform = body.transform, .translation = where};
        wish.scale = at(body.transform).scale;
        return wish;
    }
};

TEST(Points, ABoxStopsAtTheBallAndNotAtItsOctahedron) {
    for (const std::int64_t shape : {CollisionObject::kPoints, CollisionObject::kAutoShape}) {
        ScanScene scene;
        const auto scan =
            scene.points({Vec3f(0, 0, 0)}, 0.5, Vec3d(5, 0, 0), Vec3d::Constant(2));  // a ball of radius 1
        const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0.9, 0));
        scene.as(scan, shape);
        scene.interest(box.node);
        const StepResult result = scene.frame({scene.to(box, Vec3d(9, 0.9, 0))});
        ASSERT_EQ(result.stopped.size(), 1u);
        // The box's right side, from y = 0.4 on, meets the ball where it is sqrt(1 - 0.16) from its middle; an
        // octahedron would be met 0.6 from it.
        const double right = scene.at(box.transform).translation.x() + 0.5;
        EXPECT_LT(right, 5 - std::sqrt(1 - 0.16));
        EXPECT_NEAR(right, 5 - std::sqrt(1 - 0.16), 3e-4);
        ASSERT_FALSE(result.contacts.empty());
        const Contact& contact = result.contacts.front();
        const bool boxIsA = contact.objectA == box.shape;
        EXPECT_LT((boxIsA ? contact.faceB : contact.faceA), 8u) << "a face of the first octahedron";
        EXPECT_GT((boxIsA ? contact.normal : Vec3d(-contact.normal)).x(), 0.8);
        EXPECT_TRUE(result.standIns.empty());
    }
}

TEST(Points, TouchAndAreSoFarAwayAsBallsAre) {
    ScanScene scene;
    const auto scan = scene.points({Vec3f(0, 0, 0), Vec3f(0, 3, 0)}, 1, Vec3d::Zero());
    const auto other = scene.points({Vec3f(0, 0, 0)}, 0.5, Vec3d(3, 0, 0));
    scene.as(scan, CollisionObject::kPoints);
    scene.as(other, CollisionObject::kPoints);
    scene.interest(other.node, scan.node, Interest::kReport);
    Interest distance;
    distance.object = other.node;
    distance.against = scan.node;
    distance.mode = Interest::kDistance;
    distance.threshold = 10;
    scene.interest(distance);
    StepResult result = scene.frame();
    EXPECT_TRUE(result.contacts.empty());
    ASSERT_EQ(result.distances.all().size(), 1u);
    EXPECT_NEAR(result.distances.all()[0].distance, 1.5, 1e-12);
    EXPECT_NEAR((result.distances.all()[0].pointA - result.distances.all()[0].pointB).norm(), 1.5, 1e-12);
    result = scene.frame({scene.to(other, Vec3d(1.4, 0, 0))});
    ASSERT_EQ(result.contacts.size(), 1u);
    EXPECT_NEAR(result.contacts.front().depth, 0.1, 1e-12);
    EXPECT_NEAR(std::abs(result.contacts.front().normal.x()), 1, 1e-12);
    EXPECT_NEAR(result.contacts.front().point.x(), 0.95, 1e-12);
    result = scene.frame({scene.to(other, Vec3d(1.6, 0, 0))});
    EXPECT_TRUE(result.contacts.empty());
    EXPECT_EQ(result.events.all().size(), 1u);
}

/// What moves among balls: whether any is entered is told from their centres alone.
TEST(Points, NobodyIsEverLedIntoABall) {
    std::mt19937_64 random(41);
    const auto number = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int stopped = 0, far = 0;
    for (int round = 0; round < 24; ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        const std::int64_t response = round % 3 == 0   ? Interest::kSlide
                                      : round % 3 == 1 ? Interest::kStop
                                                       : Interest::kRollback;
        ScanScene scene;
        std::vector<Vec3f> places;
        for (int i = 0; i < 400; ++i) {
            const Vec3f p(static_cast<float>(number(-3, 3)), static_cast<float>(number(-3, 3)),
                          static_cast<float>(number(-3, 3)));
            if (p.norm() > 1.2f) places.push_back(p);
        }
        const double scale = round % 2 == 0 ? 1 : 1.7, radius = 0.12;
        const auto scan = scene.points(places, radius, Vec3d::Zero(), Vec3d::Constant(scale));
        // A box, or balls on two sticks' ends.
        const bool balls = round % 4 >= 2;
        const std::vector<Vec3f> ends{Vec3f(-0.4f, 0, 0), Vec3f(0.4f, 0, 0), Vec3f(0, 0.5f, 0)};
        const auto mover = balls ? scene.points(ends, 0.15, Vec3d::Zero())
                                 : scene.body(kRootNode, shapes::box(Vec3d(0.8, 0.3, 0.5)), Vec3d::Zero());
        scene.as(scan, CollisionObject::kPoints);
        scene.as(mover, balls ? CollisionObject::kPoints : CollisionObject::kTriangles);
        scene.interest(mover.node, {}, response);
        const auto least = [&] {
            const Affine3d pose = composeTransform(scene.at(mover.transform).translation,
                                                   scene.at(mover.transform).rotation, Vec3d::Ones());
            double out = 1e9;
            for (const Vec3f& p : places) {
                const Vec3d own = pose.inverse() * (scale * p.cast<double>());
                if (balls) {
                    for (const Vec3f& end : ends) out = std::min(out, (own - end.cast<double>()).norm() - 0.15);
                } else {
                    const Vec3d half(0.4, 0.15, 0.25), outside = (own.cwiseAbs() - half).cwiseMax(0);
                    const double inside = (half - own.cwiseAbs()).minCoeff();
                    out = std::min(out, inside > 0 ? -inside : outside.norm());
                }
            }
            return out - scale * radius;
        };
        ASSERT_GT(least(), 0);
        for (int frame = 0; frame < 60; ++frame) {
            TentativeTransform wish{.transform = mover.transform};
            const Transform& now = scene.at(mover.transform);
            wish.translation = now.translation + Vec3d(number(-1, 1), number(-1, 1), number(-1, 1));
            wish.rotation =
                frame % 3 == 0 ? Quatd(number(-1, 1), number(-1, 1), number(-1, 1), 1).normalized() : now.rotation;
            const StepResult result = scene.frame({wish});
            stopped += !result.stopped.empty();
            ASSERT_GT(least(), -1e-9) << "frame " << frame;
        }
        far += scene.at(mover.transform).translation.norm() > 2;
    }
    EXPECT_GT(stopped, 400);
    EXPECT_GT(far, 2);
}

TEST(Points, WhatRestsOnABallMaySlideAlongAndNotIn) {
    for (const std::int64_t response : {Interest::kStop, Interest::kSlide}) {
        ScanScene scene;
        const auto scan = scene.points({Vec3f(0, 0, 0), Vec3f(2, 0, 0)}, 1, Vec3d::Zero());
        const auto slab = scene.body(kRootNode, shapes::box(Vec3d(6, 0.5, 6)), Vec3d(0, 1.25, 0));  // on both balls
        scene.as(scan, CollisionObject::kPoints);
        scene.interest(slab.node, {}, response);
        StepResult result = scene.frame({scene.to(slab, Vec3d(0.7, 1.25, 0.3))});
        EXPECT_TRUE(result.stopped.empty());
        EXPECT_NEAR(scene.at(slab.transform).translation.x(), 0.7, 1e-9);
        result = scene.frame({scene.to(slab, Vec3d(0.7, 0.5, 0.3))});
        EXPECT_EQ(result.stopped.size(), 1u);
        EXPECT_NEAR(scene.at(slab.transform).translation.y(), 1.25, 2e-3);
        result = scene.frame({scene.to(slab, Vec3d(0.7, 3, 0.3))});
        EXPECT_TRUE(result.stopped.empty()) << "up is free";
    }
}

TEST(Points, WhatIsNotWhatItsObjectAsksForIsNamed) {
    ScanScene scene;
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    const auto scan = scene.points({Vec3f(0, 0, 0)}, 1, Vec3d(4, 0, 0));
    const auto cloth = scene.body(kRootNode, shapes::sheet(1, 1), Vec3d(0, 8, 0));
    scene.as(box, CollisionObject::kPoints);
    scene.as(scan, CollisionObject::kHeightField);
    scene.as(cloth, CollisionObject::kHull, 0, CollisionObject::kDeforming);
    scene.interest(box.node);
    scene.interest(scan.node);
    scene.interest(cloth.node);
    StepResult result = scene.frame();
    ASSERT_EQ(result.standIns.size(), 3u);
    EXPECT_EQ(result.counters.standIns, 3u);
    for (const StandIn& s : result.standIns) {
        EXPECT_EQ(s.taken, "triangles");
        EXPECT_EQ(s.asked, s.node == box.shape ? "points" : s.node == scan.shape ? "heightfield" : "hull");
    }
    scene.destroy(box.shape);
    result = scene.frame();
    EXPECT_EQ(result.standIns.size(), 2u);
}

TEST(Tolerance, OfTheTwoTheSmallerSaysHowNearAMotionStops) {
    for (const auto& [own, others, gap] :
         std::vector<std::array<double, 3>>{{0.1, 0, 0.1}, {0, 0.02, 0.02}, {0.1, 0.02, 0.02}}) {
        ScanScene scene;
        const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
        const auto wall = scene.body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
        scene.as(box, CollisionObject::kTriangles, own);
        scene.as(wall, CollisionObject::kTriangles, others);
        scene.interest(box.node);
        scene.frame({scene.to(box, Vec3d(9, 0, 0))});
        // Half of it is kept.
        EXPECT_NEAR(scene.at(box.transform).translation.x() + 0.5, 5 - 0.5 * gap, 0.05 * gap);
    }
}

}  // namespace
}  // namespace tessera
