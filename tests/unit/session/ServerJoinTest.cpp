// Who is let in, and how a host gets from its hello into the barrier.
#include "tests/support/words/Words.h"
#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

TEST(ServerJoin, WelcomesAHostAndAsksForItsSnapshot) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    const auto welcome = s.sent<message::Welcome>(a);
    ASSERT_EQ(welcome.size(), 1u);
    EXPECT_TRUE(welcome[0].token);
    EXPECT_EQ(asText(welcome[0].configuration), "the wall");
    ASSERT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
    EXPECT_EQ(s.state("a"), HostState::kJoining);
    s.snapshot(a);
    EXPECT_EQ(s.sent<message::Snapshot>(a).size(), 1u);
    EXPECT_EQ(s.state("a"), HostState::kSyncing);
}

TEST(ServerJoin, AnApplicationThatDoesNotFollowIsSentNeitherSnapshotNorLists) {
    ServerFixture s;
    const ConnectionId host = s.join("a"), other = s.join("b"), follower = s.follow("follows");
    const ConnectionId asks = s.open();
    message::Hello hello = s.greeting("asks", PeerRole::kApplication);
    hello.follows = false;
    s.forget();
    s.say(asks, hello);
    EXPECT_EQ(s.sent<message::Welcome>(asks).size(), 1u);
    EXPECT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u);
    EXPECT_TRUE(s.actions<server_action::SnapshotWanted>().empty()) << "none is made for it";
    s.snapshot(asks);  // nor taken, whoever makes one
    const FrameNumber frame = s.begin(s.commit());
    s.ready(host, frame);
    s.ready(other, frame);
    s.begin(s.commit());
    EXPECT_EQ(s.sent<message::Changes>(follower).size(), 2u);
    EXPECT_TRUE(s.sent<message::Snapshot>(asks).empty());
    EXPECT_TRUE(s.sent<message::Changes>(asks).empty());
    // What it asks for, and what it subscribed to, it is told.
    s.say(asks, message::Request{.id = 4});
    EXPECT_EQ(s.actions<server_action::RequestReceived>().size(), 1u);
    s.take(s.session.reply(asks, {.id = 4}));
    s.take(s.session.notify(asks, {}));
    EXPECT_EQ(s.sent<message::Reply>(asks).size(), 1u);
    EXPECT_EQ(s.sent<message::Notice>(asks).size(), 1u);
    s.take(s.session.finish("over"));
    EXPECT_EQ(s.sent<message::Over>(asks).size(), 1u);
}

TEST(ServerJoin, RefusesAnotherProtocolVersionNamingBoth) {
    ServerFixture s;
    const ConnectionId c = s.open();
    message::Hello hello = s.greeting("nobody");  // version comes first: the name means nothing yet
    hello.protocol = kProtocolVersion + 6;
    hello.schema = 1;
    s.say(c, hello);
    const auto refused = s.sent<message::Refused>(c);
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_NE(refused[0].reason.find("version " + std::to_string(kProtocolVersion)), std::string::npos);
    EXPECT_NE(refused[0].reason.find("version " + std::to_string(kProtocolVersion + 6)), std::string::npos);
    EXPECT_FALSE(refused[0].retry);
    EXPECT_TRUE(s.closed(c));
}

TEST(ServerJoin, TakesApplicationsOfAnotherSchemaThatHoldNoReplica) {
    ServerFixture s;
    message::Hello hello = s.greeting("of the version before");
    hello.role = PeerRole::kApplication;
    hello.schema = 78;
    const ConnectionId follower = s.open();
    s.say(follower, hello);
    EXPECT_EQ(s.sent<message::Refused>(follower).size(), 1u);
    hello.follows = false;
    const ConnectionId asks = s.open();
    s.say(asks, hello);
    EXPECT_EQ(s.sent<message::Welcome>(asks).size(), 1u);
}

