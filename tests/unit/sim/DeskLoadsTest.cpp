// What is told of files on their way, and how they are cancelled.
#include <gtest/gtest.h>

#include "common/codec/ApplicationCodec.h"
#include "common/scene/Edits.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"
#include "tests/unit/sim/GatedImporter.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

class DeskLoads : public test::DeskStage {
protected:
    ConnectionId join(const std::string& name, Role role = Role::kOperator) {
        const ConnectionId connection = server.hello(name, PeerRole::kApplication);
        desk.applicationJoined(connection, {.name = name, .who = {.role = role, .name = name + "'s person"}});
        return connection;
    }
    void ask(ConnectionId connection, const ApplicationRequest& request) {
        server.take(desk.received({connection, "somebody", ++asked, share(encodeRequest(request))}, server.now));
    }
    void load(ConnectionId connection, const std::string& name) {
        ask(connection, request::LoadFile{.path = importer.scratch.write(name, test::GatedImporter::kBox)});
    }
    /// One that takes several frames: it goes into the next one.
    void openForMany(const std::string& name) {
        const std::string file = importer.scratch.write(
            name, R"(node { name: "a" repeat { count: 20 step { x: 1 } } node { name: "b" repeat { count: 400 } } })");
        ask(application, request::LoadFile{.path = file});
        server.take(desk.prepared(*made.pop(), server.now));
    }
    message::Reply lastReply(ConnectionId connection) { return server.sent<message::Reply>(connection).back(); }
    std::vector<LoadState> loadsTold(ConnectionId connection) {
        ask(connection, request::GetLoads{});
        return std::get<answer::Loads>(decodeAnswer(lastReply(connection).body).value()).loads;
    }
    std::size_t replies(ConnectionId connection) { return server.sent<message::Reply>(connection).size(); }

    test::GatedImporter importer;
    Channel<Preparation> made{64};
    Loader gated{importer.options,
                 std::make_shared<SceneFiles>(importer.options, std::vector{importer.scratch.path("")}),
                 [this](Preparation done) { made.push(std::move(done)); }};
    RequestDesk desk{{.wall = wall,
                      .blobs = blobs,
                      .session = server.session,
                      .simulation = simulation,
                      .view = view,
                      .loader = gated,
                      .drags = drags}};
    std::uint64_t asked = 0;
    ConnectionId application = join("somebody");
};

TEST_F(DeskLoads, AreToldWithTheirPersonAndCancelledByEditors) {
    const ConnectionId ada = join("ada"), bob = join("bob", Role::kEditor), eve = join("eve", Role::kViewer);
    EXPECT_TRUE(loadsTold(eve).empty());
    load(ada, "slow.tsct");
    importer.awaitBegun(1);
    const std::vector<LoadState> told = loadsTold(eve), own = loadsTold(ada);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].path, importer.scratch.path("slow.tsct"));
    EXPECT_EQ(told[0].stage, "reading");
    EXPECT_EQ(told[0].person, "ada's person");
    EXPECT_FALSE(told[0].yours);
    EXPECT_TRUE(own.at(0).yours);

    ask(eve, request::CancelLoad{told[0].load});
    EXPECT_WORDS(lastReply(eve).error);
    ask(bob, request::CancelLoad{told[0].load + 1});
    EXPECT_EQ(lastReply(bob).code, ErrorCode::kNotFound);
    const std::size_t before = replies(ada);
    ask(bob, request::CancelLoad{told[0].load});
    EXPECT_EQ(lastReply(bob).error, "");
    ASSERT_EQ(replies(ada), before + 1) << "at once";
    EXPECT_EQ(lastReply(ada).error, importer.scratch.path("slow.tsct") + ": cancelled by bob's person");
    // What its thread says then is nobody's any more.
    server.take(desk.prepared(*made.pop(), server.now));
    EXPECT_EQ(replies(ada), before + 1) << "once";
    EXPECT_TRUE(loadsTold(eve).empty());
    ask(bob, request::CancelLoad{told[0].load});
    EXPECT_EQ(lastReply(bob).code, ErrorCode::kNotFound);
    ask(bob, request::CancelLoad{OpenEdits::kStartScene});
    EXPECT_EQ(lastReply(bob).code, ErrorCode::kRefused);
}

TEST_F(DeskLoads, ThatAppearAreNotCancelled) {
    const ConnectionId ada = join("ada");
    openForMany("many.tsct");
    const std::uint64_t load = loadsTold(ada).at(0).load;
    (void)desk.takeEdits();
    const std::vector<LoadState> told = loadsTold(ada);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].stage, "appearing");
    EXPECT_GT(told[0].part, 0);
    ask(ada, request::CancelLoad{load});
    EXPECT_EQ(lastReply(ada).code, ErrorCode::kRefused);
    EXPECT_WORDS(lastReply(ada).error);
}

