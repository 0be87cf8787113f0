#include "client/ctl/Verbs.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "common/image/Picture.h"
#include "tests/support/words/Words.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using test::ScriptedServer;

CtlOutcome ctl(const ScriptedServer& server, std::vector<std::string> words) {
    words.insert(words.begin(), {"--server", server.address(), "--timeout", "5"});
    return runCtl(words);
}
nlohmann::json askJson(const ScriptedServer& server, std::vector<std::string> words) {
    words.insert(words.begin(), "--json");
    const CtlOutcome outcome = ctl(server, std::move(words));
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
}

TEST(Ctl, TreeIsTheSceneForPeopleAndPrograms) {
    const ScriptedServer server;
    EXPECT_EQ(ctl(server, {"tree"}).out,
              "/  #1\n  hall  #2\n    crane  Transform at 1 2 3  #3\n      hook  Geometry  #5\n");
    EXPECT_EQ(ctl(server, {"tree", "/hall", "--depth", "1"}).out,
              "hall  #2\n  crane  Transform at 1 2 3  #3  (1 below)\n");
    const auto json = askJson(server, {"tree", "/hall/crane"});
    EXPECT_EQ(json["path"], "/hall/crane");
    EXPECT_EQ(json["core"]["type"], "Transform");
    EXPECT_EQ(json["core"]["translation"], nlohmann::json::array({1, 2, 3}));
    EXPECT_EQ(json["children"][0]["core"]["material"], 7);
    const CtlOutcome missing = ctl(server, {"tree", "/hall/crna"});
    EXPECT_EQ(missing.exitCode, 3);
    EXPECT_WORDS(missing.err);
}

TEST(Ctl, MovesAndTakesBack) {
    const ScriptedServer server;
    const auto moved = askJson(server, {"move", "/hall/crane/hook", "0.1", "0", "0", "--by"});
    EXPECT_EQ(moved["path"], "/hall/crane") << "the nearest Transform above";
    EXPECT_EQ(moved["translation"][0].get<double>(), 1.1) << "numbers come whole";
    EXPECT_TRUE(moved["stopped"].empty());
    EXPECT_EQ(ctl(server, {"undo"}).exitCode, 0);
    EXPECT_NE(ctl(server, {"tree"}).out.find("at 1 2 3"), std::string::npos);
    EXPECT_EQ(ctl(server, {"move", "/hall", "1", "2", "3"}).exitCode, 1) << "no Transform there";
}

/// In words of what has been done, not of what an undo would do now.
TEST(Ctl, SaysWhatARedoDid) {
    ScriptedServer server;
    bool isThere = false;
    server.script([&](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        if (std::holds_alternative<request::GetSteps>(asked)) {
            answer::Steps steps;
            (isThere ? steps.undo : steps.redo).what = isThere ? "removes /box" : "brings 1 node: box";
            return steps;
        }
        if (!std::holds_alternative<request::RedoStep>(asked)) return fail(ErrorCode::kFailed, "unexpected");
        isThere = true;
        return answer::Committed{};
    });
    const std::string said = ctl(server, {"redo"}).out;
    EXPECT_TRUE(said.starts_with("did again: brings 1 node: box")) << said;
}

TEST(Ctl, SetsAnyFieldByItsName) {
    const ScriptedServer server;
    EXPECT_EQ(ctl(server, {"set", "/hall/crane", "translation", "4", "5", "-6"}).exitCode, 0);
    EXPECT_EQ(ctl(server, {"set", "/hall/crane", "name", "hoist"}).exitCode, 0);
    EXPECT_NE(ctl(server, {"tree"}).out.find("hoist  Transform at 4 5 -6"), std::string::npos);
    EXPECT_EQ(ctl(server, {"set", "/hall/hoist", "translation", "0.30000000000000004", "5", "-6"}).exitCode, 0);
    EXPECT_NE(ctl(server, {"tree"}).out.find("Transform at 0.3 5 -6"), std::string::npos) << "numbers for people";
    EXPECT_EQ(ctl(server, {"set", "/hall/hoist", "colour", "1"}).exitCode, 3);
    EXPECT_EQ(ctl(server, {"set", "#7", "baseColor", "1", "0", "0", "1"}).exitCode, 0) << "a material has no path";
    EXPECT_EQ(ctl(server, {"set", "#7", "translation", "1", "0", "0"}).exitCode, 3);
    EXPECT_EQ(ctl(server, {"set", "#4711", "name", "nobody"}).exitCode, 3);
    EXPECT_EQ(ctl(server, {"set", "/hall/hoist", "scale", "1"}).exitCode, 2);
    EXPECT_NE(ctl(server, {"set", "/hall/hoist", "rotation", "0", "0", "0", "0"}).exitCode, 0)
        << "the scene's own rules hold";
}

