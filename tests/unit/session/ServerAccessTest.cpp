// Who may come in, as what: by a word, by a key, from this machine and from others.
#include <gtest/gtest.h>

#include <algorithm>

#include "ServerFixture.h"

#include "tests/support/words/Words.h"

namespace tessera {
namespace {

struct Gated : ServerFixture {
    Gated()
        : ServerFixture([] {
              ServerSessionConfig config = twoHosts();
              config.access = {{"looks", "changes", "runs"}, "the-door"};
              config.owner = "ada";
              return config;
          }()) {}

    /// Comes from there, sealed or not, with a key or without, and says who it is.
    ConnectionId knock(const std::string& word, const PeerOrigin& from, PeerRole role = PeerRole::kApplication,
                       const std::string& name = "") {
        const ConnectionId connection(++lastConnection);
        take(session.connectionOpened(connection, now, from.near, from.source));
        if (from.sealed) session.connectionSecured(connection, from.key);
        message::Hello hello = greeting(!name.empty() ? name : role == PeerRole::kHost ? "a" : "asks", role);
        hello.access = word;
        say(connection, hello);
        return connection;
    }
    std::string refusalOf(ConnectionId connection) {
        const auto refused = sent<message::Refused>(connection);
        return refused.empty() ? "" : refused[0].reason;
    }
};

const PeerOrigin kHere{.near = true}, kElsewhere{}, kSealed{.near = false, .sealed = true};

PeerOrigin with(Identity identity, std::string fault = {}) {
    return {.near = false,
            .sealed = true,
            .key = Credential{.identity = std::move(identity), .serial = "5", .fault = std::move(fault)}};
}
Identity hostOf(const std::string& name) {
    return {.wall = "cave", .kind = Identity::Kind::kHost, .name = name};
}
Identity person(Role role) {
    return {.wall = "cave", .kind = Identity::Kind::kPerson, .name = "ada", .role = role};
}

TEST(ServerAccess, OnThisMachineTheWordsOfItsUserLetIn) {
    Gated s;
    for (const auto& [word, role] :
         {std::pair("looks", Role::kViewer), std::pair("changes", Role::kEditor), std::pair("runs", Role::kOperator)})
        for (const PeerOrigin& from : {kHere, kSealed}) {
            s.forget();
            EXPECT_EQ(s.refusalOf(s.knock(word, from)), "");
            ASSERT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u);
            EXPECT_EQ(s.actions<server_action::ApplicationJoined>()[0].who.role, role);
        }
    s.forget();
    EXPECT_EQ(s.refusalOf(s.knock("runs", kHere, PeerRole::kHost)), "");
    EXPECT_EQ(s.state("a"), HostState::kJoining);
}

TEST(ServerAccess, OthersOfThisMachineAreRefusedInWordsAndDoNotComeAgain) {
    Gated s;
    for (const PeerRole role : {PeerRole::kApplication, PeerRole::kHost}) {
        const ConnectionId without = s.knock("", kHere, role);
        EXPECT_WORDS(s.refusalOf(without));
        EXPECT_FALSE(s.sent<message::Refused>(without)[0].retry);
        // A wrong word lets nobody in, wherever they are.
        for (const PeerOrigin& from : {kHere, kElsewhere, kSealed})
            EXPECT_NE(s.refusalOf(s.knock("guessed", from, role)), "");
    }
    for (const std::string word : {"looks", "changes"})
        EXPECT_WORDS(s.refusalOf(s.knock(word, kHere, PeerRole::kHost)));
    EXPECT_TRUE(s.actions<server_action::ApplicationJoined>().empty());
}

/// Whatever they say: without TLS others could read a word.
TEST(ServerAccess, FromElsewhereNobodyComesInPlainly) {
    Gated s;
    for (const char* word : {"", "looks", "changes", "runs", "guessed"})
        for (const PeerRole role : {PeerRole::kApplication, PeerRole::kHost}) {
            const ConnectionId plain = s.knock(word, kElsewhere, role);
            EXPECT_WORDS(s.refusalOf(plain));
            const auto refused = s.sent<message::Refused>(plain);
            ASSERT_EQ(refused.size(), 1u);
            EXPECT_FALSE(refused[0].retry);
            EXPECT_EQ(refused[0].code, ErrorCode::kNetwork);  // the program ends with 4
        }
    EXPECT_TRUE(s.actions<server_action::ApplicationJoined>().empty());
    EXPECT_NE(s.state("a"), HostState::kJoining);
}

TEST(ServerAccess, AKeySaysWhoComesAndNothingElseDoes) {
    Gated s;
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator})
        for (const char* word : {"", "looks", "runs", "guessed"}) {  // beside a key it counts for nothing
            s.forget();
            EXPECT_EQ(s.refusalOf(s.knock(word, with(person(role)))), "");
            ASSERT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u);
            EXPECT_EQ(s.actions<server_action::ApplicationJoined>()[0].who.role, role);
        }
    s.forget();
    const auto refused = [&](const PeerOrigin& from, PeerRole role, const std::string& name) {
        EXPECT_WORDS(s.refusalOf(s.knock("runs", from, role, name)));
    };
    refused(with(hostOf("b")), PeerRole::kHost, "a");
    refused(with(hostOf("a")), PeerRole::kApplication, "a");
    refused(with(person(Role::kOperator)), PeerRole::kHost, "a");
    refused(with({.wall = "cave", .kind = Identity::Kind::kServer, .name = {}}), PeerRole::kHost, "a");
    refused(with({.wall = "cave", .kind = Identity::Kind::kServer, .name = {}}), PeerRole::kApplication, "");
    refused(with(hostOf("a"), "it has been revoked"), PeerRole::kHost, "a");
    refused(with(person(Role::kOperator), "it has ended"), PeerRole::kApplication, "");
    refused(kSealed, PeerRole::kHost, "a");
    EXPECT_TRUE(s.actions<server_action::ApplicationJoined>().empty());
    EXPECT_WORDS(s.refusalOf(s.knock("", kSealed)));
    EXPECT_EQ(s.refusalOf(s.knock("", with(hostOf("a")), PeerRole::kHost, "a")), "");
    EXPECT_EQ(s.state("a"), HostState::kJoining);
}

