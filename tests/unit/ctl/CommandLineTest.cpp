#include "client/ctl/CommandLine.h"
#include "client/ctl/VerbWords.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <sstream>

#include "common/base/Hash.h"
#include "common/cores/Interest.h"
#include "common/scene/FieldTable.h"
#include "common/session/Messages.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

std::vector<std::string> split(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

/// The command after "--server a:1".
template <typename V>
V parsed(const std::string& text) {
    const auto result = parseCommandLine(split("--server a:1 " + text));
    EXPECT_TRUE(result) << text << ": " << result.error().message;
    if (!result) return {};
    const auto* line = std::get_if<CommandLine>(&*result);
    EXPECT_TRUE(line && std::holds_alternative<V>(line->verb)) << text;
    return line && std::holds_alternative<V>(line->verb) ? std::get<V>(line->verb) : V{};
}
std::string refusal(const std::string& text) {
    const auto result = parseCommandLine(split(text));
    if (result) return "accepted";
    EXPECT_EQ(result.error().code, ErrorCode::kUsage);
    return result.error().message;
}

TEST(CommandLine, OptionsStandBeforeTheVerb) {
    const auto result = parseCommandLine(split("--server wallhost:7000 --json --timeout 2.5 status"));
    ASSERT_TRUE(result);
    const auto& line = std::get<CommandLine>(*result);
    EXPECT_EQ(line.server, "wallhost:7000");
    EXPECT_TRUE(line.json);
    EXPECT_EQ(line.timeout, std::chrono::milliseconds(2500));
    EXPECT_TRUE(std::holds_alternative<verb::Status>(line.verb));
}

TEST(CommandLine, WatchesTheWall) {
    EXPECT_EQ(parsed<verb::Top>("top").everySeconds, 1);
    EXPECT_EQ(parsed<verb::Top>("top --every .5").everySeconds, 0.5);
    EXPECT_EQ(parsed<verb::Watch>("watch").seconds, 0);
    EXPECT_EQ(parsed<verb::Watch>("watch --seconds 3").seconds, 3);
    const auto trace = parsed<verb::Trace>("--timeout 2 trace out.json --frames 20");
    EXPECT_EQ(trace.file, "out.json");
    EXPECT_EQ(trace.frames, 20);
    EXPECT_EQ(trace.patience, std::chrono::seconds(2));
    EXPECT_EQ(parsed<verb::Load>("load a.obj").patience, std::chrono::minutes(10));
    EXPECT_EQ(parsed<verb::Load>("--timeout 900 load a.obj").patience, std::chrono::minutes(15));
    EXPECT_EQ(parsed<verb::Trace>("trace out.json").frames, 300);
    EXPECT_WORDS(refusal("trace"));
    EXPECT_WORDS(refusal("trace a --frames 0"));
    EXPECT_WORDS(refusal("top --every 0"));
}

TEST(CommandLine, CancelTakesALoadsNumber) {
    EXPECT_EQ(parsed<verb::Cancel>("cancel 7").load, 7u);
    EXPECT_FALSE(parsed<verb::Cancel>("cancel").load);
    for (const char* text : {"cancel 0", "cancel -- -1", "cancel 18446744073709551615", "cancel abc"})
        EXPECT_WORDS(refusal(std::string("--server a:1 ") + text));
}

TEST(CommandLine, NamesTheOptionThatWasMeant) {
    EXPECT_WORDS(refusal("move /a 1 2 3 --bi"));
    EXPECT_WORDS(refusal("view --positon 1 2 3"));
    EXPECT_WORDS(refusal("status --sever=a:1"));
    EXPECT_EQ(refusal("status --nothing-like-it").find("did you mean"), std::string::npos);
}

TEST(CommandLine, TheViewMovesFromWhereItIs) {
    const auto by = parsed<verb::View>("view --by --position 0 0 -1 --scale 2");
    EXPECT_TRUE(by.by);
    EXPECT_EQ(*by.view.position, Vec3d(0, 0, -1));
    EXPECT_EQ(*by.view.worldUnitsPerMetre, 2);
    EXPECT_FALSE(parsed<verb::View>("view --position 0 0 -1").by);
    for (const char* words :
         {"view --by --reset", "view --by --head viewer 0 0 1", "view --by --position 1 0 0 --look-at 0 0 0"})
        EXPECT_WORDS(refusal(words));
    EXPECT_WORDS(refusal("view --by"));
}

TEST(CommandLine, OptionsStandBehindTheVerbAsWell) {
    const auto result = parseCommandLine(split("move /hall/crane 1 -2 0 --by --server wallhost:7000 --json"));
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(std::get<CommandLine>(*result).server, "wallhost:7000");
    EXPECT_TRUE(std::get<CommandLine>(*result).json);
}

TEST(CommandLine, LeadsOnWhereNoVerbIsSaid) {
    EXPECT_EQ(refusal("stauts"), "there is no verb 'stauts' (did you mean 'status'?); see tessera-ctl --help");
    EXPECT_EQ(refusal("--server a:1 stauts").substr(0, 26), "there is no verb 'stauts' ");
    const std::string first = refusal("--server a:1");
    EXPECT_TRUE(first.starts_with("say what to do. First of all:\n  tessera-ctl status ")) << first;
    EXPECT_WORDS(first);
}

TEST(CommandLine, EveryVerbIsUnderstood) {
    EXPECT_EQ(parsed<verb::Tree>("tree").node, "/");
    EXPECT_EQ(parsed<verb::Tree>("tree /hall --depth 2").depth, 2);
    EXPECT_EQ(parsed<verb::Load>("load a.glb --under /hall").under, "/hall");
    EXPECT_FALSE(parsed<verb::Load>("load a.glb").placing.said());
    const Placing placing = parsed<verb::Load>("load a.stl --at 1 -2 3e1 --fit 2.5 --up z").placing;
    EXPECT_EQ(placing.at, Vec3d(1, -2, 30));
    EXPECT_EQ(placing.fit, 2.5);
    EXPECT_EQ(placing.up, UpAxis::kZ);
    EXPECT_FALSE(placing.scale);
    EXPECT_FALSE(placing.pointRadius);
    EXPECT_EQ(parsed<verb::Load>("load a.ply --point-radius 0.02").placing.pointRadius, 0.02);
    EXPECT_EQ(parsed<verb::Load>("load a.usd --variant /A:b=c --variant /D/E:f=g").placing.variants,
              (std::vector<std::string>{"/A:b=c", "/D/E:f=g"}));
    EXPECT_WORDS(refusal("--server a:1 load a.usd --variant b=c"));
    EXPECT_WORDS(refusal("--server a:1 load a.ply --point-radius -1"));
    EXPECT_EQ(parsed<verb::Load>("load a.stl --scale 0.01").placing.scale, 0.01);
    for (const char* bad : {"--scale 0", "--scale -1", "--scale nan", "--fit 0", "--fit 1e99", "--scale 2 --fit 2",
                            "--at 1e300 0 0", "--at 1 2", "--up x"})
        EXPECT_FALSE(refusal(std::string("--server a:1 load a.stl ") + bad).empty()) << bad;
    EXPECT_EQ(parsed<verb::Set>("set /lamp color 1 0.5 -1e-3").values.size(), 3u);
    EXPECT_EQ(parsed<verb::Set>("set #17 choice -1").values.at(0), "-1");
    EXPECT_EQ(parsed<verb::Remove>("remove /hall").node, "/hall");
    (void)parsed<verb::Animations>("animations");
    (void)parsed<verb::Inlines>("inlines");
    EXPECT_EQ(parsed<verb::Play>("play /fox/walk").playing, true);
    EXPECT_EQ(parsed<verb::Play>("pause /fox/walk").playing, false);
    EXPECT_EQ(parsed<verb::Play>("seek /fox/walk 1.5").time, 1.5);
    EXPECT_EQ(parsed<verb::Play>("speed #9 -0.5").speed, -0.5);
    EXPECT_FALSE(refusal("--server a:1 seek /fox/walk nan").empty());
    EXPECT_EQ(parsed<verb::Clone>("clone /hall --deep --share Material --share #17").share.size(), 2u);
    EXPECT_EQ(parsed<verb::Find>("find /hall/**[visible] --page-size 9").pageSize, 9u);
    (void)parsed<verb::Undo>("undo");
    (void)parsed<verb::Redo>("redo");
    EXPECT_EQ(parsed<verb::Pick>("pick 10 20.5").yPx, 20.5);
    (void)parsed<verb::Contacts>("contacts");
    EXPECT_EQ(parsed<verb::Snapshot>("snapshot wall.png").file, "wall.png");
    EXPECT_EQ(parsed<verb::Save>("save hall.tsct").file, "hall.tsct");
    EXPECT_FALSE(parsed<verb::Save>("save hall.tsct").foreign);
    const auto saved = parsed<verb::Save>("save hall.glb --under /crane --still --tolerance 0.01");
    EXPECT_TRUE(saved.foreign);
    EXPECT_EQ(saved.leaves.under, "/crane");
    EXPECT_TRUE(saved.leaves.still);
    EXPECT_EQ(saved.leaves.tolerance, 0.01);
    EXPECT_WORDS(refusal("--server a:1 save hall.glb --under="));
    EXPECT_WORDS(refusal("--server a:1 save hall.glb --tolerance="));
    EXPECT_WORDS(refusal("--server a:1 save hall.step"));
    EXPECT_WORDS(refusal("--server a:1 save hall.tsc --under /crane"));
}

TEST(CommandLine, MovesAreReadInAllTheirForms) {
    const verb::Move to = parsed<verb::Move>("move /hall/crane 1 -2 3.5");
    EXPECT_EQ(to.node, "/hall/crane");
    EXPECT_EQ(*to.move.translation, Vec3d(1, -2, 3.5));
    EXPECT_FALSE(to.move.relative || to.move.rotation || to.move.scale);

    const verb::Move by = parsed<verb::Move>("move #17 0 1.5 0 --by --rotate y -90 --scale 2");
    EXPECT_TRUE(by.move.relative);
    EXPECT_TRUE(by.move.rotation->isApprox(Quatd(Eigen::AngleAxisd(-EIGEN_PI / 2, Vec3d::UnitY()))));
    EXPECT_EQ(*by.move.scale, Vec3d(2, 2, 2));

    const verb::Move turn = parsed<verb::Move>("move /a --quaternion 0 0 3 0");
    EXPECT_FALSE(turn.move.translation);
    EXPECT_TRUE(turn.move.rotation->isApprox(Quatd(0, 0, 1, 0)));
}

TEST(CommandLine, NumbersAreReadAsPeopleWriteThem) {
    EXPECT_EQ(parsed<verb::Move>("move /n -0.17 1.5 -.5").move.translation, Vec3d(-0.17, 1.5, -0.5));
    EXPECT_EQ(parsed<verb::Move>("move /n 1e-3 +1 -.25e1").move.translation, Vec3d(0.001, 1, -2.5));
    EXPECT_EQ(parsed<verb::View>("view --position -.5 .5 -1e-3").view.position, Vec3d(-0.5, 0.5, -0.001));
    EXPECT_EQ(parsed<verb::View>("view --head viewer +.5 -.5 1E1").view.head, Vec3d(0.5, -0.5, 10));
    EXPECT_EQ(parsed<verb::Set>("set /n translation -.5 +1 2").values, (std::vector<std::string>{"-0.5", "+1", "2"}));
    EXPECT_EQ(parsed<verb::Pick>("pick +12 .5").xPx, 12);
    EXPECT_NE(refusal("--server a:1 move /n -.5x 0 0"), "accepted");
    EXPECT_WORDS(refusal("--server a:1 view --head viewer inf 0 0"));
    EXPECT_WORDS(refusal("--server a:1 view --head viewer 1e999 0 0"));
    // The option is named, and what is no decimal number is none.
    EXPECT_WORDS(refusal("--server a:1 view --position 0 nan 0"));
    EXPECT_WORDS(refusal("--server a:1 view --scale 0x10"));
    EXPECT_WORDS(refusal("--server a:1 move /n 1 2 inf"));
    for (const char* none : {"-inf", "-nan", "-Infinity"})
        EXPECT_EQ(refusal(std::string("--server a:1 seek /n ") + none)
                      .find(std::string(none) + " is not finite, and a number has to be"),
                  0u);
    EXPECT_WORDS(refusal("--server a:1 seek /n --"));
    const auto empty = parseCommandLine({"--server", "a:1", "view", "--position", "", "0", "0"});
    ASSERT_FALSE(empty);
    EXPECT_WORDS(empty.error().message);
    // What may be left out is not left out by an empty word.
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"exposure", ""}, {"exposure", "--tone-map", ""}, {"budget", ""}}) {
        const auto refused = parseCommandLine(words);
        ASSERT_FALSE(refused) << words.front();
        EXPECT_WORDS(refused.error().message);
    }
}

