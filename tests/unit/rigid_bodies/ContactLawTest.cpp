/// Bounce, slide, stick, roll, push: closed-form physics.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

Shape floorMesh() {
    return terrain(20, 10, [](double, double) { return 0.0; });
}

class Bounce : public testing::TestWithParam<double> {};

/// Dropped from h, it comes back to e² h: on one corner below its centre, and on four.
TEST_P(Bounce, ComesBackToTheHeightThatRestitutionSays) {
    const double e = GetParam(), h = 2;
    const Shape spike = hullShape({{0.3, 0, 0}, {-0.3, 0, 0}, {0, 0.3, 0}, {0, -0.3, 0}, {0, 0, 0.3}, {0, 0, -0.3}});
    const Shape box = hullShape(boxPoints({0.5, 0.6, 0.5})), plate = hullShape(boxPoints({40, 1, 40})),
                mesh = floorMesh();
    for (const bool onMesh : {false, true})
        for (const Shape* const shape : {&spike, &box}) {
            World w;
            if (onMesh)
                w.add(mesh, Vec3d(0, 0, 0), 0);
            else
                w.add(plate, Vec3d(0, -0.5, 0), 0);
            const std::uint32_t body = w.add(*shape, Vec3d(0, 0.3 + h, 0), 1);
            w.bodies[body].restitution = e;
            w.bodies[0].restitution = 0;
            double apex = 0;
            bool rising = false;
            for (int i = 0; i < 200; ++i) {
                const double before = w.bodies[body].velocity.y();
                w.step();
                const double now = w.bodies[body].velocity.y();
                if (before < 0 && now > 0) rising = true;
                if (rising && now <= 0) break;
                if (rising) apex = std::max(apex, w.at(body).y() - 0.3);
            }
            EXPECT_NEAR(apex, e * e * h, 0.05 * e * e * h)
                << (onMesh ? "mesh" : "hull") << (shape == &spike ? ", spike" : ", box");
        }
}
INSTANTIATE_TEST_SUITE_P(Restitution, Bounce, testing::Values(0.5, 0.7, 0.9));

TEST(ContactLaw, WithoutRestitutionNothingComesBack) {
    World w;
    const Shape box = hullShape(boxPoints({1, 1, 1})), mesh = floorMesh();
    w.add(mesh, Vec3d(0, 0, 0), 0);
    const std::uint32_t body = w.add(box, Vec3d(0, 2, 0), 1);
    w.bodies[0].restitution = w.bodies[body].restitution = 0;
    double highest = -1;
    for (int i = 0; i < 120; ++i) {
        w.step();
        highest = std::max(highest, w.bodies[body].velocity.y());
    }
    EXPECT_LT(highest, 0.02);
}

struct Incline {
    double degrees, friction;
};
class OnAnIncline : public testing::TestWithParam<Incline> {};

/// Stays where tan(angle) < mu; else goes with g (sin - mu cos).
TEST_P(OnAnIncline, GoesAsCoulombSays) {
    const double angle = GetParam().degrees * std::numbers::pi / 180, mu = GetParam().friction;
    const Quatd tilt(Eigen::AngleAxisd(-angle, Vec3d::UnitZ()));
    const Vec3d down = tilt * Vec3d::UnitX(), up = tilt * Vec3d::UnitY();
    for (const bool onMesh : {false, true}) {
        World w;
        const Shape plate = hullShape(boxPoints({60, 1, 10})),
                    mesh = terrain(30, 12, [](double, double) { return 0.0; });
        const Shape box = hullShape(boxPoints({1, 0.4, 1}));
        if (onMesh)
            w.add(mesh, Vec3d(0, 0, 0), 0, tilt);
        else
            w.add(plate, Vec3d(-0.5 * up), 0, tilt);
        const std::uint32_t body = w.add(box, Vec3d(0.1996 * up - 3 * down), 2, tilt);
        for (RigidBody& b : w.bodies) b.friction = mu;
        w.run(30);  // it settles
        const double before = w.bodies[body].velocity.dot(down);
        const Vec3d from = w.at(body);
        w.run(60);
        const double gained = w.bodies[body].velocity.dot(down) - before;
        const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle));
        if (std::tan(angle) < mu) {
            EXPECT_LT((w.at(body) - from).norm(), 2e-3) << (onMesh ? "mesh" : "hull");
        } else {
            EXPECT_NEAR(gained, expected, 0.03 * expected) << (onMesh ? "mesh" : "hull");
        }
    }
}
INSTANTIATE_TEST_SUITE_P(Slopes, OnAnIncline,
                         testing::Values(Incline{10, 0.2}, Incline{20, 0.2}, Incline{20, 0.4}, Incline{30, 0.5},
                                         Incline{30, 0.65}, Incline{25, 0.0}));