/// As before the first frame, when no host is there yet, and behind another load that is still appearing.
TEST_F(DeskLoads, OfWhichNothingAppearsYetWaitAndAreCancelled) {
    const ConnectionId ada = join("ada");
    for (const bool behindAnother : {false, true}) {
        if (behindAnother) {
            openForMany("many.tsct");
            (void)desk.takeEdits();
        }
        load(ada, "quick.tsct");
        server.take(desk.prepared(*made.pop(), server.now));
        server.take(desk.blobsEverywhere(loadsTold(ada).back().load));
        if (behindAnother) (void)desk.takeEdits();
        const LoadState told = loadsTold(ada).back();
        EXPECT_EQ(told.path, importer.scratch.path("quick.tsct"));
        EXPECT_EQ(told.stage, "waiting");
        EXPECT_LT(told.part, 0);
        ask(ada, request::CancelLoad{told.load});
        EXPECT_EQ(lastReply(ada).error, "");
        EXPECT_EQ(loadsTold(ada).size(), behindAnother ? 1u : 0u);
        for (int i = 0; i < 5; ++i)
            for (const Edit& edit : desk.takeEdits()) EXPECT_NE(edit.ticket, told.load) << "it is in no frame";
    }
}

TEST_F(DeskLoads, WhoseNodeIsRemovedMeanwhileSayWhere) {
    const ConnectionId ada = join("ada");
    for (const bool late : {false, true}) {
        test::ListMaker maker;
        maker.node("plane", kRootNode);
        ASSERT_TRUE(simulation.step(false, test::one(maker.builder.take())).outcomes.at(0).result);
        const ObjectId plane = findNode(simulation.scene(), "/plane").value();
        const std::string file = importer.scratch.write("quick.tsct", test::GatedImporter::kBox);
        ask(ada, request::LoadFile{.path = file, .parent = plane});
        Preparation done = *made.pop();
        const auto remove = [&] {
            const ChangeList removal = removalList(simulation.scene(), plane).value();
            ASSERT_TRUE(simulation.step(false, test::one(removal)).outcomes.at(0).result);
        };
        if (!late) remove();
        server.take(desk.prepared(std::move(done), server.now));
        if (late) {
            server.take(desk.blobsEverywhere(loadsTold(ada).at(0).load));
            std::vector<Edit> edits = desk.takeEdits();
            ASSERT_EQ(edits.size(), 1u);
            remove();
            server.take(desk.committed(simulation.step(false, std::move(edits)), 1_frame, {}));
        }
        EXPECT_EQ(lastReply(ada).code, ErrorCode::kNotFound);
        EXPECT_EQ(lastReply(ada).error,
                  file + " is not loaded: /plane (#" + std::to_string(plane.value) +
                      "), below which it was to go, has been removed meanwhile; load it below another node, or bring "
                      "that one back (undo) and load it again");
        EXPECT_TRUE(loadsTold(ada).empty());
    }
}

TEST_F(DeskLoads, ThatHostsStillFetchAreSentAndCancelled) {
    const ConnectionId ada = join("ada"), bob = join("bob");
    const std::string file = importer.scratch.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::uint64_t first = 0;
    for (const bool cancelled : {true, false}) {
        ask(ada, request::LoadFile{.path = file});
        server.take(desk.prepared(*made.pop(), server.now));
        const std::vector<LoadState> told = loadsTold(ada);
        ASSERT_EQ(told.size(), 1u);
        EXPECT_EQ(told[0].stage, "sending");
        EXPECT_LT(told[0].part, 0);
        if (cancelled) {
            first = told[0].load;
            ask(bob, request::CancelLoad{first});
            EXPECT_EQ(lastReply(bob).error, "");
            EXPECT_EQ(lastReply(ada).error, file + ": cancelled by bob's person");
            EXPECT_TRUE(loadsTold(ada).empty());
            continue;
        }
        server.take(desk.blobsEverywhere(first));  // too late
        EXPECT_EQ(loadsTold(ada).at(0).stage, "sending");
        server.take(desk.blobsEverywhere(told[0].load));
        EXPECT_EQ(loadsTold(ada).at(0).stage, "waiting");
        ASSERT_EQ(desk.takeEdits().size(), 1u);
        EXPECT_EQ(loadsTold(ada).at(0).stage, "appearing");
        ask(bob, request::CancelLoad{told[0].load});
        EXPECT_EQ(lastReply(bob).code, ErrorCode::kRefused);
    }
}

}  // namespace
}  // namespace tessera
