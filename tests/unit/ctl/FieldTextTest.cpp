#include "client/ctl/FieldText.h"

#include <gtest/gtest.h>

#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "common/cores/Motion.h"
#include "common/cores/Switch.h"
#include "tests/support/words/Words.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

class FieldText : public testing::Test {
protected:
    FieldText() { EXPECT_TRUE(scene.apply(test::craneScene())); }
    const FieldEntry& field(ObjectType type, std::string_view name) { return *findField(*findType(type), name); }
    std::string why(const FieldInfo& info, const std::vector<std::string>& words) {
        const auto value = parseValue(find, info, words);
        return value ? "accepted" : value.error().message;
    }
    ObjectInfo crane() { return describe(scene, {.names = {"/hall/crane"}})->objects.at(0); }
    Aspect scene;
    const FindObject find = [this](const std::string& name) -> Expected<ObjectId> {
        const ObjectInfo info = describe(scene, {.names = {name}})->objects.at(0);
        if (!info.id) return fail(ErrorCode::kNotFound, info.path);
        return info.id;
    };
};

TEST_F(FieldText, FieldsOfANodeAndOfItsCoreAreFound) {
    const auto name = findFieldOf(crane(), "name");
    ASSERT_TRUE(name);
    EXPECT_EQ(name->object, test::kCrane);
    const auto translation = findFieldOf(crane(), "translation");
    ASSERT_TRUE(translation);
    EXPECT_EQ(translation->object, test::kCraneCore);
    const auto unknown = findFieldOf(crane(), "transaltion");
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(unknown.error().message);
}

TEST_F(FieldText, NumbersHaveToBeFinite) {
    const FieldEntry& color = field(typeOf<PointLight>(), "color");
    EXPECT_EQ(why(color, {"+1", "-.5", "1e-3"}), "accepted");
    for (const char* word : {"inf", "-inf", "nan"}) EXPECT_WORDS(why(color, {"0", "0", word}));
    EXPECT_WORDS(why(color, {"0", "0", "1e999"}));
    for (const char* word : {"", "+", "-", "+-1", "1x", "0x10", "1,5"}) EXPECT_WORDS(why(color, {"0", "0", word}));
}

/// Every field that can be written reads back as the text it was written from.
TEST_F(FieldText, WhatIsReadIsWrittenTheSame) {
    std::size_t fields = 0;
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& info : type.fields) {
            if (info.kind == FieldKind::kBlob) continue;
            std::vector<std::string> words(info.width, "0.5");
            if (info.kind == FieldKind::kInt) words = {"-2"};
            if (info.kind == FieldKind::kBool) words = {"false"};
            if (info.kind == FieldKind::kRef) words = {"#3"};
            if (info.kind == FieldKind::kRefs) words = {"#3", "#7"};
            if (info.kind == FieldKind::kText) words = {"a name"};
            const auto value = parseValue(find, info, words);
            ASSERT_TRUE(value) << type.name << "." << info.name << ": " << value.error().message;
            EXPECT_EQ(kindOf(*value), info.kind);
            EXPECT_EQ(widthOf(*value), info.width);
            std::string joined;
            for (const std::string& word : words) joined += (joined.empty() ? "" : " ") + word;
            EXPECT_EQ(textOf(*value), joined);
            ++fields;
        }
    EXPECT_GT(fields, 20u);
}

TEST_F(FieldText, RefsAreWrittenAsPathsIdsOrNone) {
    const FieldInfo& object = field(typeOf<Interest>(), "object");
    EXPECT_EQ(std::get<ObjectId>(*parseValue(find, object, {"/hall/crane"})), test::kCrane);
    EXPECT_EQ(std::get<ObjectId>(*parseValue(find, object, {"#7"})), test::kMetal);
    EXPECT_EQ(std::get<ObjectId>(*parseValue(find, object, {"none"})), ObjectId{});
    EXPECT_WORDS(why(object, {"#99"}));
    EXPECT_NE(why(object, {"/hall/crna"}), "accepted");
}

TEST_F(FieldText, WrongValuesAreExplained) {
    const FieldInfo& translation = field(typeOf<Transform>(), "translation");
    EXPECT_WORDS(why(translation, {"1", "2"}));
    EXPECT_WORDS(why(translation, {"1", "2", "far"}));
    EXPECT_WORDS(why(translation, {"1", "2", "nan"}));
    EXPECT_WORDS(why(translation, {"1", "2", "1e999"}));
    EXPECT_WORDS(why(field(typeOf<Switch>(), "choice"), {"1.5"}));
    EXPECT_WORDS(why(field(typeOf<Geometry>(), "indices"), {"0"}));
}