TEST(ContactLaw, SlideHasNoFrictionAndStickHasAll) {
    for (const ContactLaw law : {ContactLaw::kSlide, ContactLaw::kStick}) {
        World w;
        w.law = law;
        const Shape box = hullShape(boxPoints({1, 0.2, 1})), mesh = floorMesh();
        w.add(mesh, Vec3d(0, 0, 0), 0);
        const std::uint32_t body = w.add(box, Vec3d(0, 0.0997, 0), 1);
        w.bodies[0].friction = w.bodies[body].friction = law == ContactLaw::kSlide ? 1 : 0;
        w.bodies[0].restitution = w.bodies[body].restitution = 1;
        w.bodies[body].velocity = Vec3d(1, 0, 0);
        w.run(60);
        EXPECT_NEAR(w.bodies[body].velocity.x(), law == ContactLaw::kSlide ? 1 : 0, 1e-3);
    }
}

/// A ball that is pushed slides first, then rolls: v = 5/7 v0, whatever the friction.
TEST(ContactLaw, PushedBallEndsUpRolling) {
    World w;
    const double r = 0.5;
    const Shape ball = hullShape(spherePoints(r, 3000)), plate = hullShape(boxPoints({200, 1, 20}));
    w.add(plate, Vec3d(0, -0.5, 0), 0);
    const std::uint32_t body = w.add(ball, Vec3d(0, r, 0), 1);
    w.bodies[body].velocity = Vec3d(7, 0, 0);
    w.run(40);  // it slides for 2 v0 / (7 mu g) = 0.41 s
    EXPECT_NEAR(w.bodies[body].velocity.x(), 5, 0.25);
    EXPECT_NEAR(-w.bodies[body].spin.z() * r, w.bodies[body].velocity.x(), 0.2);
}

TEST(ContactLaw, APusherMovesABoxWithItsOwnSpeed) {
    World w;
    const Shape box = hullShape(boxPoints({1, 1, 1})), mesh = floorMesh();
    w.add(mesh, Vec3d(0, 0, 0), 0);
    const std::uint32_t pusher = w.add(box, Vec3d(-2, 0.6, 0), 0), body = w.add(box, Vec3d(0, 0.5, 0), 1);
    w.bodies[pusher].velocity = Vec3d(1.5, 0, 0);
    w.bodies[pusher].anchor = w.at(pusher);
    w.run(120);
    EXPECT_NEAR(w.bodies[body].velocity.x(), 1.5, 1e-2);
    EXPECT_NEAR(w.at(body).x() - w.at(pusher).x(), 1, 0.02);
    EXPECT_NEAR(w.at(pusher).x(), -2 + 1.5 * 2, 1e-9);
}

TEST(ContactLaw, ATurntableCarriesWhatStandsOnIt) {
    World w;
    const Shape table = hullShape(boxPoints({6, 1, 6})), box = hullShape(boxPoints({0.5, 0.5, 0.5}));
    const std::uint32_t disc = w.add(table, Vec3d(0, -0.5, 0), 0), body = w.add(box, Vec3d(1, 0.25, 0), 1);
    w.bodies[disc].spin = Vec3d(0, 0.8, 0);
    for (RigidBody& b : w.bodies) b.friction = 0.9;
    w.run(120);
    const double turned = 0.8 * 2;
    // It starts from rest, so it lags a little.
    EXPECT_NEAR(w.at(body).head<3>().x(), std::cos(turned), 0.1);
    EXPECT_NEAR(w.at(body).z(), -std::sin(turned), 0.1);
    EXPECT_NEAR(w.bodies[body].spin.y(), 0.8, 0.02);
    EXPECT_EQ(w.last.asleep, 0U);
}

/// Over the diagonals and edges of a flat floor nothing trips.
TEST(ContactLaw, InnerEdgesOfAFloorStopNobody) {
    for (const double heading : {0.0, 0.3, 0.785, 1.3}) {
        World w;
        const Shape box = hullShape(boxPoints({0.8, 0.3, 0.6})),
                    mesh = terrain(20, 80, [](double, double) { return 0.0; });
        w.add(mesh, Vec3d(0, 0, 0), 0);
        const std::uint32_t body = w.add(box, Vec3d(-3, 0.1485, -3), 1);
        for (RigidBody& b : w.bodies) b.friction = 0;
        w.bodies[body].velocity = 5 * Vec3d(std::cos(heading), 0, std::sin(heading));
        for (int i = 0; i < 90; ++i) {
            w.step();
            EXPECT_LT(std::abs(w.bodies[body].velocity.y()), 0.05) << heading << " frame " << i;
        }
        EXPECT_NEAR(w.bodies[body].velocity.norm(), 5, 0.02) << heading;
        EXPECT_LT(w.bodies[body].spin.norm(), 0.02) << heading;
    }
}

}  // namespace
}  // namespace tessera::rigidbodytest
