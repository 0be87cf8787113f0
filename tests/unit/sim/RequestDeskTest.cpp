/// The desk with real applications on loopback and frames made by hand: who is told of what, and whose answer counts.
#include "server/sim/desk/RequestDesk.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "common/application/Application.h"
#include "common/base/Channel.h"
#include "common/codec/WallCodec.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/peers/Peers.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Decision = QuestionReply::Decision;

ServerSessionConfig configOf(const Wall& wall) {
    ServerSessionConfig config;
    config.hosts = {"only"};
    config.schema = schemaHash();
    config.configuration = share(encodeWall(wall));
    return config;
}

/// What a frame loop is to the desk, on a thread of its own; its frames are given by the test.
class DeskAtWork {
public:
    DeskAtWork() : thread_([this] { run(); }) { address_ = "127.0.0.1:" + std::to_string(port_.get_future().get()); }
    ~DeskAtWork() {
        events_.close();
        thread_.join();
    }
    [[nodiscard]] std::unique_ptr<Application> connect(const std::string& name) const {
        auto application = Application::connect({.address = address_, .name = name, .followScene = false});
        EXPECT_TRUE(application) << (application ? "" : application.error().message);
        return application ? std::move(*application) : nullptr;
    }
    /// One frame; the answers that the desk had for it.
    std::vector<Reply> frame(StepResult step, std::vector<std::uint64_t> openQuestions = {}) {
        std::promise<std::vector<Reply>> done;
        events_.push([&](Peers& peers, RequestDesk& desk) {
            std::vector<Reply> replies = desk.takeReplies();
            FrameResult result;
            result.collision = std::move(step);
            (void)peers.perform(desk.committed(std::move(result), std::exchange(frame_, frame_.next()), openQuestions));
            done.set_value(std::move(replies));
        });
        return done.get_future().get();
    }

private:
    using Event = std::function<void(Peers&, RequestDesk&)>;

    void run() {
        const Wall wall = test::wallOfOne();
        BlobStore blobs;
        Simulation simulation;
        ViewSource view(wall, "");
        Peers peers(
            configOf(wall), blobs,
            [this](LinkEvent event) {
                events_.push([event](Peers& p, RequestDesk& desk) { handle(p, p.handle(event), desk); });
            },
            Platform());
        Loader loader({}, std::make_shared<SceneFiles>(ImportOptions(), std::vector<std::string>()),
                      [](Preparation) {});
        ManipulatorDrags drags;
        RequestDesk desk({.wall = wall,
                          .blobs = blobs,
                          .session = peers.session(),
                          .simulation = simulation,
                          .view = view,
                          .loader = loader,
                          .drags = drags});
        port_.set_value(peers.listen({"127.0.0.1", 0}).value_or(0));
        while (const std::optional<Event> event = events_.pop()) (*event)(peers, desk);
    }
    static void handle(Peers& peers, const ServerActions& actions, RequestDesk& desk) {
        for (const ServerAction& action : actions) {
            if (const auto* request = std::get_if<server_action::RequestReceived>(&action))
                (void)peers.perform(desk.received(*request, std::chrono::steady_clock::now()));
            if (const auto* joined = std::get_if<server_action::ApplicationJoined>(&action))
                desk.applicationJoined(joined->connection, {.name = joined->name, .who = joined->who});
            if (const auto* left = std::get_if<server_action::ApplicationLeft>(&action))
                desk.applicationLeft(left->connection);
        }
    }

    Channel<Event> events_{1024};
    std::promise<std::uint16_t> port_;
    std::string address_;
    FrameNumber frame_;
    std::thread thread_;
};

Question question(std::uint64_t id) {
    Question q;
    q.id = id;
    q.interest = ObjectId{5};
    q.transform = ObjectId{6};
    q.wanted.translation = Vec3d(0, 0, double(id));
    return q;
}
StepResult asking(std::vector<std::uint64_t> ids) {
    StepResult step;
    for (const std::uint64_t id : ids) step.questions.push_back(question(id));
    return step;
}
StepResult touching() {
    StepResult step;
    step.contactsBegun = 1;
    step.contacts.push_back({.objectA = ObjectId{2}, .objectB = ObjectId{3}, .interest = ObjectId{5}, .time = 0.5});
    step.events.push_back({.interest = ObjectId{5}, .objectA = ObjectId{2}, .objectB = ObjectId{3}});
    step.events.push_back(
        {.interest = ObjectId{5}, .objectA = ObjectId{2}, .objectB = ObjectId{4}, .phase = Phase::kStays});
    step.distances.push_back({.interest = ObjectId{7}, .objectA = ObjectId{2}, .objectB = ObjectId{8}, .distance = 3});
    step.counters.notLookedAt = 2;
    return step;
}

