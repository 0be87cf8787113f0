// Smooth surfaces in a scene, looked at as themselves: contacts and distances beside the pair table's own, motions beside triangles, edits of
// control points beside pipelines that see them for the first time.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "common/drawable/NurbsArrays.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "server/collision/pairwise/PairTable.h"
#include "tests/unit/drawable/ControlCube.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct SmoothScene : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0.1, 2, 0.2));
    ObjectId surface, node_, object_;

    template <typename Core>
    SmoothScene(const Core& fields, CollisionObject object) : surface(ObjectId(aspect.nextFreeId())) {
        ChangeListBuilder b;
        b.create(surface, typeOf<Core>());
        for (const FieldEntry& field : findType(typeOf<Core>())->fields) b.set(surface, typeOf<Core>(), field.id, field.read(&fields));
        apply(b);
        node_ = node(kRootNode, surface);
        object.node = node_;
        object_ = this->object(object);
        Interest interest;
        interest.object = box.node;
        interest.against = node_;
        interest.response = Interest::kReport;
        interest.mode = Interest::kPseudoDynamic;
        this->interest(interest);
        interest.mode = Interest::kDistance;
        interest.threshold = 100;
        this->interest(interest);
    }
    void move(std::uint64_t first, std::span<const float> floats) {
        ChangeListBuilder b;
        b.setRange(surface, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::points>, first * sizeof(float), Blob::of(floats));
        ChangeList list = b.take();
        ASSERT_TRUE(resolveRanges(aspect, list));
        ASSERT_TRUE(aspect.apply(list));
        pipeline.sceneChanged(aspect, &list);
    }
    StepResult boxAt(const Vec3d& where) {
        commit({.transform = box.transform, .translation = where});
        return frame();
    }
    [[nodiscard]] TentativeTransform boxTo(const Vec3d& where) const { return {.transform = box.transform, .translation = where}; }
};

CollisionObject smoothObject(std::int64_t kind, double error = 0) {
    CollisionObject object;
    object.kind = kind;
    object.shape = CollisionObject::kFreeform;
    object.error = error;
    return object;
}

NurbsSurfaceCore ballCore(double radius) { return coreOfSurface(sphereSurface(radius).value()); }

/// How far a box of size 1 that stands along the axes is from a ball around the origin.
double boxFromBall(const Vec3d& at, double radius) { return (at.cwiseAbs().array() - 0.5).max(0.0).matrix().norm() - radius; }

TEST(FreeformShapes, OfANurbsBallAreItsClosedFormNotThatOfItsTriangles) {
    NurbsSurfaceCore ball = ballCore(1);
    ball.tolerance = 0.05;  // few triangles
    for (const std::int64_t kind : {CollisionObject::kRigid, CollisionObject::kDeforming})
        for (const double percent : {0.0, 0.001, 1.0}) {
            SmoothScene scene(ball, smoothObject(kind, percent));
            const double tolerance = (percent > 0 ? 0.01 * percent : 1e-4) * std::sqrt(12.0);
            for (const Vec3d& at : {Vec3d(0.3, 1.7, 0.1), Vec3d(1.6, 1.1, 0.9), Vec3d(0.1, -1.52, 0.2), Vec3d(1.3, 0.2, 0.4), Vec3d(0.2, 0.1, 1.4999)}) {
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
                    }
                }
            }
        }
}

TEST(FreeformShapes, MotionsStopAtTheTrianglesThatAreDrawn) {
    for (const std::int64_t kind : {CollisionObject::kRigid, CollisionObject::kStatic, CollisionObject::kDeforming}) {
        CollisionObject plain = smoothObject(kind);
        plain.shape = CollisionObject::kTriangles;
        SmoothScene smooth(test::controlGrid(2), smoothObject(kind)), exact(test::controlGrid(2), plain);
        for (SmoothScene* scene : {&smooth, &exact}) scene->interest(scene->box.node, scene->node_, Interest::kStop);
        for (const Vec3d& where : {Vec3d(0.2, -1, 0), Vec3d(3, 0, 0.1), Vec3d(0, 0.1, 0.2), Vec3d(-3, 0.2, 0)}) {
            const StepResult found = smooth.frame({smooth.boxTo(where)}), truth = exact.frame({exact.boxTo(where)});
            ASSERT_EQ(found.accepted.size(), truth.accepted.size());
            for (std::size_t i = 0; i < truth.accepted.size(); ++i) EXPECT_EQ(found.accepted[i].translation, truth.accepted[i].translation);
            EXPECT_TRUE(found.notLookedAt.empty());
        }
    }
}

/// What is asked of the surface after its points have moved, in ranges, is what a pipeline says that sees it so for the first time. Within the
/// errors: boxes that follow are not the boxes that are made anew.
TEST(FreeformShapes, FollowTheirControlPoints) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 0, last = one ? first : 9;
    std::size_t touching = 0, apart = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message() << "TESSERA_SEED=" << seed << " build/bin/unit_pipeline --gtest_filter=FreeformShapes.*");
        std::mt19937_64 random(seed);
        SubdivisionSurface fields = test::controlGrid(1 + static_cast<std::uint32_t>(random() % 3));
        fields.level = 1 + static_cast<std::int64_t>(random() % 3);
        SmoothScene scene(fields, smoothObject(seed % 3 ? CollisionObject::kDeforming : CollisionObject::kRigid));
        scene.frame();
        for (int step = 0; step < 8; ++step) {
            const std::size_t floats = scene.aspect.get<SubdivisionSurface>(scene.surface)->points.sizeBytes() / 4, at = random() % floats;
            std::vector<float> moved(1 + random() % std::min<std::size_t>(9, floats - at));
            for (float& x : moved) x = static_cast<float>(static_cast<double>(random() % 3000) / 1000 - 1.5);
            // Now and then two edits in one frame, and a pose besides.
            scene.move(at, moved);
            if (random() % 3 == 0) scene.move(random() % (floats - 3), std::vector<float>{0.4F, -0.3F});
            if (random() % 2 == 0) scene.commit({.transform = scene.box.transform, .translation = Vec3d(0.2, 0.9 + 0.1 * static_cast<double>(random() % 10), 0)});
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
        EXPECT_EQ(named, (std::map<ObjectId, std::pair<std::string, std::string>>{{scene.node_, taken}, {scene.box.shape, taken}}));
        // With another scheme it is one.
        scene.set<SubdivisionSurface>(scene.surface, fieldId<&SubdivisionSurface::scheme>, SubdivisionSurface::kCatmullClark);
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
