/// What a frame hands out can be fetched, whatever becomes of it in the scene.
#include "server/sim/FrameMaker.h"

#include <gtest/gtest.h>

#include "server/sim/frame/Simulation.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

// A list sets an array and edits a range of it: the scene has what comes out, and only the list names what it was made
// of. A host that does not have that asks for it.
TEST(FrameMaker, ArraysThatAListNamesCanBeFetchedThoughTheSceneHasLetThemGo) {
    const Wall wall = test::wallOfOne();
    Simulation simulation;
    ViewSource view(wall, "");
    BlobStore blobs;
    Report report(wall, "");
    Log log("test");
    FrameMaker maker({.simulation = simulation, .view = view, .blobs = blobs, .report = report, .log = log});

    test::ListMaker made;
    const ObjectId box = made.box({1, 1, 1});
    made.node("box", kRootNode, box);
    std::vector<Edit> edits(1);
    edits[0].list = made.builder.take();
    const FrameResult first = maker.make(FrameNumber(0), std::move(edits), {}, {});
    ASSERT_TRUE(first.outcomes[0].result) << first.outcomes[0].result.error().message;
    ObjectId geometry;
    for (const auto& [placeholder, id] : first.outcomes[0].result->ids)
        if (placeholder == box) geometry = id;

    Blob whole = makeBox({2, 2, 2}).toArrays().positions;
    const BlobId name = whole.id();
    const std::vector<float> corner = {5, 5, 5};
    ChangeListBuilder both;
    setField<&Geometry::positions>(both, geometry, whole);
    both.setRange(geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>, 0,
                  Blob::of(std::span<const float>(corner)));
    whole = {};
    edits.assign(1, {});
    edits[0].list = both.take();
    BlobId result;
    {
        const FrameResult second = maker.make(FrameNumber(1), std::move(edits), {}, {});
        ASSERT_TRUE(second.outcomes[0].result) << second.outcomes[0].result.error().message;
        result = simulation.scene().get<Geometry>(geometry)->positions.id();
    }
    ASSERT_NE(result, name);
    EXPECT_TRUE(blobs.find(name).resident());
    EXPECT_TRUE(blobs.find(result).resident());
    // Not for ever: ten seconds and another array later nobody asks any more.
    edits.assign(1, {});
    setField<&Geometry::positions>(both, geometry, makeBox({3, 3, 3}).toArrays().positions);
    edits[0].list = both.take();
    (void)maker.make(FrameNumber(700), std::move(edits), {}, {});
    EXPECT_FALSE(blobs.find(name).resident());
}

}  // namespace
}  // namespace tessera