TEST(ServerJoin, TakesApplicationsOfEarlierProtocolsThatHoldNoReplica) {
    for (unsigned protocol = kOldestAskersProtocol - 1; protocol <= kProtocolVersion + 1; ++protocol)
        for (const bool host : {true, false})
            for (const bool follows : {true, false}) {
                ServerFixture s;
                message::Hello hello = s.greeting("a");
                if (!host) hello.role = PeerRole::kApplication;
                hello.protocol = protocol;
                hello.follows = follows;
                const ConnectionId peer = s.open();
                s.say(peer, hello);
                const bool known = protocol >= kOldestAskersProtocol && protocol <= kProtocolVersion;
                const bool taken = protocol == kProtocolVersion || (known && !host && !follows);
                EXPECT_EQ(s.sent<message::Welcome>(peer).size(), taken ? 1u : 0u) << protocol << host << follows;
            }
}

TEST(ServerJoin, RefusesAnotherSchema) {
    ServerFixture s;
    const ConnectionId c = s.open();
    message::Hello hello = s.greeting("a");
    hello.schema = 78;
    s.say(c, hello);
    ASSERT_EQ(s.sent<message::Refused>(c).size(), 1u);
    EXPECT_FALSE(s.sent<message::Refused>(c)[0].retry);
    EXPECT_EQ(s.state("a"), HostState::kAbsent);
}

TEST(ServerJoin, RefusesAnUnknownNameAndSaysWhichThereAre) {
    ServerFixture s;
    const ConnectionId c = s.hello("x");
    const auto refused = s.sent<message::Refused>(c);
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_EQ(refused[0].reason, "unknown host 'x'; the wall has: a, b");
    EXPECT_EQ(refused[0].code, ErrorCode::kNotFound);
    EXPECT_FALSE(refused[0].retry);
}

TEST(ServerJoin, RefusesANameThatIsTakenUntilItsOwnerIsGone) {
    ServerFixture s;
    const ConnectionId first = s.hello("a");
    const ConnectionId second = s.hello("a");
    ASSERT_EQ(s.sent<message::Refused>(second).size(), 1u);
    EXPECT_TRUE(s.sent<message::Refused>(second)[0].retry);
    EXPECT_FALSE(s.closed(first));
    s.drop(first);
    const ConnectionId third = s.hello("a");
    EXPECT_EQ(s.sent<message::Welcome>(third).size(), 1u);
}

TEST(ServerJoin, WhoeverSaysATakenNameTriesUntilASilentHolderWouldHaveBeenNoticed) {
    ServerFixture s;
    const ConnectionId first = s.hello("a");
    // As a render host dials: every 100 ms. The holder has died without a word.
    ConnectionId last;
    for (int i = 0; i < 20 && !s.closed(first); ++i) {
        s.run(100ms);
        s.forget();
        last = s.hello("a");
        if (!s.sent<message::Welcome>(last).empty()) break;
        ASSERT_EQ(s.sent<message::Refused>(last).size(), 1u);
        EXPECT_TRUE(s.sent<message::Refused>(last)[0].retry);
    }
    EXPECT_EQ(s.sent<message::Welcome>(last).size(), 1u);
}

TEST(ServerJoin, WhoeverSaysATakenNameIsSentAwayOnceItsHolderHasSpokenSince) {
    ServerFixture s;
    const ConnectionId first = s.hello("a");
    const TimePoint begin = s.now;
    const auto answer = [&] {
        const ConnectionId again = s.hello("a");
        const auto refused = s.sent<message::Refused>(again);
        EXPECT_EQ(refused.size(), 1u);
        return refused.empty() ? message::Refused{} : refused[0];
    };
    message::Refused last;
    while ((last = answer()).retry) {
        s.run(50ms, {first});
        ASSERT_LT(s.now - begin, 10s);
    }
    EXPECT_GE(s.now - begin, twoHosts().sync.lostAfter);
    EXPECT_EQ(last.code, ErrorCode::kRefused);
    EXPECT_WORDS(last.reason);
    EXPECT_FALSE(s.closed(first));
    // Who comes next has not waited, and the holder may have died in between.
    EXPECT_TRUE(answer().retry);
    s.run(11s, {first});
    EXPECT_TRUE(answer().retry);
}

