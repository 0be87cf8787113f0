/// What makes tessera-ctl easy to talk to: options in any place, names for copies, words for what was done.
#include <gtest/gtest.h>

#include <cstdlib>

#include "client/ctl/MaterialVerbs.h"
#include "client/ctl/Verbs.h"
#include "common/cores/Camera.h"
#include "tests/support/words/Words.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using test::ScriptedServer;

#define EXPECT_SPOKEN(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

CtlOutcome speak(const ScriptedServer& server, std::vector<std::string> words) {
    words.insert(words.end(), {"--timeout", "5", "--server", server.address()});
    return runCtl(words);
}
nlohmann::json speakJson(const ScriptedServer& server, std::vector<std::string> words) {
    words.emplace_back("--json");
    const CtlOutcome outcome = speak(server, std::move(words));
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
}

TEST(Manners, OptionsStandInAnyPlace) {
    const ScriptedServer server;
    const std::string there = "hall  #2\n  crane  Transform at 1 2 3  #3  (1 below)\n";
    EXPECT_EQ(speak(server, {"--depth", "1", "tree", "/hall"}).out, there);
    EXPECT_EQ(speak(server, {"tree", "--depth", "1", "/hall"}).out, there);
    EXPECT_EQ(runCtl({"--timeout", "4", "--depth", "1", "--server", server.address(), "tree", "/hall"}).out, there);
    const auto named = speakJson(server, {"--name", "tower", "clone", "/hall/crane"});
    EXPECT_EQ(named["path"], "/hall/tower");
}

TEST(Manners, CopiesGetNamesOfTheirOwn) {
    const ScriptedServer server;
    EXPECT_EQ(speakJson(server, {"clone", "/hall/crane"})["path"], "/hall/crane 2");
    EXPECT_EQ(speakJson(server, {"clone", "/hall/crane"})["path"], "/hall/crane 3");
    EXPECT_EQ(speakJson(server, {"clone", "/hall/crane 2"})["path"], "/hall/crane 4");
    EXPECT_EQ(speakJson(server, {"clone", "/hall/crane", "--under", "/"})["path"], "/crane 2");
    EXPECT_EQ(speakJson(server, {"clone", "/hall"})["path"], "/hall 2") << "at the top, too";
}

TEST(Manners, UndoAndRedoSayWhat) {
    ScriptedServer server;
    server.script([](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        if (std::holds_alternative<request::GetSteps>(asked))
            return answer::Steps{.sequence = 3_seq,
                                 .undo = {.what = "sets Transform.translation of /hall/boom"},
                                 .redo = {.what = "sets Transform.translation of /hall/crane"}};
        return fail(ErrorCode::kFailed, "unexpected");
    });
    ASSERT_EQ(speak(server, {"move", "/hall/crane", "1", "0", "0"}).exitCode, 0);
    EXPECT_WORDS(speak(server, {"undo"}).out);
}

/// It does not ask a server that is gone whether the load goes on.
TEST(Manners, ALoadEndsWithItsServer) {
    ScriptedServer server;
    server.misbehave({.endWhenLoading = true});
    const auto begun = std::chrono::steady_clock::now();
    const CtlOutcome ended = runCtl({"load", "/tmp/some.glb", "--timeout", "30", "--server", server.address()});
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(10));
    EXPECT_NE(ended.exitCode, 0);
    EXPECT_SPOKEN(ended.err, "whether what was asked for was done is not known");
}

TEST(Manners, SearchThatFindsNothingSaysSo) {
    const ScriptedServer server;
    const CtlOutcome type = speak(server, {"find", "//transform"});
    EXPECT_EQ(type.exitCode, 0);
    EXPECT_EQ(type.out, "");
    EXPECT_WORDS(type.err);
    EXPECT_WORDS(speak(server, {"find", "lorry"}).err);
    EXPECT_EQ(speak(server, {"find", "crane"}).err, "");
}

TEST(Manners, OneTypeIsToldWithASentenceForEachField) {
    const CtlOutcome one = runCtl({"types", "Material"});
    EXPECT_SPOKEN(one.out, "Material (5): What a surface looks like.");
    EXPECT_SPOKEN(one.out, "roughness            float, 0 to 1  [0.6]\n      How blurred reflections are");
    EXPECT_EQ(one.out.find("Transform"), std::string::npos);
    const CtlOutcome wrong = runCtl({"types", "Materiel"});
    EXPECT_EQ(wrong.exitCode, 3);
    EXPECT_WORDS(wrong.err);
    EXPECT_EQ(nlohmann::json::parse(runCtl({"types", "Camera", "--json"}).out)["name"], "Camera");
}

