#include "common/application/Application.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::kCrane;
using test::kCraneCore;
using test::kHall;
using test::ScriptedServer;

std::unique_ptr<Application> join(const ScriptedServer& server, bool followScene = true) {
    auto application = Application::connect({.address = server.address(), .name = "test", .followScene = followScene});
    EXPECT_TRUE(application) << (application ? "" : application.error().message);
    return application ? std::move(*application) : nullptr;
}

Vec3d cranePlace(const Application& application) {
    return application.scene().get<Transform>(kCraneCore)->translation;
}

ChangeList craneTo(const Vec3d& place) {
    ChangeListBuilder edits;
    edits.set(kCraneCore, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(place));
    return edits.take();
}

TEST(Application, FindsTheSceneAndTheWallWhenItHasConnected) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    EXPECT_EQ(cranePlace(*application), Vec3d(1, 2, 3));
    EXPECT_EQ(application->scene().stateHash(), server.stateHash());
    EXPECT_EQ(application->wall().name, "1x1");
    EXPECT_EQ(application->sequence(), Sequence{1});
}

TEST(Application, FollowsWhatOthersChange) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    std::vector<Vec3d> seen;
    application->onChanges([&](const ChangeList& list, Sequence) {
        EXPECT_EQ(list.changeCount(), 1u);
        seen.push_back(cranePlace(*application));
    });
    for (int i = 1; i <= 20; ++i) server.commit(craneTo(Vec3d(i, 0, 0)));
    EXPECT_EQ(cranePlace(*application), Vec3d(1, 2, 3)) << "nothing changes but within poll";
    while (seen.size() < 20) {
        const auto polled = application->poll(5s);
        ASSERT_TRUE(polled && *polled);
    }
    for (int i = 1; i <= 20; ++i) EXPECT_EQ(seen[static_cast<std::size_t>(i) - 1], Vec3d(i, 0, 0));
    EXPECT_EQ(application->scene().stateHash(), server.stateHash());
    EXPECT_FALSE(*application->poll(0ms)) << "nothing more to come";
}

TEST(Application, ReadsWhatItHasWritten) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    for (int i = 1; i <= 10; ++i) {
        const auto moved = application->moveNode("/hall/crane/hook", {.translation = Vec3d(1, 0, 0), .relative = true});
        ASSERT_TRUE(moved) << moved.error().message;
        EXPECT_EQ(cranePlace(*application), Vec3d(1 + i, 2, 3));
        EXPECT_EQ(moved->sequence, application->sequence());
    }
    ASSERT_TRUE(application->undo());
    EXPECT_EQ(cranePlace(*application), Vec3d(10, 2, 3));
}

TEST(Application, TheServersNamesForNewObjectsComeBack) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    const ObjectId placeholder{kFirstPlaceholder};
    ChangeListBuilder edits;
    edits.create(placeholder, typeOf<Node>());
    edits.place(placeholder, kHall);
    const auto committed = application->propose(edits.take());
    ASSERT_TRUE(committed) << committed.error().message;
    ASSERT_EQ(committed->ids.size(), 1u);
    EXPECT_EQ(committed->ids[0].first, placeholder);
    EXPECT_NE(application->scene().get<Node>(committed->ids[0].second), nullptr);
}

TEST(Application, ARefusedProposalChangesNothingAndSaysWhy) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    const StateHash before = application->scene().stateHash();
    ChangeListBuilder edits;
    edits.destroy(kHall);  // has a child
    const auto refused = application->propose(edits.take());
    ASSERT_FALSE(refused);
    EXPECT_FALSE(refused.error().message.empty());
    EXPECT_EQ(application->scene().stateHash(), before);
    EXPECT_EQ(application->moveNode("/hall/crna", {.translation = Vec3d::Zero()}).error().code, ErrorCode::kNotFound);
    EXPECT_TRUE(application->moveNode("/hall/crane", {.translation = Vec3d::Zero()}));
}

