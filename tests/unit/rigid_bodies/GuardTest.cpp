/// The centre of a hull stays on its side of thin faces, also where others push it off the way that was foreseen.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

/// Their corners' mean is their origin.
std::vector<Shape> hulls() {
    std::vector<Shape> out;
    out.push_back(hullShape(boxPoints({0.1, 0.06, 0.08})));
    out.push_back(hullShape(spherePoints(0.05, 16)));
    out.push_back(hullShape({{0, 0.075, 0}, {0.05, -0.025, 0.03}, {-0.05, -0.025, 0.03}, {0, -0.025, -0.06}}));
    return out;
}

/// Does the way get through the plate y = 0 within its half width?
bool through(const Vec3d& from, const Vec3d& to, double half) {
    if ((from.y() < 0) == (to.y() < 0)) return false;
    const Vec3d at = from + (to - from) * (from.y() / (from.y() - to.y()));
    return std::abs(at.x()) < half && std::abs(at.z()) < half;
}

/// A body rests or glides just above a plate of small triangles, so that its own motion does not lead through it, and a
/// heavy fast one hits it from above, in any direction.
TEST(Guard, ABodyThatIsHitIsNotShotThroughAPlateBesideItsWay) {
    const Shape plate = terrain(2, 40, [](double, double) { return 0.0; });
    const std::vector<Shape> shapes = hulls();
    std::size_t hits = 0;
    for (unsigned seed = 1; seed <= 300; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> u(-1, 1);
        World w;
        w.gravity.setZero();
        w.add(plate, Vec3d(0, 0, 0), 0);
        const auto turned = [&] { return Quatd(u(random), u(random), u(random), u(random)).normalized(); };
        const Vec3d target(0.3 * u(random), 0.08 + 0.05 * (u(random) + 1), 0.3 * u(random));
        const std::uint32_t body = w.add(shapes[seed % 3], target, 0.1, turned());
        w.bodies[body].velocity = Vec3d(4 * u(random), 0, 4 * u(random));
        const double speed = std::pow(10.0, 0.8 + 0.6 * (u(random) + 1));
        const Vec3d from = target + Vec3d(0.3 * u(random), 0.4 + 0.3 * std::abs(u(random)), 0.3 * u(random));
        const std::uint32_t shot = w.add(shapes[(seed / 3) % 3], from, 10, turned());
        w.bodies[shot].velocity = speed * (target - from).normalized();
        w.bodies[shot].spin = 40 * Vec3d(u(random), u(random), u(random));
        for (int frame = 0; frame < 40; ++frame) {
            const Vec3d before[2] = {w.at(body), w.at(shot)};
            const double fell = w.bodies[body].velocity.y();
            w.step();
            if (w.bodies[body].velocity.y() < fell - 0.5) ++hits;
            ASSERT_FALSE(through(before[0], w.at(body), 1.99)) << "seed " << seed << " frame " << frame << ", hit";
            ASSERT_FALSE(through(before[1], w.at(shot), 1.99)) << "seed " << seed << " frame " << frame << ", shot";
        }
    }
    EXPECT_GT(hits, 50U) << "they must meet for this to say anything";
}

/// Fast spin moves no corner of a small body farther than around its centre: what glides past a wall is not held by it.
TEST(Guard, ASpinningBallThatPassesAWallIsNotTouched) {
    const Shape wall = terrain(2, 40, [](double, double) { return 0.0; }), ball = hullShape(spherePoints(0.05, 60));
    World w;
    w.gravity.setZero();
    w.add(wall, Vec3d(0, 0, 0), 0);
    const std::uint32_t body = w.add(ball, Vec3d(-1, 0.07, 0.1), 1);
    w.bodies[body].velocity = Vec3d(3, 0, 0);
    w.bodies[body].spin = Vec3d(0, 0, -60);
    for (int frame = 0; frame < 30; ++frame) {
        w.step();
        ASSERT_EQ(w.last.contactPoints, 0U) << frame;
        ASSERT_LT((w.bodies[body].velocity - Vec3d(3, 0, 0)).norm(), 1e-12) << frame;
    }
}

/// A centre exactly in a face is on neither side: it may leave to both, and does not stay there for ever.
TEST(Guard, ACentreInAFaceIsLetGo) {
    const Shape plate = terrain(1, 8, [](double, double) { return 0.0; }), ball = hullShape(spherePoints(0.05, 30));
    for (const double side : {-1.0, 1.0}) {
        World w;
        w.gravity.setZero();
        w.add(plate, Vec3d(0, 0, 0), 0);
        const std::uint32_t body = w.add(ball, Vec3d(0.03, 0, 0.04), 1);
        w.bodies[body].velocity = Vec3d(0, 3 * side, 0);
        w.run(60);
        EXPECT_GT(std::abs(w.at(body).y()), 0.04) << side;
    }
}

}  // namespace
}  // namespace tessera::rigidbodytest
