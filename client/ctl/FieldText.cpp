#include "client/ctl/FieldText.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "client/ctl/FieldWords.h"

namespace tessera {

namespace {

template <typename Number>
bool readNumber(const std::string& word, Number& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

std::string_view nameOf(FieldKind kind) {
    switch (kind) {
        case FieldKind::kFloat:
        case FieldKind::kDouble:
            return "number";
        case FieldKind::kInt:
            return "whole number";
        case FieldKind::kRef:
            return "node, #id or none";
        case FieldKind::kText:
            return "text";
        case FieldKind::kBlob:
            return "blob";
    }
    return "value";
}

template <typename Values>
Expected<FieldValue> parseNumbers(const FieldInfo& field, const std::vector<std::string>& words) {
    Values values;
    values.width = field.width;
    for (std::size_t i = 0; i < words.size(); ++i) {
        double number = 0;
        if (!readNumber(words[i], number) || !std::isfinite(number))
            return fail(ErrorCode::kUsage, fmt::format("{}: \"{}\" is not a number", field.name, words[i]));
        values.values[i] = static_cast<typename decltype(values.values)::value_type>(number);
    }
    return values;
}

Expected<FieldValue> parseRef(const Aspect& aspect, const std::string& word) {
    if (word == "none") return ObjectId{};
    if (word.starts_with('#')) {
        ObjectId id;
        if (!readNumber(word.substr(1), id.value) || aspect.find(id) == nullptr)
            return fail(ErrorCode::kNotFound, fmt::format("there is no object {}", word));
        return id;
    }
    const Expected<ObjectId> node = findNode(aspect, word);
    if (!node) return tl::unexpected(node.error());
    return *node;
}

std::vector<std::string> fieldNames(const TypeInfo& type) {
    std::vector<std::string> names;
    for (const FieldInfo& field : type.fields) names.push_back(fmt::format("{} ({})", field.name, type.name));
    return names;
}

}  // namespace

Expected<FieldPlace> findFieldOf(const Aspect& aspect, ObjectId node, const std::string& name) {
    const Object& own = *aspect.find(node);
    const ObjectId core = std::get<Node>(own).core;
    std::vector<std::string> known;
    for (const ObjectId id : {node, core}) {
        if (!id) continue;
        const TypeInfo& type = typeInfo(*aspect.find(id));
        if (const FieldInfo* field = findField(type, name)) return FieldPlace{id, &type, field};
        const std::vector<std::string> more = fieldNames(type);
        known.insert(known.end(), more.begin(), more.end());
    }
    return fail(ErrorCode::kNotFound,
                fmt::format("{} has no field \"{}\"; it has {}", pathOf(aspect, node), name, fmt::join(known, ", ")));
}

Expected<FieldValue> parseValue(const Aspect& aspect, const FieldInfo& field, const std::vector<std::string>& words) {
    if (field.kind == FieldKind::kBlob)
        return fail(ErrorCode::kUsage, fmt::format("{} holds bulk data, which cannot be set from here", field.name));
    if (words.size() != field.width)
        return fail(ErrorCode::kUsage, fmt::format("{} takes {} {}{}, not {}", field.name, field.width,
                                                   nameOf(field.kind), field.width == 1 ? "" : "s", words.size()));
    switch (field.kind) {
        case FieldKind::kFloat:
            return parseNumbers<Floats>(field, words);
        case FieldKind::kDouble:
            return parseNumbers<Doubles>(field, words);
        case FieldKind::kInt: {
            std::int64_t number = 0;
            if (!readNumber(words[0], number))
                return fail(ErrorCode::kUsage, fmt::format("{}: \"{}\" is not a whole number", field.name, words[0]));
            return number;
        }
        case FieldKind::kRef:
            return parseRef(aspect, words[0]);
        case FieldKind::kText:
        case FieldKind::kBlob:
            break;
    }
    return words[0];
}

Expected<FieldValue> parseValue(const Aspect& aspect, const FieldPlace& place, const std::vector<std::string>& words) {
    const std::vector<std::string_view> known = wordsOf(place.type->type, place.field->id);
    if (known.empty() || words.size() != 1 || words[0].empty()) return parseValue(aspect, *place.field, words);
    if (const auto number = numberOfWord(place.type->type, place.field->id, words[0])) return FieldValue(*number);
    if (!std::ranges::any_of(words[0], [](char c) { return c >= 'a' && c <= 'z'; }))
        return parseValue(aspect, *place.field, words);
    return fail(ErrorCode::kUsage,
                fmt::format("{}: \"{}\" is none of {}", place.field->name, words[0], fmt::join(known, ", ")));
}

std::string textOf(const FieldValue& value) {
    const auto numbers = [](const auto& v) {
        return fmt::format("{}", fmt::join(v.values.begin(), v.values.begin() + v.width, " "));
    };
    if (const auto* floats = std::get_if<Floats>(&value)) return numbers(*floats);
    if (const auto* doubles = std::get_if<Doubles>(&value)) return numbers(*doubles);
    if (const auto* number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
    if (const auto* id = std::get_if<ObjectId>(&value)) return *id ? fmt::format("#{}", id->value) : "none";
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    return fmt::format("{} bytes", std::get<Blob>(value).sizeBytes());
}

}  // namespace tessera