TEST(Application, IsToldOfFramesContactsAndPicksWhatItAskedFor) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    std::vector<FrameNumber> frames;
    std::size_t contacts = 0, picks = 0;
    ASSERT_TRUE(application->onFrame([&](const notice::Frame& frame) { frames.push_back(frame.frame); }));
    ASSERT_TRUE(application->onContacts([&](const answer::Contacts&) { ++contacts; }));
    ASSERT_TRUE(application->onPick([&](const answer::Picked&) { ++picks; }));
    EXPECT_TRUE(server.subscription().frames && server.subscription().contacts && server.subscription().picks);
    server.notify(notice::Frame{5_frame, {"only"}, {}});
    server.notify(answer::Contacts{});
    server.notify(answer::Picked{});
    server.notify(notice::Frame{6_frame, {"only"}, {}});
    const auto frame = application->waitForFrame(5s);
    ASSERT_TRUE(frame) << frame.error().message;
    while (frames.size() < 2) ASSERT_TRUE(application->poll(5s));
    EXPECT_EQ(frames, (std::vector{5_frame, 6_frame}));
    EXPECT_EQ(contacts, 1u);
    EXPECT_EQ(picks, 1u);
    EXPECT_FALSE(application->waitForFrame(50ms)) << "no further frame comes";
    ASSERT_TRUE(application->onFrame(nullptr));
    EXPECT_FALSE(server.subscription().frames);
}

TEST(Application, ACallbackMayAskButNotPoll) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    int calls = 0;
    application->onChanges([&](const ChangeList&, Sequence) {
        if (++calls > 1) return;
        EXPECT_FALSE(application->poll(0ms));
        EXPECT_TRUE(application->propose(craneTo(Vec3d(9, 9, 9))));
    });
    server.commit(craneTo(Vec3d(5, 5, 5)));
    while (calls < 2) ASSERT_TRUE(application->poll(5s));
    EXPECT_EQ(cranePlace(*application), Vec3d(9, 9, 9));
}

TEST(Application, WhatIsOutOfItsBoundsIsNotSent) {
    ScriptedServer server;
    std::size_t heard = 0;
    server.script([&](const ApplicationRequest&) -> Expected<ApplicationAnswer> {
        ++heard;
        return answer::Done{};
    });
    const auto application = join(server, false);
    ASSERT_TRUE(application);
    const auto budget = application->setBudget(-3);
    ASSERT_FALSE(budget);
    EXPECT_EQ(budget.error().message, "SetBudget: milliseconds must be from 0.1 to 60000, or 0, not -3");
    EXPECT_FALSE(application->setView({.worldUnitsPerMetre = -1}));
    EXPECT_FALSE(application->navigate({.deed = NavigationWish::Deed::kGoToBookmark}));
    EXPECT_EQ(heard, 0u);
    EXPECT_TRUE(application->setBudget(16));
    EXPECT_EQ(heard, 1u);
}

TEST(Application, RequestsCarryTheirAnswers) {
    ScriptedServer server;
    server.script([](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        if (const auto* load = std::get_if<request::LoadFile>(&asked)) {
            if (load->path == "/missing.glb") return fail(ErrorCode::kBadInput, "/missing.glb: no such file");
            return answer::Loaded{ObjectId{77}, 5, 6};
        }
        if (std::holds_alternative<request::PickAt>(asked)) return answer::Picked{true, kCrane, 3};
        if (std::holds_alternative<request::GetStatus>(asked))
            return answer::Status{.wallName = "1x1", .frame = 9_frame};
        if (std::holds_alternative<request::GetContacts>(asked)) return answer::Contacts{.frame = 4_frame};
        if (std::holds_alternative<request::GetImages>(asked)) return answer::Images{{}, {"front-0-0"}};
        if (const auto* view = std::get_if<request::SetView>(&asked); view && view->wish.reset) return answer::Done{};
        return fail(ErrorCode::kRefused, "no");
    });
    const auto application = join(server, false);
    ASSERT_TRUE(application);
    EXPECT_EQ(application->load("/hall.glb")->node, ObjectId{77});
    const auto missing = application->load("/missing.glb");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kBadInput);
    EXPECT_EQ(missing.error().message, "/missing.glb: no such file");
    EXPECT_EQ(application->pick(1, 2)->node, kCrane);
    EXPECT_EQ(application->status()->frame, 9_frame);
    EXPECT_EQ(application->contacts()->frame, 4_frame);
    EXPECT_EQ(application->images()->missing.size(), 1u);
    EXPECT_TRUE(application->setView({.reset = true}));
    EXPECT_FALSE(application->setView({}));
}