void pollUntil(Application& application, const std::function<bool()>& reached) {
    while (!reached()) {
        const auto polled = application.poll(10s);
        ASSERT_TRUE(polled) << polled.error().message;
        ASSERT_TRUE(*polled || reached()) << "nothing came";
    }
}

TEST(RequestDesk, EachSubscriberIsToldWhatItAskedFor) {
    DeskAtWork desk;
    const auto all = desk.connect("all"), changes = desk.connect("changes"), silent = desk.connect("silent");
    ASSERT_TRUE(all && changes && silent);
    std::vector<answer::PairEvents> everything, begunOnly;
    std::vector<answer::Distances> distances;
    std::vector<answer::Contacts> contacts;
    ASSERT_TRUE(all->onPairEvents([&](const auto& told) { everything.push_back(told); }, {.stays = true}));
    ASSERT_TRUE(all->onDistances([&](const auto& told) { distances.push_back(told); }));
    ASSERT_TRUE(all->onContacts([&](const auto& told) { contacts.push_back(told); }));
    ASSERT_TRUE(changes->onPairEvents([&](const auto& told) { begunOnly.push_back(told); }));
    (void)desk.frame(touching());
    (void)desk.frame({});
    pollUntil(*all, [&] { return everything.size() == 2 && distances.size() == 2 && contacts.size() == 2; });
    pollUntil(*changes, [&] { return begunOnly.size() == 2; });
    EXPECT_EQ(everything[0].events.size(), 2u);
    EXPECT_EQ(begunOnly[0].events.size(), 1u);
    EXPECT_EQ(begunOnly[1].frame, FrameNumber(1)) << "a frame without events is told too";
    EXPECT_TRUE(begunOnly[1].events.empty());
    EXPECT_EQ(distances[0].distances.at(0).distance, 3);
    EXPECT_EQ(contacts[0].contacts.at(0).interest, ObjectId{5});
    EXPECT_EQ(contacts[0].contacts.at(0).time, 0.5);
    EXPECT_EQ(contacts[0].notLookedAt, 2u);
    EXPECT_EQ(contacts[1].begun, 1u);
    ASSERT_TRUE(silent->status()) << "its answer comes behind whatever was told before";
    EXPECT_FALSE(*silent->poll(0ms)) << "who asked for nothing is told nothing";
}

