// Smooth surfaces in a scene, looked at as themselves: contacts and distances beside the pair table's own, motions
// beside triangles, edits of control points beside pipelines that see them for the first time.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "common/drawable/Drawable.h"
#include "server/collision/objects/ShapeCache.h"
#include "server/collision/pairwise/PairTable.h"
#include "tests/unit/drawable/ControlCube.h"
#include "tests/unit/pipeline/SmoothScene.h"

namespace tessera {
namespace {

TEST(FreeformShapes, OfANurbsBallAreItsClosedFormNotThatOfItsTriangles) {
    NurbsSurfaceCore ball = ballCore(1);
    ball.tolerance = 0.05;  // few triangles
    for (const std::int64_t kind : {CollisionObject::kRigid, CollisionObject::kDeforming})
        for (const double percent : {0.0, 0.001, 1.0}) {
            SmoothScene scene(ball, smoothObject(kind, percent));
            const double tolerance = (percent > 0 ? 0.01 * percent : 1e-4) * std::sqrt(12.0);
            for (const Vec3d& at : {Vec3d(0.3, 1.7, 0.1), Vec3d(1.6, 1.1, 0.9), Vec3d(0.1, -1.52, 0.2),
                                    Vec3d(1.3, 0.2, 0.4), Vec3d(0.2, 0.1, 1.4999)}) {
                const StepResult found = scene.boxAt(at);
                EXPECT_TRUE(found.standIns.empty());
                const double gap = boxFromBall(at, 1);
                const PairDistance distance = found.distances.all().at(0);
                if (gap > tolerance) {
                    EXPECT_TRUE(found.contacts.empty());
                    EXPECT_LE(std::abs(distance.distance - gap), distance.error + 1e-9);
                    EXPECT_LE(distance.error, 1.01 * tolerance);
                    EXPECT_EQ(distance.faceA, Contact::kNoFace);
                    EXPECT_NEAR((distance.pointA - distance.pointB).norm(), distance.distance, 1e-9);
                } else if (gap < 0) {
                    ASSERT_FALSE(found.contacts.empty());
                    EXPECT_EQ(distance.distance, 0);
                    for (const Contact& c : found.contacts.all()) {
                        EXPECT_NEAR(c.point.norm(), 1, tolerance);
                        EXPECT_NEAR((c.point - at).cwiseAbs().maxCoeff(), 0.5, tolerance);
                        EXPECT_GT(c.error, 0);
                        EXPECT_LE(c.error, 1.1 * tolerance);
                        EXPECT_EQ(c.depth, Contact::kNoDepth);
                        EXPECT_LT(c.normal.dot(at), 0.1) << "from the box to the ball";
                        EXPECT_EQ(c.patchA, Contact::kNoFace) << "the box is looked at by its triangles";
                        ASSERT_EQ(c.patchB, 0U) << "the surface";
                        EXPECT_LE(
                            (evaluate(sphereSurface(1).value(), c.patchUvB.x(), c.patchUvB.y()).at.point - c.point)
                                .norm(),
                            tolerance);
                    }
                }
            }
        }
}

/// What is asked of the surface after its points have moved, in ranges, is what a pipeline says that sees it so for the
/// first time. Within the errors: boxes that follow are not the boxes that are made anew.
TEST(FreeformShapes, FollowTheirControlPoints) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 0, last = one ? first : 9;
    std::size_t touching = 0, apart = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << "TESSERA_SEED=" << seed << " build/bin/unit_pipeline --gtest_filter=FreeformShapes.*");
        std::mt19937_64 random(seed);
        SubdivisionSurface fields = test::controlGrid(1 + static_cast<std::uint32_t>(random() % 3));
        fields.level = 1 + static_cast<std::int64_t>(random() % 3);
        SmoothScene scene(fields, smoothObject(seed % 3 ? CollisionObject::kDeforming : CollisionObject::kRigid));
        scene.frame();
        for (int step = 0; step < 8; ++step) {
            const std::size_t floats = scene.aspect.get<SubdivisionSurface>(scene.surface)->points.sizeBytes() / 4,
                              at = random() % floats;
            std::vector<float> moved(1 + random() % std::min<std::size_t>(9, floats - at));
            for (float& x : moved) x = static_cast<float>(static_cast<double>(random() % 3000) / 1000 - 1.5);
            // Now and then two edits in one frame, and a pose besides.
            scene.move(at, moved);
            if (random() % 3 == 0) scene.move(random() % (floats - 3), std::vector<float>{0.4F, -0.3F});
            if (random() % 2 == 0)
                scene.commit({.transform = scene.box.transform,
                              .translation = Vec3d(0.2, 0.9 + 0.1 * static_cast<double>(random() % 10), 0)});
            (void)scene.frame();
            const StepResult result = scene.frame();
            CollisionPipeline anew;
            anew.sceneChanged(scene.aspect, nullptr);
            const StepResult expected = anew.step(scene.aspect, {}, {});
            const PairDistance found = result.distances.all().at(0), truth = expected.distances.all().at(0);
            ASSERT_NEAR(found.distance, truth.distance, found.error + truth.error + 1e-12);
            const double tolerance = 1e-4 * 20;
            (found.distance > 0 ? apart : touching) += 1;
            if (found.distance == 0 || found.distance > tolerance) {
                ASSERT_EQ(result.contacts.empty(), found.distance > 0);
                ASSERT_EQ(expected.contacts.empty(), found.distance > 0);
            }
        }
    }
    if (!one) {
        EXPECT_GT(touching, 10U);
        EXPECT_GT(apart, 10U);
    }
}

