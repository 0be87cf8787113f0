// Where the wall stands, as applications say it: who goes back to where all is seen waits for a look that no frame
// waits for.
#include "server/sim/desk/ViewRequests.h"

#include <gtest/gtest.h>

#include "server/sim/frame/Simulation.h"
#include "server/sim/view/AnimatedBounds.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

class ViewWishes : public testing::Test {
protected:
    ViewWishes() {
        ada = server.hello("ada", PeerRole::kApplication);
        bob = server.hello("bob", PeerRole::kApplication);
        grow(3);
        before = position();
    }
    void grow(double x) {
        test::ListMaker make;
        make.node("box", make.node("place", kRootNode, make.transform(Vec3d(x, 0, 0))), make.box(Vec3d::Ones()));
        view.update(simulation.scene(), simulation.step(false, test::one(make.builder.take())).commit.list.get());
    }
    Vec3d position() { return view.view(simulation.scene()).value().position; }
    void ask(ConnectionId who, const ViewWish& wish) { server.take(views.ask({who, ++asked}, wish)); }
    void find() {
        const Sequence at = simulation.sequence();
        server.take(views.surveyed(animatedBounds(simulation.scene()), at));
    }
    std::size_t answers(ConnectionId who) { return server.sent<message::Reply>(who).size(); }

    ServerFixture server;
    Simulation simulation;
    ViewSource view{test::wallOfOne(), ""};
    int orders = 0;
    ViewRequests views{{server.session}, view, simulation, [this] { ++orders; }};
    ConnectionId ada, bob;
    std::uint64_t asked = 0;
    Vec3d before;
};

TEST_F(ViewWishes, WhoGoesBackIsAnsweredOnceTheLookIsThereAndTheWallStandsUntilThen) {
    grow(300);
    ask(ada, {.reset = true});
    EXPECT_EQ(orders, 1);
    EXPECT_EQ(answers(ada), 0u);
    EXPECT_EQ(position(), before);
    EXPECT_EQ(views.openCount(ada), 1u);
    find();
    EXPECT_EQ(answers(ada), 1u);
    EXPECT_EQ(orders, 1);
    ViewSource fresh(test::wallOfOne(), "");
    EXPECT_EQ(position(), fresh.view(simulation.scene()).value().position);
}

TEST_F(ViewWishes, CountInTheOrderInWhichTheyCame) {
    grow(300);
    ask(ada, {.reset = true});
    ask(bob, {.position = Vec3d(1, 2, 3)});
    EXPECT_EQ(answers(bob), 0u);
    find();
    EXPECT_EQ(answers(ada), 1u);
    EXPECT_EQ(answers(bob), 1u);
    EXPECT_EQ(position(), Vec3d(1, 2, 3));
    ask(bob, {.position = Vec3d(4, 5, 6)});
    EXPECT_EQ(answers(bob), 2u) << "nobody waits any more";
}

TEST_F(ViewWishes, OneLookServesAllWhoAskedBeforeIt) {
    for (int i = 0; i < 100; ++i) ask(i % 2 ? ada : bob, {.reset = true});
    EXPECT_EQ(orders, 1);
    const Sequence old = simulation.sequence();
    const AnimatedBounds bounds = animatedBounds(simulation.scene());
    grow(300);
    ask(ada, {.reset = true});
    server.take(views.surveyed(bounds, old));
    EXPECT_EQ(answers(ada) + answers(bob), 100u);
    EXPECT_EQ(orders, 2) << "the scene has changed before the last one asked";
    find();
    EXPECT_EQ(answers(ada) + answers(bob), 101u);
    ask(bob, {.reset = true});
    EXPECT_EQ(orders, 2) << "the scene is as it was then";
    EXPECT_EQ(answers(ada) + answers(bob), 102u);
}

TEST_F(ViewWishes, WhoLeavesMovesNothingAnyMore) {
    grow(300);
    ask(ada, {.reset = true});
    views.applicationLeft(ada);
    find();
    EXPECT_EQ(position(), before);
    EXPECT_EQ(views.openCount(ada), 0u);
}

}  // namespace
}  // namespace tessera
