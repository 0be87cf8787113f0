/// Pairs in which neither gives way: something that is moved runs into sleepers, or into what a limit holds; sleepers
/// lose their mass, or become one body.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

/// Two boxes on top of each other, and a bar beside them. The bar turns so fast that its end runs into them, while the
/// points of it that are near them as the frame begins do not come nearer.
struct Carousel {
    Shape floor = boxMesh({8, 1, 8}), box = hullShape(boxPoints({0.5, 0.5, 0.5})),
          bar = hullShape(boxPoints({4, 0.1, 0.2}));
    World w;
    std::uint32_t arm = 0, lower = 0, upper = 0;
    explicit Carousel(Workers* workers = nullptr) : w({}, workers) {
        arm = w.add(bar, Vec3d(0, 0.3, 0), 0);
        w.add(floor, Vec3d(0, -0.5, 0), 0);
        lower = w.add(box, Vec3d(0, 0.25, 1.2), 1);
        upper = w.add(box, Vec3d(0, 0.75, 1.2), 1);
    }
    void turn() {
        w.bodies[arm].anchor = w.at(arm);
        w.bodies[arm].spin = Vec3d(0, 0.5 * std::numbers::pi / kFrame, 0);
    }
};

TEST(RunInto, ASleeperWakesAndGoesTheWayOfABodyThatWasAwake) {
    Workers two(2);
    Carousel sleeping(&two), disturbed;
    for (Carousel* one : {&sleeping, &disturbed}) {
        one->w.run(90);
        ASSERT_EQ(one->w.last.asleep, 2U);
        one->turn();
    }
    for (const std::uint32_t body : {disturbed.lower, disturbed.upper}) disturbed.w.bodies[body].disturbed = true;
    for (int frame = 0; frame < 30; ++frame) {
        sleeping.w.step();
        disturbed.w.step();
        if (frame == 0) {
            EXPECT_EQ(sleeping.w.last.asleep, 0U);
        }
        for (std::size_t i = 0; i < sleeping.w.bodies.size(); ++i) {
            ASSERT_EQ(sleeping.w.bodies[i].velocity, disturbed.w.bodies[i].velocity) << frame << ' ' << i;
            ASSERT_EQ(sleeping.w.parts[i].world.matrix(), disturbed.w.parts[i].world.matrix()) << frame << ' ' << i;
        }
    }
    EXPECT_GT((sleeping.w.at(sleeping.lower) - Vec3d(0, 0.25, 1.2)).norm(), 0.1) << "it was hit";
}

TEST(RunInto, ABodyThatALimitHoldsStaysWhereItIs) {
    std::size_t held = 0;
    for (std::uint64_t limit = 0; limit < 200; limit += 3) {
        Carousel c;
        c.w.run(10);
        c.turn();
        c.w.findEncounters(kFrame);
        QueryWork little;
        little.limit = limit;
        const RigidFrame out = c.w.stage->advance(c.w.bodies, c.w.parts, c.w.encounters, c.w.gravity, kFrame, little);
        for (const RigidFrame::Left& left : out.notLookedAt)
            for (const std::uint32_t body : {c.lower, c.upper}) {
                const std::uint64_t part = c.w.parts[c.w.bodies[body].parts.front()].id;
                if (left.partA != part && left.partB != part) continue;
                ++held;
                ASSERT_TRUE(out.motions[body].world_T_before.matrix() == Mat4d::Identity()) << limit;
                ASSERT_EQ(out.motions[body].velocity, c.w.bodies[body].velocity) << limit;
            }
    }
    EXPECT_GT(held, 20U);
}

/// What lay on a floor is led through it.
TEST(RunInto, ASleeperThatLosesItsMassGoesThroughWhatItLayOn) {
    for (const Vec3d& way : {Vec3d(0, -3, 0), Vec3d(0.3, -0.2, 0.1), Vec3d(0, 2, 0)}) {
        Carousel c;
        c.w.run(90);
        ASSERT_EQ(c.w.last.asleep, 2U);
        const Vec3d upper = c.w.at(c.upper);
        RigidBody& body = c.w.bodies[c.lower];
        c.w.stage->gone(body.id);
        body.mass = 0;
        body.velocity = way / kFrame;
        c.w.step();
        body.velocity.setZero();
        c.w.run(60);
        EXPECT_EQ(c.w.bodies[c.lower].velocity, Vec3d(Vec3d::Zero()));
        EXPECT_TRUE(c.w.at(c.upper).allFinite());
        EXPECT_NE(c.w.at(c.upper), upper) << "it lay on the other one";
    }
}

TEST(RunInto, SleepersThatBecomeOneBodyDoNotMeetEachOther) {
    Carousel c, fresh;
    c.w.run(90);
    ASSERT_EQ(c.w.last.asleep, 2U);
    fresh.w.parts = c.w.parts;
    c.w.stage->gone(c.w.bodies[c.upper].id);
    for (World* w : {&c.w, &fresh.w}) {
        RigidBody &both = w->bodies[c.lower], &none = w->bodies[c.upper];
        const std::uint32_t part = none.parts.front();
        both.parts.push_back(part);
        both.disturbed = true;
        both.velocity = both.spin = Vec3d::Zero();
        w->parts[part].body = c.lower;
        none.parts.clear();
        none.mass = 0;
        w->findEncounters(kFrame);
        w->last = w->stage->advance(w->bodies, w->parts, w->encounters, w->gravity, kFrame, w->work);
    }
    EXPECT_GT(c.w.last.contactPoints, 0U) << "it lies on the floor";
    EXPECT_EQ(c.w.last.contactPoints, fresh.w.last.contactPoints);
}

}  // namespace
}  // namespace tessera::rigidbodytest