TEST(CommandLine, TestPicturesAreAskedForInAllTheirForms) {
    EXPECT_EQ(parsed<verb::Show>("show scene").showing, Showing::kScene);
    EXPECT_EQ(parsed<verb::Show>("show test-picture").showing, Showing::kTestPicture);
    EXPECT_EQ(parsed<verb::Show>("show test-picture --count").showing, Showing::kCountedTestPicture);
    EXPECT_NE(refusal("--server a:1 show"), "accepted");
    EXPECT_WORDS(refusal("--server a:1 show scene --count"));
}

TEST(CommandLine, ViewsAreReadInAllTheirForms) {
    const auto view = parsed<verb::View>("view --position 0 0 10 --look-at 0 0 0 --scale 100").view;
    EXPECT_EQ(*view.position, Vec3d(0, 0, 10));
    EXPECT_TRUE(view.orientation->isApprox(Quatd::Identity()));
    EXPECT_EQ(*view.worldUnitsPerMetre, 100);
    const auto head = parsed<verb::View>("view --head viewer 0.4 1.5 -2").view;
    EXPECT_EQ(head.user, "viewer");
    EXPECT_EQ(*head.head, Vec3d(0.4, 1.5, -2));
    EXPECT_TRUE(parsed<verb::View>("view --reset").view.reset);
    EXPECT_FALSE(parsed<verb::View>("view --reset").view.worldUnitsPerMetre) << "what is not said stays as it is";
}

