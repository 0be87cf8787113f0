/// Pushing against what one stands at already, and pushing very far.
#include <gtest/gtest.h>

#include <cmath>

#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

double anyBetween(Random& random, double least, double most) {
    return least + (most - least) * static_cast<double>(random() >> 11) * 0x1p-53;
}

/// "pushed", at a place, and "wall": boxes, of which the first is stopped by whatever is there.
struct PushedBox {
    PushedBox(const Vec3d& size, const Vec3d& wallAt, const Vec3d& wallSize, std::int64_t response,
              const Vec3d& at = Vec3d::Zero()) {
        test::ListMaker make;
        const ObjectId pushed = make.node("pushed", kRootNode, make.transform(at));
        make.node("box", pushed, make.box(size));
        make.node("box", make.node("wall", kRootNode, make.transform(wallAt)), make.box(wallSize));
        const ObjectId interest = make.create<Interest>();
        setField<&Interest::object>(make.builder, interest, pushed);
        setField<&Interest::response>(make.builder, interest, response);
        make.node("interest", kRootNode, interest);
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
        core = test::transformAt(simulation.scene(), "/pushed");
    }
    FrameResult push(const Vec3d& to, const Quatd& rotation = Quatd::Identity()) {
        ChangeListBuilder list;
        setField<&Transform::translation>(list, core, to);
        setField<&Transform::rotation>(list, core, rotation);
        return simulation.step(false, test::one(list.take()));
    }
    [[nodiscard]] Vec3d at() const { return test::placeOf(simulation.scene(), "/pushed"); }

    Simulation simulation;
    ObjectId core;
};

TEST(Pushing, AgainstWhatOneStandsAtIsNoWayAndNoStep) {
    forSeeds(200, [](Random& random) {
        const double unit = std::pow(10, anyBetween(random, -3, 3));
        const Vec3d place = Vec3d::Random() * (oneIn(random, 2) ? 0.0 : std::pow(10, anyBetween(random, 0, 5)) * unit);
        const std::int64_t response = std::array{Interest::kStop, Interest::kBounce, Interest::kAsk}[below(random, 3)];
        PushedBox show(Vec3d::Constant(unit), place + Vec3d(3 * unit, 0, 0), Vec3d(unit, 4 * unit, 4 * unit), response,
                       place);
        const Vec3d way = Vec3d(1, anyBetween(random, -0.4, 0.4), anyBetween(random, -0.4, 0.4)) * unit;
        const Quatd turned = oneIn(random, 2) ? Quatd::Identity()
                                              : Quatd(Eigen::AngleAxisd(anyBetween(random, -0.3, 0.3), Vec3d::UnitX()));
        ASSERT_EQ(
            show.push(show.at() + anyBetween(random, 4, 40) * way, turned).outcomes.front().result->stopped.size(), 1u);
        const StateHash there = show.simulation.scene().stateHash();
        const Quatd now = show.simulation.scene().get<Transform>(show.core)->rotation;
        for (int i = 0; i < 10; ++i) {
            const FrameResult again = show.push(show.at() + std::pow(10, anyBetween(random, -3, 4)) * way, now);
            ASSERT_EQ(again.outcomes.front().result->stopped.size(), 1u);
            ASSERT_EQ(show.simulation.scene().stateHash(), there) << "push " << i;
            ASSERT_EQ(show.simulation.history().undoDepth(), 1u);
        }
    });
}

TEST(Pushing, StopsAsNearHoweverLongTheWayIs) {
    for (const std::int64_t response : {Interest::kStop, Interest::kSlide, Interest::kRollback, Interest::kBounce})
        for (int power = 6; power <= 30; ++power)
            for (const Vec3d& slope : {Vec3d(1, 0, 0), Vec3d(1, 0.05, -0.1)}) {
                PushedBox show(Vec3d::Ones(), Vec3d(4, 0, 0), Vec3d(1, 4, 4), response);
                const FrameResult frame = show.push(slope * std::pow(10.0, power));
                ASSERT_EQ(frame.outcomes.front().result->stopped.size(), 1u) << "1e" << power;
                const double gap = 3 - show.at().x(), tolerance = 1e-4 * std::sqrt(3.0);
                // Slid along the wall and past its end, it is behind it as soon as one digit of its direction says so.
                if (show.at().tail<2>().cwiseAbs().maxCoeff() > 2.5) continue;
                ASSERT_GT(gap, 0) << "response " << response << ", 1e" << power;
                ASSERT_LE(gap, 1.01 * tolerance) << "response " << response << ", 1e" << power;
                if (response == Interest::kSlide) continue;
                ASSERT_FALSE(frame.collision.contacts.all().empty());
                for (const Contact& contact : frame.collision.contacts.all())
                    ASSERT_NEAR(contact.point.x(), 3.5, 1e-3) << "1e" << power;
            }
}

TEST(Pushing, PassesWhatIsBesideAVeryLongWay) {
    for (int power = 6; power <= 30; ++power) {
        PushedBox show(Vec3d::Ones(), Vec3d(4, 1.001, 0), Vec3d::Ones(), Interest::kStop);
        const Vec3d to(std::pow(10.0, power), 0, 0);
        EXPECT_TRUE(show.push(to).outcomes.front().result->stopped.empty()) << "1e" << power;
        EXPECT_EQ(show.at(), to);
    }
}

TEST(Pushing, StopsAsNearWhereItTurnsOnAVeryLongWay) {
    for (int power = 6; power <= 30; ++power) {
        PushedBox show(Vec3d::Ones(), Vec3d(4, 0, 0), Vec3d(1, 4, 4), Interest::kStop);
        const FrameResult frame =
            show.push(Vec3d(std::pow(10.0, power), 0, 0), Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitX())));
        ASSERT_EQ(frame.outcomes.front().result->stopped.size(), 1u);
        const double gap = 3 - show.at().x();
        ASSERT_GT(gap, 0) << "1e" << power;
        ASSERT_LE(gap, 1e-4 * std::sqrt(3.0)) << "1e" << power;
    }
}

}  // namespace
}  // namespace tessera