TEST(Application, WhoDoesNotFollowIsToldWhatItAsksFor) {
    ScriptedServer server;
    const auto application = join(server, false);
    ASSERT_TRUE(application);
    const auto hook = application->describe("/hall/crane/hook");
    ASSERT_TRUE(hook) << hook.error().message;
    EXPECT_EQ(hook->id, test::kHook);
    EXPECT_EQ(hook->parent, kCrane);
    EXPECT_EQ(hook->core, test::kHookCore);
    EXPECT_EQ(hook->coreType, typeOf<Geometry>());
    EXPECT_EQ(hook->movable, kCrane) << "the nearest Transform above";
    EXPECT_EQ(application->describe("#7")->type, typeOf<Material>());
    EXPECT_EQ(application->describeNode("#7").error().message, "node #7: it is a Material, not a node");
    const auto missing = application->describe("/hall/crna");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(missing.error().message);
    const auto several = application->describe(std::vector<std::string>{"#3", "#4711", "/"});
    ASSERT_TRUE(several);
    EXPECT_EQ(several->at(0).path, "/hall/crane");
    EXPECT_FALSE(several->at(1).id) << "one that is not there does not spoil the others";
    EXPECT_EQ(several->at(2).id, kRootNode);

    const auto tree = application->fetchTree({});
    ASSERT_TRUE(tree) << tree.error().message;
    ASSERT_EQ(tree->nodes().size(), 4u) << "over several pages";
    EXPECT_EQ(tree->get<Node>(test::kHall)->children.front(), kCrane);
    EXPECT_EQ(tree->coreOf(kCrane).as<Transform>()->translation, Vec3d(1, 2, 3));
    EXPECT_EQ(tree->get<Geometry>(test::kHookCore)->material, test::kMetal);
    EXPECT_FALSE(tree->find(test::kMetal)) << "what is referred to is not told";
    const auto level = application->fetchTree({.node = test::kHall, .levels = 1});
    ASSERT_EQ(level->nodes().size(), 2u);
    EXPECT_EQ(level->childCount(kCrane), 1u);
    const auto movers = application->fetchTree({.coreType = typeOf<Transform>()});
    ASSERT_EQ(movers->nodes().size(), 1u);
    EXPECT_EQ(movers->nodes()[0].node, kCrane);
    EXPECT_EQ(application->fetchTree({.node = ObjectId{4711}}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(application->scene().objectCount(), 1u) << "nothing of the scene itself came";
}

TEST(Application, WhoDoesNotFollowMovesAndRemovesByName) {
    ScriptedServer server;
    const auto application = join(server, false), follower = join(server);
    ASSERT_TRUE(application && follower);
    ASSERT_TRUE(application->moveNode("/hall/crane/hook", {.translation = Vec3d(1, 0, 0), .relative = true}));
    EXPECT_EQ(application->moveNode("/hall", {.translation = Vec3d(1, 0, 0)}).error().message,
              "/hall cannot be moved: neither it nor any node above it holds a Transform");
    EXPECT_EQ(application->fetch(std::vector{kCrane})->coreOf(kCrane).as<Transform>()->translation, Vec3d(2, 2, 3))
        << "one reads what one has written";
    while (cranePlace(*follower) != Vec3d(2, 2, 3)) ASSERT_TRUE(follower->poll(5s));
    const auto removed = application->removeNode(kCrane);
    ASSERT_TRUE(removed) << removed.error().message;
    EXPECT_EQ(removed->removed, 5u);
    EXPECT_EQ(application->removeNode(kRootNode).error().code, ErrorCode::kRefused);
    EXPECT_EQ(application->removeNode(kCrane).error().code, ErrorCode::kNotFound);
}

TEST(Application, AServerThatIsOverEndsItInOrder) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    server.commit(craneTo(Vec3d(4, 4, 4)));
    server.finish();
    Expected<bool> polled = true;
    while (polled) polled = application->poll(5s);
    EXPECT_EQ(cranePlace(*application), Vec3d(4, 4, 4)) << "what came before the end is applied";
    EXPECT_TRUE(application->serverIsOver());
    EXPECT_WORDS(polled.error().message);
    EXPECT_FALSE(application->propose(craneTo(Vec3d::Zero())));
    EXPECT_FALSE(application->status());
}

/// An application that counts how often its connection broke and came back.
struct Counted {
    explicit Counted(const ScriptedServer& server, bool follows = true) : application(join(server, follows)) {
        application->onLost([this](const Error& error) {
            ++lost;
            EXPECT_EQ(error.code, ErrorCode::kNetwork);
        });
        application->onBack([this] {
            ++back;
            EXPECT_TRUE(application->connected());
        });
    }
    void pollUntilBack() {
        while (back == 0) {
            const auto polled = application->poll(10s);
            ASSERT_TRUE(polled) << polled.error().message;
        }
    }

    std::unique_ptr<Application> application;
    int lost = 0, back = 0;
};

TEST(Application, ABrokenConnectionComesBackWithSceneAndSubscriptions) {
    ScriptedServer server;
    Counted counted(server);
    Application& application = *counted.application;
    int contacts = 0;
    ASSERT_TRUE(application.onContacts([&](const answer::Contacts&) { ++contacts; }));
    server.cutAll();
    server.commit(craneTo(Vec3d(4, 4, 4)));  // while nobody listens
    std::vector<Vec3d> seen;
    application.onChanges([&](const ChangeList&, Sequence) { seen.push_back(cranePlace(application)); });
    counted.pollUntilBack();
    EXPECT_EQ(counted.lost, 1);
    EXPECT_EQ(seen, std::vector<Vec3d>{Vec3d(4, 4, 4)}) << "the whole scene, once";
    EXPECT_EQ(application.scene().stateHash(), server.stateHash());

    server.commit(craneTo(Vec3d(5, 5, 5)));
    ASSERT_TRUE(application.propose(craneTo(Vec3d(6, 6, 6))));
    EXPECT_EQ(seen.size(), 3u);
    EXPECT_TRUE(server.subscription().contacts);
    server.notify(answer::Contacts{});
    while (contacts == 0) ASSERT_TRUE(application.poll(5s));
    EXPECT_EQ(counted.back, 1);
}

TEST(Application, WhoDoesNotFollowComesBackToo) {
    ScriptedServer server;
    Counted counted(server, false);
    server.cutAll();
    counted.pollUntilBack();
    EXPECT_TRUE(counted.application->describe("/hall/crane"));
}

TEST(Application, ARequestThatTheBreakMetSaysThatItMayHaveBeenDone) {
    ScriptedServer server;
    Counted counted(server);
    Application& application = *counted.application;
    server.misbehave({.cutWhenAsked = true});
    const auto undone = application.undo();
    ASSERT_FALSE(undone);
    EXPECT_EQ(undone.error().code, ErrorCode::kNetwork);
    EXPECT_WORDS(undone.error().message);
    server.misbehave({});
    // Made from a scene that is not the server's any more, perhaps.
    const auto early = application.propose(craneTo(Vec3d(4, 4, 4)));
    ASSERT_FALSE(early);
    EXPECT_WORDS(early.error().message);
    // What needs no scene waits for the return.
    EXPECT_TRUE(application.describe("/hall/crane"));
    counted.pollUntilBack();
    EXPECT_TRUE(application.moveNode("/hall/crane", {.translation = Vec3d(4, 4, 4)}));
    EXPECT_EQ(counted.lost, 1);
}

TEST(Application, ABrokenConnectionThatStaysSoIsAnErrorAndNotAnEnd) {
    for (const auto redial : {0ms, 300ms}) {
        auto server = std::make_unique<ScriptedServer>();
        const auto connected =
            Application::connect({.address = server->address(), .name = "test", .timeout = 100ms, .redial = redial});
        ASSERT_TRUE(connected) << connected.error().message;
        server.reset();
        const auto begun = std::chrono::steady_clock::now();
        Expected<bool> polled = true;
        if (redial > 0ms) {
            EXPECT_EQ((*connected)->status().error().code, ErrorCode::kNetwork) << "waits for its own time at most";
        }
        while (polled) polled = (*connected)->poll(5s);
        EXPECT_GE(std::chrono::steady_clock::now() - begun, redial);
        EXPECT_EQ(polled.error().code, ErrorCode::kNetwork);
        EXPECT_EQ(polled.error().message.find("nobody has answered there") != std::string::npos, redial > 0ms)
            << polled.error().message;
        EXPECT_FALSE((*connected)->serverIsOver());
        EXPECT_FALSE((*connected)->connected());
    }
}

TEST(Application, AServerThatIsOverOrRefusesIsNotDialledAgain) {
    ScriptedServer server;
    Counted counted(server);
    message::Refused refusal;
    refusal.reason = "no room";
    refusal.code = ErrorCode::kLimit;
    server.misbehave({.refuse = refusal});
    server.cutAll();
    Expected<bool> polled = true;
    while (polled) polled = counted.application->poll(5s);
    EXPECT_EQ(polled.error().code, ErrorCode::kLimit) << polled.error().message;
    EXPECT_EQ(counted.lost, 1);
    EXPECT_EQ(counted.back, 0);
}

TEST(Application, ASceneThatDiffersFromTheServersIsNotUsed) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    server.misbehave({.wrongHash = true});
    server.commit(craneTo(Vec3d(4, 4, 4)));
    Expected<bool> polled = true;
    while (polled) polled = application->poll(5s);
    EXPECT_WORDS(polled.error().message);
}

