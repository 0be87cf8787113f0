#include "server/import/TableCores.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "common/scene/Text.h"

namespace tessera {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

const FieldDescriptor* contentField(const proto::scene::Node& node) {
    return node.GetReflection()->GetOneofFieldDescriptor(node, node.GetDescriptor()->FindOneofByName("content"));
}

/// The field of a message that says a field of the table, and what its number is to be multiplied with.
struct Said {
    const FieldDescriptor* field = nullptr;
    double factor = 1;
};

Said findSaid(const Message& message, const FieldInfo& field) {
    if (field.holdsRefs() || field.kind == FieldKind::kBlob)
        return {};  // names and arrays: who knows the message reads them
    const std::string name = snakeCase(field.name);
    const auto& descriptor = *message.GetDescriptor();
    if (field.measuredIn == Unit::kRadian && field.width == 1)
        return {descriptor.FindFieldByName(name + "_deg"), std::numbers::pi / 180};
    return {descriptor.FindFieldByName(name), 1};
}

template <typename Packed>
FieldValue packed(const FieldInfo& field, std::initializer_list<double> numbers) {
    Packed values;
    values.width = field.width;
    std::size_t i = 0;
    for (const double number : numbers)
        if (i < field.width) values.values[i++] = static_cast<typename decltype(values.values)::value_type>(number);
    return values;
}

/// A vector's third number, where the field has two.
Expected<void> checkThird(const FieldInfo& field, bool said) {
    if (field.width > 2 || !said) return {};
    return fail(ErrorCode::kBadInput, "it has an x and a y alone");
}

FieldValue numbersOf(const FieldInfo& field, std::initializer_list<double> numbers) {
    return field.kind == FieldKind::kFloat ? packed<Floats>(field, numbers) : packed<Doubles>(field, numbers);
}

Expected<FieldValue> readMessage(const Message& value, const FieldInfo& field) {
    if (const auto* color = dynamic_cast<const proto::scene::Color*>(&value)) {
        const Expected<Vec3f> rgb = readColor(*color);
        if (!rgb) return tl::unexpected(rgb.error());
        // Out of what its field may be it goes on as it stands, not brought near as others are.
        if (const auto [least, most] = std::minmax({color->r(), color->g(), color->b()});
            least < field.least || most > field.greatest)
            return numbersOf(field, {color->r(), color->g(), color->b(), color->has_a() ? color->a() : 1.0});
        return numbersOf(field, {rgb->x(), rgb->y(), rgb->z(), color->has_a() ? color->a() : 1.0});
    }
    if (const auto* vector = dynamic_cast<const proto::scene::Vector*>(&value)) {
        if (Expected<void> good = checkThird(field, vector->z() != 0); !good) return tl::unexpected(good.error());
        return numbersOf(field, {vector->x(), vector->y(), vector->z()});
    }
    if (const auto* factors = dynamic_cast<const proto::scene::Factors*>(&value)) {
        if (Expected<void> good = checkThird(field, factors->has_z()); !good) return tl::unexpected(good.error());
        return numbersOf(field, {factors->has_x() ? factors->x() : 1.0, factors->has_y() ? factors->y() : 1.0,
                                 factors->has_z() ? factors->z() : 1.0});
    }
    if (const auto* rotation = dynamic_cast<const proto::scene::Rotation*>(&value)) {
        const Expected<Quatd> turn = readRotation(*rotation);
        if (!turn) return tl::unexpected(turn.error());
        return toValue(*turn);
    }
    TESSERA_CHECK(false, "a message of the scene schema that no kind of field has");
    return FieldValue();
}

Expected<FieldValue> readField(const Message& message, const Said& said, const FieldInfo& field) {
    const auto& reflection = *message.GetReflection();
    switch (said.field->cpp_type()) {
        case FieldDescriptor::CPPTYPE_MESSAGE:
            return readMessage(reflection.GetMessage(message, said.field), field);
        case FieldDescriptor::CPPTYPE_BOOL:
            return reflection.GetBool(message, said.field);
        case FieldDescriptor::CPPTYPE_ENUM:
            return std::int64_t{reflection.GetEnumValue(message, said.field)};
        case FieldDescriptor::CPPTYPE_UINT32:
            return std::int64_t{reflection.GetUInt32(message, said.field)};
        case FieldDescriptor::CPPTYPE_INT64:
            return reflection.GetInt64(message, said.field);
        case FieldDescriptor::CPPTYPE_STRING:
            return reflection.GetString(message, said.field);
        case FieldDescriptor::CPPTYPE_FLOAT:
            return numbersOf(field, {reflection.GetFloat(message, said.field) * said.factor});
        case FieldDescriptor::CPPTYPE_DOUBLE:
            return numbersOf(field, {reflection.GetDouble(message, said.field) * said.factor});
        default:
            TESSERA_CHECK(false, "a field of the scene schema that no kind of field has");
            return FieldValue();
    }
}

}  // namespace

const TypeInfo* tableTypeOf(const proto::scene::Node& node) {
    const FieldDescriptor* content = contentField(node);
    return content && content->message_type() ? findType(content->message_type()->name()) : nullptr;
}

const Message& contentOf(const proto::scene::Node& node) {
    return node.GetReflection()->GetMessage(node, contentField(node));
}

std::string placeIn(const proto::scene::Material& material, int field) {
    for (const proto::scene::FieldPlace& told : material.at())
        if (told.field() == static_cast<std::uint32_t>(field))
            return fmt::format("{}:{}: ", told.at() >> 32, told.at() & 0xffffffffu);
    return {};
}

Expected<TableFields> readTableFields(const Message& message, const TypeInfo& type, std::vector<Mended>* mended) {
    TableFields fields;
    for (const FieldEntry& field : type.fields) {
        const Said said = findSaid(message, field);
        if (!said.field || !message.GetReflection()->HasField(message, said.field)) continue;
        Expected<FieldValue> value = readField(message, said, field);
        if (!value) return failWith(std::string(said.field->name()), value.error());
        if (mended)
            if (std::string what = takeNearest(field, *value); !what.empty())
                mended->push_back({said.field->number(), std::move(what)});
        if (Expected<void> good = checkValue(field, *value); !good) return tl::unexpected(good.error());
        fields.emplace_back(field.id, std::move(*value));
    }
    return fields;
}

}  // namespace tessera