TEST(RequestDesk, WhoDoesNotFollowIsToldOfTheScenePieceByPiece) {
    DeskAtWork desk;
    const auto application = desk.connect("asks");
    ASSERT_TRUE(application);
    const auto root = application->describe("/");
    ASSERT_TRUE(root) << root.error().message;
    EXPECT_EQ(root->id, kRootNode);
    EXPECT_EQ(application->describe("/nowhere").error().code, ErrorCode::kNotFound);
    const auto tree = application->fetchTree({});
    ASSERT_TRUE(tree) << tree.error().message;
    EXPECT_EQ(tree->nodes().size(), 1u);
    EXPECT_EQ(application->fetchTree({.node = ObjectId{99}}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(application->removeNode(kRootNode).error().code, ErrorCode::kRefused);
    EXPECT_EQ(application->removeNode(ObjectId{99}).error().code, ErrorCode::kNotFound);
    EXPECT_TRUE(application->status()) << "and whoever was refused goes on asking";
}

TEST(RequestDesk, TheNewestFrameIsThereForWhoAsks) {
    DeskAtWork desk;
    const auto application = desk.connect("asks");
    ASSERT_TRUE(application);
    EXPECT_TRUE(application->contacts()->contacts.empty()) << "before the first frame";
    (void)desk.frame({});
    (void)desk.frame(touching());
    EXPECT_EQ(application->contacts()->contacts.size(), 1u);
    EXPECT_EQ(application->contacts()->frame, FrameNumber(1));
    EXPECT_EQ(application->pairEvents()->events.size(), 2u) << "those that stay included";
    EXPECT_EQ(application->distances()->distances.size(), 1u);
    EXPECT_TRUE(application->questions()->questions.empty());
}

TEST(RequestDesk, TheFirstAnswerCountsAndTheNextFrameHasIt) {
    DeskAtWork desk;
    const auto quick = desk.connect("quick"), late = desk.connect("late");
    ASSERT_TRUE(quick && late);
    std::vector<QuestionValue> asked;
    ASSERT_TRUE(quick->onQuestions([&](const answer::Questions& told) {
        asked.insert(asked.end(), told.questions.begin(), told.questions.end());
    }));
    EXPECT_TRUE(desk.frame(asking({1, 2}), {1, 2}).empty());
    pollUntil(*quick, [&] { return asked.size() == 2; });
    EXPECT_EQ(asked[1].wanted.translation, Vec3d(0, 0, 2));

    const Pose beside{Vec3d(7, 0, 0), Quatd::Identity(), Vec3d(2, 2, 2)};
    ASSERT_TRUE(quick->respond(2, Decision::kMove, beside));
    const auto second = late->respond(2, Decision::kPass);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(second.error().message);
    EXPECT_EQ(late->questions()->questions.size(), 1u) << "what has an answer is not asked any more";
    ASSERT_TRUE(late->respond(1, Decision::kPass)) << "anybody may answer, subscribed or not";

    const std::vector<Reply> replies = desk.frame({}, {});
    ASSERT_EQ(replies.size(), 2u);
    EXPECT_EQ(replies[0].question, 2u);
    EXPECT_EQ(replies[0].decision, Reply::Decision::kMove);
    EXPECT_EQ(replies[0].pose.translation, Vec3d(7, 0, 0));
    EXPECT_EQ(replies[0].pose.scale, Vec3d(2, 2, 2));
    EXPECT_EQ(replies[1].decision, Reply::Decision::kPass);
    EXPECT_TRUE(desk.frame({}, {}).empty()) << "once";

    const auto over = late->respond(2, Decision::kStop);
    ASSERT_FALSE(over);
    EXPECT_WORDS(over.error().message);
    const auto unknown = late->respond(3, Decision::kStop);
    ASSERT_FALSE(unknown);
    EXPECT_WORDS(unknown.error().message);
}

TEST(RequestDesk, OneThatNeverAnswersDelaysNothingAndIsToldWhenItIsOver) {
    DeskAtWork desk;
    const auto mute = desk.connect("mute");
    ASSERT_TRUE(mute);
    std::vector<answer::Questions> told;
    ASSERT_TRUE(mute->onQuestions([&](const answer::Questions& questions) { told.push_back(questions); }));
    (void)desk.frame(asking({1}), {1});
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(desk.frame({}, {1}).empty());
    StepResult patienceOver;
    patienceOver.counters.unanswered = 1;
    (void)desk.frame(patienceOver, {});
    pollUntil(*mute, [&] { return told.size() == 2; });
    EXPECT_EQ(told[0].questions.at(0).id, 1u);
    EXPECT_EQ(told[1].closed, std::vector<std::uint64_t>{1});
    EXPECT_EQ(told[1].unanswered, 1u);
    EXPECT_EQ(told[1].frame, FrameNumber(11)) << "frames in which nothing is asked or closed are not told";
    EXPECT_FALSE(mute->respond(1, Decision::kPass));
}

TEST(RequestDesk, WhoSubscribesLateIsToldOfWhatIsOpen) {
    DeskAtWork desk;
    (void)desk.frame(asking({4, 6}), {4, 6});
    const auto late = desk.connect("late");
    ASSERT_TRUE(late);
    std::vector<std::uint64_t> ids;
    ASSERT_TRUE(late->onQuestions([&](const answer::Questions& told) {
        for (const QuestionValue& q : told.questions) ids.push_back(q.id);
    }));
    pollUntil(*late, [&] { return ids.size() == 2; });
    EXPECT_EQ(ids, (std::vector<std::uint64_t>{4, 6}));
    ASSERT_TRUE(late->onContacts([](const answer::Contacts&) {}));
    EXPECT_FALSE(*late->poll(0ms)) << "a further subscription does not ask again";
}

}  // namespace
}  // namespace tessera
