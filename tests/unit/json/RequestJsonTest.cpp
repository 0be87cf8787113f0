/// Requests as JSON: each that there is, there and back; and all that can be wrong with one.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/codec/ApplicationCodec.h"
#include "common/json/MemberJson.h"
#include "common/json/RequestJson.h"
#include "common/request/Catalogue.h"
#include "common/request/Check.h"
#include "common/request/Requests.h"
#include "common/scene/FieldTable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/json/RandomMembers.h"

namespace tessera {
namespace {

ApiExpected<ReadRequest> read(std::string_view name, std::string_view fields,
                              std::span<const ByteSlice> binaries = {}) {
    ObjectNames names;
    return readRequest(name, *parseJson(fields), binaries, names);
}

template <typename... R>
void thereAndBack(std::type_identity<std::variant<R...>>, std::uint64_t seed) {
    RandomMembers random(seed);
    const auto tryOne = [&]<typename One>(std::type_identity<One>) {
        One request{};
        random.fill(descriptionOf<One>(), &request);
        if (findFault(descriptionOf<One>(), &request)) return;  // a rule of the whole, as "a place or a node"
        Binaries binaries;
        const std::string text = jsonText(memberJson(descriptionOf<One>(), &request, binaries));
        ObjectNames names;
        const ApiExpected<ReadRequest> back = readRequest(One::kInfo.name, *parseJson(text), binaries, names);
        ASSERT_TRUE(back) << One::kInfo.name << ", seed " << seed << ": " << back.error().message << "\n" << text;
        EXPECT_EQ(encodeRequest(back->request), encodeRequest(request)) << One::kInfo.name << ", seed " << seed << "\n"
                                                                        << text;
    };
    (tryOne(std::type_identity<R>{}), ...);
}

TEST(RequestJson, EachRequestThereAndBack) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) thereAndBack(std::type_identity<ApplicationRequest>{}, seed);
}

TEST(RequestJson, NothingSaidIsTheDefault) {
    for (const RequestText& request : allRequests()) {
        ObjectNames names;
        const ApiExpected<ReadRequest> nothing = readRequest(request.info.name, Json(), {}, names);
        const ApiExpected<ReadRequest> empty = read(request.info.name, "{}");
        ASSERT_EQ(nothing.has_value(), empty.has_value()) << request.info.name;
        if (nothing) EXPECT_EQ(encodeRequest(nothing->request), encodeRequest(empty->request)) << request.info.name;
    }
    const ApiExpected<ReadRequest> objects = read("GetObjects", R"({"names":["/a"]})");
    ASSERT_TRUE(objects);
    EXPECT_TRUE(std::get<request::GetObjects>(objects->request).wish.paths);
}

/// Keys of what is written are those that the catalogue names, for each answer and notice.
template <typename... A>
void expectNamedKeys(std::type_identity<std::variant<A...>>, std::span<const ToldText> told) {
    const auto tryOne = [&]<typename One>(std::type_identity<One>) {
        RandomMembers random(7);
        One answer{};
        random.fill(descriptionOf<One>(), &answer);
        Binaries binaries;
        const Json json = memberJson(descriptionOf<One>(), &answer, binaries);
        const auto text = std::ranges::find(told, One::kInfo.name, [](const ToldText& each) { return each.info.name; });
        ASSERT_NE(text, told.end());
        for (const auto& item : json.items())
            EXPECT_TRUE(
                std::ranges::any_of(text->members, [&](const MemberText& member) { return member.name == item.key(); }))
                << One::kInfo.name << "." << item.key();
        for (const MemberText& member : text->members)
            EXPECT_TRUE(json.contains(member.name) || member.optional || member.isRest || !member.when.empty() ||
                        member.type == "bool")
                << One::kInfo.name << "." << member.name;
    };
    (tryOne(std::type_identity<A>{}), ...);
}
TEST(RequestJson, AnswersAndNoticesHaveTheNamesOfTheCatalogue) {
    expectNamedKeys(std::type_identity<ApplicationAnswer>{}, allAnswers());
    expectNamedKeys(std::type_identity<ApplicationNotice>{}, allNotices());
}

struct Wrong {
    std::string_view request, fields, field;
};