TEST(CommandLine, ContactsAreAskedForInAllTheirForms) {
    const verb::Contacts plain = parsed<verb::Contacts>("contacts");
    EXPECT_FALSE(plain.events || plain.distances || plain.follow || plain.stays || plain.show);
    EXPECT_EQ(plain.limit, -1);
    const verb::Contacts follow =
        parsed<verb::Contacts>("contacts --events --distances --follow --stays --frames 12 --interest /watch");
    EXPECT_TRUE(follow.events && follow.distances && follow.follow && follow.stays);
    EXPECT_EQ(follow.frames, 12);
    EXPECT_EQ(follow.interest, "/watch");
    EXPECT_EQ(parsed<verb::Contacts>("contacts --limit 0").limit, 0);
    EXPECT_EQ(parsed<verb::Contacts>("contacts --show none").show, 0);
    EXPECT_EQ(parsed<verb::Contacts>("contacts --show faces,points").show,
              Interest::kShowFaces | Interest::kShowPoints);
    EXPECT_WORDS(refusal("--server a:1 contacts --show points,,faces"));
    EXPECT_WORDS(refusal("--server a:1 contacts --show points --follow"));
    EXPECT_WORDS(refusal("--server a:1 contacts --frames 3"));
    EXPECT_WORDS(refusal("--server a:1 contacts --follow --frames 0"));
    EXPECT_NE(refusal("--server a:1 contacts --follow --frames many"), "accepted");
    EXPECT_NE(refusal("--server a:1 contacts --follow --frames -1"), "accepted");
    EXPECT_WORDS(refusal("--server a:1 contacts --limit -3"));
}

