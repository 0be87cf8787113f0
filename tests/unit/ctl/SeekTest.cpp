// Where a seek leads that goes beyond an end; streams of particles, which have none.
#include <gtest/gtest.h>

#include "client/ctl/Verbs.h"
#include "common/cores/Animation.h"
#include "common/cores/ParticleEmitter.h"
#include "tests/support/words/Words.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using test::ScriptedServer;

Blob blobOf(const std::vector<double>& numbers) {
    return Blob::of(std::span<const double>(numbers));
}

/// The crane walks four seconds: /hall/walk, of a mode. Ids follow those of the server's own scene.
ChangeList walkOf(std::int64_t mode) {
    constexpr ObjectId kWalk{20}, kAnimation{21}, kFrames{22};
    ChangeListBuilder edits;
    edits.create(kWalk, typeOf<Node>());
    edits.create(kAnimation, typeOf<Animation>());
    edits.create(kFrames, typeOf<KeyFrames>());
    edits.place(kWalk, test::kHall);
    setField<&Node::name>(edits, kWalk, std::string("walk"));
    setField<&Node::core>(edits, kWalk, kAnimation);
    setField<&Animation::channels>(edits, kAnimation, RefList{kFrames});
    setField<&Animation::mode>(edits, kAnimation, mode);
    setField<&KeyFrames::target>(edits, kFrames, test::kCraneCore);
    setField<&KeyFrames::field>(edits, kFrames, std::string("translation"));
    setField<&KeyFrames::times>(edits, kFrames, blobOf({0, 4}));
    setField<&KeyFrames::values>(edits, kFrames, blobOf({0, 0, 0, 1, 0, 0}));
    return edits.take();
}

class Seek : public testing::Test {
protected:
    CtlOutcome seek(const ScriptedServer& server, const char* seconds, bool json = false) {
        std::vector<std::string> words = {"--server", server.address(), "--timeout", "5",
                                          "seek",     "/hall/walk",     seconds};
        if (json) words.insert(words.begin(), "--json");
        return runCtl(words);
    }
    double timeOf(const ScriptedServer& server) {
        const CtlOutcome told = runCtl({"--server", server.address(), "--json", "animations"});
        return nlohmann::json::parse(told.out)["animations"][0]["time"].get<double>();
    }
};

TEST_F(Seek, BeyondTheEndSaysWhereItStopped) {
    ScriptedServer server;
    server.commit(walkOf(Animation::kOnce));
    EXPECT_EQ(seek(server, "1.5").out.rfind("/hall/walk is at 1.5 s (change", 0), 0u);
    EXPECT_EQ(seek(server, "99").out.rfind("/hall/walk stopped at 4 s: 99 s is beyond its end, 4 s (change", 0), 0u)
        << seek(server, "99").out;
    EXPECT_EQ(
        seek(server, "4.0000001").out.rfind("/hall/walk stopped at 4 s: 4.0000001 s is beyond its end, 4 s (change", 0),
        0u)
        << "no contradiction";
    EXPECT_EQ(timeOf(server), 4) << "what is shown is what it says";
    EXPECT_EQ(seek(server, "1e10").out.rfind("/hall/walk stopped at 4 s: 1e+10 s is beyond its end, 4 s (change", 0),
              0u)
        << seek(server, "1e10").out;
    EXPECT_EQ(
        seek(server, "-1e300").out.rfind("/hall/walk stopped at 0 s: -1e+300 s is before its beginning (change", 0), 0u)
        << seek(server, "-1e300").out;
    EXPECT_EQ(seek(server, "-2").out.rfind("/hall/walk stopped at 0 s: -2 s is before its beginning (change", 0), 0u);
    const auto json = nlohmann::json::parse(seek(server, "99", true).out);
    EXPECT_EQ(json["time"], 4);
    EXPECT_EQ(json["length"], 4);
    EXPECT_EQ(nlohmann::json::parse(seek(server, "4", true).out)["time"], 4);
}