TEST(Application, RubbishInPlaceOfAListEndsTheConnection) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    server.misbehave({.malformed = true});
    server.commit(craneTo(Vec3d(4, 4, 4)));
    Expected<bool> polled = true;
    while (polled) polled = application->poll(5s);
    EXPECT_WORDS(polled.error().message);
}

TEST(Application, EveryWaitHasAnEnd) {
    ScriptedServer server;
    const auto application = *Application::connect({.address = server.address(), .name = "test", .timeout = 1500ms});
    server.misbehave({.mute = true});
    const auto begun = std::chrono::steady_clock::now();
    const auto unanswered = application->status();
    ASSERT_FALSE(unanswered);
    EXPECT_EQ(unanswered.error().code, ErrorCode::kNetwork);
    EXPECT_WORDS(unanswered.error().message);
    EXPECT_LT(std::chrono::steady_clock::now() - begun, 8s);

    server.misbehave({.noSnapshot = true});
    const auto empty = Application::connect({.address = server.address(), .name = "test", .timeout = 300ms});
    ASSERT_FALSE(empty);
    EXPECT_WORDS(empty.error().message);
}

TEST(Application, ARefusalKeepsItsReasonAndCode) {
    ScriptedServer server;
    server.misbehave({.refuse = message::Refused{ErrorCode::kLimit, "already 64 applications are connected", true}});
    const auto refused = Application::connect({.address = server.address(), .name = "test"});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
    EXPECT_WORDS(refused.error().message);
}