TEST(Manners, MaterialsAreToldWithLooksAndUsers) {
    const ScriptedServer server;
    const CtlOutcome told = speak(server, {"materials"});
    ASSERT_EQ(told.exitCode, 0) << told.err;
    EXPECT_WORDS(told.out);
    const auto json = speakJson(server, {"materials"});
    ASSERT_EQ(json["materials"].size(), 1u);
    EXPECT_EQ(json["materials"][0]["material"], 7);
    EXPECT_EQ(json["materials"][0]["nodes"][0], "/hall/crane/hook");
}

TEST(Manners, LooksAreInWordsOfPeople) {
    Material material;
    const auto look = [&](Vec4f color) {
        material.baseColor = color;
        return lookOf(material);
    };
    EXPECT_EQ(look({1, 1, 1, 1}), "white");
    EXPECT_EQ(look({0, 0, 0, 1}), "black");
    EXPECT_EQ(look({1, 0, 0, 1}), "red");
    EXPECT_EQ(look({0, 0.05f, 0, 1}), "dark green");
    EXPECT_EQ(look({0, 0, 1, 0.5f}), "blue, see-through");
    material.metallic = 1;
    material.roughness = 0.1f;
    EXPECT_EQ(look({0.9f, 0.5f, 0.05f, 1}), "orange, mirroring metal");
    material.roughness = 0.6f;
    EXPECT_EQ(look({0.1f, 0, 0, 1}), "dark red, metal");
    material.roughness = 0.9f;
    EXPECT_EQ(look({0.1f, 0, 0, 0.5f}), "dark red, rough metal, see-through");
    material.emissive = Vec3f::Ones();
    material.unlit = true;
    EXPECT_EQ(look({1, 1, 1, 1}), "white, unlit, glows");
}

TEST(Manners, ViewIsReadOut) {
    ScriptedServer server;
    server.script([](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        if (!std::holds_alternative<request::GetWall>(asked)) return fail(ErrorCode::kFailed, "unexpected");
        answer::WallPlan plan{.name = "1x1"};
        plan.users = {{.name = "viewer", .position = Vec3d(0, 1.7, 2)},
                      {.name = "guest", .position = Vec3d(1, 1.5, 3)}};
        answer::TilePlan left{.name = "left", .user = "viewer", .eye = Eye::kLeft};
        left.seenFrom = Vec3d(0.27, 1.8, 2.1);
        answer::TilePlan right = left;
        right.eye = Eye::kRight;
        right.seenFrom = Vec3d(0.33, 1.8, 2.1);
        plan.tiles = {left, right};
        plan.position = Vec3d(3, 1e-17, 5.000000000000003);
        plan.orientation = Quatd::Identity();
        plan.worldUnitsPerMetre = 2;
        return plan;
    });
    const CtlOutcome told = speak(server, {"view"});
    ASSERT_EQ(told.exitCode, 0) << told.err;
    EXPECT_EQ(told.out,
              "position  3 0 5\nlook-at   3 0 3\nscale     2 world units per metre\n"
              "head      viewer at 0.3 1.8 2.1 m of the wall\nhead      guest at 1 1.5 3 m of the wall\n");
    const auto json = speakJson(server, {"view"});
    EXPECT_EQ(json["position"][2].get<double>(), 5.000000000000003) << "programs get all digits";
    EXPECT_EQ(json["heads"][1]["user"], "guest");
}

TEST(Manners, NumbersAreShort) {
    EXPECT_EQ(readable(0.1), "0.1");
    EXPECT_EQ(readable(-6.00000000000003), "-6");
    EXPECT_EQ(readable(1.5184047683738544), "1.5184");
    EXPECT_EQ(readable(1234567.8912), "1234568");
    EXPECT_EQ(textOf(Vec3d(1, 0, 5.10894e-16)), "(1, 0, 0)");
    EXPECT_EQ(textOf(Vec3d(1e-12, 0, 0)), "(1e-12, 0, 0)") << "small is not nothing";
}

}  // namespace
}  // namespace tessera
