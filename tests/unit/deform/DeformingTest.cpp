/// Control points that are bent, twisted and swollen, to and fro.
#include "client/deform/Deforming.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "client/deform/ControlPoints.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/scene/FieldTable.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

std::mt19937_64 randomOfThisRun(std::string& repeat, const std::string& filter) {
    const char* given = std::getenv("TESSERA_SEED");
    const std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : std::random_device()();
    repeat = "TESSERA_SEED=" + std::to_string(seed) + " unit_deform --gtest_filter=" + filter;
    return std::mt19937_64(seed);
}

std::vector<Vec3d> someBox(std::mt19937_64& random) {
    std::uniform_real_distribution<double> power(-6, 6), unit(0, 1);
    const Vec3d lower(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    const Vec3d size(std::pow(10, power(random)), std::pow(10, power(random)), std::pow(10, power(random)));
    std::vector<Vec3d> points;
    for (int i = 0; i < 40; ++i)
        points.push_back(lower + size.cwiseProduct(Vec3d(unit(random), unit(random), unit(random))));
    return points;
}

TEST(Deforming, IsReadFromWords) {
    const Expected<Deforming> bend = Deforming::parse("bend-x:-10..35:4:/garden/animal: the first");
    ASSERT_TRUE(bend) << bend.error().message;
    EXPECT_EQ(bend->kind, DeformingKind::kBend);
    EXPECT_EQ(bend->axis, 0);
    EXPECT_EQ(bend->from, -10);
    EXPECT_EQ(bend->to, 35);
    EXPECT_EQ(bend->seconds, 4);
    EXPECT_EQ(bend->node, "/garden/animal: the first") << "a node's name may hold anything";
    const Expected<Deforming> swell = Deforming::parse("swell:+2.5:0.5:#17");
    ASSERT_TRUE(swell) << swell.error().message;
    EXPECT_EQ(swell->axis, -1);
    EXPECT_EQ(swell->from, -2.5);
    EXPECT_EQ(swell->to, 2.5);
    for (const char* words : {"",
                              "bend",
                              "bend:1:2",
                              "bend:1:2:",
                              "fold:1:2:/a",
                              "bend-w:1:2:/a",
                              "bend-:1:2:/a",
                              "bend-xy:1:2:/a",
                              "bend:x:2:/a",
                              "bend:1..:2:/a",
                              "bend:..1:2:/a",
                              "bend:nan:2:/a",
                              "bend:inf:2:/a",
                              "bend:1e5:2:/a",
                              "bend:1:0:/a",
                              "bend:1:-2:/a",
                              "bend:1:nan:/a",
                              "bend:1:1e7:/a",
                              "Bend:1:2:/a",
                              " bend:1:2:/a"}) {
        const Expected<Deforming> refused = Deforming::parse(words);
        ASSERT_FALSE(refused) << words;
        EXPECT_EQ(refused.error().code, ErrorCode::kUsage) << words;
        EXPECT_WORDS(refused.error().message);
    }
}

TEST(Deforming, GoesToAndFro) {
    const Deforming both = *Deforming::parse("bend:30:4:/a"), between = *Deforming::parse("bend:-10..50:4:/a");
    EXPECT_EQ(both.amountAt(0), 0) << "begins at rest";
    EXPECT_NEAR(both.amountAt(1), 30, 1e-12);
    EXPECT_NEAR(both.amountAt(3), -30, 1e-12);
    EXPECT_NEAR(between.amountAt(0), -10, 1e-12);
    EXPECT_NEAR(between.amountAt(2), 50, 1e-12);
    for (double time = 0; time < 1e4; time += 1.37) {
        ASSERT_LE(std::abs(both.amountAt(time)), 30) << time;
        ASSERT_GE(between.amountAt(time), -10 - 1e-12) << time;
        ASSERT_LE(between.amountAt(time), 50 + 1e-12) << time;
    }
}

/// A bar along X, bent by a quarter turn: its middle line is a quarter of a circle, as long as it was.
TEST(Deformed, ABentLineIsAnArcOfItsLength) {
    std::vector<Vec3d> bar;
    for (int i = 0; i <= 100; ++i)
        for (const double y : {-1.0, 0.0, 1.0}) bar.emplace_back(5 + 0.1 * i, 2 + y, 0);
    const std::vector<Vec3d> bent = deformed(bar, DeformingKind::kBend, -1, 90);
    const double radius = 10 / (std::numbers::pi / 2);
    const Vec3d center(5, 2 + radius, 0);
    double length = 0;
    for (std::size_t i = 0; i < bent.size(); i += 3) {
        EXPECT_NEAR((bent[i] - center).norm(), radius + 1, 1e-12);
        EXPECT_NEAR((bent[i + 1] - center).norm(), radius, 1e-12);
        EXPECT_NEAR((bent[i + 2] - center).norm(), radius - 1, 1e-12);
        if (i > 0) length += (bent[i + 1] - bent[i - 2]).norm();
    }
    EXPECT_NEAR(length, 10, 10 * 1e-4) << "a hundred chords";
    EXPECT_TRUE(bent[1].isApprox(bar[1])) << "the lower end stays";
}

TEST(Deformed, TwistsAndSwellsAboutTheMiddleAlone) {
    const std::vector<Vec3d> bar{{1, 0, 1}, {-1, 0, -1}, {1, 10, 1}, {-1, 10, -1}, {1, 5, 0}, {0, 5, 0}};
    const std::vector<Vec3d> twisted = deformed(bar, DeformingKind::kTwist, 1, 90),
                             swollen = deformed(bar, DeformingKind::kSwell, 1, 50);
    EXPECT_TRUE(twisted[0].isApprox(bar[0]));
    EXPECT_NEAR(twisted[2].y(), 10, 1e-12);
    EXPECT_NEAR(twisted[2].dot(Vec3d(1, 0, 1)), 0, 1e-12) << "a quarter turn";
    EXPECT_NEAR(twisted[4].norm(), bar[4].norm(), 1e-12);
    EXPECT_LT((twisted[5] - bar[5]).norm(), 1e-12) << "the line in the middle stays";
    EXPECT_LT((swollen[2] - bar[2]).norm(), 1e-12) << "the ends stay";
    EXPECT_TRUE(swollen[4].isApprox(Vec3d(1.5, 5, 0)));
}

/// Whatever the box: by nothing nothing moves; a twist turns; nothing is lost in numbers.
TEST(Deformed, OfAnyBoxIsFiniteAndByNothingIsItself) {
    std::string repeat;
    std::mt19937_64 random = randomOfThisRun(repeat, "Deformed.*");
    SCOPED_TRACE(repeat);
    std::uniform_real_distribution<double> amounts(-1e4, 1e4), small(-1e-5, 1e-5);
    for (int round = 0; round < 300; ++round) {
        const std::vector<Vec3d> rest = someBox(random);
        double size = 0;
        for (const Vec3d& point : rest) size = std::max(size, (point - rest[0]).norm() + point.norm());
        for (const DeformingKind kind : {DeformingKind::kBend, DeformingKind::kTwist, DeformingKind::kSwell})
            for (int axis = -1; axis < 3; ++axis) {
                const std::vector<Vec3d> same = deformed(rest, kind, axis, 0),
                                         far = deformed(rest, kind, axis, amounts(random)),
                                         near = deformed(rest, kind, axis, small(random));
                ASSERT_EQ(far.size(), rest.size());
                for (std::size_t i = 0; i < rest.size(); ++i) {
                    ASSERT_LE((same[i] - rest[i]).norm(), 1e-14 * size);
                    ASSERT_TRUE(far[i].allFinite());
                    // An angle of 1e-5 degrees moves nothing by more than its arc over a box; a swelling of 1e-5 per
                    // cent by less.
                    ASSERT_LE((near[i] - rest[i]).norm(), 1e-6 * size);
                }
            }
    }
}

TEST(Deformed, WhatHasNoExtentStays) {
    const double nan = std::nan("");
    EXPECT_TRUE(deformed({}, DeformingKind::kBend, -1, 20).empty());
    const std::vector<Vec3d> one(5, Vec3d(1, 2, 3)), bad{Vec3d::Zero(), Vec3d(nan, 0, 0)},
        flat{Vec3d::Zero(), Vec3d::UnitX()};
    EXPECT_EQ(deformed(one, DeformingKind::kTwist, -1, 20), one);
    EXPECT_EQ(deformed(bad, DeformingKind::kTwist, -1, 20)[0], bad[0]);
    EXPECT_EQ(deformed(flat, DeformingKind::kBend, 1, 20), flat) << "it has no length along this axis";
    EXPECT_NE(deformed(flat, DeformingKind::kBend, 0, 20), flat);
}

/// A surface, a lattice at rest without points, and a box: the surface alone is led, by what it was when it was found.
TEST(ControlPointsOf, ASceneAreFoundAndLed) {
    Aspect scene;
    ChangeListBuilder builder;
    const ObjectId surface{100}, lattice{101}, node{102}, other{103}, both{104};
    const std::vector<float> points{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    builder.create(surface, typeOf<SubdivisionSurface>());
    builder.create(lattice, typeOf<Deformation>());
    for (const ObjectId id : {both, node, other}) builder.create(id, typeOf<Node>());
    builder.set(surface, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::points>,
                Blob::of(std::span<const float>(points)));
    builder.set(both, typeOf<Node>(), fieldId<&Node::name>, std::string("all"));
    builder.set(node, typeOf<Node>(), fieldId<&Node::core>, surface);
    builder.set(other, typeOf<Node>(), fieldId<&Node::core>, lattice);
    builder.place(both, kRootNode);
    builder.place(node, both);
    builder.place(other, both);
    ASSERT_TRUE(scene.apply(builder.take()));
    const Expected<std::vector<ControlPoints>> bodies = controlPointsBelow(scene, "/all");
    ASSERT_TRUE(bodies) << bodies.error().message;
    ASSERT_EQ(bodies->size(), 1u);
    EXPECT_EQ(bodies->front().rest.size(), 4u);
    EXPECT_EQ(bodies->front().rest[2], Vec3d(1, 1, 0));
    EXPECT_EQ(controlPointsBelow(scene, "/all/nobody").error().code, ErrorCode::kNotFound);

    ChangeListBuilder led;
    std::vector<Vec3d> moved = bodies->front().rest;
    moved[3].z() = 5;
    lead(led, scene, bodies->front(), moved);
    ASSERT_TRUE(scene.apply(led.take()));
    EXPECT_EQ(scene.get<SubdivisionSurface>(surface)->points.as<float>()[11], 5);

    moved.pop_back();
    lead(led, scene, bodies->front(), moved);
    EXPECT_TRUE(led.empty()) << "another number of points is another surface";
    lead(led, Aspect(), bodies->front(), bodies->front().rest);
    EXPECT_TRUE(led.empty()) << "it is gone";
}

}  // namespace
}  // namespace tessera
