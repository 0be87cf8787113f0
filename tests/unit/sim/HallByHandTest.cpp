// The shipped scene in which panels are carried through a hall: frame by frame, as the wall would show it.
#include <gtest/gtest.h>

#include "server/sim/frame/Simulation.h"
#include "tests/unit/import/ImportFixture.h"
#include "tests/unit/response/FaceOracle.h"

namespace tessera {
namespace {

/// The first node below (or at) one that bears a Geometry.
ObjectId shapeBelow(const Aspect& scene, ObjectId node) {
    const Node& at = *scene.get<Node>(node);
    if (scene.coreOf<Geometry>(at)) return node;
    for (const ObjectId child : at.children)
        if (const ObjectId found = shapeBelow(scene, child)) return found;
    return {};
}

TEST(HallByHand, EachPanelStopsWhereARealOneWouldAndNonePassesAnything) {
    Expected<ImportedScene> scene =
        importScene(std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/hall-by-hand.tsct", kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    Simulation simulation;
    const Expected<CommittedFrame> loaded = simulation.load({scene->list});
    ASSERT_TRUE(loaded) << loaded.error().message;
    const auto shape = [&](const char* path) {
        return shapeBelow(simulation.scene(), findNode(simulation.scene(), path).value());
    };
    const std::vector<ObjectId> panels{shape("/panels/carried"), shape("/panels/thrown"),
                                       shape("/panels/led into the corner")};
    const auto place = [&](std::size_t i) -> Vec3d {
        return worldTransform(simulation.scene(), panels[i]).translation();
    };
    const FaceOracle oracle(simulation.scene(), panels, {shape("/hall")});
    const FaceOracle::Meetings start = oracle.meetings();
    EXPECT_GE(start.size(), 6u) << "all stand on the floor";
    bool throughTheDoor = false;
    double largestStep = 0;
    for (int frame = 0; frame < 330; ++frame) {
        const Vec3d before = place(1);
        (void)simulation.step(frame == 0, {});
        const auto wrong = FaceOracle::wrong(start, oracle.meetings(), 1e-4 * 2.3, 1e-9);
        ASSERT_FALSE(wrong) << *wrong << ", frame " << frame;
        throughTheDoor = throughTheDoor || (place(0).x() > 2.9 && std::abs(place(0).z()) < 0.1);
        largestStep = std::max(largestStep, (place(1) - before).norm());
        EXPECT_LT(place(1).x(), -0.06) << "frame " << frame;
    }
    EXPECT_TRUE(throughTheDoor);
    EXPECT_NEAR(place(0).z(), -3.9 + 0.01, 1e-3) << "carried against the wall";
    EXPECT_GT(largestStep, 0.9);
    EXPECT_NEAR(place(1).x(), -0.05 - 0.01, 1e-3) << "thrown at the partition";
    EXPECT_NEAR(place(2).z(), -3.9 + 0.01, 1e-3) << "slid along the wall";
    EXPECT_NEAR(place(2).x(), 5.9 - 0.5, 1e-3) << "into the corner";
}

}  // namespace
}  // namespace tessera
