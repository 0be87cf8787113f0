// Spherical and distance fields in a scene: what is exact stays so, what is approximate says by how much; and surfaces
// that deform from frame to frame, beside pipelines that see each frame for the first time.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "common/base/Workers.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SameResults.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct FieldScene : SceneMaker {
    shapes::Soup ball = shapes::sphere(1, 16, 32);
    Body target = body(kRootNode, ball, Vec3d::Zero(), Quatd(0.9, 0.1, 0.3, -0.2).normalized());
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(1.9, 0.1, 0));
    ObjectId core;
    CollisionObject fields;

    explicit FieldScene(std::int64_t shape, double error = 0) {
        set<Transform>(target.transform, fieldId<&Transform::scale>, Vec3d(Vec3d::Constant(1.3)));
        fields.node = target.node;
        fields.shape = shape;
        fields.error = error;
        core = object(fields);
        interest(box.node, target.node, Interest::kStop);
        Interest distance;
        distance.object = box.node;
        distance.against = target.node;
        distance.mode = Interest::kDistance;
        distance.threshold = 10;
        interest(distance);
    }
    TentativeTransform boxTo(const Vec3d& where) {
        TentativeTransform wish{.transform = box.transform, .translation = where};
        wish.rotation = at(box.transform).rotation;
        wish.scale = at(box.transform).scale;
        return wish;
    }
};

TEST(SphericalShapes, MotionsStopAndTouchAsOfTriangles) {
    for (const auto& [shape, error] :
         {std::pair(CollisionObject::kSpherical, 0.0), std::pair(CollisionObject::kDistanceField, 5.0),
          std::pair(CollisionObject::kAutoShape, 2.0)}) {
        FieldScene exact(CollisionObject::kTriangles), scene(shape, error);
        for (const Vec3d& where : {Vec3d(2.5, 0.2, 0), Vec3d(-3, 0.1, 0), Vec3d(0.3, 4, 0.1), Vec3d(0.2, -4, 0)}) {
            const StepResult truth = exact.frame({exact.boxTo(where)}), found = scene.frame({scene.boxTo(where)});
            EXPECT_TRUE(found.standIns.empty());
            ASSERT_EQ(found.accepted.size(), truth.accepted.size());
            for (std::size_t i = 0; i < truth.accepted.size(); ++i)
                EXPECT_EQ(found.accepted[i].translation, truth.accepted[i].translation);
            ASSERT_EQ(found.contacts.size(), truth.contacts.size());
            for (std::size_t i = 0; i < truth.contacts.size(); ++i) {
                EXPECT_EQ(found.contacts[i].faceA, truth.contacts[i].faceA);
                EXPECT_EQ(found.contacts[i].depth, truth.contacts[i].depth);
                EXPECT_EQ(found.contacts[i].error, 0);
            }
        }
    }
}

TEST(SphericalShapes, DistancesSayTheirErrorAndAnotherOneIsRightInTheNextFrame) {
    FieldScene scene(CollisionObject::kTriangles);
    const PairDistance truth = scene.frame().distances.all().at(0);
    ASSERT_EQ(truth.error, 0);
    ASSERT_GT(truth.distance, 0.05);
    const double size = 1.3 * scene.ball.mesh().bounds().size().norm();
    for (const double percent : {1.0, 5.0, 2.0, 10.0}) {
        scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::shape>, CollisionObject::kDistanceField);
        scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::error>, percent);
        const PairDistance found = scene.frame().distances.all().at(0);
        EXPECT_GT(found.error, 0);
        EXPECT_LE(found.error, 0.01 * percent * size * 1.25);
        EXPECT_LE(std::abs(found.distance - truth.distance), found.error);
        EXPECT_EQ(found.faceA, Contact::kNoFace);
        EXPECT_NEAR((found.pointA - found.pointB).norm(), found.distance, 1e-6);
        scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::shape>, CollisionObject::kSpherical);
        EXPECT_EQ(scene.frame().distances.all().at(0).distance, truth.distance) << "and back";
    }
    // Nothing that may be within the threshold is missed.
    FieldScene coarse(CollisionObject::kDistanceField, 10);
    const StepResult seen = coarse.frame();
    EXPECT_LE(seen.distances.all().at(0).distance - seen.distances.all().at(0).error, truth.distance);
}

TEST(SphericalShapes, WhatCannotBeHadIsNamed) {
    SceneMaker scene;
    const shapes::Soup ball = shapes::sphere(1, 8, 16);
    std::map<ObjectId, std::pair<std::string, std::string>> expected;
    const auto place = [&](std::int64_t shape, double error, std::int64_t kind, std::int64_t level, const char* asked) {
        const auto body = scene.body(kRootNode, ball, Vec3d(5 * static_cast<double>(expected.size()), 0, 7));
        CollisionObject fields;
        fields.node = body.node;
        fields.shape = shape;
        fields.error = error;
        fields.kind = kind;
        fields.level = level;
        scene.object(fields);
        if (*asked != 0) expected[body.shape] = {asked, "triangles"};
        return body;
    };
    const auto first =
        place(CollisionObject::kDistanceField, 0.1, CollisionObject::kRigid, 0, "distance-field");  // too many places
    place(CollisionObject::kDistanceField, 0.01, CollisionObject::kRigid, 0, "distance-field");
    place(CollisionObject::kDistanceField, 0, CollisionObject::kDeforming, 0, "distance-field");
    place(CollisionObject::kSpherical, 0, CollisionObject::kDeforming, 0, "spherical");
    place(CollisionObject::kDistanceField, 0, CollisionObject::kRigid, 0, "");
    place(CollisionObject::kSpherical, 0, CollisionObject::kStatic, 0, "");
    place(CollisionObject::kAutoShape, 0.01, CollisionObject::kRigid, 0, "");  // exact will do
    scene.interest(first.node);
    const StepResult result = scene.frame();
    std::map<ObjectId, std::pair<std::string, std::string>> named;
    for (const StandIn& s : result.standIns) named[s.node] = {std::string(s.asked), std::string(s.taken)};
    EXPECT_EQ(named, expected);
}

