/// Bodies that turn freely: closed forms, flips, and long runs.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

struct Spinner {
    World w;
    Shape shape;
    Vec3d moments;  ///< about the axes of the box

    Spinner(const Vec3d& size, const Vec3d& spin, const Quatd& turned = Quatd::Identity())
        : shape(hullShape(boxPoints(size))) {
        w.gravity.setZero();
        w.add(shape, Vec3d(0, 0, 0), 12, turned);
        w.bodies[0].spin = spin;
        moments = Vec3d(size.y() * size.y() + size.z() * size.z(), size.x() * size.x() + size.z() * size.z(),
                        size.x() * size.x() + size.y() * size.y());
    }
    [[nodiscard]] Mat3d turn() const { return w.parts[0].world.linear(); }
    [[nodiscard]] Vec3d own() const { return turn().transpose() * w.bodies[0].spin; }
    [[nodiscard]] Vec3d momentum() const { return turn() * moments.cwiseProduct(own()); }
    [[nodiscard]] double energy() const { return 0.5 * own().dot(moments.cwiseProduct(own())); }
};

TEST(Spin, AngularMomentumAndEnergyOfAFreeBoxStay) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> u(-1, 1);
        const Quatd turned = Quatd(u(random), u(random), u(random), u(random)).normalized();
        Spinner s({1, 0.2 + 0.2 * (1 + u(random)), 2 + u(random)},
                  (seed % 4 == 0 ? 60 : 10) * Vec3d(u(random), u(random), u(random)), turned);
        const Vec3d before = s.momentum();
        const double energy = s.energy();
        double drift = 0, gain = 0;
        for (int frame = 0; frame < 1000; ++frame) {
            s.w.step();
            drift = std::max(drift, (s.momentum() - before).norm() / before.norm());
            gain = std::max(gain, std::abs(s.energy() / energy - 1));
        }
        EXPECT_LT(drift, 1e-11) << "seed " << seed;
        EXPECT_LT(gain, 1e-10) << "seed " << seed;
    }
}

/// A torque-free symmetric top: its axis goes around the momentum at |L| / I1 (L. Landau, E. Lifshitz, "Mechanics", §
/// 33).
TEST(Spin, ASymmetricTopPrecesses) {
    const Vec3d spin(1.5, 6, 0);
    Spinner s({1, 0.3, 1}, spin);
    const Vec3d momentum = s.momentum(), axis = Vec3d::UnitY();
    const double rate = momentum.norm() / s.moments.x();
    const int frames = 240;
    double worst = 0;
    for (int frame = 1; frame <= frames; ++frame) {
        s.w.step();
        const Vec3d expected = Eigen::AngleAxisd(rate * frame * kFrame, momentum.normalized()) * axis;
        worst = std::max(worst, (s.turn().col(1) - expected).norm());
    }
    EXPECT_LT(worst, 0.02) << "about " << rate * frames * kFrame << " radians later";
}

/// About the middle axis it flips over and back, again and again, at even intervals (Dzhanibekov).
TEST(Spin, AboutTheMiddleAxisItFlipsForEver) {
    Spinner s({2, 0.5, 1}, Vec3d(2e-3, 1e-3, 8));
    // Moments of x < z < y: z is the middle axis.
    ASSERT_LT(s.moments.x(), s.moments.z());
    ASSERT_LT(s.moments.z(), s.moments.y());
    const Vec3d before = s.momentum();
    const double energy = s.energy();
    std::vector<int> flips;
    bool along = true;
    for (int frame = 0; frame < 20'000; ++frame) {
        s.w.step();
        if ((s.own().z() > 0) != along) {
            along = !along;
            flips.push_back(frame);
        }
    }
    ASSERT_GT(flips.size(), 30U);
    int least = 1 << 30, most = 0;
    for (std::size_t i = 1; i < flips.size(); ++i) {
        least = std::min(least, flips[i] - flips[i - 1]);
        most = std::max(most, flips[i] - flips[i - 1]);
    }
    EXPECT_LE(most - least, 2) << least << " to " << most;
    EXPECT_LT((s.momentum() - before).norm() / before.norm(), 1e-10);
    EXPECT_LT(std::abs(s.energy() / energy - 1), 1e-9);
}

TEST(Spin, NothingIsLostInALongRun) {
    const char* text = std::getenv("TESSERA_HUNT");
    const int frames = text != nullptr ? 1'000'000 : 100'000;
    Spinner s({1, 0.3, 0.6}, Vec3d(3, 5, -4));
    const Vec3d before = s.momentum();
    const double energy = s.energy();
    s.w.run(frames);
    EXPECT_LT((s.momentum() - before).norm() / before.norm(), 1e-9);
    EXPECT_LT(std::abs(s.energy() / energy - 1), 1e-9);
}

/// At the smallest sizes the squares of their inertia are no numbers.
TEST(Spin, BodiesOfTinyAndOfLargeSizeTurn) {
    for (const double size : {1e5, 1.0, 1e-40, 1e-80, 1e-100}) {
        Spinner s({1, 1, 1}, Vec3d(0, 0, 1));
        s.w.parts[0].world.linear() *= size;
        s.w.run(60);
        const Vec3d now = s.turn().col(0).stableNormalized(), expected(std::cos(1), std::sin(1), 0);
        EXPECT_LT((now - expected).norm(), 1e-6) << "size " << size;
    }
}

}  // namespace
}  // namespace tessera::rigidbodytest