TEST(ServerJoin, AServerThatGoesOnBeginsWithALaterFrame) {
    ServerSessionConfig config = twoHosts();
    config.firstFrame = FrameNumber(500);
    ServerFixture s(config);
    EXPECT_EQ(s.session.nextFrame(), FrameNumber(500));
    const ConnectionId a = s.join("a");
    EXPECT_FALSE(s.session.mayBegin(s.now)) << "b is not there yet";
    const ConnectionId b = s.join("b");
    ASSERT_TRUE(s.session.mayBegin(s.now));
    const FrameNumber frame = s.begin();
    EXPECT_EQ(frame, FrameNumber(500));
    s.ready(a, frame);
    s.ready(b, frame);
    EXPECT_EQ(s.session.nextFrame(), FrameNumber(501));
}

TEST(ServerJoin, ClosesWhoeverSpeaksBeforeHello) {
    ServerFixture s;
    const ConnectionId a = s.join("a");
    const ConnectionId c = s.open();
    s.say(c, message::Ready{});
    EXPECT_TRUE(s.closed(c));
    EXPECT_FALSE(s.closed(a));
    s.forget();
    s.say(c, s.greeting("b"));  // was still on its way
    EXPECT_TRUE(s.done.empty());
}

TEST(ServerJoin, ClosesConnectionsThatSayNothing) {
    ServerFixture s;
    const ConnectionId c = s.open();
    s.run(1'990ms);
    EXPECT_FALSE(s.closed(c));
    s.run(60ms);
    EXPECT_TRUE(s.closed(c));
}

TEST(ServerJoin, BoundsApplications) {
    ServerSessionConfig config = twoHosts();
    config.maxApplications = 1;
    ServerFixture s(config);
    const ConnectionId first = s.follow("ctl");
    const ConnectionId second = s.hello("ctl", PeerRole::kApplication);
    ASSERT_EQ(s.sent<message::Refused>(second).size(), 1u);
    EXPECT_TRUE(s.sent<message::Refused>(second)[0].retry);
    s.drop(first);
    EXPECT_EQ(s.actions<server_action::ApplicationLeft>().size(), 1u);
    EXPECT_EQ(s.sent<message::Welcome>(s.hello("ctl", PeerRole::kApplication)).size(), 1u);
}

TEST(ServerJoin, TheFirstFrameWaitsForAllHosts) {
    ServerFixture s;
    s.join("a");
    EXPECT_FALSE(s.session.mayBegin(s.now));
    EXPECT_EQ(s.session.missing(), Names{"b"});
    const ConnectionId b = s.hello("b");
    EXPECT_FALSE(s.session.mayBegin(s.now));
    s.snapshot(b);
    EXPECT_FALSE(s.session.mayBegin(s.now));
    s.synced(b);
    EXPECT_TRUE(s.session.mayBegin(s.now));
}

TEST(ServerJoin, TheFirstFrameWaitsNoLongerThanTheStartDeadline) {
    ServerFixture s;
    const ConnectionId a = s.join("a");
    const TimePoint start = s.now;
    s.run(29'990ms, {a});
    EXPECT_FALSE(s.session.mayBegin(s.now));
    EXPECT_LE(s.session.nextDeadline(), start + 30s);
    s.run(20ms, {a});
    EXPECT_TRUE(s.session.mayBegin(s.now));
    EXPECT_EQ(s.session.missing(), Names{"b"});
}

TEST(ServerJoin, ALateJoinerGetsEveryListOnceAndEntersAtANamedFrame) {
    ServerFixture s;
    const ConnectionId a = s.join("a");
    s.join("b");
    const ConnectionId gone = ConnectionId(2);
    s.begin();
    s.drop(gone);
    s.ready(a, 0_frame);
    const ConnectionId b = s.hello("b");
    const message::Snapshot old{listAt(s.sequence)};  // made now, handed in late
    for (int i = 0; i < 2; ++i) s.ready(a, s.begin(s.commit()));
    s.forget();
    s.take(s.session.snapshotReady(b, old, s.now));
    s.ready(a, s.begin(s.commit()));
    std::vector<Sequence> got;
    for (const auto& changes : s.sent<message::Changes>(b)) got.push_back(changes.list->sequence);
    EXPECT_EQ(got, (std::vector{6_seq, 7_seq, 8_seq}));
    s.say(b, message::Synced{8_seq, hashAfter(8_seq)});
    s.forget();
    const FrameNumber frame = s.begin(s.commit());
    const auto entered = s.actions<server_action::HostEntered>();
    ASSERT_EQ(entered.size(), 1u);
    EXPECT_EQ(entered[0].host, "b");
    EXPECT_EQ(entered[0].frame, frame);
    EXPECT_TRUE(entered[0].rejoined);
    EXPECT_TRUE(s.sent<message::Changes>(b).empty());
    ASSERT_EQ(s.sent<message::Begin>(b).size(), 1u);
    EXPECT_EQ(s.sent<message::Begin>(b)[0].list->sequence, 9_seq);
}

TEST(ServerJoin, ASyncedHostEntersThoughNewerListsAreOnTheirWayToIt) {
    ServerFixture s;
    const ConnectionId a = s.join("a");
    s.join("b");
    s.begin();
    s.drop(ConnectionId(2));
    s.ready(a, 0_frame);
    const ConnectionId b = s.hello("b");
    s.snapshot(b);
    s.ready(a, s.begin(s.commit()));
    s.say(b, message::Synced{5_seq, hashAfter(5_seq)});  // it has not seen list 6 yet
    s.forget();
    s.begin(s.commit());
    EXPECT_EQ(s.actions<server_action::HostEntered>().size(), 1u);
    EXPECT_EQ(s.sent<message::Begin>(b).size(), 1u);
}

TEST(ServerJoin, ASnapshotThatHoldsThisFramesListEntersAtTheNext) {
    ServerFixture s;
    const CommittedListPtr committed = s.commit();  // before the frame that carries it
    const ConnectionId a = s.join("a");
    s.join("b");
    s.begin(committed);
    EXPECT_TRUE(s.sent<message::Begin>(a).empty());
    EXPECT_TRUE(s.sent<message::Changes>(a).empty());
    EXPECT_EQ(s.actions<server_action::FrameReleased>().size(), 1u);
    s.begin(s.commit());
    EXPECT_EQ(s.sent<message::Begin>(a).size(), 1u);
}

TEST(ServerJoin, AsksAgainWhereTheListsSinceASnapshotWereTooMany) {
    ServerSessionConfig config = twoHosts();
    config.maxTailLists = 2;
    ServerFixture s(config);
    const ConnectionId a = s.join("a");
    s.join("b");
    s.begin();
    s.drop(ConnectionId(2));
    s.ready(a, 0_frame);
    const ConnectionId b = s.hello("b");
    const message::Snapshot old{listAt(s.sequence)};
    for (int i = 0; i < 3; ++i) s.ready(a, s.begin(s.commit()));
    s.forget();
    s.take(s.session.snapshotReady(b, old, s.now));
    EXPECT_TRUE(s.sent<message::Snapshot>(b).empty());
    EXPECT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
    s.snapshot(b);
    EXPECT_EQ(s.sent<message::Snapshot>(b).size(), 1u);
}

TEST(ServerJoin, ASnapshotForSomebodyWhoLeftIsForgotten) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    s.drop(a);
    s.forget();
    s.snapshot(a);
    EXPECT_TRUE(s.done.empty());
}

TEST(ServerJoin, AHostThatDoesNotSyncIsToldToStartOver) {
    ServerSessionConfig config = twoHosts();
    config.syncDeadline = 500ms;
    ServerFixture s(config);
    const ConnectionId a = s.hello("a");
    s.snapshot(a);
    const ConnectionId bulk = s.bulk(a);
    s.run(400ms, {a});
    s.say(bulk, message::BlobRequest{.id = blobOf("x").id, .length = 1});  // it is at work
    s.run(400ms, {a});
    EXPECT_FALSE(s.closed(a));
    s.run(150ms, {a});
    EXPECT_TRUE(s.closed(a));
    EXPECT_TRUE(s.closed(bulk));
    EXPECT_EQ(s.state("a"), HostState::kLost);
}

TEST(ServerJoin, ASyncedHostThatIsToldOfBlobsGetsTheWholeTimeForThem) {
    ServerSessionConfig config = twoHosts();
    config.syncDeadline = 500ms;
    ServerFixture s(config);
    const ConnectionId a = s.join("a");
    s.run(1s, {a});  // done, and waiting for the others
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    s.run(490ms, {a});
    EXPECT_FALSE(s.closed(a));
    s.run(20ms, {a});
    EXPECT_TRUE(s.closed(a));
}

TEST(ServerJoin, AnApplicationFollowsFromItsSnapshot) {
    ServerFixture s;
    const ConnectionId app = s.follow("viewer");
    ASSERT_EQ(s.actions<server_action::ApplicationJoined>().size(), 1u);
    EXPECT_EQ(s.sent<message::Snapshot>(app).size(), 1u);
    s.begin(s.commit());
    s.begin(s.commit());
    EXPECT_EQ(s.sent<message::Changes>(app).size(), 2u);
    s.say(app, message::Request{3, textBytes("move")});
    ASSERT_EQ(s.actions<server_action::RequestReceived>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::RequestReceived>()[0].application, "viewer");
    s.take(s.session.reply(app, {.id = 3}));
    EXPECT_EQ(s.sent<message::Reply>(app).size(), 1u);
}

TEST(ServerJoin, WhoReadsTooSlowlyIsSentNothingMoreUntilItHasRead) {
    std::map<ConnectionId, std::size_t> unsent;
    ServerSessionConfig config = twoHosts();
    config.unsentBytes = [&](ConnectionId connection) { return unsent[connection]; };
    config.maxTailLists = 20;
    config.snapshotServesFor = 0ms;
    ServerFixture s(config);
    const ConnectionId app = s.follow("viewer");
    s.begin(s.commit());
    unsent[app] = config.maxUnsentBytes + 1;
    for (int i = 0; i < 10; ++i) s.begin(s.commit());
    s.take(s.session.notify(app, {textBytes("news")}));
    EXPECT_EQ(s.sent<message::Changes>(app).size(), 1u);
    EXPECT_TRUE(s.sent<message::Notice>(app).empty());

    unsent[app] = 0;
    s.forget();
    s.begin(s.commit());
    const auto since = s.sent<message::Changes>(app);
    ASSERT_EQ(since.size(), 11u) << "the lists that it has missed, and this one";
    for (std::size_t i = 1; i < since.size(); ++i)
        EXPECT_EQ(since[i].list->sequence, since[i - 1].list->sequence.next());

    // Behind by more than is kept: it starts anew.
    unsent[app] = config.maxUnsentBytes + 1;
    for (int i = 0; i < 30; ++i) s.begin(s.commit());
    unsent[app] = 0;
    s.forget();
    s.begin(s.commit());
    EXPECT_TRUE(s.sent<message::Changes>(app).empty());
    ASSERT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
    s.snapshot(app);
    s.begin(s.commit());
    EXPECT_EQ(s.sent<message::Changes>(app).size(), 1u);
}

TEST(ServerJoin, NoMoreListsAreKeptForWhoDoesNotReadThanAnotherSnapshotWouldBe) {
    constexpr std::size_t kListBytes = std::size_t{256} << 10;
    bool reads = true;
    ServerSessionConfig config = twoHosts();
    config.maxUnsentBytes = 4 * kListBytes;
    config.unsentBytes = [&](ConnectionId) { return reads ? 0 : config.maxUnsentBytes + 1; };
    ServerFixture s(config);
    s.follow("viewer");
    reads = false;
    std::vector<std::weak_ptr<const CommittedList>> lists;
    for (int i = 0; i < 100; ++i) {
        const CommittedListPtr list = listAt(s.sequence = s.sequence.next(), {}, Bytes(kListBytes));
        lists.push_back(list);
        s.begin(list);
        s.forget();
        const auto kept = std::ranges::count_if(lists, [](const auto& one) { return !one.expired(); });
        EXPECT_LE(kept, 5) << "after " << i + 1;
    }
    reads = true;
    s.begin(s.commit());
    EXPECT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
}

TEST(ServerJoin, ASnapshotServesWhoComesSoonAfter) {
    ServerSessionConfig config = twoHosts();
    config.snapshotServesFor = 1'000ms;
    ServerFixture s(config);
    const ConnectionId a = s.hello("a");
    const Sequence made = s.sequence;
    s.snapshot(a);
    s.begin(s.commit());
    EXPECT_TRUE(s.session.snapshotServes(made, 1000));
    EXPECT_FALSE(s.session.snapshotServes(made, 3)) << "the lists since are more bytes than it";
    s.run(1'100ms, {a});
    s.begin(s.commit());
    EXPECT_FALSE(s.session.snapshotServes(made, 1000));
}

TEST(ServerJoin, BulkConnectionsAreBoundByTheirToken) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    const ConnectionId bulk = s.bulk(a);
    s.say(bulk, message::BlobRequest{.id = blobOf("x").id, .length = 10});
    ASSERT_EQ(s.actions<server_action::BlobRequested>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::BlobRequested>()[0].connection, bulk);

    const ConnectionId stranger = s.open();
    message::Hello hello = s.greeting("a");
    hello.channel = ChannelKind::kBulk;
    hello.token = {12345, 6};
    s.say(stranger, hello);
    EXPECT_EQ(s.sent<message::Refused>(stranger).size(), 1u);
    EXPECT_FALSE(s.closed(bulk));
}

TEST(ServerJoin, TokensAreOfTheSystemsAndNoneTellsOfAnother) {
    std::set<std::pair<std::uint64_t, std::uint64_t>> tokens;
    std::uint64_t everSet[2] = {0, 0}, everClear[2] = {0, 0};
    for (int session = 0; session < 2; ++session) {
        ServerSessionConfig config = twoHosts();
        config.maxApplications = 64;
        ServerFixture s(config);
        for (int i = 0; i < 64; ++i) {
            const SessionToken token =
                s.sent<message::Welcome>(s.hello(std::to_string(i), PeerRole::kApplication)).at(0).token;
            EXPECT_TRUE(tokens.emplace(token.low, token.high).second) << "given twice";
            everSet[0] |= token.low, everSet[1] |= token.high;
            everClear[0] |= ~token.low, everClear[1] |= ~token.high;
        }
    }
    for (const int half : {0, 1}) {
        EXPECT_EQ(everSet[half], ~0ull) << "every bit is sometimes set";
        EXPECT_EQ(everClear[half], ~0ull) << "and sometimes not";
    }
}

TEST(ServerJoin, ATokenThatIsNearlyRightIsRefused) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    const SessionToken right = s.sent<message::Welcome>(a).at(0).token;
    for (const SessionToken& wrong :
         {SessionToken{}, SessionToken{right.low, 0}, SessionToken{right.low ^ 1, right.high},
          SessionToken{right.low, right.high ^ (1ull << 63)}, SessionToken{right.high, right.low}}) {
        const ConnectionId stranger = s.open();
        message::Hello hello = s.greeting("a");
        hello.channel = ChannelKind::kBulk;
        hello.token = wrong;
        s.say(stranger, hello);
        EXPECT_EQ(s.sent<message::Refused>(stranger).size(), 1u);
        EXPECT_TRUE(s.closed(stranger));
    }
    // Nor does a pending connection, which has none yet, let one in.
    EXPECT_FALSE(s.closed(a));
}

