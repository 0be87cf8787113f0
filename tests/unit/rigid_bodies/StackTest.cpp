/// Heavy on light, high towers: what few passes of a solver do not reach.
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

/// A body lies on one a thousand times lighter, that lies on the floor: how deep are they in each other?
TEST(Stack, AHeavyBodyDoesNotSinkIntoALightOne) {
    for (const bool mesh : {false, true})
        for (const double ratio : {10.0, 100.0, 1000.0})
            for (const double gap : {0.0, 0.1}) {
                const Shape box = hullShape(boxPoints({1, 1, 1})),
                            slab = mesh ? boxMesh({10, 1, 10}) : hullShape(boxPoints({10, 1, 10}));
                World w;
                w.add(slab, Vec3d(0, -0.5, 0), 0);
                const std::uint32_t light = w.add(box, Vec3d(0, 0.5, 0), 1),
                                    heavy = w.add(box, Vec3d(0.1, 1.5 + gap, 0.05), ratio);
                double deepest = 0;
                for (int frame = 0; frame < 600; ++frame) {
                    w.step();
                    const Box a = w.boxOf(light), b = w.boxOf(heavy);
                    deepest = std::max({deepest, a.upper.y() - b.lower.y(), -a.lower.y()});
                }
                EXPECT_LT(deepest, 0.01) << "mesh " << mesh << " ratio " << ratio << " gap " << gap;
                EXPECT_EQ(w.last.asleep, 2U) << "mesh " << mesh << " ratio " << ratio << " gap " << gap;
            }
}

TEST(Stack, ATowerOfFortyComesToRest) {
    const Shape box = hullShape(boxPoints({1, 1, 1})), floor = boxMesh({10, 1, 10});
    for (const double gap : {0.0, 0.01}) {
        World w;
        w.add(floor, Vec3d(0, -0.5, 0), 0);
        for (int i = 0; i < 40; ++i) w.add(box, Vec3d(0, 0.5 + i * (1 + gap), 0), 1);
        int frame = 0;
        while (frame < 900 && w.last.asleep < 40) {
            w.step();
            ++frame;
        }
        EXPECT_LE(frame, 600) << "gap " << gap << ", " << w.last.asleep << " asleep";
        EXPECT_NEAR(w.at(40).y(), 39.5, 0.4) << gap;
        EXPECT_LT(w.at(40).x() * w.at(40).x() + w.at(40).z() * w.at(40).z(), 0.01) << gap;
    }
}

}  // namespace
}  // namespace tessera::rigidbodytest