TEST_F(FieldText, PartsOfArraysOfNumbersAreSaidFromAnElementOn) {
    EXPECT_FALSE(*parseArrayPart("points"));
    const auto part = *parseArrayPart("points@17");
    ASSERT_TRUE(part);
    EXPECT_EQ(part->field, "points");
    EXPECT_EQ(part->first, 17u);
    for (const char* bad :
         {"points@", "points@x", "points@-1", "points@1.5", "points@99999999999999999999", "points@1@2"})
        EXPECT_FALSE(parseArrayPart(bad)) << bad;
    const FieldInfo& points = field(typeOf<SubdivisionSurface>(), "points");
    const Expected<Blob> said = parseElements(points, {"1", "-2", ".5", "0", "0", "4"});
    ASSERT_TRUE(said) << said.error().message;
    const auto numbers = said->as<float>();
    EXPECT_EQ(std::vector<float>(numbers.begin(), numbers.end()), (std::vector<float>{1, -2, 0.5f, 0, 0, 4}));
    const Expected<Blob> doubles = parseElements(field(typeOf<NurbsSurfaceCore>(), "points"), {"1e300", "-2", ".1"});
    ASSERT_TRUE(doubles) << doubles.error().message;
    EXPECT_EQ(std::vector<double>(doubles->as<double>().begin(), doubles->as<double>().end()),
              (std::vector<double>{1e300, -2, .1}));
    const auto whyNot = [&](const FieldInfo& of, const std::vector<std::string>& words) {
        const Expected<Blob> read = parseElements(of, words);
        return read ? std::string("accepted") : read.error().message;
    };
    EXPECT_WORDS(whyNot(points, {"1", "2"}));
    EXPECT_WORDS(whyNot(points, {}));
    EXPECT_WORDS(whyNot(points, {"1", "2", "up"}));
    EXPECT_WORDS(whyNot(points, {"1", "2", "1e39"}));
    EXPECT_WORDS(whyNot(field(typeOf<SubdivisionSurface>(), "creases"), {"1"}));
    EXPECT_WORDS(whyNot(field(typeOf<Transform>(), "translation"), {"1", "2", "3"}));
}

/// So a list is made longer, and a first clip plane comes where there is none.
TEST_F(FieldText, ArraysOfNumbersAreSetWholeAtAnyLength) {
    const FieldEntry& planes = field(typeOf<Volume>(), "clipPlanes");
    const auto parsed = [&](const std::vector<std::string>& words) {
        return std::get<Blob>(*parseValue(find, planes, words));
    };
    for (const std::size_t count : {std::size_t(1), std::size_t(2), std::size_t(5)}) {
        std::vector<std::string> words;
        std::vector<double> numbers;
        for (std::size_t i = 0; i < 4 * count; ++i)
            words.push_back(std::to_string(numbers.emplace_back(static_cast<double>(i) / 4)));
        const Blob blob = parsed(words);
        EXPECT_EQ(std::vector<double>(blob.as<double>().begin(), blob.as<double>().end()), numbers);
        EXPECT_EQ(wordOf(planes, blob), std::to_string(count) + (count == 1 ? " element" : " elements"));
    }
    EXPECT_TRUE(parsed({"none"}).empty());
    EXPECT_EQ(wordOf(planes, Blob()), "none");
    EXPECT_WORDS(why(planes, {"1", "0", "0"}));
    EXPECT_WORDS(why(planes, {"none", "1", "0", "0"}));
}

/// Every word of every field, against the constants that the cores have for them.
TEST_F(FieldText, NumbersThatStandForSomethingMayBeWords) {
    const auto number = [&](ObjectType type, std::string_view name, const std::string& word) {
        const auto value = parseValue(find, field(type, name), {word});
        EXPECT_TRUE(value) << word << ": " << value.error().message;
        return value ? std::get<std::int64_t>(*value) : -99;
    };
    EXPECT_EQ(number(typeOf<Interest>(), "response", "slide"), Interest::kSlide);
    EXPECT_EQ(number(typeOf<Interest>(), "response", "ask"), Interest::kAsk);
    EXPECT_EQ(number(typeOf<Interest>(), "response", "0"), Interest::kReport) << "numbers stay numbers";
    EXPECT_EQ(number(typeOf<Interest>(), "mode", "static"), Interest::kStatic);
    EXPECT_EQ(number(typeOf<Interest>(), "mode", "distance"), Interest::kDistance);
    EXPECT_EQ(number(typeOf<Interest>(), "detail", "yes-or-no"), Interest::kYesOrNo);
    EXPECT_EQ(number(typeOf<Interest>(), "detail", "16"), 16);
    EXPECT_EQ(number(typeOf<Interest>(), "show", "normals,faces"), Interest::kShowNormals | Interest::kShowFaces);
    EXPECT_EQ(number(typeOf<CollisionObject>(), "kind", "static"), CollisionObject::kStatic);
    EXPECT_EQ(number(typeOf<CollisionObject>(), "shape", "hull"), CollisionObject::kHull);
    EXPECT_EQ(number(typeOf<CollisionObject>(), "division", "each-child"), CollisionObject::kEachChild);
    EXPECT_EQ(number(typeOf<Motion>(), "mode", "ping-pong"), Motion::kPingPong);
    EXPECT_EQ(number(typeOf<Switch>(), "choice", "-2"), Switch::kNone);
    EXPECT_EQ(number(typeOf<Switch>(), "choice", "all"), Switch::kAll);
    const FieldInfo& response = field(typeOf<Interest>(), "response");
    const auto unknown = parseValue(find, response, {"slde"});
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::kUsage);
    EXPECT_EQ(unknown.error().message, "response: \"slde\" is none of report, stop, slide, bounce, rollback, ask");
    EXPECT_FALSE(parseValue(find, response, {"1", "2"}));
    EXPECT_FALSE(parseValue(find, response, {""}));
    EXPECT_WORDS(why(field(typeOf<Switch>(), "choice"), {"al"}));
    EXPECT_EQ(std::get<bool>(*parseValue(find, field(typeOf<Motion>(), "playing"), {"false"})), false);
    EXPECT_EQ(std::get<bool>(*parseValue(find, field(typeOf<Motion>(), "playing"), {"1"})), true);
    EXPECT_WORDS(why(field(typeOf<Motion>(), "playing"), {"yes"}));
}

}  // namespace
}  // namespace tessera