TEST(ServerJoin, ATokenEndsWithItsControlConnection) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    message::Hello hello = s.greeting("a");
    hello.channel = ChannelKind::kBulk;
    hello.token = s.sent<message::Welcome>(a).at(0).token;
    s.drop(a);
    const ConnectionId late = s.open();
    s.say(late, hello);
    EXPECT_EQ(s.sent<message::Refused>(late).size(), 1u);
    EXPECT_TRUE(s.closed(late));
}

TEST(ServerJoin, ABrokenBulkConnectionMayBeOpenedAgain) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    s.drop(s.bulk(a));
    EXPECT_EQ(s.state("a"), HostState::kJoining);
    const ConnectionId second = s.bulk(a);
    const ConnectionId third = s.bulk(a);  // the second broke and we have not noticed yet
    EXPECT_TRUE(s.closed(second));
    s.say(third, message::BlobRequest{.id = blobOf("x").id, .length = 10});
    EXPECT_EQ(s.actions<server_action::BlobRequested>().size(), 1u);
    s.drop(a);
    EXPECT_TRUE(s.closed(third));
}

TEST(ServerJoin, NamesHostsWhosePixelsDiffer) {
    ServerFixture s;
    for (const auto& [name, probe] : {std::pair{"a", 1u}, {"b", 2u}}) {
        const ConnectionId c = s.open();
        message::Hello hello = s.greeting(name);
        hello.pixelProbe = probe;
        s.say(c, hello);
    }
    const auto differ = s.actions<server_action::PixelsDiffer>();
    ASSERT_EQ(differ.size(), 1u);
    EXPECT_EQ(differ[0].host, "b");
    EXPECT_EQ(differ[0].reference, "a");
}

