#include "common/cores/Geometry.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <new>
#include <set>

#include "common/base/Utf8.h"
#include "common/scene/Text.h"

namespace tessera {
namespace {

/// An object of any type, to write to.
class Scratch {
public:
    explicit Scratch(const TypeInfo& type) : type_(type), memory_(::operator new (type.size, std::align_val_t{64})) {
        type_.construct(memory_);
    }
    ~Scratch() {
        type_.destroy(memory_);
        ::operator delete (memory_, std::align_val_t{64});
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    [[nodiscard]] Object object() const { return {type_, memory_}; }
    void store(const FieldEntry& field, const FieldValue& value) { field.store(memory_, value); }

private:
    const TypeInfo& type_;
    void* memory_;
};

/// A value of a field's kind and width that differs from its default.
FieldValue someValue(const FieldEntry& field, const Object& fresh) {
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
        case FieldKind::kBool:
            return !std::get<bool>(field.load(fresh));
        case FieldKind::kRefs:
            return RefList{ObjectId(7), ObjectId(5)};
        case FieldKind::kMatrix:
            return Matrix{{1, 2, 3}};
    }
    return {};
}

TEST(FieldTable, EveryFieldLoadsWhatWasStoredAndTouchesNoOther) {
    std::size_t fields = 0;
    for (const TypeInfo& type : allTypes()) {
        const Object fresh = type.freshObject();
        EXPECT_EQ(typeOf(fresh), type.type);
        for (const FieldEntry& field : type.fields) {
            ++fields;
            Scratch scratch(type);
            const Object object = scratch.object();
            EXPECT_EQ(kindOf(field.load(object)), field.kind);
            EXPECT_EQ(widthOf(field.load(object)), field.width);
            EXPECT_EQ(field.load(object), field.load(fresh));
            const std::uint64_t hash = type.hash(object.data(), 1);
            EXPECT_EQ(hash, type.hash(fresh.data(), 1));
            EXPECT_NE(hash, type.hash(fresh.data(), 2));
            scratch.store(field, someValue(field, fresh));
            EXPECT_EQ(field.load(object), someValue(field, fresh)) << type.name << "." << field.name;
            EXPECT_NE(hash, type.hash(object.data(), 1)) << type.name << "." << field.name << " does not count";
            for (const FieldEntry& other : type.fields)
                if (other.id != field.id) {
                    EXPECT_EQ(other.load(object), other.load(fresh)) << type.name << "." << other.name;
                }
        }
    }
    EXPECT_EQ(fields, 353u) << "a field was added to the table: its id and name are part of the schema now";
}

TEST(FieldTable, DefaultsAreValidAndWordsAreUnique) {
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields) {
            const Expected<void> good = checkValue(field, field.load(type.freshObject()));
            EXPECT_TRUE(good) << type.name << "." << good.error().message;
            std::set<std::string_view> words;
            for (const FieldWord& word : field.words()) {
                EXPECT_TRUE(words.insert(word.word).second) << word.word;
                EXPECT_EQ(numberOfWord(field, word.word), word.number);
                EXPECT_EQ(wordOfNumber(field, word.number), std::string(word.word));
            }
        }
    const FieldEntry& show = *findField(*findType("Interest"), "show");
    for (std::int64_t bits = 0; bits < 8; ++bits) EXPECT_EQ(numberOfWord(show, *wordOfNumber(show, bits)), bits);
    EXPECT_EQ(wordOfNumber(show, 5), "points,faces");
    EXPECT_FALSE(numberOfWord(show, "points,"));
    EXPECT_FALSE(numberOfWord(show, "everything"));
    EXPECT_FALSE(wordOfNumber(show, 8));
}

/// A number that means something in a part of all numbers says which; what is without bounds here is good whatever it
/// is.
TEST(FieldTable, NumbersHaveTheirBounds) {
    const std::set<std::string> anyNumber = {"Transform.translation",
                                             "Transform.rotation",
                                             "Transform.scale",
                                             "ComponentTransform.translation",
                                             "ComponentTransform.center",
                                             "ComponentTransform.rotation",
                                             "ComponentTransform.scaleOrientation",
                                             "ComponentTransform.scale",
                                             "Motion.time",
                                             "Uniform.value"};
    std::set<std::string> without;
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields) {
            const bool number = field.kind == FieldKind::kFloat || field.kind == FieldKind::kDouble;
            if (number && !std::isfinite(field.least)) without.insert(fmt::format("{}.{}", type.name, field.name));
            // Scenes that hold another one are shown, whoever saved them.
            const bool ofLooks = type.type == typeOf<Material>() && number;
            EXPECT_EQ(field.nearestFromFiles, ofLooks) << type.name << "." << field.name;
            EXPECT_TRUE(!ofLooks || (std::isfinite(field.least) && std::isfinite(field.greatest))) << field.name;
        }
    EXPECT_EQ(without, anyNumber);
}

