// The row of smooth surfaces: every question, beside closed forms and beside exact trees of fine tessellations.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>

#include "common/freeform/subdivision/LimitTessellation.h"
#include "common/math/Compose.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/FreeformPairs.h"
#include "server/collision/pairwise/PairTable.h"
#include "tests/unit/freeform_query/SmoothBodies.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using SmoothShape = std::shared_ptr<CollisionShape>;
using bodies::anyRotation;
using bodies::between;
using bodies::inCube;
using bodies::Random;

std::uint64_t freeformSeeds(std::uint64_t count, std::uint64_t& first) {
    first = 0;
    if (const char* only = std::getenv("TESSERA_SEED")) {
        first = std::strtoull(only, nullptr, 10);
        return first + 1;
    }
    return count;
}

std::string repeatFreeform(std::uint64_t seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_pairwise --gtest_filter=FreeformPairs.*";
}

/// The sphere itself; drawn as few triangles.
SmoothShape smoothBall(double radius, double error) {
    return CollisionShape::ofFreeform(test::sphere(radius), bodies::meshOf(shapes::sphere(radius, 8, 12)), error);
}

/// As it is drawn: closed, on grids of 2^level.
TriangleMesh drawnOf(const ControlMesh& control, int level) {
    const std::shared_ptr<const LimitTessellation> tessellation = LimitTessellation::build(control, level).value();
    std::vector<float> points, positions(3 * tessellation->vertexCount()), normals(positions.size());
    for (const Vec3d& p : control.positions)
        for (const double x : {p.x(), p.y(), p.z()}) points.push_back(static_cast<float>(x));
    tessellation->evaluate(points, positions, normals);
    // Creases have vertices at one place: one of them will do.
    std::map<std::array<float, 3>, std::uint32_t> first;
    std::vector<std::uint32_t> indices;
    for (const std::uint32_t v : tessellation->indices())
        indices.push_back(
            first.try_emplace({positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]}, v).first->second);
    return TriangleMesh::make(std::span<const float>(positions), indices).value();
}

SmoothShape smoothBody(const ControlMesh& control, double error) {
    return CollisionShape::ofFreeform(FreeformShape::ofSubdivision(control).value(), drawnOf(control, 2), error);
}

/// A map that keeps angles, and what it makes of a ball around the origin.
struct PlacedBall {
    Affine3d world;
    Vec3d centre;
    double radius;
};
PlacedBall placedBall(Random& random, const Vec3d& at, double radius) {
    const double scale = std::pow(10, between(random, -2, 2));
    return {composeTransform(at, anyRotation(random), Vec3d::Constant(scale)), at, radius * scale};
}

/// From the middle of a box that is not in the ball, and whose middle is not: how far the two are apart, below 0 where
/// they overlap.
double ballFromBox(const Vec3d& centre, double radius, const Vec3d& half) {
    return (centre.cwiseAbs() - half).cwiseMax(0).norm() - radius;
}