TEST(CommandLine, DecisionsAreReadInAllTheirForms) {
    using Decision = QuestionReply::Decision;
    (void)parsed<verb::Questions>("questions");
    EXPECT_EQ(parsed<verb::Respond>("answer 7 stop").question, 7u);
    EXPECT_EQ(parsed<verb::Respond>("answer 7 stop").decision, Decision::kStop);
    EXPECT_EQ(parsed<verb::Respond>("answer 7 pass").decision, Decision::kPass);
    const verb::Respond move = parsed<verb::Respond>("answer 18446744073709551615 move 1 -2.5 3");
    EXPECT_EQ(move.question, ~0ull);
    EXPECT_EQ(move.decision, Decision::kMove);
    EXPECT_EQ(move.place, Vec3d(1, -2.5, 3));
    EXPECT_WORDS(refusal("--server a:1 answer 7 fly"));
    EXPECT_WORDS(refusal("--server a:1 answer 7 move 1 2"));
    EXPECT_WORDS(refusal("--server a:1 answer 7 stop 1 2 3"));
    EXPECT_NE(refusal("--server a:1 answer seven stop"), "accepted");
    EXPECT_NE(refusal("--server a:1 answer 7"), "accepted");
}

TEST(CommandLine, LookingAlongAnyDirectionTurnsMinusZThere) {
    for (const Vec3d& direction :
         {Vec3d(0, 0, -1), Vec3d(0, 0, 1), Vec3d(1, 2, 3), Vec3d(0, 1, 0), Vec3d(0, -5, 0), Vec3d(-1, 0, 0)}) {
        const auto q = lookAlong(direction);
        ASSERT_TRUE(q);
        EXPECT_TRUE((*q * Vec3d(0, 0, -1)).isApprox(direction.normalized(), 1e-12));
        EXPECT_GE((*q * Vec3d::UnitY()).y(), -1e-12) << "up stays up";
        EXPECT_NEAR((*q * Vec3d::UnitX()).y(), 0, 1e-12) << "the horizon stays level";
    }
    EXPECT_FALSE(lookAlong(Vec3d::Zero()));
}