TEST(Ctl, GetsWhatIsSet) {
    const ScriptedServer server;
    EXPECT_EQ(ctl(server, {"get", "/hall/crane", "translation"}).out, "1 2 3\n");
    EXPECT_EQ(ctl(server, {"set", "#7", "alphaMode", "blend"}).exitCode, 0);
    EXPECT_EQ(ctl(server, {"get", "#7", "alphaMode"}).out, "blend\n") << "by its word";
    const auto json = askJson(server, {"get", "/hall/crane"});
    EXPECT_EQ(json["object"]["type"], "Node");
    EXPECT_EQ(json["object"]["name"], "crane");
    EXPECT_EQ(json["core"]["translation"], nlohmann::json::array({1, 2, 3}));
    const std::string text = ctl(server, {"get", "/hall/crane"}).out;
    EXPECT_TRUE(text.starts_with("Node #3\n  name ")) << text;
    EXPECT_NE(text.find("\nTransform #"), std::string::npos) << text;
    EXPECT_EQ(ctl(server, {"get", "/hall/crane", "colour"}).exitCode, 3);
    EXPECT_EQ(ctl(server, {"get", "#4711"}).exitCode, 3);
}

TEST(Ctl, FindsPageByPage) {
    const ScriptedServer server;
    EXPECT_EQ(ctl(server, {"find", "/hall/**"}).out, "/hall/crane  Transform\n/hall/crane/hook  Geometry\n");
    EXPECT_EQ(ctl(server, {"find", "h*", "--limit", "1"}).out, "/hall\n");
    EXPECT_EQ(ctl(server, {"find", "*", "--type", "Geometry"}).out, "/hall/crane/hook  Geometry\n");
    EXPECT_EQ(askJson(server, {"find", "/*", "--under", "/hall"})["nodes"][0]["path"], "/hall/crane");
    EXPECT_EQ(askJson(server, {"find", "nobody"})["nodes"].size(), 0u);
    EXPECT_EQ(ctl(server, {"find", "/a["}).exitCode, 2);
    EXPECT_EQ(ctl(server, {"find", "*", "--type", "Sphere"}).exitCode, 2);
    EXPECT_EQ(ctl(server, {"find", "*", "--under", "/nowhere"}).exitCode, 3);
}

TEST(Ctl, ClonesAndTakesBack) {
    const ScriptedServer server;
    const auto shallow = askJson(server, {"clone", "/hall/crane"});
    EXPECT_EQ(shallow["path"], "/hall/crane 2");
    EXPECT_EQ(shallow["objects"], 2);
    EXPECT_EQ(ctl(server, {"undo"}).exitCode, 0);
    const auto deep = askJson(server, {"clone", "/hall/crane", "--deep", "--name", "twin", "--under", "/"});
    EXPECT_EQ(deep["path"], "/twin");
    const auto shared =
        askJson(server, {"clone", "/hall/crane", "--deep", "--share", "Material", "--share", "/hall/crane"});
    EXPECT_EQ(shared["objects"].get<int>(), deep["objects"].get<int>() - 2) << "a material, and the crane's Transform";
    EXPECT_EQ(ctl(server, {"clone", "/hall", "--under", "/hall/crane"}).exitCode, 1);
    EXPECT_EQ(ctl(server, {"clone", "/hall", "--share", "Material"}).exitCode, 2);
    EXPECT_EQ(ctl(server, {"clone", "/hall", "--deep", "--share", "Sphere"}).exitCode, 3);
}

TEST(Ctl, RemovesAndBringsBack) {
    const ScriptedServer server;
    const auto removed = askJson(server, {"remove", "/hall/crane"});
    EXPECT_EQ(removed["objects"], 5);
    EXPECT_EQ(ctl(server, {"tree"}).out, "/  #1\n  hall  #2\n");
    EXPECT_EQ(ctl(server, {"undo"}).exitCode, 0);
    EXPECT_NE(ctl(server, {"tree"}).out.find("hook  Geometry"), std::string::npos);
    EXPECT_EQ(ctl(server, {"remove", "/"}).exitCode, 1);
}