/// For whom it asks is the door's word, and nobody else's.
TEST(ServerAccess, TheServersOwnDoorComesInForOthers) {
    Gated s;
    const AccessTokens words{{"looks", "changes", "runs"}, "the-door"};
    for (const Entrant& who : {Entrant{Role::kViewer, Entrant::By::kKey, "ada/x", "10.0.0.7"},
                               Entrant{Role::kOperator, Entrant::By::kPass, "ci", "fe80::1%eth0"},
                               Entrant{Role::kEditor, Entrant::By::kWord, "", ""}}) {
        s.forget();
        EXPECT_EQ(s.refusalOf(s.knock(words.ofDoorFor(who), kHere)), "");
        ASSERT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u);
        EXPECT_EQ(s.actions<server_action::ApplicationJoined>()[0].who, who);
        EXPECT_NE(s.refusalOf(s.knock(words.ofDoorFor(who), kSealed)), "") << "the door is on this machine";
    }
    s.forget();
    const std::string ada = toText({Role::kOperator, Entrant::By::kKey, "ada", "10.0.0.7"});
    const std::vector<std::string> others{
        "the-dooR/" + ada,         "/" + ada, ada, "the-door", "the-door/", "runs/" + ada, "the-door/operator/9///ada",
        "the-door/operator/3//ada"};
    for (const std::string& said : others) EXPECT_NE(s.refusalOf(s.knock(said, kHere)), "") << said;
    EXPECT_TRUE(s.actions<server_action::ApplicationJoined>().empty());
}

TEST(ServerAccess, ABulkConnectionComesWithTheKeyOfItsControlConnection) {
    for (const PeerOrigin& control : {kHere, kSealed, with(person(Role::kEditor))})
        for (const PeerOrigin& bulk : {kHere, kElsewhere, kSealed, with(person(Role::kEditor)), with(hostOf("a")),
                                       with(person(Role::kEditor), "it has been revoked")}) {
            Gated s;
            const ConnectionId first = s.knock(control.key ? "" : "changes", control);
            const auto welcome = s.sent<message::Welcome>(first);
            ASSERT_EQ(welcome.size(), 1u);
            PeerOrigin from = bulk;
            if (bulk.key && bulk.key->identity.kind == Identity::Kind::kHost) from.key->serial = "6";
            const ConnectionId second(++s.lastConnection);
            s.take(s.session.connectionOpened(second, s.now, from.near));
            if (from.sealed) s.session.connectionSecured(second, from.key);
            message::Hello hello = s.greeting("asks", PeerRole::kApplication);
            hello.channel = ChannelKind::kBulk;
            hello.token = welcome[0].token;
            s.say(second, hello);
            const bool same = control.sealed == from.sealed && control.key.has_value() == from.key.has_value() &&
                              (!from.key || (from.key->serial == "5" && from.key->fault.empty()));
            EXPECT_EQ(s.refusalOf(second).empty(), same);
        }
}

