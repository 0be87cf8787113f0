/// The wall assistant: what its measures are taken as, and the wall that they make.
#include "client/ctl/NewWall.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/codec/WallCodec.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

using Said = std::map<std::string, std::string>;

/// What is wrong with an answer; empty: nothing.
std::string wrong(const std::string& name, const std::string& word, WallPlan plan = {}) {
    for (const WallMeasure& measure : wallMeasures())
        if (name == measure.name) return measure.take(word, plan).value_or("");
    return "no such measure";
}

Wall wallOf(const Said& said) {
    return wallOfPlan(planOf({.file = "my.wall", .measures = said}, {}).value()).value();
}

TEST(NewWall, TakesMeasuresAsPeopleWriteThem) {
    WallPlan plan;
    const auto take = [&](const std::string& name, const std::string& word) {
        for (const WallMeasure& measure : wallMeasures()) {
            if (name != measure.name) continue;
            EXPECT_EQ(measure.take(word, plan).value_or(""), "") << name << " " << word;
        }
    };
    take("pixels", "3840 x 2160");
    take("size", "55");
    EXPECT_NEAR(std::hypot(plan.widthM, plan.heightM), 55 * 0.0254, 1e-12);
    EXPECT_NEAR(plan.widthM / plan.heightM, 16.0 / 9, 1e-12) << "as its pixels are";
    take("size", "30 16:10");
    EXPECT_NEAR(plan.widthM / plan.heightM, 1.6, 1e-12);
    take("size", "1.21x0.68");
    EXPECT_EQ(plan.heightM, 0.68);
    take("columns", "+3");
    EXPECT_EQ(plan.columns, 3) << "a number as everywhere on the command line";
    take("bezel", "3.5 4");
    EXPECT_EQ(plan.bezelYMm, 4);
    take("bezel", "2");
    EXPECT_EQ(plan.bezelYMm, 2);
}

TEST(NewWall, SaysWhatIsWrongWithAnAnswer) {
    for (const auto& [name, word] : {std::pair{"columns", "0"},
                                     {"columns", "2.5"},
                                     {"columns", "129"},
                                     {"rows", "two"},
                                     {"rows", "1e999"},
                                     {"pixels", "1920"},
                                     {"pixels", "1920x0"},
                                     {"pixels", "1920x1080x2"},
                                     {"size", "0"},
                                     {"size", "55 16"},
                                     {"size", "55 16:0"},
                                     {"size", "2x"},
                                     {"size", "-1x1"},
                                     {"size", "nan"},
                                     {"bezel", "-1"},
                                     {"bezel", "1 2 3"},
                                     {"distance", "0"},
                                     {"distance", "inf"},
                                     {"hosts", "each"}})
        EXPECT_WORDS(wrong(name, word));
    EXPECT_EQ(wrong("rows", "64", {.columns = 64}), "64 x 64 are 4096 monitors: a wall has at most 1024");
}

TEST(NewWall, AsksForWhatIsNotSaidAndAgainForWhatIsWrong) {
    std::vector<std::string> answers{"many", "3", " 2 ", "", "1x0.5", "", "2"}, questions;
    const auto plan = planOf({.file = "my.wall", .measures = {{"hosts", "row"}}},
                             [&](const std::string& question) -> std::optional<std::string> {
                                 questions.push_back(question);
                                 if (answers.empty()) return std::nullopt;
                                 const std::string answer = answers.front();
                                 answers.erase(answers.begin());
                                 return answer;
                             });
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_EQ(plan->columns, 3);
    EXPECT_EQ(plan->rows, 2);
    EXPECT_EQ(plan->widthPx, 1920);
    EXPECT_EQ(plan->hosts, "row");
    ASSERT_EQ(questions.size(), 7u) << "none for what was said";
    EXPECT_WORDS(questions[1]);
    EXPECT_WORDS(questions[3]);
    const auto ended = planOf({.file = "my.wall"}, [](const std::string&) { return std::nullopt; });
    EXPECT_WORDS(ended.error().message);
    // A wrong option is no question.
    EXPECT_EQ(
        planOf({.file = "my.wall", .measures = {{"rows", "x"}}}, [](const std::string&) { return "1"; }).error().code,
        ErrorCode::kUsage);
}

TEST(NewWall, NamesWhatIsMissingWhereNobodyCanBeAsked) {
    const auto plan = planOf({.file = "my.wall", .measures = {{"rows", "2"}, {"size", ""}}}, {});
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(plan.error().message);
}

TEST(NewWall, PutsTheWallBeforeTheEyes) {
    // Monitors of a metre and 1000 pixels: a pixel is a millimetre.
    const Wall wall = wallOf({{"columns", "3"},
                              {"rows", "2"},
                              {"pixels", "1000x500"},
                              {"size", "1x0.5"},
                              {"bezel", "10.4 4"},
                              {"distance", "2.5"}});
    const Screen& screen = wall.screens[0];
    EXPECT_EQ(screen.grid.bezelXPx, 10);
    EXPECT_EQ(screen.grid.bezelYPx, 4);
    EXPECT_NEAR(screen.widthMetres(), 3.02, 1e-9);
    EXPECT_NEAR(screen.heightMetres(), 1.004, 1e-9);
    EXPECT_NEAR((screen.lowerLeft.y() + screen.upperLeft.y()) / 2, 1.7, 1e-9) << "its middle before the eyes";
    EXPECT_EQ(wall.users[0].position, Vec3d(0, 1.7, 2.5));
    EXPECT_EQ(wall.hosts.size(), 6u);
    EXPECT_EQ(wall.hosts[1].name, "monitor-1-0");
    const Wall high = wallOf(
        {{"columns", "1"}, {"rows", "4"}, {"size", "2x1"}, {"distance", "3"}, {"bezel", "7"}, {"hosts", "wall"}});
    EXPECT_EQ(high.screens[0].lowerLeft.y(), 0) << "not below the floor";
    EXPECT_EQ(high.screens[0].grid.bezelXPx, 0) << "between one column and none there is nothing";
    ASSERT_EQ(high.hosts.size(), 1u);
    EXPECT_EQ(high.hosts[0].tiles.size(), 4u);
    EXPECT_EQ(wallOf({{"columns", "2"}, {"rows", "3"}, {"size", "46"}, {"distance", "3"}, {"hosts", "column"}})
                  .hosts[1]
                  .tiles.size(),
              3u);
    // What a file holds is the wall.
    EXPECT_EQ(parseWall(*wallText(wall), "my.wall")->screens[0].lowerLeft, screen.lowerLeft);
    const auto large = wallOfPlan(
        planOf({.file = "my.wall",
                .measures =
                    {{"columns", "100"}, {"rows", "1"}, {"pixels", "3840x2160"}, {"size", "1x0.5"}, {"distance", "3"}}},
               {})
            .value());
    EXPECT_FALSE(large) << "more pixels than a screen may have";
}

}  // namespace
}  // namespace tessera