TEST(FieldTable, FilesAreTakenWithTheNearestGoodNumber) {
    const TypeInfo& material = *findType(typeOf<Material>());
    const auto taken = [&](const char* name, FieldValue value) {
        const std::string said = takeNearest(*findField(material, name), value);
        return std::pair(said, value);
    };
    EXPECT_EQ(taken("roughness", toValue(9.0f)),
              std::pair(std::string("roughness 9 is not between 0 and 1: 1 is taken"), toValue(1.0f)));
    EXPECT_EQ(taken("baseColor", toValue(Vec4f(-1, 0.5f, 3, 1))),
              std::pair(std::string("baseColor -1 is not between 0 and 1: 0 is taken"), toValue(Vec4f(0, 0.5f, 1, 1))));
    EXPECT_EQ(taken("coarserBelow", toValue(-2.0)),
              std::pair(std::string("coarserBelow -2 is not between 0 and 1000000: 0 is taken"), toValue(0.0)));
    EXPECT_EQ(taken("roughness", toValue(0.5f)).first, "");
    EXPECT_EQ(taken("roughness", toValue(std::numeric_limits<float>::infinity())).first, "") << "that is refused";
    FieldValue radius = toValue(-1.0f);
    EXPECT_EQ(takeNearest(*findField(*findType(typeOf<Geometry>()), "pointRadius"), radius), "")
        << "of shapes nothing is guessed";
}

TEST(FieldTable, SaysWhatAChangeAffects) {
    const auto effects = [](auto... lists) { return effectsOf(lists...); };
    EXPECT_TRUE(effects(typeOf<Transform>(), fieldId<&Transform::scale>) & Effect::kPose);
    EXPECT_FALSE(effects(typeOf<Transform>(), fieldId<&Transform::scale>) & Effect::kShape);
    EXPECT_TRUE(effects(typeOf<Switch>(), fieldId<&Switch::choice>) & Effect::kVisibility);
    EXPECT_EQ(effects(ObjectType(999), FieldId(1)), Effect::kNone);
    ChangeListBuilder list;
    list.create(ObjectId(9), typeOf<Geometry>());
    EXPECT_EQ(effectsOf(list.take()), Effect::kNone);
    list.place(ObjectId(2), kRootNode);
    setField<&Geometry::material>(list, ObjectId(9), ObjectId(8));
    EXPECT_EQ(effectsOf(list.take()), Effect::kStructure | Effect::kLook);
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields)
            if (type.type != typeOf<ApplicationData>())  // whose bytes mean something to who keeps them alone
                EXPECT_NE(field.effects, Effect::kNone) << type.name << "." << field.name << " affects nothing";
}

TEST(FieldTable, NumbersAndNamesAreUnique) {
    std::set<std::string_view> typeNames;
    std::set<ObjectType> types;
    for (const TypeInfo& type : allTypes()) {
        EXPECT_TRUE(typeNames.insert(type.name).second);
        EXPECT_TRUE(types.insert(type.type).second);
        std::set<std::string_view> names;
        std::set<FieldId> ids;
        for (const FieldEntry& field : type.fields) {
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
    const FieldEntry& rotation = *findField(*findType("Transform"), "rotation");
    Transform transform;
    rotation.store(&transform, Doubles{{0.1, 0.2, 0.3, 0.4}, 4});
    EXPECT_EQ(transform.rotation.w(), 0.1);
    EXPECT_EQ(rotation.in<double>(&transform)[3], 0.1) << "w lies last";
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
