/// The session thread against a scripted server on loopback; the draw thread is the test.
#include "client/replica/ServerLink.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "common/codec/MessageCodec.h"
#include "tests/support/words/Words.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
constexpr auto kPatience = 20s;

/// What the server hears, in order; says what the test wants it to.
class ScriptedServer {
public:
    ScriptedServer() {
        TransportLimits limits;
        limits.maxPayload = maxPayloadBytes;
        transport_ =
            std::make_unique<TcpTransport>(limits, [this](LinkEvent event) { events_.push(std::move(event)); });
        port_ = transport_->listen({.host = "127.0.0.1", .port = 0}).value();
    }
    ~ScriptedServer() {
        events_.close();
        transport_.reset();
    }
    [[nodiscard]] Address address() const { return {.host = "127.0.0.1", .port = port_}; }

    /// The next message of this kind; others are passed over, and hellos of bulk connections.
    template <typename T>
    std::optional<std::pair<LinkId, T>> hear() {
        const auto end = std::chrono::steady_clock::now() + kPatience;
        while (std::chrono::steady_clock::now() < end) {
            const auto event = events_.popFor(100ms);
            const auto* received = event ? std::get_if<link_event::Received>(&event->what) : nullptr;
            if (!received) continue;
            const auto message = decodeMessage(received->type, received->payload);
            if (!message) continue;
            const auto* wanted = std::get_if<T>(&*message);
            if (!wanted) continue;
            if constexpr (std::is_same_v<T, message::Hello>)
                if (wanted->channel != ChannelKind::kControl) continue;
            return std::pair(received->link, *wanted);
        }
        return std::nullopt;
    }
    void say(LinkId link, const Message& message) {
        transport_->send(link, wireType(message), epoch_, share(encodeMessage(message)));
    }
    void goOnAt(Epoch epoch) { epoch_ = epoch; }
    void hangUp(LinkId link) { transport_->close(link, "hung up by the test"); }

private:
    Channel<LinkEvent> events_{10'000};
    std::uint16_t port_ = 0;
    Epoch epoch_{1};
    std::unique_ptr<TcpTransport> transport_;
};

class ServerLinkTest : public testing::Test {
protected:
    void start(std::chrono::milliseconds finishDeadline = 15s) {
        link_ = std::make_unique<ServerLink>(ServerLinkOptions{.server = server_.address(),
                                                               .name = "left",
                                                               .pixelProbe = 42,
                                                               .finishDeadline = finishDeadline,
                                                               .atOnce = atOnce_},
                                             shelf_, nullptr, nullptr, events_, work_, log_);
        thread_ = std::thread([this] { end_ = link_->run(); });
    }
    void TearDown() override {
        if (!thread_.joinable()) return;
        // A test that failed half-way has not waited for the end.
        link_->tell(Outcome{Attempt{}, outcome::Broken{{ErrorCode::kFailed, "the test is over"}}});
        link_->tell(Outcome{Attempt{}, outcome::Ended{}});
        thread_.join();
    }
    HostEnd waitForEnd() {
        while (work_.pop()) {
        }
        link_->tell(Outcome{Attempt{}, outcome::Ended{}});
        thread_.join();
        return end_;
    }
    LinkId welcome() {
        const auto hello = server_.hear<message::Hello>();
        EXPECT_TRUE(hello);
        server_.say(
            hello->first,
            message::Welcome{.epoch = 1_epoch, .token = {5, 6}, .configuration = share(Bytes(3, std::byte{1}))});
        return hello->first;
    }