TEST(FreeformShapes, OfNurbsThatDeformFollow) {
    SmoothScene scene(ballCore(1), smoothObject(CollisionObject::kDeforming));
    const Vec3d at(0.3, 3, 0.1);
    for (const double radius : {1.0, 1.5, 0.5, 2.0}) {
        scene.set<NurbsSurfaceCore>(scene.surface, fieldId<&NurbsSurfaceCore::points>, ballCore(radius).points);
        (void)scene.boxAt(at);
        const PairDistance found = scene.frame().distances.all().at(0);
        EXPECT_NEAR(found.distance, boxFromBall(at, radius), found.error + 1e-9) << radius;
    }
}

TEST(FreeformShapes, BodiesOfOneControlMeshShareItsPlansWhereverTheirPointsAre) {
    SubdivisionSurface one = test::controlGrid(2), other = one, unlike = test::controlGrid(3);
    std::vector<float> moved(other.points.as<float>().begin(), other.points.as<float>().end());
    moved[0] += 0.5F;
    other.points = Blob::of(std::span<const float>(moved));
    const auto shapeOf = [](const SubdivisionSurface& surface) {
        const Object object = Object::of(surface);
        return smoothShapeOf(drawableOf(object)).value();
    };
    const FreeformShape first = shapeOf(one), again = shapeOf(one), pulled = shapeOf(other), alone = shapeOf(unlike);
    EXPECT_EQ(first.subdivision()->graph, again.subdivision()->graph);
    EXPECT_EQ(first.subdivision()->graph, pulled.subdivision()->graph);
    EXPECT_NE(first.subdivision()->graph, alone.subdivision()->graph);
    EXPECT_EQ(pulled.subdivision()->positions[0].x(), first.subdivision()->positions[0].x() + 0.5);
    EXPECT_NE(pulled.bounds().lower, first.bounds().lower);
}

TEST(FreeformShapes, WhatIsNoSmoothSurfaceIsNamed) {
    SubdivisionSurface flat = test::controlGrid(2);
    flat.scheme = SubdivisionSurface::kBilinear;
    for (const std::int64_t kind : {CollisionObject::kRigid, CollisionObject::kDeforming}) {
        SmoothScene scene(flat, smoothObject(kind));
        CollisionObject ofBox = smoothObject(kind);
        ofBox.node = scene.box.node;
        scene.object(ofBox);
        std::map<ObjectId, std::pair<std::string, std::string>> named;
        for (const StandIn& s : scene.frame().standIns) named[s.node] = {std::string(s.asked), std::string(s.taken)};
        const std::pair<std::string, std::string> taken{"freeform", "triangles"};
        EXPECT_EQ(named, (std::map<ObjectId, std::pair<std::string, std::string>>{{scene.node_, taken},
                                                                                  {scene.box.shape, taken}}));
        // With another scheme it is one.
        scene.set<SubdivisionSurface>(scene.surface, fieldId<&SubdivisionSurface::scheme>,
                                      SubdivisionSurface::kCatmullClark);
        (void)scene.frame();
        const StepResult smooth = scene.frame();
        ASSERT_EQ(smooth.standIns.size(), 1U);
        EXPECT_EQ(smooth.standIns.front().node, scene.box.shape);
        EXPECT_GT(smooth.distances.all().at(0).error, 0);
    }
}

TEST(FreeformShapes, AutoTakesThemOfWhatDeformsWhereAnErrorIsAllowed) {
    const auto errorOf = [](std::int64_t kind, double percent) {
        CollisionObject object = smoothObject(kind, percent);
        object.shape = CollisionObject::kAutoShape;
        SmoothScene scene(test::controlGrid(2), object);
        const StepResult found = scene.boxAt(Vec3d(0.1, 0.9, 0.2));
        EXPECT_TRUE(found.standIns.empty());
        EXPECT_FALSE(found.contacts.empty());
        return found.contacts.all().front().error;
    };
    EXPECT_GT(errorOf(CollisionObject::kDeforming, 0.1), 0);
    EXPECT_EQ(errorOf(CollisionObject::kDeforming, 0), 0);
    EXPECT_EQ(errorOf(CollisionObject::kRigid, 0), 0);
    EXPECT_EQ(errorOf(CollisionObject::kRigid, 1), 0) << "a distance field touches as its triangles do";
}

}  // namespace
}  // namespace tessera
