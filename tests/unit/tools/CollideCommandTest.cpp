#include "server/tools/CollideCommand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/support/words/Words.h"

namespace tessera {
namespace {

CollideArguments arguments(const std::vector<std::string>& words) {
    const auto parsed = parseCollideArguments(words);
    EXPECT_TRUE(parsed) << parsed.error().message;
    if (!parsed || !std::holds_alternative<CollideArguments>(*parsed)) return {};
    return std::get<CollideArguments>(*parsed);
}

std::string refusal(const std::vector<std::string>& words) {
    const auto parsed = parseCollideArguments(words);
    if (parsed) return "accepted";
    EXPECT_EQ(parsed.error().code, ErrorCode::kUsage);
    return parsed.error().message;
}

TEST(CollideCommand, TakesTwoFilesPosesAndAQuery) {
    const CollideArguments out = arguments({"a.obj", "b.obj", "--poses", "p.txt", "--query", "all", "--json"});
    EXPECT_EQ(out.a, "a.obj");
    EXPECT_EQ(out.b, "b.obj");
    EXPECT_EQ(out.poses, "p.txt");
    EXPECT_EQ(out.query, CollideQuery::kAll);
    EXPECT_EQ(out.format, AnswerFormat::kJson);
    EXPECT_FALSE(out.time);
    EXPECT_FALSE(out.tolerance);
}

TEST(CollideCommand, AFileMayTakeMoreMemory) {
    EXPECT_EQ(arguments({"a", "b", "--poses", "p", "--query", "any", "--import-memory", "4096"}).importMemoryMib,
              4096u);
    EXPECT_EQ(arguments({"a", "b", "--poses", "p", "--query", "any"}).importMemoryMib, 0u);
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "any", "--import-memory", "9"}));
}

TEST(CollideCommand, PointsHaveARadius) {
    const CollideArguments out =
        arguments({"scan.ply", "b.obj", "--poses", "p", "--query", "any", "--as-a", "points", "--radius", "0.5"});
    EXPECT_EQ(out.asA, Representation::kPoints);
    EXPECT_EQ(out.radius, 0.5);
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "any", "--radius", "1"}));
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "any", "--as-b", "points", "--radius", "-1"}));
    EXPECT_WORDS(refusal({"a", "--query", "self", "--as-a", "points"}));
}

TEST(CollideCommand, KDopsAreRealignedByPlanesOrByTable) {
    const auto with = [](const std::string& query, std::vector<std::string> more) {
        more.insert(more.begin(), {"a", "b", "--poses", "p", "--query", query});
        return more;
    };
    EXPECT_FALSE(arguments(with("any", {})).realignment);
    const CollideArguments table = arguments(with("any", {"--realignment", "table"}));
    EXPECT_EQ(table.realignment, Realignment::kTable);
    EXPECT_EQ(table.tree.volume, VolumeKind::kDop18);
    EXPECT_TRUE(table.tree.profiles);
    const CollideArguments planes = arguments(with("all", {"--realignment", "planes", "--volume", "dop26"}));
    EXPECT_EQ(planes.realignment, Realignment::kThreePlanes);
    EXPECT_EQ(planes.tree.volume, VolumeKind::kDop26);
    EXPECT_FALSE(planes.tree.profiles);
    EXPECT_WORDS(refusal(with("any", {"--realignment", "boxes"})));
    for (const char* query : {"distance", "toi", "depth"})
        EXPECT_EQ(refusal(with(query, {"--realignment", "table"})),
                  std::string("--realignment is for any and all, not for ") + query);
    for (const char* volume : {"obb", "dop6", "sphere"})
        EXPECT_EQ(refusal(with("any", {"--realignment", "table", "--volume", volume})),
                  std::string("--realignment is for --volume dop14, dop18 and dop26, not for ") + volume);
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"--as-a", "hull"}, {"--as-b", "points"}, {"--as-a", "loop"}, {"--level-b", "3"}}) {
        std::vector<std::string> words = with("all", more);
        words.insert(words.end(), {"--realignment", "planes"});
        EXPECT_EQ(refusal(words), "--realignment is for triangles on both sides, without levels");
    }
    EXPECT_WORDS(refusal({"a", "--query", "self", "--realignment", "planes"}));
}

TEST(CollideCommand, SurfacesMayBeSphericalBezierPatches) {
    const CollideArguments out =
        arguments({"a", "b", "--poses", "p", "--query", "all", "--as-a", "spherical-bezier", "--as-b", "hull"});
    EXPECT_EQ(out.asA, Representation::kSphericalBezier);
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "any", "--as-a", "spherical-bezier", "--level-a", "3"}));
}