TEST(RequestJson, WhatIsWrongIsToldWithItsField) {
    const Wrong all[] = {
        {"MoveNode", R"({"nod":1})", "nod"},
        {"MoveNode", R"({"node":1,"translation":[1,2]})", "translation"},
        {"MoveNode", R"({"node":1,"translation":[1,"2",3]})", "translation[1]"},
        {"MoveNode", R"({"node":1,"translation":["NaN",2,3]})", "translation[0]"},
        {"MoveNode", R"({"node":-1})", "node"},
        {"MoveNode", R"({"node":1.5})", "node"},
        {"MoveNode", R"({"node":"$x"})", "node"},
        {"MoveNode", R"({"node":1,"scale":[0,1,1]})", "scale"},
        {"MoveNode", R"({"node":1,"rotation":[0,0,0,0]})", "rotation"},
        {"MoveNode", R"([])", ""},
        {"SetView", R"({"world_units_per_metre":-3})", "world_units_per_metre"},
        {"NavigateView", R"({"deed":"dance"})", "deed"},
        {"AnswerQuestion", R"({"question":1,"translation":[0,0,0]})", "translation"},
        {"MeasureDistance", R"({"from":[0,0,0]})", ""},
        {"FindNodes", R"({"core_type":"Ligth"})", "core_type"},
        {"GetStatus", R"({"all":true})", "all"},
        {"GetEverything", R"({})", ""},
        {"ProposeChanges",
         R"({"list":{"set":[{"type":"Transform","field":"translatoin","ids":[1],"values":[[1,2,3]]}]}})",
         "list.set[0].field"},
        {"ProposeChanges",
         R"({"list":{"set":[{"type":"Transform","field":"translation","ids":[1,2],"values":[[1,2,3]]}]}})",
         "list.set[0].values"},
        {"ProposeChanges",
         R"({"list":{"set":[{"type":"Geometry","field":"positions","ids":[1],"values":[{"binary":0}]}]}})",
         "list.set[0].values[0].binary"},
        {"ProposeChanges", R"({"list":{"sett":[]}})", "list.sett"},
    };
    for (const Wrong& wrong : all) {
        const ApiExpected<Json> fields = parseJson(wrong.fields);
        ASSERT_TRUE(fields) << wrong.fields;
        ObjectNames names;
        const ApiExpected<ReadRequest> read = readRequest(wrong.request, *fields, {}, names);
        ASSERT_FALSE(read) << wrong.request << wrong.fields;
        EXPECT_EQ(read.error().field, wrong.field) << wrong.request << wrong.fields << ": " << read.error().message;
        EXPECT_WORDS(read.error().message);
    }
    // No JSON at all: a number beyond a double.
    EXPECT_FALSE(
        parseJson(R"({"list":{"set":[{"type":"Transform","field":"translation","ids":[1],"values":[[1,2,1e999]]}]}})"));
}

TEST(RequestJson, SumsThatAreCountedAroundMayBeBelowZero) {
    const ApiExpected<ReadRequest> request =
        read("NavigateView", R"({"input":{"look_right":-3,"wheel":-65536,"pan_down":5}})");
    ASSERT_TRUE(request) << request.error().message;
    const InputState& input = *std::get<request::NavigateView>(request->request).wish.input;
    EXPECT_EQ(input.lookRight, std::uint64_t{0} - 3);
    EXPECT_EQ(input.wheel, std::uint64_t{0} - 65536);
    EXPECT_EQ(input.panDown, 5u);
    EXPECT_EQ(read("NavigateView", R"({"input":{"look_right":-1.5}})").error().code, ErrorCode::kBadInput);
    EXPECT_EQ(read("NavigateView", R"({"input":{"held":-1}})").error().code, ErrorCode::kBadInput) << "that is no sum";
}

TEST(RequestJson, OfPathsTooManyAndTooLongOnesAreRefusedAsSuch) {
    const auto sharing = [](std::size_t count) {
        Json fields{{"node", "/hall"}};
        for (std::size_t i = 0; i < count; ++i) fields["share_objects"].push_back("/hall/" + std::to_string(i));
        return fields;
    };
    ObjectNames few, many, longer;
    EXPECT_TRUE(readRequest("CloneNode", sharing(63), {}, few));
    EXPECT_EQ(few.wanted().size(), 64u);
    EXPECT_EQ(few.wanted().at("/hall/7"), "share_objects[7]");
    const ApiExpected<ReadRequest> read = readRequest("CloneNode", sharing(64), {}, many);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kLimit);
    EXPECT_EQ(read.error().field, "share_objects[63]");
    const ApiExpected<ReadRequest> tooLong =
        readRequest("RemoveNode", Json{{"node", "/" + std::string(5000, 'n')}}, {}, longer);
    ASSERT_FALSE(tooLong);
    EXPECT_EQ(tooLong.error().code, ErrorCode::kLimit);
    EXPECT_EQ(tooLong.error().field, "node");
}