TEST(Ctl, SpeaksOfHostsPicksContactsAndLoads) {
    ScriptedServer server;
    server.script([](const ApplicationRequest& asked) -> Expected<ApplicationAnswer> {
        if (std::holds_alternative<request::GetStatus>(asked)) {
            answer::Status status;
            status.wallName = "1x1";
            status.frame = 118_frame;
            status.hosts = {{"only", "live", 117_frame, 0.125}};
            status.waitingFor = {"only"};
            return status;
        }
        if (const auto* pick = std::get_if<request::PickAt>(&asked))
            return answer::Picked{pick->aim.xPx == 10,  test::kHook,   4,
                                  Vec3d(0.1, 0.2, 0.3), pick->aim.xPx, pick->aim.yPx};
        if (const auto* measure = std::get_if<request::MeasureDistance>(&asked)) {
            if (measure->to)
                return answer::Measured{
                    .from = measure->from, .to = *measure->to, .distance = (*measure->to - measure->from).norm()};
            return answer::Measured{.from = measure->from,
                                    .to = Vec3d(0.5, 1, 0),
                                    .distance = 0.5,
                                    .node = test::kHook,
                                    .face = 7,
                                    .normal = Vec3d::UnitX()};
        }
        if (std::holds_alternative<request::GetContacts>(asked)) {
            answer::Contacts contacts{9_frame, 3, {}};
            contacts.contacts.push_back({test::kHook, ObjectId{999}, 1, 2, Vec3d(1, 2, 3), Vec3d::UnitX()});
            return contacts;
        }
        if (const auto* load = std::get_if<request::LoadFile>(&asked)) {
            if (!load->path.starts_with('/')) return fail(ErrorCode::kFailed, load->path);
            if (load->path.ends_with("bad.ply")) return fail(ErrorCode::kBadInput, load->path + ": no faces");
            return answer::Loaded{load->parent ? load->parent : ObjectId{50}, 3, 12, {"which way is up was guessed"}};
        }
        if (const auto* load = std::get_if<request::LoadAsset>(&asked))
            return answer::Loaded{load->parent, 3, 12, {load->name}};
        if (const auto* view = std::get_if<request::SetView>(&asked)) {
            if (view->wish.head && view->wish.head->z() < 0)
                return fail(ErrorCode::kBadInput, "the head is behind the screen");
            return answer::Done{};
        }
        return fail(ErrorCode::kFailed, "unexpected");
    });
    const auto status = askJson(server, {"status"});
    EXPECT_EQ(status["frame"], 118);
    EXPECT_EQ(status["hosts"][0]["state"], "live");
    EXPECT_WORDS(ctl(server, {"status"}).out);

    const auto hit = askJson(server, {"pick", "10", "20"});
    EXPECT_EQ(hit["path"], "/hall/crane/hook");
    EXPECT_EQ(hit["point"][0].get<double>(), 0.1);
    EXPECT_EQ(askJson(server, {"pick", "11", "20"})["hit"], false);

    EXPECT_EQ(askJson(server, {"measure", "0,0,0", "-.5,0,0"})["distance"], 0.5);
    EXPECT_EQ(ctl(server, {"measure", "-1,0,0", "+1,0,0"}).out, "2 from (-1, 0, 0) to (1, 0, 0)\n");
    const auto measured = askJson(server, {"measure", "0,1,0", "/hall/crane"});
    EXPECT_EQ(measured["path"], "/hall/crane/hook");
    EXPECT_EQ(measured["face"], 7);
    EXPECT_EQ(askJson(server, {"measure", "/hall/crane", "0,1,0"}), measured) << "as well the other way round";
    EXPECT_EQ(ctl(server, {"measure", "/hall", "/hall/crane"}).exitCode, 2);
    EXPECT_EQ(ctl(server, {"measure", "0,1", "/hall/crane"}).exitCode, 2);
    EXPECT_EQ(ctl(server, {"measure", "0,1,x", "/hall/crane"}).exitCode, 2);
    EXPECT_EQ(ctl(server, {"measure", "0,1,2", "/hall/crna"}).exitCode, 3);

    const auto contacts = askJson(server, {"contacts"});
    EXPECT_EQ(contacts["contacts"][0]["objects"], nlohmann::json::array({"/hall/crane/hook", "#999"}));
    EXPECT_EQ(contacts["begun"], 3);

    EXPECT_EQ(askJson(server, {"load", "some.glb"})["triangles"], 12) << "a relative path was made whole";
    EXPECT_EQ(askJson(server, {"load", "some.glb", "--under", "/hall"})["path"], "/hall");
    EXPECT_WORDS(ctl(server, {"load", "some.glb"}).out);
    EXPECT_EQ(askJson(server, {"load", "asset://some.glb", "--under", "/hall"})["node"], 2);
    EXPECT_WORDS(ctl(server, {"load", "asset://some.glb"}).out);  // by its name alone
    EXPECT_EQ(ctl(server, {"load", ""}).exitCode, 2) << "no path, and no exception";
    const CtlOutcome bad = ctl(server, {"load", "/tmp/bad.ply"});
    EXPECT_EQ(bad.exitCode, 3);
    EXPECT_EQ(bad.err, "tessera-ctl: /tmp/bad.ply: no faces\n");

    EXPECT_EQ(ctl(server, {"view", "--reset"}).exitCode, 0);
    EXPECT_EQ(ctl(server, {"view", "--head", "viewer", "0", "1.5", "-2"}).exitCode, 3);
}

