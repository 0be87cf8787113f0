#include "client/ctl/FieldText.h"

#include <gtest/gtest.h>

#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

class FieldText : public testing::Test {
protected:
    FieldText() { EXPECT_TRUE(scene.apply(test::craneScene())); }
    const FieldInfo& field(TypeNumber type, std::string_view name) {
        return *findField(*findType(objectType(type)), name);
    }
    std::string why(const FieldInfo& info, const std::vector<std::string>& words) {
        const auto value = parseValue(scene, info, words);
        return value ? "accepted" : value.error().message;
    }
    Aspect scene;
};

TEST_F(FieldText, FieldsOfANodeAndOfItsCoreAreFound) {
    const auto name = findFieldOf(scene, test::kCrane, "name");
    ASSERT_TRUE(name);
    EXPECT_EQ(name->object, test::kCrane);
    const auto translation = findFieldOf(scene, test::kCrane, "translation");
    ASSERT_TRUE(translation);
    EXPECT_EQ(translation->object, test::kCraneCore);
    const auto unknown = findFieldOf(scene, test::kCrane, "transaltion");
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::kNotFound);
    EXPECT_NE(unknown.error().message.find("/hall/crane has no field \"transaltion\"; it has name (Node)"),
              std::string::npos)
        << unknown.error().message;
    EXPECT_NE(unknown.error().message.find("translation (Transform)"), std::string::npos);
}

/// Every field that can be written reads back as the text it was written from.
TEST_F(FieldText, WhatIsReadIsWrittenTheSame) {
    std::size_t fields = 0;
    for (const TypeInfo& type : allTypes())
        for (const FieldInfo& info : type.fields) {
            if (info.kind == FieldKind::kBlob) continue;
            std::vector<std::string> words(info.width, "0.5");
            if (info.kind == FieldKind::kInt) words = {"-2"};
            if (info.kind == FieldKind::kRef) words = {"#3"};
            if (info.kind == FieldKind::kText) words = {"a name"};
            const auto value = parseValue(scene, info, words);
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
    const FieldInfo& object = field(TypeNumber::kInterest, "object");
    EXPECT_EQ(std::get<ObjectId>(*parseValue(scene, object, {"/hall/crane"})), test::kCrane);
    EXPECT_EQ(std::get<ObjectId>(*parseValue(scene, object, {"#7"})), test::kMetal);
    EXPECT_EQ(std::get<ObjectId>(*parseValue(scene, object, {"none"})), ObjectId{});
    EXPECT_NE(why(object, {"#99"}).find("there is no object #99"), std::string::npos);
    EXPECT_NE(why(object, {"/hall/crna"}), "accepted");
}

TEST_F(FieldText, WrongValuesAreExplained) {
    const FieldInfo& translation = field(TypeNumber::kTransform, "translation");
    EXPECT_NE(why(translation, {"1", "2"}).find("takes 3 numbers, not 2"), std::string::npos);
    EXPECT_NE(why(translation, {"1", "2", "far"}).find("\"far\" is not a number"), std::string::npos);
    EXPECT_NE(why(translation, {"1", "2", "nan"}).find("is not a number"), std::string::npos);
    EXPECT_NE(why(translation, {"1", "2", "1e999"}).find("is not a number"), std::string::npos);
    EXPECT_NE(why(field(TypeNumber::kSwitch, "choice"), {"1.5"}).find("whole number"), std::string::npos);
    EXPECT_NE(why(field(TypeNumber::kGeometry, "positions"), {"0"}).find("bulk data"), std::string::npos);
}

}  // namespace
}  // namespace tessera