TEST(ServerJoin, HostsOfOneMachineAreToldOfEachOther) {
    ServerSessionConfig config = twoHosts();
    config.hosts = {"a", "b", "c", "d"};
    ServerFixture s(config);
    const auto come = [&](const std::string& name, const std::string& machine, const std::string& board) {
        const ConnectionId connection = s.open();
        message::Hello hello = s.greeting(name);
        hello.machine = machine;
        hello.board = board;
        s.say(connection, hello);
        return connection;
    };
    const auto told = [&](ConnectionId connection) {
        std::vector<std::string> boards;
        for (const message::Neighbours& said : s.sent<message::Neighbours>(connection)) boards.push_back(said.boards);
        s.forget();
        return boards;
    };
    const ConnectionId a = come("a", "here", "1/3");
    EXPECT_TRUE(told(a).empty()) << "it is alone";
    const ConnectionId c = come("c", "there", "1/3");
    EXPECT_TRUE(told(c).empty()) << "on another machine";
    const ConnectionId d = come("d", "", "4/3");
    EXPECT_TRUE(told(d).empty());
    ConnectionId b = come("b", "here", "2/3");
    EXPECT_EQ(s.sent<message::Neighbours>(b), std::vector{message::Neighbours{"a 1/3\n"}});
    EXPECT_EQ(told(a), std::vector<std::string>{"b 2/3\n"});
    s.drop(b);
    EXPECT_EQ(told(a), std::vector<std::string>{""}) << "it is gone";
    b = come("b", "here", "a line\nand another");
    EXPECT_TRUE(told(a).empty()) << "what would read as two";
    s.drop(b);
    b = come("b", "here", std::string(1000, 'x'));
    EXPECT_TRUE(told(a).empty()) << "too long to be a place";
}

}  // namespace
}  // namespace tessera