/// Cloths and balls that wave, one that is moved, one that rests; from a seed.
struct Waving : SceneMaker {
    explicit Waving(std::uint64_t seed, Workers* workers = nullptr) : SceneMaker({}, workers), random(seed) {
        Interest fields;
        for (int i = 0; i < 5; ++i) {
            soups.push_back(i % 2 == 0 ? shapes::sphere(1, 8, 12) : shapes::sphere(0.8, 6, 9));
            bodies.push_back(body(kRootNode, soups.back(), Vec3d(1.7 * i, 0.2 * i, 0)));
            CollisionObject object;
            object.node = bodies.back().node;
            object.kind = i < 3 ? CollisionObject::kDeforming : CollisionObject::kRigid;
            object.shape = i == 3 ? CollisionObject::kHull : CollisionObject::kTriangles;
            this->object(object);
            fields.object = bodies.back().node;
            fields.response = i == 4 ? Interest::kStop : Interest::kReport;
            fields.mode = i == 1 ? Interest::kStatic : Interest::kPseudoDynamic;
            interest(fields);
        }
    }
    double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    StepResult next() {
        for (std::size_t i = 0; i < 3; ++i) {
            shapes::Soup soup = soups[i];
            const double phase = number(0, 6);
            for (std::size_t k = 0; k < soup.positions.size(); k += 3)
                soup.positions[k] += static_cast<float>(0.25 * std::sin(4 * soup.positions[k + 1] + phase));
            const ObjectId geometry = aspect.get<Node>(bodies[i].shape)->core;
            if (number(0, 1) < 0.7) {
                set<Geometry>(geometry, fieldId<&Geometry::positions>,
                              Blob::of(std::span<const float>(soup.positions)));
                continue;
            }
            // A range of it.
            const std::size_t from = 3 * (random() % (soup.positions.size() / 6)), count = soup.positions.size() / 3;
            ChangeListBuilder b;
            b.setRange(geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>, from * sizeof(float),
                       Blob::of(std::span<const float>(soup.positions).subspan(from, count)));
            apply(b);
        }
        const Transform now = at(bodies[4].transform);
        TentativeTransform wish{.transform = bodies[4].transform,
                                .translation = now.translation + Vec3d(number(-0.4, 0.3), 0, number(-0.1, 0.1))};
        wish.rotation = now.rotation;
        wish.scale = now.scale;
        return frame({wish});
    }

    std::mt19937_64 random;
    std::vector<shapes::Soup> soups;
    std::vector<Body> bodies;
};

TEST(SphericalShapes, WhatDeformsAgainAndAgainIsAsAtFirstSight) {
    std::size_t contacts = 0;
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Waving scene(seed);
        for (int step = 0; step < 30; ++step) {
            (void)scene.next();
            const StepResult resting = scene.frame();
            CollisionPipeline fresh;
            fresh.sceneChanged(scene.aspect, nullptr);
            const StepResult expected = fresh.step(scene.aspect, {}, {});
            ASSERT_EQ(resting.contacts.size(), expected.contacts.size()) << step;
            for (std::size_t i = 0; i < expected.contacts.size(); ++i) {
                const Contact &x = resting.contacts[i], &y = expected.contacts[i];
                ASSERT_TRUE(x.objectA == y.objectA && x.objectB == y.objectB && x.faceA == y.faceA &&
                            x.faceB == y.faceB)
                    << step;
                ASSERT_EQ(x.point, y.point) << step;
                ASSERT_EQ(x.normal, y.normal) << step;
            }
            contacts += expected.contacts.size();
            // Picks go to the surface as it is now.
            if (step % 4 != 3) continue;
            const Ray ray{Vec3d(0.3, 0.2, 9), Vec3d(0, 0, -1)};
            const auto picked = scene.pipeline.pickNode(scene.aspect, ray), truth = fresh.pickNode(scene.aspect, ray);
            ASSERT_EQ(picked.has_value(), truth.has_value());
            if (picked) {
                ASSERT_EQ(picked->point, truth->point);
            }
        }
    }
    EXPECT_GT(contacts, 1000U);
}

TEST(SphericalShapes, DeformingAgainAndAgainIsTheSameForAnyNumberOfThreads) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        Workers two(2), three(3);
        Waving one(seed), other(seed, &two), third(seed, &three);
        for (int step = 0; step < 25; ++step) {
            const StepResult expected = one.next();
            expectEqual(expected, other.next());
            expectEqual(expected, third.next());
            if (HasFailure()) FAIL() << "seed " << seed << ", step " << step;
        }
    }
}

}  // namespace
}  // namespace tessera
