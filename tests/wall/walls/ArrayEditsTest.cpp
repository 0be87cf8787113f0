/// A large array whose ranges an application edits: hosts make the edits themselves, one that comes later fetches what
/// came of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/application/Application.h"
#include "common/cores/Geometry.h"
#include "common/cores/Node.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;

TEST(ArrayEdits, OfALargeMeshAreTheSameEverywhere) {
    AskedWall wall({.wall = "1x1", .scene = kYard, .widthPx = 160, .heightPx = 90});
    const auto application = Application::connect(
        {.address = toString(wall.address()), .name = "editor", .followScene = false, .timeout = 120s},
        wall.platform("editor"));
    ASSERT_TRUE(application) << application.error().message;
    ASSERT_TRUE((*application)->waitForFrame(60s));

    // A sheet of 400 x 400 points in front of the viewer: 1.9 MB of places.
    constexpr std::uint32_t kSide = 400;
    std::vector<float> places;
    std::vector<std::uint32_t> faces;
    for (std::uint32_t y = 0; y < kSide; ++y)
        for (std::uint32_t x = 0; x < kSide; ++x) {
            const float step = 2.0F / kSide;
            for (const float number : {step * static_cast<float>(x) - 1, step * static_cast<float>(y), -3.0F})
                places.push_back(number);
            const std::uint32_t here = y * kSide + x;
            if (x + 1 < kSide && y + 1 < kSide)
                for (const std::uint32_t corner :
                     {here, here + 1, here + kSide, here + 1, here + kSide + 1, here + kSide})
                    faces.push_back(corner);
        }
    ChangeListBuilder edits;
    const ObjectId mesh{kFirstPlaceholder}, node{kFirstPlaceholder + 1};
    edits.create(mesh, typeOf<Geometry>());
    setField<&Geometry::positions>(edits, mesh, Blob::of(std::span<const float>(places)));
    setField<&Geometry::indices>(edits, mesh, Blob::of(std::span<const std::uint32_t>(faces)));
    edits.create(node, typeOf<Node>());
    setField<&Node::name>(edits, node, std::string("sheet"));
    setField<&Node::core>(edits, node, mesh);
    edits.place(node, kRootNode);
    const auto made = (*application)->propose(edits.take());
    ASSERT_TRUE(made) << made.error().message;
    const auto id = std::ranges::find(made->ids, mesh, [](const auto& pair) { return pair.first; });
    ASSERT_NE(id, made->ids.end());
    ASSERT_GE(places.size() * sizeof(float), Blob::kPagedBytes);

    std::mt19937_64 random(1);
    const auto edit = [&] {
        const std::size_t first = random() % (places.size() / 3 - 80) * 3;
        for (std::size_t i = first + 2; i < first + 240; i += 3)
            places[i] = -3.0F - 1e-3F * static_cast<float>(random() % 500);
        ChangeListBuilder list;
        list.setRange(id->second, typeOf<Geometry>(), fieldId<&Geometry::positions>, first * sizeof(float),
                      Blob::of(std::span<const float>(places).subspan(first, 240)));
        const auto done = (*application)->propose(list.take());
        ASSERT_TRUE(done) << done.error().message;
    };
    for (int i = 0; i < 60; ++i) edit();
    // One that has not seen the edits draws and says the same as those that have.
    wall.killHost("all");
    wall.startHost("all");
    for (int i = 0; i < 60; ++i) edit();
    ASSERT_TRUE((*application)->waitForFrame(60s));
    const auto undone = (*application)->undo();
    ASSERT_TRUE(undone) << undone.error().message;
    const auto redone = (*application)->redo();
    ASSERT_TRUE(redone) << redone.error().message;

    const auto there = (*application)->describeNode("/sheet");
    ASSERT_TRUE(there) << there.error().message;
    const auto told = (*application)->fetch(std::vector{there->id});
    ASSERT_TRUE(told) << told.error().message;
    EXPECT_EQ(told->coreOf(there->id).as<Geometry>()->positions, Blob::of(std::span<const float>(places)));

    const nlohmann::json report = wall.SimulatedWall::finish();  // the kill is a fault
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

}  // namespace
}  // namespace tessera::simulation