/// A word for some time: its holder goes within a second of its end.
TEST(ServerAccess, AWordThatHasEndedLetsNobodyInNorGoOn) {
    bool holds = true;
    struct Timed : ServerFixture {
        explicit Timed(bool& holds)
            : ServerFixture([&] {
                  ServerSessionConfig config = twoHosts();
                  config.access = {{"looks", "changes", "runs"}, "the-door"};
                  config.passOf = [&](std::string_view word) {
                      if (!holds || word != "for an hour") return std::optional<AccessPass>();
                      return std::optional(AccessPass{"ci", Role::kEditor});
                  };
                  return config;
              }()) {}
        ConnectionId knock(const std::string& word, PeerRole role = PeerRole::kApplication) {
            const ConnectionId connection(++lastConnection);
            take(session.connectionOpened(connection, now, true));
            message::Hello hello = greeting(role == PeerRole::kHost ? "a" : "asks", role);
            hello.access = word;
            say(connection, hello);
            return connection;
        }
    } s(holds);
    const ConnectionId timed = s.knock("for an hour"), usual = s.knock("changes");
    ASSERT_EQ(s.actions<server_action::ApplicationJoined>().size(), 2u);
    EXPECT_EQ(s.actions<server_action::ApplicationJoined>()[0].who.role, Role::kEditor);
    EXPECT_EQ(s.sent<message::Refused>(s.knock("for an hour", PeerRole::kHost)).size(), 1u) << "hosts have keys";
    s.run(2s, {timed, usual});
    EXPECT_TRUE(s.actions<server_action::ApplicationLeft>().empty());
    holds = false;
    s.run(1s, {timed, usual});
    const auto left = s.actions<server_action::ApplicationLeft>();
    ASSERT_EQ(left.size(), 1u);
    EXPECT_EQ(left[0].connection, timed);
    EXPECT_EQ(s.sent<message::Refused>(s.knock("for an hour")).size(), 1u);
}

/// Tokens of roles are others from now on: whoever came in by one goes, a host of this machine, too.
TEST(ServerAccess, WhoCameInByATokenThatWasRenewedGoesAndComesAgainWithANewOne) {
    Gated s;
    const ConnectionId viewer = s.knock("looks", kHere), editor = s.knock("changes", kSealed),
                       host = s.knock("runs", kHere, PeerRole::kHost);
    const ConnectionId door =
        s.knock(AccessTokens{{}, "the-door"}.ofDoorFor({Role::kEditor, Entrant::By::kWord}), kHere);
    const ConnectionId key = s.knock("", with(person(Role::kEditor)));
    const std::vector<ConnectionId> all{viewer, editor, host, door, key};
    s.run(1s, all);
    EXPECT_TRUE(s.actions<server_action::ApplicationLeft>().empty());
    s.session.renewAccess({{"looks-anew", "changes", "runs-anew"}, "the-door"});
    s.run(1s, all);
    for (const ConnectionId ended : {viewer, host}) EXPECT_WORDS(s.refusalOf(ended));
    for (const ConnectionId stays : {editor, door, key}) EXPECT_EQ(s.refusalOf(stays), "");
    EXPECT_EQ(s.actions<server_action::ApplicationLeft>().size(), 1u);
    EXPECT_EQ(s.state("a"), HostState::kLost);
    EXPECT_WORDS(s.refusalOf(s.knock("looks", kHere)));
    EXPECT_EQ(s.refusalOf(s.knock("looks-anew", kHere)), "");
    EXPECT_EQ(s.refusalOf(s.knock("runs-anew", kHere, PeerRole::kHost)), "");
    EXPECT_EQ(s.state("a"), HostState::kJoining);
}