TEST(CollideCommand, SubdivisionSurfacesMayBeBezierPatches) {
    const auto with = [](const std::string& query, std::vector<std::string> more) {
        more.insert(more.begin(), {"a", "b", "--poses", "p", "--query", query, "--as-a", "bezier"});
        return more;
    };
    EXPECT_EQ(arguments(with("toi", {"--as-b", "subdivision"})).freeformA, FreeformKind::kBezier);
    EXPECT_EQ(arguments(with("any", {"--as-b", "hull"})).freeformA, FreeformKind::kBezier);
    EXPECT_EQ(refusal(with("depth", {})), "bezier has no depth: subdivision has");
    for (const char* kind : {"spherical", "distance-field", "spherical-bezier"})
        EXPECT_EQ(refusal(with("any", {"--as-b", kind})),
                  "bezier is compared with smooth surfaces, triangles and hulls")
            << kind;
}

TEST(CollideCommand, RaysAreAskedOfOneFile) {
    const CollideArguments out = arguments({"hall.tsct", "--query", "ray", "--poses", "rays", "--json"});
    EXPECT_EQ(out.query, CollideQuery::kRay);
    EXPECT_EQ(out.poses, "rays");
    EXPECT_EQ(out.format, AnswerFormat::kJson);
    EXPECT_WORDS(refusal({"hall.tsct", "--query", "ray"}));
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"b.obj"}, {"--as-a", "hull"}, {"--threads", "2"}, {"--time"}, {"--volume", "obb"}}) {
        std::vector<std::string> words{"hall.tsct", "--query", "ray", "--poses", "rays"};
        words.insert(words.begin() + 1, more.begin(), more.end());
        EXPECT_WORDS(refusal(words));
    }
}

TEST(CollideCommand, SurfacesHaveLevelsOfDetail) {
    const std::vector<std::string> asked{"a", "b", "--poses", "p", "--query", "distance"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), asked.begin(), asked.end());
        return more;
    };
    EXPECT_EQ(arguments(asked).levelA, 0u);
    const CollideArguments out = arguments(with({"--level-a", "12", "--level-b", "1", "--as-b", "heightfield"}));
    EXPECT_EQ(out.levelA, 12u);
    EXPECT_EQ(out.levelB, 1u);
    EXPECT_EQ(arguments(with({"--level-a", "0", "--as-a", "triangles"})).levelA, 0u);
    for (const std::string side : {"a", "b"}) {
        for (const char* level : {"-1", "13", "1000000000000", "2.5", "fine", "nan", ""})
            EXPECT_WORDS(refusal(with({"--level-" + side, level}))) << level;
        for (const char* kind : {"hull", "points"})
            EXPECT_EQ(refusal(with({"--level-" + side, "4", "--as-" + side, kind})),
                      "--level-" + side + " is for triangles and height fields");
    }
    EXPECT_WORDS(refusal({"a", "--query", "self", "--level-a", "3"}));
}

TEST(CollideCommand, DistanceFieldsHaveAnError) {
    const std::vector<std::string> asked{"a", "b", "--poses", "p", "--query", "distance"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), asked.begin(), asked.end());
        return more;
    };
    const CollideArguments usual = arguments(with({"--as-a", "distance-field", "--as-b", "spherical"}));
    EXPECT_EQ(usual.asA, Representation::kDistanceField);
    EXPECT_EQ(usual.asB, Representation::kSpherical);
    EXPECT_EQ(usual.error, 0.01);
    EXPECT_EQ(arguments(with({"--as-b", "distance-field", "--error", "20"})).error, 0.2);
    for (const char* error : {"0", "-1", "0.09", "20.1", "nan", "much", ""})
        EXPECT_WORDS(refusal(with({"--as-a", "distance-field", "--error", error})));
    EXPECT_EQ(refusal(with({"--error", "1"})), "--error is for --as-a distance-field and --as-b distance-field");
    EXPECT_EQ(refusal(with({"--as-a", "spherical", "--error", "1"})),
              "--error is for --as-a distance-field and --as-b distance-field");
    for (const char* kind : {"spherical", "distance-field"})
        EXPECT_EQ(refusal(with({"--level-a", "4", "--as-a", kind})), "--level-a is for triangles and height fields");
}

