// Interests that ask an application what shall become of a motion.
#include <gtest/gtest.h>

#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct Asked : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    Body wall = body(kRootNode, shapes::box(Vec3d(1, 10, 10)), Vec3d(5, 0, 0));
    ObjectId asking = [&] {
        Interest fields;
        fields.object = box.node;
        fields.response = Interest::kAsk;
        fields.patience = 3;
        return interest(fields);
    }();

    StepResult push(double x, const std::vector<Reply>& replies = {}) {
        return frame({{.transform = box.transform, .translation = Vec3d(x, 0, 0)}}, replies);
    }
    double x() { return at(box.transform).translation.x(); }
};

TEST(Questions, AStoppedMotionIsAskedAboutOnce) {
    Asked scene;
    EXPECT_TRUE(scene.push(2).questions.empty());
    const StepResult result = scene.push(6);
    ASSERT_EQ(result.questions.size(), 1u);
    const Question& question = result.questions.front();
    EXPECT_EQ(question.interest, scene.asking);
    EXPECT_EQ(question.transform, scene.box.transform);
    EXPECT_EQ(question.objectA, scene.box.node);
    EXPECT_EQ(question.wanted.translation, Vec3d(6, 0, 0));
    EXPECT_EQ(question.present.translation.x(), scene.x());
    EXPECT_NEAR(question.point.x(), 4.5, 1e-2);
    EXPECT_NEAR(scene.x(), 4, 1e-3) << "meanwhile it stands";
    EXPECT_TRUE(scene.push(6).questions.empty());
    EXPECT_EQ(scene.pipeline.openQuestions(), std::vector{question.id});
}

TEST(Questions, NobodyAnswersAndTheFrameGoesOn) {
    Asked scene;
    EXPECT_EQ(scene.push(6).questions.size(), 1u);
    std::uint64_t unanswered = 0;
    for (int frame = 0; frame < 10; ++frame) {
        const StepResult result = scene.push(6);
        unanswered += result.counters.unanswered;
        EXPECT_TRUE(result.questions.empty()) << "pressing on is no news";
        EXPECT_NEAR(scene.x(), 4, 1e-3);
    }
    EXPECT_EQ(unanswered, 1u);
    EXPECT_TRUE(scene.pipeline.openQuestions().empty());
    // Away and back: a new matter.
    scene.push(0);
    scene.push(0);
    EXPECT_EQ(scene.push(6).questions.size(), 1u);
}

TEST(Questions, AnAnswerAfterThePatienceMeansNothing) {
    Asked scene;
    const std::uint64_t id = scene.push(6).questions.front().id;
    for (int frame = 0; frame < 5; ++frame) scene.push(6);
    scene.push(6, {{.question = id, .decision = Reply::Decision::kPass, .pose = {}}});
    EXPECT_NEAR(scene.x(), 4, 1e-3);
}

TEST(Questions, PassLetsItGoWhereItWantedToBe) {
    Asked scene;
    const std::uint64_t id = scene.push(6).questions.front().id;
    const StepResult result = scene.frame({}, {{.question = id, .decision = Reply::Decision::kPass, .pose = {}}});
    EXPECT_EQ(scene.x(), 6);
    EXPECT_TRUE(result.stopped.empty());
    // As long as they touch the pair is no obstacle.
    EXPECT_TRUE(scene.push(5.5).stopped.empty());
    EXPECT_TRUE(scene.push(8).stopped.empty());
    EXPECT_TRUE(scene.push(8).stopped.empty());
    EXPECT_EQ(scene.push(5).questions.size(), 1u) << "apart again: the wall is a wall";
}

TEST(Questions, APassageIsOverWhenItHasLedToTheOtherSide) {
    Asked scene;
    const std::uint64_t id = scene.push(9).questions.front().id;
    scene.frame({}, {{.question = id, .decision = Reply::Decision::kPass, .pose = {}}});
    EXPECT_EQ(scene.x(), 9);
    EXPECT_EQ(scene.push(0).questions.size(), 1u) << "in the very next frame";
    EXPECT_NEAR(scene.x(), 6, 1e-3);
}

TEST(Questions, MovePutsItElsewhere) {
    Asked scene;
    const std::uint64_t id = scene.push(6).questions.front().id;
    scene.push(6, {{.question = id, .decision = Reply::Decision::kMove, .pose = {.translation = Vec3d(-3, 1, 0)}}});
    EXPECT_EQ(scene.at(scene.box.transform).translation, Vec3d(-3, 1, 0))
        << "the reply stands above the wish of the frame";
}

TEST(Questions, StopIsNotAskedAgainWhileItPressesOn) {
    Asked scene;
    const std::uint64_t id = scene.push(6).questions.front().id;
    scene.push(6, {{.question = id, .decision = Reply::Decision::kStop, .pose = {}}});
    for (int frame = 0; frame < 5; ++frame) EXPECT_TRUE(scene.push(6).questions.empty());
    EXPECT_TRUE(scene.pipeline.openQuestions().empty());
}

TEST(Questions, RepliesThatMakeNoSenseChangeNothing) {
    Asked scene;
    const std::uint64_t id = scene.push(6).questions.front().id;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    scene.frame({}, {{.question = id + 7, .decision = Reply::Decision::kPass, .pose = {}}});
    EXPECT_NEAR(scene.x(), 4, 1e-3);
    scene.frame({}, {{.question = id, .decision = Reply::Decision::kMove, .pose = {.translation = Vec3d(nan, 0, 0)}},
                     {.question = id, .decision = Reply::Decision::kPass, .pose = {}}});
    EXPECT_NEAR(scene.x(), 4, 1e-3) << "the first reply counts, and that one cannot be granted";
}

TEST(Questions, OfADeletedObjectRunOut) {
    Asked scene;
    EXPECT_EQ(scene.push(6).questions.size(), 1u);
    scene.set<Node>(scene.wall.shape, fieldId<&Node::core>, ObjectId{});
    for (int frame = 0; frame < 6; ++frame) scene.frame();
    EXPECT_TRUE(scene.pipeline.openQuestions().empty());
    scene.push(6);
    EXPECT_EQ(scene.x(), 6);
}

}  // namespace
}  // namespace tessera