    ScriptedServer server_;
    BlobStore store_;
    BlobShelf shelf_{store_, 1'000'000};
    Channel<ServerLink::Event> events_{4096};
    WorkQueue work_{64};
    std::function<std::optional<Outcome>(const Work&)> atOnce_;
    Log log_{"test"};
    HostEnd end_;
    std::unique_ptr<ServerLink> link_;
    std::thread thread_;
};

TEST_F(ServerLinkTest, SaysWhoItIsAndEndsWhenTheServerIsOver) {
    start();
    const auto hello = server_.hear<message::Hello>();
    ASSERT_TRUE(hello);
    EXPECT_EQ(hello->second.name, "left");
    EXPECT_EQ(hello->second.pixelProbe, 42u);
    EXPECT_EQ(hello->second.protocol, kProtocolVersion);
    server_.say(hello->first, message::Over{"all frames are shown"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, SaysWhereItsBoardLiesAndHandsNeighboursAndTheirCallsOn) {
    link_ = std::make_unique<ServerLink>(
        ServerLinkOptions{.server = server_.address(), .name = "left", .machine = "here", .board = "1/3"}, shelf_,
        nullptr, nullptr, events_, work_, log_);
    thread_ = std::thread([this] { end_ = link_->run(); });
    const auto hello = server_.hear<message::Hello>();
    ASSERT_TRUE(hello);
    EXPECT_EQ(hello->second.machine, "here");
    EXPECT_EQ(hello->second.board, "1/3");
    server_.say(hello->first, message::Welcome{.epoch = 1_epoch, .token = {5, 6}});
    server_.say(hello->first, message::Neighbours{"right 2/3\n"});
    ASSERT_TRUE(std::holds_alternative<work::Configure>(work_.popFor(kPatience).value().what));
    const auto met = work_.popFor(kPatience);
    ASSERT_TRUE(met && std::holds_alternative<work::Meet>(met->what)) << "after the wall, which has their names";
    EXPECT_EQ(std::get<work::Meet>(met->what).neighbours.boards, "right 2/3\n");
    link_->tell(Outcome{Attempt{}, outcome::Called{}});
    const auto called = work_.popFor(kPatience);
    EXPECT_TRUE(called && std::holds_alternative<work::Help>(called->what));
    server_.say(hello->first, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, TellsARestartedServerTheHighestEpochAndLeavesALowerOne) {
    start();
    const auto join = [&](Epoch epoch) {
        const auto hello = server_.hear<message::Hello>();
        server_.goOnAt(epoch);
        if (hello) server_.say(hello->first, message::Welcome{.epoch = epoch, .token = {5, 6}});
        return hello ? std::pair(hello->first, hello->second.seenEpoch) : std::pair(LinkId(), Epoch());
    };
    const auto [first, knewNone] = join(7_epoch);
    EXPECT_EQ(knewNone, 0_epoch);
    server_.hangUp(first);
    // Its clock went back, and it does not listen to what hosts have seen.
    const auto [second, afterFirst] = join(3_epoch);
    EXPECT_EQ(afterFirst, 7_epoch);
    const auto [third, afterLower] = join(8_epoch);
    EXPECT_EQ(afterLower, 7_epoch) << "it came again by itself";
    server_.say(third, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, EndsWithTheReasonWhenItIsRefusedForGood) {
    start();
    const auto hello = server_.hear<message::Hello>();
    ASSERT_TRUE(hello);
    server_.say(hello->first, message::Refused{ErrorCode::kNotFound, "unknown host 'left'; the wall has: a, b", false});
    const HostEnd end = waitForEnd();
    EXPECT_FALSE(end.over);
    EXPECT_EQ(end.error.code, ErrorCode::kNotFound);
    EXPECT_WORDS(end.error.message);
}

TEST_F(ServerLinkTest, DialsAgainAfterALostConnectionAndARefusalForNow) {
    start();
    const LinkId first = welcome();
    server_.hangUp(first);
    const auto second = server_.hear<message::Hello>();
    ASSERT_TRUE(second);
    server_.say(second->first, message::Refused{ErrorCode::kRefused, "host 'left' is connected already", true});
    const auto third = server_.hear<message::Hello>();
    ASSERT_TRUE(third);
    server_.say(third->first, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, HeartbeatsGoOnWhileTheDrawThreadIsBusy) {
    start();
    const LinkId control = welcome();
    server_.say(control, message::Snapshot{share(CommittedList{1_seq, 9_hash, share(Bytes(1)), {}})});
    // The draw thread has its work and answers nothing.
    bool asked = false;
    while (const auto next = work_.popFor(kPatience))
        if (std::holds_alternative<work::ApplySnapshot>(next->what)) {
            asked = true;
            break;
        }
    ASSERT_TRUE(asked);
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(server_.hear<message::Heartbeat>()) << i;
    link_->tell(Outcome{Attempt{1}, outcome::Applied{1_seq, 9_hash}});
    EXPECT_TRUE(server_.hear<message::Synced>());
    server_.say(control, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, DoesAtOnceWhatTakesNoTimeWhileTheDrawThreadHasNothingToDo) {
    int done = 0;
    atOnce_ = [&](const Work& work) -> std::optional<Outcome> {
        const auto* draw = std::get_if<work::Draw>(&work.what);
        if (!draw || draw->begin.frame == 2_frame) return std::nullopt;
        ++done;
        return Outcome{work.attempt, outcome::Drawn{draw->begin.frame, 9_hash, {}}};
    };
    start();
    const LinkId control = welcome();
    const auto begin = [](FrameNumber frame) {
        return message::Begin{frame, {}, share(CommittedList{1_seq, 9_hash, {}, {}})};
    };
    ASSERT_TRUE(work_.popFor(kPatience)) << "Configure";
    server_.say(control, begin(0_frame));
    ASSERT_TRUE(work_.popFor(kPatience)) << "Configure is still in hand";
    EXPECT_EQ(done, 0);
    work_.done();
    work_.done();
    link_->tell(Outcome{Attempt{1}, outcome::Drawn{0_frame, 9_hash, {}}});
    EXPECT_EQ(server_.hear<message::Ready>()->second.frame, 0_frame);
    server_.say(control, begin(1_frame));
    EXPECT_EQ(server_.hear<message::Ready>()->second.frame, 1_frame);
    EXPECT_EQ(done, 1);
    server_.say(control, begin(2_frame));
    const auto next = work_.popFor(kPatience);
    ASSERT_TRUE(next && std::holds_alternative<work::Draw>(next->what)) << "this one takes time";
    EXPECT_EQ(done, 1);
    server_.say(control, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

/// What the draw thread is at after it has drawn, a part for a neighbour or a program that may be needed, is no
/// business of the others: they show the frame now.
TEST_F(ServerLinkTest, ShowsInTheInstantOfTheSwapWhateverTheDrawThreadIsAt) {
    const test::TestFolder folder;
    auto left = SharedFrameWriter::create(folder / "left/shown.frame", 8, 4).value(),
         right = SharedFrameWriter::create(folder / "right/shown.frame", 8, 4).value();
    const auto shown = [&](const std::string& tile) {
        const auto image = readSharedFrame(folder / (tile + "/shown.frame"));
        return image ? static_cast<int>(image->frame) : -1;
    };
    start();
    const LinkId control = welcome();
    ASSERT_TRUE(work_.popFor(kPatience)) << "Configure";
    work_.done();
    for (const FrameNumber frame : {0_frame, 1_frame, 2_frame}) {
        server_.say(control, message::Begin{frame, {}, share(CommittedList{1_seq, 9_hash, {}, {}})});
        ASSERT_TRUE(std::holds_alternative<work::Draw>(work_.popFor(kPatience).value().what));
        for (SharedFrameWriter* file : {&left, &right}) file->prepare(frame.value, Picture::filled(8, 4, 1, 2, 3));
        link_->tell({Attempt{1}, outcome::Drawn{frame, 9_hash, {}, {left.ready(), right.ready()}}});
        EXPECT_EQ(server_.hear<message::Ready>()->second.frame, frame);
        EXPECT_EQ(shown("left"), static_cast<int>(frame.value) - 1) << "not before the others";
        EXPECT_FALSE(work_.more());
        server_.say(control, message::Swap{frame});
        // The draw thread has its piece of work in hand: `done` is not said.
        const auto said = server_.hear<message::Shown>();
        ASSERT_TRUE(said) << "frame " << frame.value << " waits for the draw thread";
        EXPECT_EQ(said->second.frame, frame);
        EXPECT_EQ(shown("left"), static_cast<int>(frame.value));
        EXPECT_EQ(shown("right"), static_cast<int>(frame.value));
        EXPECT_TRUE(work_.more()) << "so that it leaves what is for nobody now";
        work_.done();
        const auto noted = work_.popFor(kPatience);
        ASSERT_TRUE(noted && std::holds_alternative<work::Shown>(noted->what)) << "it hears before the next frame";
        EXPECT_EQ(std::get<work::Shown>(noted->what).frame, frame);
        work_.done();
    }
    server_.say(control, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, PicturesOfALostConnectionAreNotShownOnTheNext) {
    const test::TestFolder folder;
    auto file = SharedFrameWriter::create(folder / "shown.frame", 8, 4).value();
    start();
    const LinkId first = welcome();
    server_.say(first, message::Begin{0_frame, {}, share(CommittedList{1_seq, 9_hash, {}, {}})});
    while (!std::holds_alternative<work::Draw>(work_.popFor(kPatience).value().what)) {
    }
    file.prepare(0, Picture::filled(8, 4, 1, 2, 3));
    link_->tell({Attempt{1}, outcome::Drawn{0_frame, 9_hash, {}, {file.ready()}}});
    ASSERT_TRUE(server_.hear<message::Ready>());
    server_.hangUp(first);
    const LinkId second = welcome();
    server_.say(second, message::Begin{1_frame, {}, share(CommittedList{1_seq, 9_hash, {}, {}})});
    while (!std::holds_alternative<work::Draw>(work_.popFor(kPatience).value().what)) {
    }
    link_->tell({Attempt{2}, outcome::Drawn{1_frame, 9_hash, {}, {}}});
    ASSERT_TRUE(server_.hear<message::Ready>());
    server_.say(second, message::Swap{1_frame});
    ASSERT_TRUE(server_.hear<message::Shown>());
    EXPECT_FALSE(readSharedFrame(folder / "shown.frame")) << "a picture that nobody released";
    server_.say(second, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, LeavesWhereAPictureCannotBeShown) {
    const test::TestFolder folder;
    auto file = SharedFrameWriter::create(folder / "tile/shown.frame", 8, 4).value();
    start();
    const LinkId control = welcome();
    server_.say(control, message::Begin{0_frame, {}, share(CommittedList{1_seq, 9_hash, {}, {}})});
    while (!std::holds_alternative<work::Draw>(work_.popFor(kPatience).value().what)) {
    }
    file.prepare(0, Picture::filled(8, 4, 1, 2, 3));
    std::filesystem::remove_all(folder / "tile");
    link_->tell({Attempt{1}, outcome::Drawn{0_frame, 9_hash, {}, {file.ready()}}});
    ASSERT_TRUE(server_.hear<message::Ready>());
    server_.say(control, message::Swap{0_frame});
    const HostEnd end = waitForEnd();
    EXPECT_FALSE(end.over);
    EXPECT_WORDS(end.error.message);
}

TEST_F(ServerLinkTest, AnswersOfAnEarlierConnectionComeToNothing) {
    start();
    const LinkId first = welcome();
    server_.say(first, message::Snapshot{share(CommittedList{1_seq, 9_hash, share(Bytes(1)), {}})});
    while (const auto next = work_.popFor(kPatience))
        if (std::holds_alternative<work::ApplySnapshot>(next->what)) break;
    server_.hangUp(first);
    const LinkId second = welcome();
    link_->tell(Outcome{Attempt{1}, outcome::Applied{1_seq, 9_hash}});
    ASSERT_TRUE(server_.hear<message::Heartbeat>());
    server_.say(second, message::Over{"over"});
    EXPECT_TRUE(waitForEnd().over);
}

TEST_F(ServerLinkTest, LeavesWhenTheHostCannotDraw) {
    start();
    welcome();
    link_->tell(Outcome{Attempt{}, outcome::Broken{{ErrorCode::kUnsupported, "no such surface"}}});
    const HostEnd end = waitForEnd();
    EXPECT_EQ(end.error.code, ErrorCode::kUnsupported);
    EXPECT_EQ(end.error.message, "no such surface");
}

TEST_F(ServerLinkTest, GivesUpOnADrawThreadThatDoesNotComeBack) {
    start(100ms);
    const auto hello = server_.hear<message::Hello>();
    ASSERT_TRUE(hello);
    server_.say(hello->first, message::Over{"over"});
    thread_.join();
    EXPECT_FALSE(end_.over);
    EXPECT_FALSE(link_->drawThreadEnded());
    EXPECT_EQ(end_.error.code, ErrorCode::kFailed);
}

TEST_F(ServerLinkTest, FailsToWriteEvenAfterTheEndIsAFailure) {
    start();
    const auto hello = server_.hear<message::Hello>();
    ASSERT_TRUE(hello);
    server_.say(hello->first, message::Over{"over"});
    while (const auto next = work_.pop())
        if (std::holds_alternative<work::Finish>(next->what))
            link_->tell(Outcome{Attempt{}, outcome::Broken{{ErrorCode::kFailed, "disk full"}}});
    const HostEnd end = waitForEnd();
    EXPECT_FALSE(end.over);
    EXPECT_EQ(end.error.message, "disk full");
}

}  // namespace
}  // namespace tessera