TEST(CollideCommand, KnowsEveryQuery) {
    const std::vector<std::pair<std::string, CollideQuery>> queries{{"any", CollideQuery::kAny},
                                                                    {"all", CollideQuery::kAll},
                                                                    {"distance", CollideQuery::kDistance},
                                                                    {"toi", CollideQuery::kImpact},
                                                                    {"depth", CollideQuery::kDepth}};
    for (const auto& [word, query] : queries)
        EXPECT_EQ(arguments({"a", "b", "--poses", "p", "--query", word}).query, query);
}

TEST(CollideCommand, RefusesWhatMakesNoSense) {
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p"}));
    EXPECT_NE(refusal({"a", "--poses", "p", "--query", "any"}), "accepted");
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "some"}));
    EXPECT_WORDS(refusal({"a", "b", "--query", "any"}));
    const std::vector<std::string> toi{"a", "b", "--poses", "p", "--query", "toi", "--tolerance"};
    for (const char* tolerance : {"0", "-1", "nan", "inf", "much"}) {
        std::vector<std::string> words = toi;
        words.push_back(tolerance);
        EXPECT_NE(refusal(words), "accepted") << tolerance;
    }
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "distance", "--threads", "2"}));
}

TEST(CollideCommand, SelfIsAboutOneModel) {
    const CollideArguments out = arguments({"a.obj", "--query", "self", "--as-a", "triangles"});
    EXPECT_EQ(out.query, CollideQuery::kSelf);
    EXPECT_WORDS(refusal({"a", "b", "--query", "self"}));
    EXPECT_WORDS(refusal({"a", "--poses", "p", "--query", "self"}));
    EXPECT_EQ(arguments({"a", "b", "--poses", "p", "--query", "depth", "--as-b", "hull"}).asB, Representation::kHull);
    EXPECT_WORDS(refusal({"a", "b", "--poses", "p", "--query", "depth", "--as-b", "cloud"}));
}

TEST(CollideCommand, HelpFitsATerminal) {
    const auto parsed = parseCollideArguments({"--help"});
    ASSERT_TRUE(parsed && std::holds_alternative<CollideHelp>(*parsed));
    std::istringstream lines(std::get<CollideHelp>(*parsed).text);
    std::string line;
    int count = 0;
    for (; std::getline(lines, line); ++count) EXPECT_LE(line.size(), 80u) << line;
    EXPECT_GT(count, 10);
}

TEST(CollideCommand, WantsPosesForPosesAndMotionsForToi) {
    PoseLine pose, motion;
    pose.line = 1;
    motion.line = 2;
    motion.end = Pose{};
    EXPECT_TRUE(checkPosesFor(CollideQuery::kAny, {pose}, "p"));
    EXPECT_TRUE(checkPosesFor(CollideQuery::kImpact, {motion}, "p"));
    const auto any = checkPosesFor(CollideQuery::kAny, {pose, motion}, "p");
    ASSERT_FALSE(any);
    EXPECT_EQ(any.error().message, "p:2: 14 numbers, a motion, is for toi; a pose has 7");
    const auto toi = checkPosesFor(CollideQuery::kImpact, {pose}, "p");
    ASSERT_FALSE(toi);
    EXPECT_EQ(toi.error().message, "p:1: 7 numbers; toi needs the end of the motion too, 14");
}

TEST(CollideAnswers, AreWhatTheirSheetSays) {
    EXPECT_EQ(answerLine(Touch::kYes, AnswerFormat::kJson), R"({"hit":true})");
    EXPECT_EQ(answerLine(Touch::kNo, AnswerFormat::kJson), R"({"hit":false})");
    EXPECT_EQ(answerLine(PairTouch{}, AnswerFormat::kJson), R"({"hit":false,"pairs":0,"first":[]})");
    EXPECT_EQ(answerLine(PairTouch{.touch = Touch::kYes, .count = 2, .faces = {{0, 7}, {3, 1}}}, AnswerFormat::kJson),
              R"({"hit":true,"pairs":2,"first":[[0,7],[3,1]]})");
    Distance distance;
    distance.distance = 0.5;
    distance.faces = {1, 2};
    distance.onA = {0, 0, 0};
    distance.onB = {0.5, 0, 0};
    EXPECT_EQ(answerLine(distance, AnswerFormat::kJson),
              R"({"distance":0.5,"faces":[1,2],"points":[[0,0,0],[0.5,0,0]]})");
    distance.faces = {kWhole, kWhole};
    EXPECT_EQ(answerLine(distance, AnswerFormat::kJson),
              R"({"distance":0.5,"faces":null,"points":[[0,0,0],[0.5,0,0]]})");
    EXPECT_EQ(answerLine(PairDepth{.depth = 0.25, .normal = Vec3d(0, 0, 1)}, 0, AnswerFormat::kJson),
              R"({"depth":0.25,"normal":[0,0,1],"error":0})");
    EXPECT_EQ(answerLine(PairDepth{}, 0, AnswerFormat::kJson), R"({"depth":null,"normal":[0,0,0],"error":0})");
    Impact impact;
    EXPECT_EQ(answerLine(impact, AnswerFormat::kJson), R"({"hit":false})");
    impact = {.hit = true, .t = 0.25, .distance = 1e-5, .faces = {4, 5}, .point = {1, 2, 3}, .normal = {0, 0, 1}};
    EXPECT_EQ(
        answerLine(impact, AnswerFormat::kJson),
        R"({"hit":true,"t":0.25,"distance":1.0000000000000001e-05,"faces":[4,5],"point":[1,2,3],"normal":[0,0,1]})");
}