TEST(CommandLine, NonsenseIsRefusedInWords) {
    EXPECT_WORDS(refusal("--server a:1"));
    EXPECT_NE(refusal("--server a:1 flee"), "accepted");
    EXPECT_NE(refusal("--server a:1 status extra"), "accepted");
    EXPECT_NE(refusal("--server a:1 --timeout -1 status"), "accepted");
    EXPECT_NE(refusal("--server a:1 --timeout nan status"), "accepted");
    EXPECT_NE(refusal("play-tracker 127.0.0.1:1 --seconds nan"), "accepted");
    EXPECT_WORDS(refusal("--server a:1 move /a"));
    EXPECT_WORDS(refusal("--server a:1 move /a 1 2"));
    EXPECT_NE(refusal("--server a:1 move /a one 2 3"), "accepted");
    EXPECT_WORDS(refusal("--server a:1 move /a --rotate w 90"));
    EXPECT_WORDS(refusal("--server a:1 move /a --rotate x much"));
    EXPECT_WORDS(refusal("--server a:1 move /a --quaternion 0 0 0 0"));
    EXPECT_WORDS(refusal("--server a:1 view --orientation 1e300 1e300 0 0"));
    EXPECT_WORDS(refusal("--server a:1 move /a --rotate x 1 --quaternion 1 0 0 0"));
    EXPECT_WORDS(refusal("--server a:1 view --look-at 0 0 0"));
    EXPECT_WORDS(refusal("--server a:1 view --scale 0"));
    EXPECT_WORDS(refusal("--server a:1 view --head viewer 1 2 x"));
    EXPECT_NE(refusal("--server a:1 view --position 1 2"), "accepted");
    EXPECT_NE(refusal("--server a:1 pick 1"), "accepted");
    EXPECT_WORDS(refusal("--server a:1 navigate"));
    EXPECT_WORDS(refusal("--server a:1 navigate up"));
    EXPECT_WORDS(refusal("--server a:1 navigate home /a"));
    EXPECT_WORDS(refusal("--server a:1 navigate bookmark ten"));
    EXPECT_NE(refusal("--server a:1 navigate bookmark 0"), "accepted");
    EXPECT_NE(refusal("--server a:1 bookmark 10"), "accepted");
}

