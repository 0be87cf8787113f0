// CollisionObject.shape SPHERICAL_BEZIER in scenes that deform, from seeds: patches only reject, so frames are those of
// triangles.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "common/base/Workers.h"
#include "tests/unit/pipeline/SameResults.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// Balls that wave, among them one that is led about, and a box and a hull that rest.
struct PatchedWaves : SceneMaker {
    PatchedWaves(std::uint64_t seed, std::int64_t shape, Workers* workers = nullptr)
        : SceneMaker({}, workers), random(seed) {
        Interest fields;
        for (int i = 0; i < 6; ++i) {
            soups.push_back(i == 5       ? shapes::box(Vec3d(1, 1, 1))
                            : i % 2 == 0 ? shapes::sphere(1, 8, 12)
                                         : shapes::sphere(0.8, 6, 9));
            bodies.push_back(body(kRootNode, soups.back(), Vec3d(1.9 * i, 0.3 * (i % 2), 0)));
            CollisionObject object;
            object.node = bodies.back().node;
            object.kind = i < 4 ? CollisionObject::kDeforming : CollisionObject::kRigid;
            object.shape = i == 4 ? CollisionObject::kHull : shape;
            this->object(object);
            fields.object = bodies.back().node;
            fields.response = i == 5 ? Interest::kStop : Interest::kReport;
            fields.mode = i == 1 ? Interest::kDynamic : i == 2 ? Interest::kStatic : Interest::kPseudoDynamic;
            interest(fields);
        }
        Interest distance;
        distance.object = bodies[0].node;
        distance.against = bodies[2].node;
        distance.mode = Interest::kDistance;
        distance.threshold = 10;
        interest(distance);
    }
    double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    StepResult next() {
        for (std::size_t i = 0; i < 4; ++i) {
            if (number(0, 1) < 0.2) continue;
            shapes::Soup soup = soups[i];
            const double phase = number(0, 6), strength = number(0, 0.6);
            for (std::size_t k = 0; k < soup.positions.size(); k += 3)
                soup.positions[k] += static_cast<float>(strength * std::sin(4 * soup.positions[k + 1] + phase));
            const ObjectId geometry = aspect.get<Node>(bodies[i].shape)->core;
            if (number(0, 1) < 0.7) {
                set<Geometry>(geometry, fieldId<&Geometry::positions>,
                              Blob::of(std::span<const float>(soup.positions)));
                continue;
            }
            const std::size_t from = 3 * (random() % (soup.positions.size() / 6)), count = soup.positions.size() / 3;
            ChangeListBuilder b;
            b.setRange(geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>, from * sizeof(float),
                       Blob::of(std::span<const float>(soup.positions).subspan(from, count)));
            apply(b);
        }
        std::vector<TentativeTransform> wishes;
        for (const std::size_t i : {std::size_t{1}, std::size_t{5}}) {
            const Transform now = at(bodies[i].transform);
            TentativeTransform wish{.transform = bodies[i].transform,
                                    .translation = now.translation + Vec3d(number(-0.4, 0.4), number(-0.1, 0.1), 0)};
            wish.rotation = now.rotation;
            wish.scale = now.scale;
            wishes.push_back(wish);
        }
        return frame(wishes);
    }

    std::mt19937_64 random;
    std::vector<shapes::Soup> soups;
    std::vector<Body> bodies;
};

void expectAsTriangles(const StepResult& x, StepResult truth) {
    // Work is another; all that is told is not.
    truth.counters.boxTests = x.counters.boxTests;
    truth.counters.triangleTests = x.counters.triangleTests;
    expectEqual(x, truth);
    for (std::size_t i = 0; i < x.contacts.size(); ++i) {
        EXPECT_EQ(x.contacts[i].depth, truth.contacts[i].depth);
        EXPECT_EQ(x.contacts[i].error, 0);
    }
}

TEST(SphericalBezierShapes, FramesAreThoseOfTriangles) {
    std::size_t contacts = 0;
    std::uint64_t boxes = 0, boxesOfTriangles = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        PatchedWaves scene(seed, CollisionObject::kSphericalBezier), plain(seed, CollisionObject::kTriangles);
        for (int step = 0; step < 30; ++step) {
            SCOPED_TRACE("step " + std::to_string(step));
            const StepResult found = scene.next(), truth = plain.next();
            EXPECT_TRUE(found.standIns.empty());
            expectAsTriangles(found, truth);
            if (HasFailure()) return;
            contacts += found.contacts.size();
            boxes += found.counters.boxTests;
            boxesOfTriangles += truth.counters.boxTests;
        }
    }
    EXPECT_GT(contacts, 1000U);
    EXPECT_NE(boxes, boxesOfTriangles) << "patches have been asked";
}

TEST(SphericalBezierShapes, AreTheSameForAnyNumberOfThreads) {
    Workers three(3);
    PatchedWaves one(7, CollisionObject::kSphericalBezier), many(7, CollisionObject::kSphericalBezier, &three);
    for (int step = 0; step < 25; ++step) {
        expectEqual(one.next(), many.next());
        if (HasFailure()) FAIL() << "step " << step;
    }
}

TEST(SphericalBezierShapes, WhatIsNotStarShapedIsTakenAsTrianglesAndNamed) {
    SceneMaker scene;
    std::map<ObjectId, std::string> expected;
    shapes::Soup two = shapes::sphere(1, 6, 9);
    const std::size_t half = two.positions.size() / 3;
    for (std::size_t i = 0; i < 3 * half; ++i) two.positions.push_back(two.positions[i] + (i % 3 == 0 ? 3.0F : 0.0F));
    for (std::size_t i = 0, count = two.indices.size(); i < count; ++i)
        two.indices.push_back(two.indices[i] + static_cast<std::uint32_t>(half));
    ObjectId first;
    for (const std::int64_t kind : {CollisionObject::kRigid, CollisionObject::kDeforming})
        for (const bool suits : {false, true}) {
            const auto body = scene.body(kRootNode, suits ? shapes::box(Vec3d::Ones()) : two,
                                         Vec3d(9 * static_cast<double>(kind), suits ? 9 : 0, 0));
            if (!first) first = body.node;
            CollisionObject fields;
            fields.node = body.node;
            fields.kind = kind;
            fields.shape = CollisionObject::kSphericalBezier;
            scene.object(fields);
            if (!suits) expected[body.shape] = "spherical-bezier as triangles";
        }
    scene.interest(first);
    std::map<ObjectId, std::string> named;
    for (const StandIn& s : scene.frame().standIns)
        named[s.node] = std::string(s.asked) + " as " + std::string(s.taken);
    EXPECT_EQ(named, expected);
}

}  // namespace
}  // namespace tessera
