// Every core that has a pose puts what is below it there for picks and collisions, not Transform alone.
#include <gtest/gtest.h>

#include "common/cores/ComponentTransform.h"
#include "common/cores/InverseTransform.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

template <typename Core>
ObjectId coreOf(SceneMaker& scene, const Core& fields) {
    ChangeListBuilder b;
    const ObjectId id(scene.aspect.nextFreeId());
    b.create(id, typeOf<Core>());
    setAllFields(b, id, Object::of(fields));
    scene.apply(b);
    return id;
}

TEST(PoseCores, WhatStandsBelowAComponentTransformIsHitWhereItIs) {
    SceneMaker scene;
    ComponentTransform about;
    about.center = Vec3d(2, 0, 0);
    about.scale = Vec3d(3, 1, 1);  // the box from 1.5 to 2.5 becomes 0.5 to 3.5
    const ObjectId core = coreOf(scene, about);
    const ObjectId bent = scene.node(kRootNode, core);
    const auto box = scene.body(bent, shapes::box(Vec3d::Ones()), Vec3d(2, 0, 0));
    const auto hits = [&](double x) {
        const auto hit = scene.pipeline.pickNode(scene.aspect, {Vec3d(x, 0.1, 10), Vec3d(0, 0, -1)});
        return hit && hit->node == box.shape;
    };
    EXPECT_TRUE(hits(0.6));
    EXPECT_TRUE(hits(3.4));
    EXPECT_FALSE(hits(0.4));
    // Another centre is another place, at once.
    ChangeListBuilder edit;
    setField<&ComponentTransform::center>(edit, core, Vec3d(0, 0, 0));
    scene.apply(edit);
    EXPECT_FALSE(hits(0.6));
    EXPECT_TRUE(hits(7.4));

    // And what is moved against it stops there: it reaches from 4.5 to 7.5 now.
    const auto mover = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, 0));
    scene.interest(mover.node);
    const StepResult result = scene.frame({{.transform = mover.transform, .translation = Vec3d(20, 0, 0)}});
    EXPECT_EQ(result.stopped, std::vector{mover.transform});
    EXPECT_NEAR(scene.at(mover.transform).translation.x(), 4.0, 1e-3);
}

TEST(PoseCores, BelowAnInverseTransformNothingMovesWithWhatIsAbove) {
    SceneMaker scene;
    const ObjectId above =
        scene.transform(Vec3d(5, 0, 0), Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitZ())), Vec3d(2, 2, 2));
    const ObjectId node = scene.node(kRootNode, above);
    const ObjectId inverse = scene.node(node, coreOf(scene, InverseTransform()));
    const auto box = scene.body(inverse, shapes::box(Vec3d::Ones()), Vec3d(1, 0, 0));
    const auto beside = scene.body(node, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    const auto pick = [&](double x) {
        const auto hit = scene.pipeline.pickNode(scene.aspect, {Vec3d(x, 0.1, 10), Vec3d(0, 0, -1)});
        return hit ? hit->node : ObjectId();
    };
    EXPECT_EQ(pick(1.3), box.shape);
    EXPECT_EQ(pick(5), beside.shape);
    scene.commit({.transform = above, .translation = Vec3d(-40, 0, 0)});
    EXPECT_EQ(pick(1.3), box.shape) << "it stands in the world";
    EXPECT_EQ(pick(-40), beside.shape);
    EXPECT_EQ(pick(5), ObjectId());

    const auto mover = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(-3, 0, 0));
    scene.interest(mover.node);
    (void)scene.frame({{.transform = mover.transform, .translation = Vec3d(20, 0, 0)}});
    EXPECT_NEAR(scene.at(mover.transform).translation.x(), 0.0, 1e-3);
    // What moves above it does not carry it: the other box that hangs there meets it and stops.
    scene.interest(beside.node);
    const StepResult result = scene.frame({{.transform = above, .translation = Vec3d(40, 0, 0)}});
    EXPECT_EQ(result.stopped, std::vector{above});
    EXPECT_LT(scene.at(above).translation.x(), 0.0);
}

}  // namespace
}  // namespace tessera