/// A host of this machine may have an operator's token for some hours.
TEST(ServerAccess, AHostGoesWithTheTokenThatItCameInWith) {
    bool holds = true;
    struct Timed : ServerFixture {
        explicit Timed(bool& holds)
            : ServerFixture([&] {
                  ServerSessionConfig config = twoHosts();
                  config.access = {{"looks", "changes", "runs"}, "the-door"};
                  config.passOf = [&](std::string_view token) {
                      if (!holds || token != "for an hour") return std::optional<AccessPass>();
                      return std::optional(AccessPass{"ci", Role::kOperator});
                  };
                  return config;
              }()) {}
    } s(holds);
    const ConnectionId host(++s.lastConnection);
    s.take(s.session.connectionOpened(host, s.now, true));
    message::Hello hello = s.greeting("a");
    hello.access = "for an hour";
    s.say(host, hello);
    s.run(1s, {host});
    EXPECT_EQ(s.state("a"), HostState::kJoining);
    holds = false;
    s.run(1s, {host});
    EXPECT_EQ(s.state("a"), HostState::kLost);
    ASSERT_EQ(s.sent<message::Refused>(host).size(), 1u);
}

/// A panel's token: its holder has the panel's text, and neither the scene nor its arrays.
TEST(ServerAccess, APanelsTokenBringsItsPanelAndNothingElse) {
    struct OfPanels : ServerFixture {
        OfPanels()
            : ServerFixture([] {
                  ServerSessionConfig config = twoHosts();
                  config.access = {{"looks", "changes", "runs"}, "the-door"};
                  config.passOf = [](std::string_view word) {
                      return std::optional(AccessPass{"visitor", Role::kEditor, word == "gone" ? "gone" : "hall"});
                  };
                  config.panelOf = [](const std::string& name) {
                      return name == "hall" ? std::make_shared<const std::string>("the text") : nullptr;
                  };
                  return config;
              }()) {}
        ConnectionId knock(const std::string& word, bool follows = false, SessionToken bulkOf = {}) {
            const ConnectionId connection(++lastConnection);
            take(session.connectionOpened(connection, now, true));
            message::Hello hello = greeting("tablet", PeerRole::kApplication);
            hello.access = word;
            hello.follows = follows;
            hello.token = bulkOf;
            if (bulkOf != SessionToken()) hello.channel = ChannelKind::kBulk;
            say(connection, hello);
            return connection;
        }
    } s;
    const Entrant byDoor{Role::kEditor, Entrant::By::kPass, "visitor", "10.0.0.7", "hall"};
    for (const std::string& word : {std::string("a token of the hall"),
                                    AccessTokens{{"looks", "changes", "runs"}, "the-door"}.ofDoorFor(byDoor)}) {
        s.forget();
        const ConnectionId visitor = s.knock(word);
        const auto joined = s.actions<server_action::ApplicationJoined>();
        ASSERT_EQ(joined.size(), 1u);
        ASSERT_TRUE(joined[0].panel);
        EXPECT_EQ(*joined[0].panel, "the text");
        EXPECT_EQ(joined[0].who.panel, "hall");
        const SessionToken token = s.sent<message::Welcome>(visitor).at(0).token;
        EXPECT_EQ(s.sent<message::Refused>(s.knock(word, false, token)).size(), 1u) << "it has no arrays";
        EXPECT_EQ(s.sent<message::Refused>(s.knock(word, true)).size(), 1u) << "it does not follow";
    }
    EXPECT_EQ(s.sent<message::Refused>(s.knock("gone")).size(), 1u) << "its panel is not there";
}

TEST(ServerAccess, OfOneNameThereAreNoMoreThanLeaveRoomForOthers) {
    Gated s;
    const auto come = [&](const PeerOrigin& from, const std::string& word) {
        for (int count = 0;; ++count)
            if (const std::string refused = s.refusalOf(s.knock(word, from)); !refused.empty()) {
                EXPECT_WORDS(refused);
                return count;
            }
    };
    Identity bob = person(Role::kViewer);
    bob.name = "bob";
    EXPECT_EQ(come(with(person(Role::kEditor)), ""), 32) << "half of all";
    EXPECT_EQ(come(with(bob), ""), 16) << "half of what is left";
    EXPECT_EQ(come(kHere, "runs"), 16) << "the server's user has the rest";
}

TEST(ServerAccess, OnlyItsDoorIsBelievedFromWhereARequestComes) {
    Gated s;
    const std::string asDoor =
        AccessTokens{{}, "the-door"}.ofDoorFor({Role::kEditor, Entrant::By::kPass, "visitor", "", ""});
    for (const bool door : {true, false}) {
        const ConnectionId application = s.knock(door ? asDoor : "runs", kHere);
        ASSERT_EQ(s.refusalOf(application), "");
        s.forget();
        s.say(application, message::Request{.id = 3, .body = textBytes("move"), .from = "10.0.0.9"});
        const auto asked = s.actions<server_action::RequestReceived>();
        ASSERT_EQ(asked.size(), 1u);
        EXPECT_EQ(asked[0].from, door ? "10.0.0.9" : "");
    }
}

