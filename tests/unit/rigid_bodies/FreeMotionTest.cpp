/// Bodies that meet nobody, and pairs that meet once: closed forms.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

/// Of semi-implicit Euler in sub-steps of h: v = N h g, x = N (N + 1) / 2 h² g.
TEST(FreeMotion, FallsAsSemiImplicitEulerDoes) {
    World w;
    const Shape box = hullShape(boxPoints({1, 1, 1}));
    const std::uint32_t body = w.add(box, Vec3d(0, 100, 0), 3);
    const int frames = 50, substeps = w.options.iterations / 2;
    w.run(frames);
    const double h = kFrame / substeps, n = frames * substeps;
    EXPECT_NEAR(w.bodies[body].velocity.y(), -9.81 * n * h, 1e-11);
    EXPECT_NEAR(w.at(body).y(), 100 - 9.81 * h * h * n * (n + 1) / 2, 1e-10);
    EXPECT_EQ(w.at(body).x(), 0);
}

TEST(FreeMotion, SpinsAboutAFixedAxisByTheRightAngle) {
    World w;
    w.gravity.setZero();
    const Shape box = hullShape(boxPoints({1, 2, 3}));
    const std::uint32_t body = w.add(box, Vec3d(1, 2, 3), 3);
    w.bodies[body].spin = Vec3d(0, 0, 2);
    w.run(60);
    const Mat3d expected = Eigen::AngleAxisd(2.0, Vec3d::UnitZ()).toRotationMatrix();
    EXPECT_LT((w.pose(body).linear() - expected).norm(), 1e-6);
    EXPECT_LT((w.at(body) - Vec3d(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT((w.bodies[body].spin - Vec3d(0, 0, 2)).norm(), 1e-13);
}

/// The centre of mass moves in a straight line, not the part's origin.
TEST(FreeMotion, TurnsAboutTheCentreOfMassOfAllParts) {
    World w;
    w.gravity.setZero();
    const Shape box = hullShape(boxPoints({1, 1, 1}));
    const std::uint32_t body = w.add(box, Vec3d(0, 0, 0), 2);
    RigidPart second = w.parts[0];
    second.id += 1;
    second.world.translation() = Vec3d(3, 0, 0);
    w.parts.push_back(second);
    w.bodies[body].parts.push_back(1);
    w.bodies[body].spin = Vec3d(0, 0, 3);
    w.run(40);
    EXPECT_LT((0.5 * (w.parts[0].world.translation() + w.parts[1].world.translation()) - Vec3d(1.5, 0, 0)).norm(),
              1e-11);
    EXPECT_NEAR((w.parts[0].world.translation() - w.parts[1].world.translation()).norm(), 3, 1e-11);
}

/// Two equal elastic bodies exchange their speeds, as in Newton's cradle.
TEST(Collision, EqualElasticBoxesExchangeTheirSpeeds) {
    World w;
    w.gravity.setZero();
    const Shape box = hullShape(boxPoints({1, 1, 1}));
    const std::uint32_t a = w.add(box, Vec3d(-2, 0, 0), 1), b = w.add(box, Vec3d(0, 0, 0), 1);
    w.bodies[a].velocity = Vec3d(3, 0, 0);
    for (RigidBody& body : w.bodies) {
        body.restitution = 1;
        body.friction = 0;
    }
    w.run(60);
    EXPECT_LT(w.bodies[a].velocity.norm(), 1e-4);
    EXPECT_LT((w.bodies[b].velocity - Vec3d(3, 0, 0)).norm(), 1e-4);
}

TEST(Collision, RowOfElasticBoxesPassesTheSpeedOn) {
    World w;
    w.gravity.setZero();
    const Shape box = hullShape(boxPoints({1, 1, 1}));
    for (int i = 0; i < 4; ++i) w.add(box, Vec3d(i == 0 ? -3 : 1.5 * i, 0, 0), 1);
    for (RigidBody& body : w.bodies) {
        body.restitution = 1;
        body.friction = 0;
    }
    w.bodies[0].velocity = Vec3d(4, 0, 0);
    w.run(120);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(w.bodies[i].velocity.norm(), 0.01) << i;
    EXPECT_NEAR(w.bodies[3].velocity.x(), 4, 0.01);
}

struct Quantities {
    Vec3d momentum = Vec3d::Zero();
    double energy = 0;
};

/// Of boxes of edge lengths `size` with their inertia about their centres.
Quantities quantitiesOf(const World& w, const Vec3d& size) {
    Quantities out;
    for (const RigidBody& b : w.bodies) {
        const Vec3d inertia =
            b.mass / 12 *
            Vec3d(size.y() * size.y() + size.z() * size.z(), size.x() * size.x() + size.z() * size.z(),
                  size.x() * size.x() + size.y() * size.y());
        const Vec3d own = w.parts[b.parts[0]].world.linear().transpose() * b.spin;
        out.momentum += b.mass * b.velocity;
        out.energy += 0.5 * b.mass * b.velocity.squaredNorm() + 0.5 * own.dot(inertia.cwiseProduct(own));
    }
    return out;
}

/// A cloud of boxes that fly into each other.
class Cloud : public testing::TestWithParam<double> {};

TEST_P(Cloud, KeepsItsMomentumAndGainsNoEnergy) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        World w;
        w.gravity.setZero();
        const Vec3d size(1, 0.7, 0.8);
        const Shape box = hullShape(boxPoints(size));
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> u(-1, 1);
        for (int i = 0; i < 27; ++i) {
            const Vec3d at = 1.6 * Vec3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
            const std::uint32_t b =
                w.add(box, at, 1 + 0.5 * u(random), Quatd(u(random), u(random), u(random), u(random)).normalized());
            w.bodies[b].velocity = -at + 2 * Vec3d(u(random), u(random), u(random));
            w.bodies[b].spin = 2 * Vec3d(u(random), u(random), u(random));
            w.bodies[b].restitution = GetParam();
            w.bodies[b].friction = 0.3;
        }
        Quantities before = quantitiesOf(w, size);
        const double first = before.energy;
        std::size_t met = 0;
        for (int frame = 0; frame < 120; ++frame) {
            w.step();
            met += w.last.contactPoints;
            const Quantities now = quantitiesOf(w, size);
            EXPECT_LT((now.momentum - before.momentum).norm(), 1e-12) << "seed " << seed << " frame " << frame;
            // What rotation in place does to spin × inertia is no gain: an axis that stays turns with the body. (Of
            // 7,200 frames of clouds that bounce without loss one gained 3.4e-6 of the first energy, as far as impulses
            // are worked out.)
            EXPECT_LT(now.energy, before.energy + 1e-5 * first) << "seed " << seed << " frame " << frame;
            before = now;
        }
        EXPECT_GT(met, 100U) << seed;
        EXPECT_LT(before.energy, first) << seed;
    }
}
INSTANTIATE_TEST_SUITE_P(Restitution, Cloud, testing::Values(0.0, 0.5, 1.0));

}  // namespace
}  // namespace tessera::rigidbodytest