TEST(FreeformPairs, OfBallsIsTheirClosedForm) {
    std::uint64_t first = 0;
    int met = 0, apart = 0, deep = 0;
    for (std::uint64_t end = freeformSeeds(30, first), seed = first; seed < end; ++seed) {
        SCOPED_TRACE(repeatFreeform(seed));
        Random random(seed);
        const double error = std::pow(10, between(random, -6, -2));
        const SmoothShape a = smoothBall(1, error), b = smoothBall(0.6, 3 * error);
        const PlacedBall ballA = placedBall(random, inCube(random, 3), 1);
        PlacedBall ballB = placedBall(random, Vec3d::Zero(), 0.6);
        const double reach = ballA.radius + ballB.radius, least = std::abs(ballA.radius - ballB.radius);
        const bool touches = seed % 2 == 0;
        const Vec3d along = inCube(random, 1).normalized();
        const double between_ =
            touches ? between(random, least, reach) : reach * (1 + std::pow(10, between(random, -4, 0)));
        ballB.centre = ballA.centre + between_ * along;
        ballB.world.translation() = ballB.centre;
        const PlacedShape placedA{*a, ballA.world}, placedB{*b, ballB.world};
        const double tolerance = touchError(placedA, placedB), gap = between_ - reach;
        ASSERT_GT(tolerance, 0);
        ASSERT_LE(tolerance, 4 * error * 3.6 * std::max(ballA.radius, ballB.radius));
        QueryWork work;
        const PairTouch touch = touchOf(placedA, placedB, {work}), all = contactsOf(placedA, placedB, 1000, {work});
        const WorldDistance distance = distanceInWorld(placedA, placedB, {}, work);
        ASSERT_TRUE(touch.complete && all.complete && distance.complete);
        if (touches) {
            ++met;
            ASSERT_EQ(touch.touch, Touch::kYes);
            ASSERT_EQ(all.touch, Touch::kYes);
            ASSERT_EQ(distance.distance, 0);
            ASSERT_LE(distance.error, tolerance);
        } else if (gap > tolerance) {
            ++apart;
            ASSERT_EQ(touch.touch, Touch::kNo);
            ASSERT_EQ(all.touch, Touch::kNo);
            ASSERT_GE(gap, distance.distance - distance.error - 1e-12 * reach);
            ASSERT_LE(gap, distance.distance + 1e-12 * reach);
            ASSERT_LE(distance.error, 1.0001 * tolerance + 1e-12 * reach);
            ASSERT_NEAR((distance.pointA - distance.pointB).norm(), distance.distance, 1e-9 * reach);
            ASSERT_TRUE(distanceInWorld(placedA, placedB, {.upperBound = 0.9 * gap}, work).farther);
        }
        // What motions ask: a gap that is proven, and where it is.
        const double proven = freeform_pairs::provenGap(placedA, placedB, 10 * reach, work);
        if (touches) {
            ASSERT_EQ(proven, 0);
            ASSERT_EQ(freeform_pairs::meeting(placedA, placedB, work), Touch::kYes);
        } else if (gap > tolerance) {
            ASSERT_LE(proven, gap + 1e-12 * reach);
            ASSERT_GE(proven, std::min(0.49 * gap, 10 * reach));
            ASSERT_EQ(freeform_pairs::meeting(placedA, placedB, work), Touch::kNo);
            const auto nearest = freeform_pairs::nearestPlaces(placedA, placedB, work);
            ASSERT_TRUE(nearest);
            ASSERT_NEAR(nearest->distance, gap, 1e-5 * gap + 1e-9 * reach);
            ASSERT_GT(nearest->place.normal.dot(along), 0.99);
            ASSERT_EQ(nearest->place.onA.face, 0U);
            ASSERT_LE((ballA.world * evaluate(a->smoothSurface()->nurbs()->surfaces[0], nearest->place.onA.uv.x(),
                                              nearest->place.onA.uv.y())
                                         .at.point -
                       nearest->place.point)
                          .norm(),
                      0.51 * gap + 1e-6 * reach);
        }
        for (const PairTouch* told : {&touch, &all}) {
            ASSERT_EQ(told->faces.size(), told->places.size());
            ASSERT_TRUE(std::ranges::is_sorted(told->faces));
            for (std::size_t i = 0; i < told->places.size(); ++i) {
                const MeetingPlace& place = told->places[i];
                ASSERT_NEAR((place.point - ballA.centre).norm(), ballA.radius, tolerance);
                ASSERT_NEAR((place.point - ballB.centre).norm(), ballB.radius, tolerance);
                ASSERT_NEAR(place.normal.norm(), 1, 1e-9);
                ASSERT_GT(place.normal.dot(along), -1e-6);
                // The triangle that is drawn there: no farther than its ball is from its chords.
                for (const auto& [placed, face, radius] : {std::tuple(placedA, told->faces[i].a, ballA.radius),
                                                           std::tuple(placedB, told->faces[i].b, ballB.radius)}) {
                    ASSERT_LT(face, placed.shape.faceCount());
                    const Triangle t = transformed(placed.world, placed.shape.triangle(face));
                    ASSERT_LE((t[0] - place.point).norm(), 1.2 * radius);
                }
            }
        }
        // The other way round.
        const PairTouch back = contactsOf(placedB, placedA, 1000, {work});
        ASSERT_EQ(back.touch, all.touch);
        if (!back.places.empty()) {
            ASSERT_LE(back.places.front().normal.dot(along), 1e-6);
        }

        const PairDepth depth = depthOf(placedA, placedB, work);
        ASSERT_TRUE(depth.depth);
        if (touches && gap<-0.05 * reach&& * depth.depth> 0) {
            ++deep;
            // Along that normal it is apart for good where the centres are as far apart as the radii say.
            const Vec3d c = ballB.centre - ballA.centre, &n = depth.normal;
            const double half = c.dot(n), truth = -half + std::sqrt(half * half - c.squaredNorm() + reach * reach);
            ASSERT_LE(truth, *depth.depth + 1e-9 * reach);
            ASSERT_GE(truth, *depth.depth - depth.error - 1e-9 * reach);
            ASSERT_LE(depth.error, 64 * tolerance + 1e-9 * reach);
        } else if (!touches && gap > tolerance) {
            ASSERT_EQ(*depth.depth, 0);
        }

        if (touches || gap < 4 * tolerance) continue;
        BodyMotion rest, way;
        rest.body_T_mesh = ballA.world;
        way.body_T_mesh = ballB.world;
        way.end.translation = -2 * gap * along;
        const Impact hit = pairMethods(*a, *b).firstContact(*a, rest, *b, way, work, {.tolerance = tolerance});
        ASSERT_TRUE(hit.hit && hit.complete);
        ASSERT_LE(hit.t, 0.5 + 1e-9);
        ASSERT_GE(hit.t, 0.5 - 0.5 * tolerance / gap - 1e-6);
        ASSERT_LE(hit.distance, tolerance);
        ASSERT_GT(hit.normal.dot(along), 0.99);
        ASSERT_LT(hit.faces.a, a->faceCount());
        way.end.translation = 2 * gap * along;
        ASSERT_FALSE(pairMethods(*a, *b).firstContact(*a, rest, *b, way, work, {.tolerance = tolerance}).hit);
    }
    if (std::getenv("TESSERA_SEED") == nullptr) {
        EXPECT_GT(met, 10);
        EXPECT_GT(apart, 8);
        EXPECT_GT(deep, 5);
    }
}

