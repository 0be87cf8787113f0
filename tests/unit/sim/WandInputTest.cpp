#include "server/sim/navigation/WandInput.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tessera {
namespace {

WandState wandWith(std::vector<double> axes) {
    return {.name = "right", .tracked = true, .axes = std::move(axes)};
}

TEST(WandInput, AStickGoesWhereTheWandPointsAndTurns) {
    WandState wand = wandWith({0, 1});
    EXPECT_LT((inputOf(wand).move - Vec3d(0, 0, -1)).norm(), 1e-12);
    // Pointing to the left, and pulled: to the right.
    wand.orientation = Quatd(Eigen::AngleAxisd(M_PI / 2, Vec3d::UnitY()));
    wand.axes = {0.55, -0.55};
    const NavigationInput input = inputOf(wand);
    EXPECT_LT((input.move - Vec3d(0.5, 0, 0)).norm(), 1e-12);
    EXPECT_NEAR(input.turn.x(), 0.5, 1e-12);
    EXPECT_TRUE(input.actions.empty());
}

TEST(WandInput, NothingIsWantedAtRestSilentOrOfNumbersThatAreNone) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    WandState silent = wandWith({1, 1});
    silent.tracked = false;
    for (const WandState& wand : {wandWith({}), wandWith({0.1, -0.1}), wandWith({nan, nan}), silent})
        EXPECT_FALSE(inputOf(wand).steers());
    // As far as a stick goes.
    EXPECT_EQ(inputOf(wandWith({-inf, 7})).turn.x(), -1);
    EXPECT_LT((inputOf(wandWith({-inf, 7})).move - Vec3d(0, 0, -1)).norm(), 1e-12);
}

}  // namespace
}  // namespace tessera