/// A listener without a Tessera behind it.
class Stranger {
public:
    explicit Stranger(std::string greeting) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        EXPECT_EQ(::listen(fd_, 8), 0);
        socklen_t length = sizeof address;
        ::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &length);
        port_ = ntohs(address.sin_port);
        thread_ = std::thread([this, greeting] {
            const int peer = ::accept(fd_, nullptr, nullptr);
            if (peer < 0) return;
            if (!greeting.empty()) (void)::send(peer, greeting.data(), greeting.size(), MSG_NOSIGNAL);
            char rest[256];
            while (::recv(peer, rest, sizeof rest, 0) > 0) continue;
            ::close(peer);
        });
    }
    ~Stranger() {
        ::shutdown(fd_, SHUT_RDWR);
        thread_.join();
        ::close(fd_);
    }
    [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

private:
    int fd_;
    std::uint16_t port_ = 0;
    std::thread thread_;
};

TEST(Application, WhatIsNoTesseraServerIsNamed) {
    const auto why = [](const std::string& address, std::chrono::milliseconds timeout) {
        const auto begun = std::chrono::steady_clock::now();
        const auto application = Application::connect({.address = address, .name = "test", .timeout = timeout});
        EXPECT_LT(std::chrono::steady_clock::now() - begun, timeout + 5s);
        EXPECT_FALSE(application);
        EXPECT_EQ(application.error().code, ErrorCode::kNetwork);
        EXPECT_NE(application.error().message.find(address), std::string::npos) << application.error().message;
        return application.error().message;
    };
    EXPECT_WORDS(why("127.0.0.1:1", 20s));
    const Stranger ssh("SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n");
    EXPECT_WORDS(why(ssh.address(), 20s));
    const Stranger silent("");
    EXPECT_WORDS(why(silent.address(), 500ms));
    // Nobody is welcomed within a long frame: --timeout says how long that may last, and not the 5 s of a lost server.
    const Stranger busy("");
    EXPECT_WORDS(why(busy.address(), 5500ms));
    EXPECT_EQ(Application::connect({.address = "nonsense"}).error().code, ErrorCode::kUsage);
}

}  // namespace
}  // namespace tessera