TEST(CommandLine, WhatAKeyAsksForAVerbAsksFor) {
    using Deed = NavigationWish::Deed;
    const auto wish = [](const std::string& words) {
        return std::get<verb::Navigate>(std::get<CommandLine>(*parseCommandLine(split("--server a:1 " + words))).verb);
    };
    EXPECT_EQ(wish("navigate walk").wish.mode, NavigationMode::kWalk);
    EXPECT_EQ(wish("navigate home").wish.deed, Deed::kHome);
    EXPECT_EQ(wish("navigate fit").node, "");
    EXPECT_EQ(wish("navigate fit /hall").node, "/hall");
    EXPECT_EQ(wish("navigate fit /hall").wish.deed, Deed::kFit);
    EXPECT_EQ(wish("navigate bookmark 9").wish.bookmark, 9u);
    EXPECT_EQ(wish("bookmark 3").wish.deed, Deed::kGoToBookmark);
    EXPECT_EQ(wish("bookmark 3 --keep").wish.deed, Deed::kKeepBookmark);
    EXPECT_EQ(wish("bookmark 3 --keep").wish.bookmark, 3u);
}

TEST(CommandLine, HelpFitsATerminal) {
    for (const std::string verb :
         {"",        "status ",   "tree ",  "load ",     "move ",     "set ",      "remove ",       "undo ",
          "redo ",   "view ",     "fly ",   "navigate ", "bookmark ", "pick ",     "contacts ",     "questions ",
          "answer ", "snapshot ", "types ", "requests ", "save ",     "trackers ", "play-tracker ", "files "}) {
        const auto result = parseCommandLine(split(verb + "--help"));
        ASSERT_TRUE(result) << verb << result.error().message;
        std::istringstream text(std::get<HelpText>(*result).text);
        for (std::string line; std::getline(text, line);) EXPECT_LT(line.size(), 80u) << verb << ": " << line;
    }
    const auto version = parseCommandLine({"--version"});
    ASSERT_TRUE(version);
    EXPECT_WORDS(std::get<HelpText>(*version).text);
}

/// Nobody is asked for it, and nothing of the table is left out.
TEST(CommandLine, TypesAreListedWithoutAServer) {
    const auto result = parseCommandLine(split("types"));
    ASSERT_TRUE(result) << result.error().message;
    const std::string text = std::get<HelpText>(*result).text;
    for (const TypeInfo& type : allTypes()) {
        EXPECT_NE(text.find(fmt::format("{} ({})\n", type.name, type.type.value)), std::string::npos) << type.name;
        for (const FieldEntry& field : type.fields)
            EXPECT_NE(text.find(fmt::format("  {} ", field.name)), std::string::npos) << type.name << "." << field.name;
    }
    EXPECT_NE(text.find("one of report, stop, slide, bounce, rollback, ask  [stop]"), std::string::npos) << text;
    EXPECT_NE(text.find("float, 0 to 1.5707963705062866; radians"), std::string::npos) << text;

    const auto asJson = parseCommandLine(split("--json types"));
    ASSERT_TRUE(asJson);
    const auto jsonLast = parseCommandLine(split("types --json"));
    ASSERT_TRUE(jsonLast) << jsonLast.error().message;
    EXPECT_EQ(std::get<HelpText>(*jsonLast).text, std::get<HelpText>(*asJson).text);
    const auto json = nlohmann::json::parse(std::get<HelpText>(*asJson).text);
    ASSERT_EQ(json["types"].size(), allTypes().size());
    for (std::size_t i = 0; i < allTypes().size(); ++i) {
        const TypeInfo& type = allTypes()[i];
        const auto& said = json["types"][i];
        EXPECT_EQ(said["name"], type.name);
        EXPECT_EQ(said["number"], type.type.value);
        EXPECT_EQ(said["core"], type.isCore);
        ASSERT_EQ(said["fields"].size(), type.fields.size());
        for (std::size_t f = 0; f < type.fields.size(); ++f) {
            EXPECT_EQ(said["fields"][f]["name"], type.fields[f].name);
            EXPECT_EQ(said["fields"][f]["number"], type.fields[f].id.value);
            EXPECT_TRUE(said["fields"][f].contains("default"));
        }
    }
    EXPECT_EQ(json["types"][12]["fields"][2]["words"]["slide"], Interest::kSlide);
    EXPECT_EQ(std::get<CommandLine>(*parseCommandLine(split("status"))).server, "") << "the one wall of this machine";
}