TEST(Ctl, SnapshotWritesThePictureAndTriesAgainWhenFramesDiffer) {
    std::string folder = testing::TempDir() + "ctl-XXXXXX";
    ASSERT_NE(::mkdtemp(folder.data()), nullptr);
    ScriptedServer server;
    int asked = 0;
    const Wall wall = test::oneByOne();
    const Tile tile = layoutTiles(wall)[0];
    server.script([&](const ApplicationRequest& request) -> Expected<ApplicationAnswer> {
        if (!std::holds_alternative<request::GetImages>(request)) return fail(ErrorCode::kFailed, "unexpected");
        const Picture picture = Picture::filled(96, 54, 10, 20, 30);
        answer::Images images;
        images.tiles.push_back({tile.name, "only", 30_frame, share(encodePng(picture, 30))});
        if (++asked < 3) images.tiles.push_back({"another", "late", 29_frame, share(encodePng(picture, 29))});
        return images;
    });
    const std::string file = folder + "/new/wall.png";
    const CtlOutcome outcome = ctl(server, {"snapshot", file});
    EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
    EXPECT_EQ(asked, 3);
    const auto bytes = readFile(file, 1 << 20);
    ASSERT_TRUE(bytes);
    const auto png = decodePng(*bytes);
    ASSERT_TRUE(png);
    EXPECT_EQ(png->picture, Picture::filled(96, 54, 10, 20, 30));
    EXPECT_EQ(png->frame, 30u);
    std::filesystem::remove_all(folder);
}

TEST(Ctl, ExitCodesSayWhatKindOfThingWentWrong) {
    EXPECT_EQ(runCtl({"--server", "nonsense", "status"}).exitCode, 2);
    EXPECT_EQ(runCtl({"move"}).exitCode, 2);
    EXPECT_EQ(runCtl({"--help"}).exitCode, 0);
    const CtlOutcome nobody = runCtl({"--server", "127.0.0.1:1", "--timeout", "2", "status"});
    EXPECT_EQ(nobody.exitCode, 4);
    EXPECT_NE(nobody.err.find("127.0.0.1:1"), std::string::npos);
    ScriptedServer server;
    server.misbehave({.mute = true});
    EXPECT_EQ(runCtl({"--server", server.address(), "--timeout", "0.3", "status"}).exitCode, 4);
    server.misbehave({});
    const CtlOutcome nothing = ctl(server, {"undo"});
    EXPECT_EQ(nothing.exitCode, 1);
    EXPECT_EQ(nothing.err, "tessera-ctl: there is nothing to undo\n");
}

TEST(Answer, NoNameCommandsATerminal) {
    EXPECT_EQ(withoutControls("\x1b[31mEVIL\a\x1b]0;t\a\r\n\tok \x7f"), "?[31mEVIL??]0;t??\n\tok ?");
    EXPECT_EQ(withoutControls("a\xc2\x9bm b\xc2\xa0"
                              "c \xc3\xa4\xe2\x80\xa6 \xc2"),
              "a?m b\xc2\xa0"
              "c \xc3\xa4\xe2\x80\xa6 \xc2");
    // Turned, "gpj.exe" reads as "exe.jpg". Marks of languages written from right to left stay.
    EXPECT_EQ(withoutControls("\u202egpj\u202c \u2066a\u2069 \u200f\u05d0\u200d"),
              "\\u202egpj\\u202c \\u2066a\\u2069 \u200f\u05d0\u200d");
    const CtlOutcome wrong = runCtl({"--server", "\x1b[31mnonsense", "status"});
    EXPECT_EQ(wrong.err.find('\x1b'), std::string::npos) << wrong.err;
}

}  // namespace
}  // namespace tessera