TEST(FreeformPairs, BesideBoxesOfEveryRepresentationAreAsFarAsTheirFacesAre) {
    std::uint64_t first = 0;
    int met = 0, apart = 0, within = 0;
    for (std::uint64_t end = freeformSeeds(24, first), seed = first; seed < end; ++seed) {
        Random random(seed);
        const double error = std::pow(10, between(random, -6, -3));
        const SmoothShape ball = smoothBall(0.5, error);
        Vec3d half(between(random, 0.3, 1), between(random, 0.3, 1), between(random, 0.3, 1));
        half = half.cast<float>().cast<double>();  // as meshes have it
        const TriangleMesh box = bodies::meshOf(shapes::box(2 * half));
        const std::pair<const char*, SmoothShape> others[] = {
            {"triangles", CollisionShape::ofTriangles(box)},
            {"hull", CollisionShape::ofHull(box)},
            {"spherical", CollisionShape::ofSphericalField(box)},
            {"distance field", CollisionShape::ofDistanceField(TriangleMesh(box), 0.05).value()}};
        const Affine3d boxWorld =
            composeTransform(inCube(random, 5), anyRotation(random), Vec3d::Constant(between(random, 0.1, 10)));
        // Outside, or (of a solid) inside.
        const bool inside = seed % 6 == 5;
        const Vec3d centre = inside ? Vec3d::Zero() : Vec3d(inCube(random, 2.2));
        const double shrink = inside ? 0.2 * half.minCoeff() / 0.5 : 1, radius = 0.5 * shrink;
        if (!inside && (centre.cwiseAbs().array() < half.array()).all()) continue;
        const Affine3d ballWorld = boxWorld * composeTransform(centre, anyRotation(random), Vec3d::Constant(shrink));
        const double scale = similarityScale(boxWorld).value(), gap = scale * ballFromBox(centre, radius, half);
        for (const auto& [name, other] : others) {
            SCOPED_TRACE(repeatFreeform(seed) + " " + name);
            const PlacedShape a{*ball, ballWorld}, b{*other, boxWorld};
            ASSERT_EQ(pairMethods(*ball, *other).byTrees, kNoQuestion);
            QueryWork work;
            const double tolerance = touchError(a, b);
            const Touch touch = touchOf(a, b, {work}).touch, back = touchOf(b, a, {work}).touch;
            const PairTouch all = contactsOf(b, a, 100, {work});
            const WorldDistance distance = distanceInWorld(b, a, {}, work);
            if (inside) {
                ++within;
                const bool solid = other->hull() != nullptr;
                ASSERT_EQ(touch, solid ? Touch::kYes : Touch::kNo);
                ASSERT_EQ(all.touch, touch);
                ASSERT_EQ(distance.distance == 0, solid);
                if (solid) {
                    ASSERT_TRUE(all.faces.empty());
                    ASSERT_EQ(all.count, 1U);
                } else {
                    ASSERT_NEAR(distance.distance, scale * (half.minCoeff() - radius), distance.error + 1e-9);
                }
                continue;
            }
            if (gap < 0) {
                ++met;
                ASSERT_EQ(touch, Touch::kYes);
                ASSERT_EQ(back, Touch::kYes);
                ASSERT_EQ(all.touch, Touch::kYes);
                ASSERT_EQ(distance.distance, 0);
            } else if (gap > tolerance) {
                ++apart;
                ASSERT_EQ(touch, Touch::kNo);
                ASSERT_EQ(back, Touch::kNo);
                ASSERT_EQ(all.touch, Touch::kNo);
                ASSERT_GE(gap, distance.distance - distance.error - 1e-9);
                ASSERT_LE(gap, distance.distance + 1e-9);
            }
            for (std::size_t i = 0; i < all.places.size(); ++i) {
                const Vec3d inBox = boxWorld.inverse() * all.places[i].point;
                ASSERT_NEAR((inBox - centre).norm(), radius, tolerance / scale + 1e-9);
                ASSERT_NEAR((inBox.cwiseAbs() - half).maxCoeff(), 0, tolerance / scale + 1e-9);
                ASSERT_LT(all.faces[i].a, 12U);
            }
        }
    }
    if (std::getenv("TESSERA_SEED") == nullptr) {
        EXPECT_GT(met, 10);
        EXPECT_GT(apart, 20);
        EXPECT_GT(within, 8);
    }
}