/// Messages quote the words that they refuse, but not all of them.
TEST(RequestJson, RefusalsAreShortHoweverLongWhatIsRefused) {
    const std::string much(1 << 20, 'k');
    ObjectNames names;
    for (const auto& [request, fields] :
         std::initializer_list<std::pair<std::string, Json>>{{"MoveNode", {{much, 1}}},
                                                             {"ProposeChanges", {{"list", {{much, 1}}}}},
                                                             {"NavigateView", {{"deed", much}}},
                                                             {"FindNodes", {{"core_type", much}}},
                                                             {"MoveNode", {{"node", "#" + much}}},
                                                             {much, {}}}) {
        const ApiExpected<ReadRequest> read = readRequest(request, fields, {}, names);
        ASSERT_FALSE(read);
        EXPECT_LT(read.error().message.size() + read.error().field.size(), 2000u) << read.error().message.substr(0, 99);
    }
    const ApiExpected<Json> twice = parseJson("{\"" + much + "\":1,\"" + much + "\":2}");
    ASSERT_FALSE(twice);
    EXPECT_LT(twice.error().message.size() + twice.error().field.size(), 2000u);
}

TEST(RequestJson, PathsAreWantedAndThenKnown) {
    ObjectNames names;
    const Json fields = *parseJson(R"({"node":"/hall/crane"})");
    ASSERT_TRUE(readRequest("RemoveNode", fields, {}, names));
    ASSERT_EQ(names.wanted(), (std::map<std::string, std::string>{{"/hall/crane", "node"}}));
    names.forgetWanted();
    names.know("/hall/crane", ObjectId(17));
    const ApiExpected<ReadRequest> read = readRequest("RemoveNode", fields, {}, names);
    ASSERT_TRUE(read);
    EXPECT_TRUE(names.wanted().empty());
    EXPECT_EQ(std::get<request::RemoveNode>(read->request).node, ObjectId(17));
}

TEST(ParseJson, RefusesWhatIsNoJsonInWords) {
    for (const std::string_view text : {"", "{", "{}{}", "[1,]", "nul", "\"\xff\"", "NaN", "1e999", "{\"a\":1e400}"}) {
        const ApiExpected<Json> json = parseJson(text);
        ASSERT_FALSE(json) << text;
        EXPECT_EQ(json.error().code, ErrorCode::kBadInput) << text;
        EXPECT_TRUE(json.error().message.starts_with("no JSON: ")) << json.error().message;
    }
    for (const char open : {'[', '{'}) {
        const ApiExpected<Json> deep = parseJson(std::string(1 << 20, open));
        ASSERT_FALSE(deep);
        EXPECT_EQ(deep.error().code, ErrorCode::kLimit);
    }
    for (const std::string text : {R"({"node":1,"node":2})", R"([{"a":{"node":1,"b":2,"node":1}}])"}) {
        const ApiExpected<Json> twice = parseJson(text);
        ASSERT_FALSE(twice) << text;
        EXPECT_WORDS(twice.error().message);
    }
    EXPECT_TRUE(parseJson(R"([{"node":1},{"node":2,"in":{"node":3}}])"));
    // Minutes, if an element took longer the more there are.
    std::string many = "[{}";
    for (int i = 0; i < 1'000'000; ++i) many += ",{}";
    EXPECT_EQ(parseJson(many + "]")->size(), 1'000'001u);
    std::string members = "{\"0\":0";
    for (std::size_t i = 1; i < kMaxJsonMembers; ++i) members += fmt::format(",\"{}\":0", i);
    EXPECT_TRUE(parseJson(members + "}"));
    const ApiExpected<Json> tooMany = parseJson(members + ",\"x\":0}");
    ASSERT_FALSE(tooMany);
    EXPECT_EQ(tooMany.error().code, ErrorCode::kLimit);
    EXPECT_TRUE(parseJson(std::string(kMaxJsonDepth, '[') + std::string(kMaxJsonDepth, ']')));
    EXPECT_FALSE(parseJson(std::string(kMaxJsonDepth + 1, '[') + std::string(kMaxJsonDepth + 1, ']')));
    // Brackets in a text are none.
    EXPECT_TRUE(parseJson("\"" + std::string(1000, '[') + "\\\"[\""));
}

}  // namespace
}  // namespace tessera
