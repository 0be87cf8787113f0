/// An application's own response, out of process: it is asked what shall become of a motion, and the wall goes on
/// meanwhile.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/application/Application.h"
#include "common/cores/Transform.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using Decision = QuestionReply::Decision;

const double kStop = 2 - 0.15 - 0.5;  ///< of the first lane: the post's place, half its thickness, half the cart
const double kPassTolerance = 1e-4 * std::sqrt(1 + 0.64 + 1);

/// A program that is asked.
class Asked {
public:
    explicit Asked(AskedWall& wall) : wall_(wall) {
        auto connected =
            Application::connect({.address = toString(wall.address()), .name = "judge"}, wall.platform("judge"));
        EXPECT_TRUE(connected) << connected.error().message;
        if (!connected) return;
        application_ = std::move(*connected);
        EXPECT_TRUE(application_->onQuestions([this](const answer::Questions& told) {
            questions_.insert(questions_.end(), told.questions.begin(), told.questions.end());
            closed_.insert(closed_.end(), told.closed.begin(), told.closed.end());
            unanswered_ += told.unanswered;
        }));
    }
    [[nodiscard]] Application& operator*() { return *application_; }
    [[nodiscard]] explicit operator bool() const { return application_ != nullptr; }

    /// The question after those that were waited for before.
    [[nodiscard]] QuestionValue next() {
        const bool came = pollUntil([&] { return questions_.size() > seen_; });
        EXPECT_TRUE(came) << "no question";
        return came ? questions_[seen_++] : QuestionValue{};
    }
    [[nodiscard]] bool waitUntilClosed(std::uint64_t id) {
        return pollUntil([&] { return std::ranges::find(closed_, id) != closed_.end(); });
    }
    [[nodiscard]] bool waitUntilAt(const std::string& node, const Vec3d& place) {
        return pollUntil([&] { return (this->place(node) - place).norm() < 1e-12; });
    }
    [[nodiscard]] Vec3d place(const std::string& path) const {
        const Expected<ObjectId> node = findNode(application_->scene(), path);
        EXPECT_TRUE(node);
        return node ? application_->scene().coreOf<Transform>(*application_->scene().get<Node>(*node))->translation
                    : Vec3d::Zero();
    }
    [[nodiscard]] std::size_t asked() const { return questions_.size(); }
    [[nodiscard]] std::uint64_t unanswered() const { return unanswered_; }

private:
    template <typename Condition>
    bool pollUntil(Condition condition) {
        const TimePoint deadline = wall_.world().now() + 30s;
        while (!condition()) {
            if (wall_.world().now() > deadline) return false;
            if (const auto polled = application_->poll(1s); !polled) {
                ADD_FAILURE() << polled.error().message;
                return false;
            }
        }
        return true;
    }

    AskedWall& wall_;
    std::unique_ptr<Application> application_;
    std::vector<QuestionValue> questions_;
    std::vector<std::uint64_t> closed_;
    std::uint64_t unanswered_ = 0;
    std::size_t seen_ = 0;
};

TEST(Questions, AProgramLetsPassPutsElsewhereAndStopsAndOneThatIsSilentHoldsNobodyUp) {
    AskedWall wall({.wall = "1x1", .widthPx = 160, .heightPx = 90});
    wall.tell({"set", "/stop/interest", "response", "ask"});
    wall.tell({"set", "/stop/interest", "patience", "1000000"});
    Asked judge(wall);
    ASSERT_TRUE(judge);

    // It may pass: from where it was stopped to where it wanted to be, beyond the post.
    const AskedWall::Moved pushed = wall.move("/stop/cart", {"10", "0", "0", "--by"});
    EXPECT_TRUE(pushed.stopped) << "until somebody answers it is stopped";
    const QuestionValue pass = judge.next();
    EXPECT_EQ(pathOf((*judge).scene(), pass.objectA).rfind("/stop/", 0), 0u);
    EXPECT_EQ(pathOf((*judge).scene(), pass.objectB).rfind("/stop/", 0), 0u);
    EXPECT_LE(pass.present.translation.x(), kStop + 1e-7);
    EXPECT_GE(pass.present.translation.x(), kStop - kPassTolerance);
    EXPECT_EQ(pass.wanted.translation, Vec3d(7, 0.45, 2));
    // Nobody waits: the wall draws on while it is open.
    wall.settle();
    EXPECT_EQ(wall.ask({"questions"})["questions"].size(), 1u);
    ASSERT_TRUE((*judge).respond(pass.id, Decision::kPass));
    EXPECT_TRUE(judge.waitUntilAt("/stop/cart", Vec3d(7, 0.45, 2)));
    EXPECT_TRUE(judge.waitUntilClosed(pass.id));
    const auto twice = (*judge).respond(pass.id, Decision::kPass);
    ASSERT_FALSE(twice);
    EXPECT_EQ(twice.error().code, ErrorCode::kRefused);
    wall.settle();

    // A passage is over once a frame has gone by without that motion. Back again it meets the post's other side, and a
    // person puts it behind.
    EXPECT_TRUE(wall.move("/stop/cart", {"-3", "0.45", "2"}).stopped);
    const QuestionValue back = judge.next();
    EXPECT_NEAR(back.present.translation.x(), 2 + 0.15 + 0.5, kPassTolerance);
    wall.tell({"answer", std::to_string(back.id), "move", "-2", "0.45", "2"});
    EXPECT_TRUE(judge.waitUntilAt("/stop/cart", Vec3d(-2, 0.45, 2)));
    EXPECT_TRUE(judge.waitUntilClosed(back.id));
    wall.settle();

    // It stays where it was stopped.
    EXPECT_TRUE(wall.move("/stop/cart", {"9", "0", "0", "--by"}).stopped);
    const QuestionValue stop = judge.next();
    ASSERT_TRUE((*judge).respond(stop.id, Decision::kStop));
    EXPECT_TRUE(judge.waitUntilClosed(stop.id));
    wall.settle();
    EXPECT_EQ(wall.placeOf("/stop/cart"), stop.present.translation);

    // Nobody answers: after its patience the question is closed, and the frames have gone on.
    wall.tell({"move", "/stop/cart", "-3", "0.45", "2"});
    wall.tell({"set", "/stop/interest", "patience", "10"});
    EXPECT_TRUE(wall.move("/stop/cart", {"9", "0", "0", "--by"}).stopped);
    const QuestionValue silent = judge.next();
    EXPECT_TRUE(judge.waitUntilClosed(silent.id));
    EXPECT_EQ(judge.unanswered(), 1u);
    EXPECT_FALSE((*judge).respond(silent.id, Decision::kPass)) << "too late";
    wall.settle();
    EXPECT_EQ(wall.placeOf("/stop/cart"), silent.present.translation);
    EXPECT_EQ(judge.asked(), 4u);
    EXPECT_TRUE(wall.ask({"questions"})["questions"].empty());

    const json report = wall.finish();
    ASSERT_FALSE(report.is_null());
    EXPECT_EQ(report["collision"]["unanswered"], 1);
}

}  // namespace
}  // namespace tessera::simulation
