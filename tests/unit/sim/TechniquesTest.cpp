// The shipped scene that looks at one pair of models in nine ways: each lane shows where it touches.
#include <gtest/gtest.h>

#include <map>

#include "common/cores/Motion.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/import/ImportFixture.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

TEST(Techniques, EachLaneListsItsContactsAndNoneIsLeftOut) {
    Expected<ImportedScene> scene =
        importScene(std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/techniques.tsct", kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    Simulation simulation;
    const Expected<CommittedFrame> loaded = simulation.load({scene->list});
    ASSERT_TRUE(loaded) << loaded.error().message;
    (void)simulation.step(true, {});
    // Where the hand is deepest.
    ChangeListBuilder seek;
    setField<&Motion::time>(
        seek, simulation.scene().get<Node>(findNode(simulation.scene(), "/hand/motion").value())->core, 2.5);
    (void)simulation.step(false, test::one(seek.take()));
    const FrameResult deepest = simulation.step(false, {});
    EXPECT_EQ(deepest.collision.counters.contactsLeftOut, 0u);
    std::map<ObjectId, std::size_t> of;
    for (const Contact& contact : deepest.collision.contacts) ++of[contact.objectA];
    EXPECT_EQ(of.size(), 9u);
}

}  // namespace
}  // namespace tessera