TEST(ServerAccess, WhoShowsWrongWordsAgainAndAgainHearsOfItLaterAndNobodyElseWaits) {
    Gated s;
    PeerOrigin from = kSealed, elsewhere = kSealed;
    from.source = SourceAddress(7);
    elsewhere.source = SourceAddress(8);
    for (int i = 0; i < 5; ++i) EXPECT_NE(s.refusalOf(s.knock("wrong", from)), "");
    EXPECT_TRUE(s.actions<server_action::LoginsSlowed>().empty());
    const ConnectionId sixth = s.knock("wrong", from);
    EXPECT_EQ(s.refusalOf(sixth), "");
    ASSERT_EQ(s.actions<server_action::LoginsSlowed>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::LoginsSlowed>()[0].source, from.source);
    EXPECT_LE(s.session.nextDeadline(), s.now + 1s);

    EXPECT_NE(s.refusalOf(s.knock("wrong", elsewhere)), "") << "each address has its own";
    s.forget();
    s.knock("runs", from);
    EXPECT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u) << "the right word never waits";
    s.say(sixth, s.greeting("asks", PeerRole::kApplication));  // too late to think better of it
    EXPECT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u);

    s.run(900ms);
    EXPECT_EQ(s.refusalOf(sixth), "");
    s.run(200ms);
    EXPECT_NE(s.refusalOf(sixth), "");
    const auto closed = s.actions<server_action::Close>();
    EXPECT_TRUE(std::ranges::any_of(closed, [&](const auto& each) { return each.connection == sixth; }));
}

TEST(ServerAccess, OfRefusalsThatWaitAFewAreHeldAndWhoHangsUpLeavesNothing) {
    Gated s;
    PeerOrigin from = kSealed;
    from.source = SourceAddress(7);
    std::vector<ConnectionId> waiting;
    for (int i = 0; i < 9; ++i) waiting.push_back(s.knock("wrong", from));
    s.forget();
    const ConnectionId tenth = s.knock("wrong", from);
    EXPECT_EQ(s.refusalOf(tenth), "");
    ASSERT_EQ(s.actions<server_action::Close>().size(), 1u) << "and closed";
    EXPECT_EQ(s.actions<server_action::Close>()[0].connection, tenth);
    s.take(s.session.malformed(waiting[8], "rubbish", s.now));
    EXPECT_EQ(s.actions<server_action::Close>().size(), 1u) << "what it goes on saying does not help it";
    s.take(s.session.connectionClosed(waiting[8], s.now));
    s.forget();
    s.knock("wrong", from);
    EXPECT_TRUE(s.actions<server_action::Close>().empty()) << "there is room for one";
}

TEST(ServerAccess, ThisMachinesProgramsAndThoseWithoutAWordAreAnsweredAtOnce) {
    Gated s;
    PeerOrigin here = kHere, sealed = kSealed;
    here.source = sealed.source = SourceAddress(7);
    for (int i = 0; i < 20; ++i) {
        EXPECT_NE(s.refusalOf(s.knock("wrong", here)), "");
        EXPECT_NE(s.refusalOf(s.knock("", sealed)), "");
    }
}

TEST(ServerAccess, AnInsecureServerTakesWhomeverComes) {
    struct Open : ServerFixture {
        Open()
            : ServerFixture([] {
                  ServerSessionConfig config = twoHosts();
                  config.access = {{"looks", "changes", "runs"}, "the-door"};
                  config.insecure = true;
                  return config;
              }()) {}
    } s;
    const ConnectionId connection(++s.lastConnection);
    s.take(s.session.connectionOpened(connection, s.now, false));
    s.say(connection, s.greeting("a", PeerRole::kHost));
    EXPECT_EQ(s.state("a"), HostState::kJoining);
    // On this machine it is as everywhere.
    const ConnectionId here(++s.lastConnection);
    s.take(s.session.connectionOpened(here, s.now, true));
    s.say(here, s.greeting("b", PeerRole::kHost));
    EXPECT_EQ(s.sent<message::Refused>(here).size(), 1u);
}

}  // namespace
}  // namespace tessera