TEST(FreeformPairs, OfSubdivisionSurfacesAreWithinTheirErrorOfFineTessellations) {
    std::uint64_t first = 0;
    int apart = 0, met = 0;
    for (std::uint64_t end = freeformSeeds(10, first), seed = first; seed < end; ++seed) {
        SCOPED_TRACE(repeatFreeform(seed));
        test::Chance chance(seed);
        Random random(seed);
        ControlMesh controlA = test::lumpyCube(chance, 2, 0.3),
                    controlB = test::lumpyCube(chance, 1 + static_cast<int>(seed % 2), 0.3);
        if (seed % 3 == 1) controlA = test::asTriangles(controlA);
        const SmoothShape a = smoothBody(controlA, 1e-4), b = smoothBody(controlB, 1e-4);
        const SmoothShape treeA = CollisionShape::ofTriangles(drawnOf(controlA, 4)),
                          treeB = CollisionShape::ofTriangles(drawnOf(controlB, 4));
        const double offA = test::tessellate(controlA, 16).error + 1e-6,
                     offB = test::tessellate(controlB, 16).error + 1e-6;  // and floats
        for (int pose = 0; pose < 4; ++pose) {
            const bool stretched = pose == 3;
            const Affine3d here = composeTransform(inCube(random, 2), anyRotation(random),
                                                   stretched ? Vec3d(0.8, 1.3, 1) : Vec3d(Vec3d::Ones()));
            const Affine3d there =
                here *
                composeTransform(between(random, 0.9, 2.4) * inCube(random, 1).normalized(), anyRotation(random),
                                 stretched ? Vec3d(1.2, 1, 0.7) : Vec3d(Vec3d::Constant(between(random, 0.5, 1.2))));
            const PlacedShape placedA{*a, here}, placedB{*b, there}, trueA{*treeA, here}, trueB{*treeB, there};
            const double off = 1.3 * (1.3 * offA + 1.3 * 1.2 * offB), tolerance = touchError(placedA, placedB);
            QueryWork work;
            const WorldDistance found = distanceInWorld(placedA, placedB, {}, work),
                                truth = distanceInWorld(trueA, trueB, {}, work);
            const Touch touch = touchOf(placedA, placedB, {work}).touch;
            ASSERT_TRUE(found.complete);
            ASSERT_GE(truth.distance + off, found.distance - found.error);
            ASSERT_LE(truth.distance - off, found.distance);
            ASSERT_LE(found.error, 3 * tolerance);
            if (truth.distance > tolerance + off) {
                ++apart;
                ASSERT_EQ(touch, Touch::kNo);
                continue;
            }
            // What is told of a pair that surely meets.
            const PairDepth depth = depthOf(trueA, trueB, work);
            if (!depth.depth || *depth.depth < 4 * off) continue;
            ++met;
            ASSERT_EQ(touch, Touch::kYes);
            const PairTouch all = contactsOf(placedA, placedB, 10'000, {work});
            ASSERT_EQ(all.touch, Touch::kYes);
            ASSERT_EQ(found.distance, 0);
            // Every place is on both, as far as these tell.
            for (const MeetingPlace& place : all.places)
                for (const PlacedShape* of : {&trueA, &trueB}) {
                    const std::array<Vec3d, 1> here_{place.point};
                    const SmoothShape point = CollisionShape::ofPoints(here_, 1e-9).value();
                    ASSERT_LE(distanceInWorld({*point, Affine3d::Identity()}, *of, {}, work).distance,
                              off + tolerance + 1e-8);
                }
            // And the depth is what they have to go, as far as these tell.
            const PairDepth smooth = depthOf(placedA, placedB, work);
            ASSERT_TRUE(smooth.depth);
            const auto gone = [&](double way) {
                Affine3d out = there;
                out.translation() += way * smooth.normal;
                return out;
            };
            const Affine3d free = gone(*smooth.depth + 2 * off),
                           still = gone(std::max(0.0, *smooth.depth - smooth.error - 2 * off));
            ASSERT_EQ(touchOf(trueA, {*treeB, free}, {work}).touch, Touch::kNo);
            ASSERT_LE(distanceInWorld(trueA, {*treeB, still}, {}, work).distance, off);
        }
    }
    if (std::getenv("TESSERA_SEED") == nullptr) {
        EXPECT_GT(apart, 4);
        EXPECT_GT(met, 8);
    }
}

TEST(FreeformPairs, WhatMovesIsAsIfMadeAnew) {
    std::uint64_t first = 0;
    for (std::uint64_t end = freeformSeeds(6, first), seed = first; seed < end; ++seed) {
        SCOPED_TRACE(repeatFreeform(seed));
        test::Chance chance(seed);
        ControlMesh control = test::lumpyCube(chance, 2, 0.2);
        const SmoothShape moving = smoothBody(control, 1e-4), ball = smoothBall(0.7, 1e-4);
        const SmoothShape box = CollisionShape::ofTriangles(bodies::meshOf(shapes::box(Vec3d(1, 1, 1))));
        moving->setDeforms();
        const Affine3d here = Affine3d::Identity();
        for (int step = 0; step < 4; ++step) {
            const std::size_t from = chance.engine() % control.positions.size(),
                              count = 1 + chance.engine() % (control.positions.size() - from);
            for (std::size_t i = from; i < from + count; ++i) control.positions[i] += 0.2 * chance.direction();
            const TriangleMesh drawn = drawnOf(control, 2);
            const std::vector<Vec3d> corners(drawn.positions().begin(), drawn.positions().end());
            ASSERT_TRUE(moving->move(corners));
            ASSERT_TRUE(moving->moveControlPoints(from, std::span(control.positions).subspan(from, count)));
            const SmoothShape fresh = smoothBody(control, 1e-4);
            ASSERT_EQ(moving->bounds().lower, fresh->bounds().lower);
            ASSERT_EQ(moving->bounds().upper, fresh->bounds().upper);
            ASSERT_EQ(moving->freeformTolerance(), fresh->freeformTolerance());
            for (const SmoothShape& other : {ball, box}) {
                const Affine3d there(Eigen::Translation3d(chance.uniform(0.8, 2.2) * chance.direction()));
                QueryWork work;
                const PlacedShape a{*moving, here}, b{*other, there}, f{*fresh, here};
                const WorldDistance found = distanceInWorld(a, b, {}, work), expected = distanceInWorld(f, b, {}, work);
                ASSERT_NEAR(found.distance, expected.distance, found.error + expected.error);
                const double tolerance = touchError(a, b);
                if (found.distance == 0 || found.distance > 2 * tolerance) {
                    ASSERT_EQ(contactsOf(a, b, 100, {work}).touch == Touch::kYes, found.distance == 0);
                }
            }
            // A mesh that is asked beside it follows its own moves.
            std::vector<Vec3d> grown;
            for (const Vec3d p : box->mesh().positions()) grown.push_back(1.1 * p);
            ASSERT_TRUE(box->move(grown));
            ASSERT_EQ(box->freeform().bounds().upper, box->mesh().bounds().upper);
        }
        std::vector<Vec3d> none(control.positions.size(), Vec3d::Constant(std::nan("")));
        const Box before = moving->bounds();
        ASSERT_FALSE(moving->moveControlPoints(0, none));
        ASSERT_EQ(moving->bounds().upper, before.upper);
    }
}

TEST(FreeformPairs, BesidePointsAndGridsTheirTrianglesAnswer) {
    Random random(4);
    const SmoothShape ball = smoothBall(1, 1e-4), triangles = CollisionShape::ofTriangles(TriangleMesh(ball->mesh()));
    std::vector<Vec3d> cloud;
    for (int i = 0; i < 40; ++i) cloud.push_back(inCube(random, 1));
    const SmoothShape points = CollisionShape::ofPoints(cloud, 0.1).value();
    const SmoothShape field = CollisionShape::ofHeightField(bodies::roughGround(random, 9, 0.5, 0.3)).value();
    for (int pose = 0; pose < 20; ++pose) {
        const Affine3d here = composeTransform(inCube(random, 2), anyRotation(random), Vec3d::Ones()),
                       there = Affine3d::Identity();
        for (const SmoothShape& other : {points, field}) {
            QueryWork work;
            ASSERT_EQ(pairMethods(*ball, *other).byTrees, kEveryQuestion);
            ASSERT_EQ(touchError({*ball, here}, {*other, there}), 0);
            const PairTouch found = contactsOf({*ball, here}, {*other, there}, 100, {work}),
                            truth = contactsOf({*triangles, here}, {*other, there}, 100, {work});
            ASSERT_EQ(found.faces, truth.faces);
            ASSERT_EQ(distanceInWorld({*ball, here}, {*other, there}, {}, work).distance,
                      distanceInWorld({*triangles, here}, {*other, there}, {}, work).distance);
        }
        // Motions are stopped by the triangles of both.
        const PlacedShape a{*ball, here}, b{*ball, there}, trueA{*triangles, here}, trueB{*triangles, there};
        QueryWork work;
        ASSERT_EQ(surfaceFacesTouching(a, b, work).pairs, surfaceFacesTouching(trueA, trueB, work).pairs);
        ASSERT_EQ(drawnTouching(a, b, work), touchOf(trueA, trueB, {work}).touch);
    }
}

TEST(FreeformPairs, WorkThatEndsIsSaid) {
    const SmoothShape a = smoothBall(1, 1e-6), b = smoothBall(1, 1e-6);
    const Affine3d here = Affine3d::Identity(), apart(Eigen::Translation3d(2.1, 0.3, 0)),
                   near(Eigen::Translation3d(1.9, 0.1, 0));
    QueryWork all;
    const double truth = distanceInWorld({*a, here}, {*b, apart}, {}, all).distance;
    int cut = 0;
    for (std::uint64_t limit = 0; limit < 200; limit += 9) {
        QueryWork work{.limit = limit}, other{.limit = limit}, third{.limit = limit};
        const WorldDistance found = distanceInWorld({*a, here}, {*b, apart}, {}, work);
        if (!found.complete) {
            ++cut;
            ASSERT_LE(found.distance, truth);
        }
        const PairTouch touch = contactsOf({*a, here}, {*b, near}, 10, {other});
        ASSERT_NE(touch.touch, Touch::kNo);
        ASSERT_TRUE(touch.complete || other.exhausted());
        const PairDepth depth = depthOf({*a, here}, {*b, near}, third);
        ASSERT_TRUE(!depth.depth || *depth.depth > 0);
    }
    EXPECT_GT(cut, 0);
}

TEST(FreeformPairs, QuestionsAboutSurfacesThatRunAlongEachOtherEnd) {
    // One ball within another, about one centre: everything is as near. Within a ten-millionth of the size that cannot
    // be told in any time; what is told says how far off it may be.
    const Affine3d here = Affine3d::Identity();
    const SmoothShape outer = smoothBall(1, 1e-9), inner = smoothBall(0.7, 1e-9);
    QueryWork work;
    const WorldDistance apart = distanceInWorld({*outer, here}, {*inner, here}, {}, work);
    EXPECT_TRUE(apart.complete);
    EXPECT_LE(apart.error, 0.01);
    EXPECT_NEAR(apart.distance, 0.3, apart.error + 1e-9);
    EXPECT_EQ(touchOf({*outer, here}, {*inner, here}, {work}).touch, Touch::kNo);
    // The same ball: they touch everywhere.
    const SmoothShape same = smoothBall(1, 1e-9);
    EXPECT_EQ(touchOf({*outer, here}, {*same, here}, {work}).touch, Touch::kYes);
    EXPECT_FALSE(contactsOf({*outer, here}, {*same, here}, 100, {work}).faces.empty());
    (void)depthOf({*outer, here}, {*same, here}, work);
    // A million tests of parts or so, each counted as some of boxes: no scene's step has more than 30 million.
    EXPECT_LT(work.boxTests, 60'000'000U);
}

TEST(FreeformPairs, AnEmptyMeshMeetsNothing) {
    const SmoothShape ball = smoothBall(1, 1e-4), none = CollisionShape::ofTriangles(TriangleMesh());
    const Affine3d here = Affine3d::Identity();
    for (const auto& [a, b] : {std::pair(ball, none), std::pair(none, ball)}) {
        const PlacedShape placedA{*a, here}, placedB{*b, here};
        QueryWork work;
        EXPECT_EQ(touchOf(placedA, placedB, {work}).touch, Touch::kNo);
        EXPECT_EQ(contactsOf(placedA, placedB, 10, {work}).touch, Touch::kNo);
        EXPECT_TRUE(distanceInWorld(placedA, placedB, {}, work).farther);
        EXPECT_EQ(depthOf(placedA, placedB, work).depth, 0.0);
        EXPECT_FALSE(pairMethods(*a, *b).firstContact(*a, {}, *b, {}, work, {}).hit);
    }
}

}  // namespace
}  // namespace tessera
