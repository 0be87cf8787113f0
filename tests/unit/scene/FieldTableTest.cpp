#include "common/scene/FieldTable.h"

#include <gtest/gtest.h>

#include <set>

#include "common/scene/Text.h"

namespace tessera {
namespace {

/// A value that differs from any default, of a field's kind and width.
FieldValue someValue(const FieldInfo& field) {
    switch (field.kind) {
        case FieldKind::kFloat:
            return Floats{
                {0.25f, field.width > 1 ? 0.5f : 0, field.width > 2 ? 0.75f : 0, field.width > 3 ? 0.125f : 0},
                field.width};
        case FieldKind::kDouble:
            return Doubles{{0.25, field.width > 1 ? 0.5 : 0, field.width > 2 ? 0.75 : 0, field.width > 3 ? 0.125 : 0},
                           field.width};
        case FieldKind::kInt:
            return std::int64_t{77};
        case FieldKind::kRef:
            return ObjectId(77);
        case FieldKind::kText:
            return std::string("text");
        case FieldKind::kBlob:
            return Blob::absent(Hash128{1, 2}, 3);
    }
    return {};
}

TEST(FieldTable, EveryFieldLoadsWhatWasStoredAndTouchesNoOther) {
    std::size_t fields = 0;
    for (const TypeInfo& type : allTypes()) {
        const Object fresh = type.make();
        EXPECT_EQ(typeOf(fresh), type.type);
        for (const FieldInfo& field : type.fields) {
            ++fields;
            Object object = type.make();
            EXPECT_EQ(kindOf(field.load(object)), field.kind);
            EXPECT_EQ(widthOf(field.load(object)), field.width);
            field.store(object, someValue(field));
            EXPECT_EQ(field.load(object), someValue(field)) << type.name << "." << field.name;
            for (const FieldInfo& other : type.fields)
                if (other.id != field.id) {
                    EXPECT_EQ(other.load(object), other.load(fresh)) << type.name << "." << other.name;
                }
        }
    }
    EXPECT_EQ(fields, 58u) << "a field was added to the table: its id and name are part of the schema now";
}

TEST(FieldTable, NumbersAndNamesAreUnique) {
    std::set<std::string_view> typeNames;
    std::set<ObjectType> types;
    for (const TypeInfo& type : allTypes()) {
        EXPECT_TRUE(typeNames.insert(type.name).second);
        EXPECT_TRUE(types.insert(type.type).second);
        std::set<std::string_view> names;
        std::set<FieldId> ids;
        for (const FieldInfo& field : type.fields) {
            EXPECT_TRUE(names.insert(field.name).second);
            EXPECT_TRUE(ids.insert(field.id).second);
            EXPECT_EQ(findField(type, field.id), &field);
            EXPECT_EQ(findField(type, field.name), &field);
        }
        EXPECT_EQ(findType(type.type), &type);
        EXPECT_EQ(findType(type.name), &type);
    }
    EXPECT_EQ(findType(ObjectType(0)), nullptr);
    EXPECT_EQ(findType("Teapot"), nullptr);
    EXPECT_EQ(findField(*findType("Transform"), FieldId(99)), nullptr);
    EXPECT_EQ(findField(*findType("Transform"), "colour"), nullptr);
}

TEST(FieldTable, SaysQuaternionsAsWxyz) {
    const FieldInfo& rotation = *findField(*findType("Transform"), "rotation");
    Object object = Transform{};
    rotation.store(object, Doubles{{0.1, 0.2, 0.3, 0.4}, 4});
    EXPECT_EQ(std::get<Transform>(object).rotation.w(), 0.1);
    EXPECT_EQ(fieldAt<double>(rotation, object)[3], 0.1) << "w lies last";
}

TEST(Text, KnowsUtf8) {
    for (const char* good :
         {"", "hall", "Größe", "\xE2\x82\xAC", "\xF0\x9F\x8F\x97", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"})
        EXPECT_TRUE(isUtf8(good)) << good;
    for (const char* bad : {"\x80", "\xC0\x80", "\xC3", "\xE2\x82", "\xED\xA0\x80", "\xF4\x90\x80\x80",
                            "\xF5\x80\x80\x80", "\xE0\x80\x80", "a\xFF"})
        EXPECT_FALSE(isUtf8(bad)) << bad;
}

TEST(Text, RepairsAndCutsAtACharactersEnd) {
    EXPECT_EQ(toUtf8("a\xFF"
                     "b",
                     100),
              "a\xEF\xBF\xBD"
              "b");
    EXPECT_EQ(toUtf8("Gr\xC3\xB6\xC3\x9F"
                     "e",
                     5),
              "Gr\xC3\xB6");
    EXPECT_TRUE(isUtf8(toUtf8("\xE2\x82", 100)));
}

}  // namespace
}  // namespace tessera
