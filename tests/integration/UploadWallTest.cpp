/// An array that is larger than one message could ever be: sent by an application, fetched by a host, shown by the
/// wall.
#include <gtest/gtest.h>

#include "common/application/Application.h"
#include "common/cores/ApplicationData.h"
#include "common/cores/Node.h"
#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

TEST(UploadWall, AnArrayOfThreeHundredMiBIsCommittedAndFramesGoOn) {
    ThreadWall wall({.wall = "1x1"});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    wall.startClient("all");
    const auto application =
        Application::connect({.address = wall.address(), .name = "sender", .followScene = false, .timeout = 120s});
    ASSERT_TRUE(application) << application.error().message;
    ASSERT_TRUE((*application)->waitForFrame(60s));

    constexpr std::size_t kSize = std::size_t{300} << 20;
    Bytes bytes(kSize);
    for (std::size_t at = 0; at < kSize; at += 4096) bytes[at] = static_cast<std::byte>(at >> 12);
    const Blob array(std::move(bytes));
    ChangeListBuilder edits;
    const ObjectId data{kFirstPlaceholder}, node{kFirstPlaceholder + 1};
    edits.create(data, typeOf<ApplicationData>());
    setField<&ApplicationData::data>(edits, data, array);
    edits.create(node, typeOf<Node>());
    setField<&Node::name>(edits, node, std::string("luggage"));
    setField<&Node::core>(edits, node, data);
    edits.place(node, kRootNode);
    const auto committed = (*application)->propose(edits.take());
    ASSERT_TRUE(committed) << committed.error().message;
    const auto there = (*application)->describeNode("/luggage");
    ASSERT_TRUE(there) << there.error().message;
    const auto told = (*application)->fetch(std::vector{there->id});
    ASSERT_TRUE(told) << told.error().message;
    EXPECT_EQ(told->coreOf(there->id).as<ApplicationData>()->data, array);
    // It is committed when every host has it.
    const auto frame = (*application)->waitForFrame(60s);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->shown, std::vector<std::string>{"all"});

    const nlohmann::json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

}  // namespace
}  // namespace tessera::test