/// A program in another language can say all of them: it has each number, role, field and bound.
TEST(CommandLine, RequestsAreListedWithoutAServer) {
    const auto textOf = [](const std::string& words) {
        return std::get<HelpText>(*parseCommandLine(split(words))).text;
    };
    const auto json = nlohmann::json::parse(textOf("requests --json"));
    ASSERT_EQ(json["requests"].size(), std::variant_size_v<ApplicationRequest>);
    ASSERT_GE(json["requests"].size(), 15u);
    std::map<std::string, nlohmann::json> byName;
    for (const auto& request : json["requests"]) {
        const std::string role = request["role"];
        EXPECT_TRUE(role == "viewer" || role == "editor" || role == "operator") << request["name"];
        EXPECT_FALSE(request["help"].get<std::string>().empty()) << request["name"];
        EXPECT_TRUE(request["fields"].is_array() && request["stays_open"].is_boolean() &&
                    request["answer"].is_string());
        EXPECT_NE(textOf("requests").find(request["name"].get<std::string>() + " "), std::string::npos);
        EXPECT_NE(textOf("requests --proto").find("message " + request["name"].get<std::string>() + " {"),
                  std::string::npos);
        byName[request["name"]] = request;
    }
    // And what is said around them: each message, each code, the hash that a Hello carries.
    const auto wire = json["wire"];
    ASSERT_EQ(wire["messages"].size(), std::variant_size_v<Message>);
    for (const auto& message : wire["messages"]) {
        const MessageInfo* info = findInfo(message["number"].get<std::uint16_t>());
        ASSERT_TRUE(info) << message["number"];
        EXPECT_EQ(message["name"], info->name);
        EXPECT_EQ(message["most_bytes"], info->maxPayload);
    }
    EXPECT_EQ(wire["messages"][1]["fields"][0],
              nlohmann::json::parse(R"({"name":"protocol","form":"varint","number":1})"));
    EXPECT_EQ(wire["schema"], toHex(schemaHash()));
    EXPECT_EQ(wire["errors"].size(), static_cast<std::size_t>(ErrorCode::kFailed) + 1);
    EXPECT_EQ(wire["errors"][static_cast<std::size_t>(ErrorCode::kRefused)], "refused");
    EXPECT_EQ(wire["limits"]["upload_piece_bytes"], limits::kUploadPieceBytes);
    EXPECT_EQ(byName["ProposeChanges"]["fields"][2]["rest"], true);
    EXPECT_EQ(nlohmann::json::parse(textOf("types --json"))["schema"], toHex(schemaHash()));

    EXPECT_EQ(byName["LoadFile"]["role"], "operator");
    EXPECT_EQ(byName["LoadAsset"]["role"], "editor");
    EXPECT_EQ(byName["GetImages"]["role"], "viewer");
    EXPECT_EQ(byName["SetView"]["changes"], "view");
    EXPECT_EQ(byName["MoveNode"]["changes"], "scene");
    EXPECT_TRUE(byName["ProposeChanges"]["stays_open"]);
    const auto budget = byName["SetBudget"]["fields"][0];
    EXPECT_EQ(budget["name"], "milliseconds");
    EXPECT_EQ(budget["unit"], "ms");
    EXPECT_EQ(budget["least"], 0.1);
    EXPECT_EQ(budget["or"], 0);
    EXPECT_EQ(byName["ShowPicture"]["fields"][0]["words"][1], "test_picture");
    EXPECT_EQ(json["former"], nlohmann::json::array({24}));
}

}  // namespace
}  // namespace tessera