TEST(CollideAnswers, OfCoversSayTheirError) {
    EXPECT_EQ(answerLine(Touch::kYes, AnswerFormat::kJson, 0.25), R"({"hit":true,"error":0.25})");
    EXPECT_EQ(answerLine(Touch::kUnknown, AnswerFormat::kJson, 0.25), R"({"hit":true,"error":0.25,"complete":false})");
    EXPECT_EQ(answerLine(PairTouch{}, AnswerFormat::kJson, 0.5), R"({"hit":false,"pairs":0,"first":[],"error":0.5})");
    EXPECT_NE(answerLine(Distance{}, AnswerFormat::kJson, 0.5).find(R"(,"error":0.5})"), std::string::npos);
    EXPECT_EQ(answerLine(Impact{}, AnswerFormat::kJson, 0.5), R"({"hit":false,"error":0.5})");
    EXPECT_EQ(answerLine(Impact{.t = 0.25, .complete = false}, AnswerFormat::kJson),
              R"({"hit":false,"t":0.25,"complete":false})")
        << "who gave up has met nothing";
    EXPECT_NE(answerLine(Impact{.hit = true}, AnswerFormat::kJson, 0.5).find(R"(,"error":0.5})"), std::string::npos);
    EXPECT_EQ(answerLine(PairDepth{}, std::nullopt, AnswerFormat::kJson),
              R"({"depth":null,"normal":[0,0,0],"error":null})");
    EXPECT_EQ(answerLine(Touch::kNo, AnswerFormat::kText, 0.25), "do not touch; error 0.25");
}

TEST(CollideAnswers, NameTheFirstSixteenPairs) {
    PairTouch many{.touch = Touch::kYes, .count = 40};
    for (std::uint32_t f = 0; f < 40; ++f) many.faces.push_back({f, f});
    const std::string line = answerLine(many, AnswerFormat::kJson);
    EXPECT_NE(line.find(R"("pairs":40)"), std::string::npos);
    EXPECT_NE(line.find("[15,15]]"), std::string::npos);
    EXPECT_EQ(line.find("[16,16]"), std::string::npos);
    EXPECT_EQ(std::count(line.begin(), line.end(), '['), 17);
}

TEST(CollideAnswers, ThatAreNotCompleteSaySo) {
    EXPECT_EQ(answerLine(Touch::kUnknown, AnswerFormat::kJson), R"({"hit":true,"complete":false})");
    EXPECT_EQ(answerLine(PairTouch{.touch = Touch::kUnknown, .complete = false}, AnswerFormat::kJson),
              R"({"hit":true,"pairs":0,"first":[],"complete":false})");
    EXPECT_WORDS(answerLine(Touch::kUnknown, AnswerFormat::kText));
}

TEST(CollideAnswers, TimesAreMeanMedianAndTail) {
    QueryTimes times{
        .buildUs = 10, .queryUs = {}, .faces = {5, 6}, .bytes = {700, 800}, .threads = 2, .instructionSet = "avx2"};
    for (int i = 100; i > 0; --i) times.queryUs.push_back(i);
    EXPECT_EQ(timeLine(times, AnswerFormat::kJson),
              R"({"build_us":10,"mean_us":50.5,"median_us":51,"p99_us":100,"threads":2,"instruction_set":"avx2",)"
              R"("faces":[5,6],"bytes":[700,800]})");
    EXPECT_NE(timeLine({.instructionSet = "avx2"}, AnswerFormat::kJson).find(R"("mean_us":0,)"), std::string::npos);
}

}  // namespace
}  // namespace tessera