TEST_F(Seek, BeyondTheEndOfWhatGoesRoundSaysWhereItIs) {
    ScriptedServer server;
    server.commit(walkOf(Animation::kLoop));
    EXPECT_EQ(
        seek(server, "99").out.rfind("/hall/walk is at 3 s: 99 s is beyond its end, 4 s, and it goes round (change", 0),
        0u)
        << seek(server, "99").out;
    EXPECT_EQ(timeOf(server), 3);
    EXPECT_EQ(nlohmann::json::parse(seek(server, "-1", true).out)["time"], 3);
    EXPECT_EQ(nlohmann::json::parse(seek(server, "2.5", true).out)["time"], 2.5);
}

TEST_F(Seek, OfWhatGoesToAndFroSaysWhenItIsOnItsWayBack) {
    ScriptedServer server;
    server.commit(walkOf(Animation::kPingPong));
    EXPECT_EQ(seek(server, "5")
                  .out.rfind(
                      "/hall/walk is at 5 s: 5 s is beyond its end, 4 s, and it is on its way back, at 3 s (change", 0),
              0u)
        << seek(server, "5").out;
    EXPECT_EQ(timeOf(server), 5);
    // A list says where it is within its length.
    const std::string listed = runCtl({"--server", server.address(), "animations"}).out;
    EXPECT_EQ(listed.find("5.000"), std::string::npos) << listed;
    EXPECT_WORDS(listed);
    EXPECT_EQ(nlohmann::json::parse(
                  runCtl({"--server", server.address(), "--json", "animations"}).out)["animations"][0]["shown"],
              3);
    EXPECT_EQ(
        seek(server, "9").out.rfind("/hall/walk is at 1 s: 9 s is beyond its end, 4 s, and it goes round (change", 0),
        0u)
        << seek(server, "9").out;
}

/// /hall/fountain plays, with no end.
class SeekStream : public testing::Test {
protected:
    SeekStream() {
        constexpr ObjectId kFountain{20}, kEmitter{21};
        ChangeListBuilder edits;
        edits.create(kFountain, typeOf<Node>());
        edits.create(kEmitter, typeOf<ParticleEmitter>());
        edits.place(kFountain, test::kHall);
        setField<&Node::name>(edits, kFountain, std::string("fountain"));
        setField<&Node::core>(edits, kFountain, kEmitter);
        setField<&ParticleEmitter::mode>(edits, kEmitter, ParticleEmitter::kQuads);
        server_.commit(edits.take());
    }
    CtlOutcome say(std::vector<std::string> words) {
        words.insert(words.begin(), {"--server", server_.address(), "--timeout", "5"});
        return runCtl(words);
    }
    nlohmann::json listed() { return nlohmann::json::parse(say({"--json", "animations"}).out)["animations"][0]; }

    ScriptedServer server_;
};

TEST_F(SeekStream, AStreamOfParticlesPlaysStandsAndGoesToATimeAsAnimationsDo) {
    EXPECT_EQ(listed()["kind"], "ParticleEmitter");
    EXPECT_EQ(listed()["mode"], "-") << "how it looks is no way to play";
    EXPECT_EQ(say({"pause", "/hall/fountain"}).out.rfind("/hall/fountain stands (change", 0), 0u);
    EXPECT_EQ(listed()["playing"], false);
    EXPECT_EQ(say({"seek", "/hall/fountain", "12.5"}).out.rfind("/hall/fountain is at 12.5 s (change", 0), 0u);
    EXPECT_EQ(listed()["time"], 12.5);
    EXPECT_TRUE(listed()["length"].is_null()) << "it has no end";
    EXPECT_EQ(say({"speed", "/hall/fountain", "2"}).out.rfind("/hall/fountain has the speed 2 (change", 0), 0u);
    EXPECT_EQ(listed()["speed"], 2);
    EXPECT_EQ(say({"play", "/hall/fountain"}).out.rfind("/hall/fountain plays (change", 0), 0u);
    EXPECT_EQ(listed()["playing"], true);
}

TEST_F(SeekStream, WhatIsBeforeTheBeginningOfAStreamIsRefusedInWords) {
    const CtlOutcome refused = say({"seek", "/hall/fountain", "-1"});
    EXPECT_NE(refused.exitCode, 0);
    EXPECT_WORDS(refused.err);
    EXPECT_EQ(listed()["time"], 0);
}

}  // namespace
}  // namespace tessera
