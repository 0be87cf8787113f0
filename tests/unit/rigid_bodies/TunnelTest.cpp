/// Nothing gets through a surface that it was told of, however thin and however fast.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

/// A small body shot at a plate of triangles without thickness, from many sides, at speeds up to 200 times its size a
/// frame.
TEST(Tunnel, FastSmallBodiesStayOnTheirSideOfAPlate) {
    const Shape plate = terrain(5, 16, [](double, double) { return 0.0; });
    const std::vector<Shape> shapes = [] {
        std::vector<Shape> out;
        out.push_back(hullShape(boxPoints({0.1, 0.06, 0.08})));
        out.push_back(hullShape(spherePoints(0.05, 16)));
        out.push_back(hullShape({{0, 0.07, 0}, {0.05, -0.03, 0.03}, {-0.05, -0.03, 0.03}, {0, -0.03, -0.05}}));
        return out;
    }();
    for (unsigned seed = 1; seed <= 300; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> u(-1, 1);
        World w;
        const double side = seed % 2 == 0 ? 1 : -1;
        const Quatd tilt = Quatd(u(random), u(random), u(random), u(random)).normalized();
        const Vec3d up = tilt * Vec3d(0, side, 0);
        w.add(plate, Vec3d(0, 0, 0), 0, tilt);
        const Vec3d from = tilt * Vec3d(u(random), side * (0.3 + 0.5 * std::abs(u(random))), u(random));
        const Vec3d aim = tilt * Vec3d(2 * u(random), 0, 2 * u(random));
        const double speed = std::pow(10.0, 0.5 + 1.3 * (u(random) + 1));
        const std::uint32_t body =
            w.add(shapes[seed % 3], from, 1, Quatd(u(random), u(random), u(random), u(random)).normalized());
        w.bodies[body].velocity = speed * (aim - from).normalized();
        w.bodies[body].spin = 20 * Vec3d(u(random), u(random), u(random));
        w.gravity = -9.81 * up;
        for (int frame = 0; frame < 30; ++frame) {
            w.step();
            const Vec3d at = tilt.conjugate() * w.at(body);
            if (at.cwiseAbs().maxCoeff() > 4.9 && std::abs(at.y()) < 4.9) break;  // it has left the plate sideways
            ASSERT_GT(side * at.y(), 0) << "seed " << seed << " frame " << frame << " speed " << speed;
        }
    }
}

/// The same against a plate that comes towards the body.
TEST(Tunnel, AMovingPlateTakesTheBodyAlong) {
    for (const double speed : {1.0, 5.0, 20.0}) {
        const Shape plate = terrain(2, 6, [](double, double) { return 0.0; }),
                    box = hullShape(boxPoints({0.2, 0.2, 0.2}));
        World w;
        w.gravity.setZero();
        const std::uint32_t mover = w.add(plate, Vec3d(0, -1, 0), 0), body = w.add(box, Vec3d(0.1, 0, 0.2), 1);
        w.bodies[mover].velocity = Vec3d(0, speed, 0);
        for (RigidBody& b : w.bodies) b.restitution = 0;
        for (int frame = 0; frame < 90; ++frame) {
            w.step();
            ASSERT_GT(w.at(body).y(), w.at(mover).y()) << speed << " frame " << frame;
        }
        EXPECT_NEAR(w.bodies[body].velocity.y(), speed, 0.02 * speed);
    }
}

/// Overlapping from the start, hulls in each other and hulls in a thick closed mesh: they come apart without a bang.
TEST(Tunnel, WhatOverlapsAtTheStartIsPushedApartGently) {
    const Shape box = hullShape(boxPoints({1, 1, 1})), block = boxMesh({4, 4, 4});
    for (const bool mesh : {false, true}) {
        World w;
        w.gravity.setZero();
        if (mesh) w.add(block, Vec3d(0, 0, 0), 0);
        const std::uint32_t a = w.add(box, mesh ? Vec3d(0.3, 2.1, 0.1) : Vec3d(0, 0, 0), 1);
        const std::uint32_t b = w.add(box, mesh ? Vec3d(2.2, 0.1, 0) : Vec3d(0.3, 0.1, 0), 1);
        double fastest = 0;
        for (int frame = 0; frame < 120; ++frame) {
            w.step();
            for (const std::uint32_t i : {a, b}) fastest = std::max(fastest, w.bodies[i].velocity.norm());
        }
        EXPECT_LT(fastest, 6) << mesh;
        if (mesh) {
            EXPECT_GT(w.at(a).y(), 2.45);
            EXPECT_GT(w.at(b).x(), 2.45);
        } else {
            EXPECT_GT((w.at(a) - w.at(b)).cwiseAbs().maxCoeff(), 0.95);
        }
    }
}

/// Bodies that are no hulls: a closed mesh falls on a mesh and lies on it.
TEST(Tunnel, AMeshLiesOnAMesh) {
    const Shape block = boxMesh({1, 0.6, 0.8}), floor = boxMesh({10, 1, 10});
    World w;
    w.add(floor, Vec3d(0, -0.5, 0), 0);
    const std::uint32_t body = w.add(block, Vec3d(0.1, 1, 0.2), 2);
    double fastest = 0;
    for (int i = 0; i < 300; ++i) {
        w.step();
        fastest = std::max(fastest, w.bodies[body].velocity.norm());
    }
    EXPECT_NEAR(w.at(body).y(), 0.3, 0.02);
    EXPECT_GT(w.pose(body).linear().col(1).y(), 0.99);
    EXPECT_LT(w.bodies[body].velocity.norm(), 0.1);
    EXPECT_LT(fastest, 5);
}

}  // namespace
}  // namespace tessera::rigidbodytest
