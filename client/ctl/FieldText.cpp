#include "client/ctl/FieldText.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "client/ctl/Answer.h"
#include "client/ctl/NumberText.h"
#include "common/base/Nearest.h"
#include "common/cores/Interest.h"

namespace tessera {

namespace {

bool readWholeNumber(std::string_view word, std::int64_t& value) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

std::string_view wanted(FieldKind kind) {
    static constexpr std::array<std::string_view, kFieldKinds> kWanted = {
        "number",        "number",      "whole number", "node, #id or none", "text", "blob",
        "true or false", "node or #id", "number"};
    return kWanted[static_cast<std::size_t>(kind)];
}

template <typename Values>
Expected<FieldValue> parseNumbers(const FieldInfo& field, const std::vector<std::string>& words) {
    Values values;
    values.width = field.width;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const Expected<double> number = finiteNumber(words[i], field.name);
        if (!number) return tl::unexpected(number.error());
        values.values[i] = static_cast<typename decltype(values.values)::value_type>(*number);
    }
    return values;
}

Expected<FieldValue> parseMatrix(const FieldInfo& field, const std::vector<std::string>& words) {
    Matrix matrix;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const Expected<double> number = finiteNumber(words[i], field.name);
        if (!number) return tl::unexpected(number.error());
        matrix.values[i] = *number;
    }
    return matrix;
}

Expected<FieldValue> parseInteger(const FieldInfo& field, const std::string& word) {
    if (const std::optional<std::int64_t> number = numberOfWord(field, word)) return *number;
    std::int64_t number = 0;
    if (readWholeNumber(word, number)) return number;
    if (field.words().empty())
        return fail(ErrorCode::kUsage, fmt::format("{}: \"{}\" is not a whole number", field.name, word));
    std::vector<std::string_view> known;
    if (field.wordUse == WordUse::kFlags) known.push_back("none");
    for (const FieldWord& other : field.words()) known.push_back(other.word);
    return fail(ErrorCode::kUsage,
                fmt::format("{}: \"{}\" is {}none of {}", field.name, word,
                            field.wordUse == WordUse::kNamed ? "no whole number and " : "", fmt::join(known, ", ")));
}

Expected<FieldValue> parseRef(const FindObject& find, const std::string& word) {
    if (word == "none") return ObjectId{};
    const Expected<ObjectId> object = find(word);
    if (!object && object.error().code == ErrorCode::kNotFound && word.starts_with('#'))
        return fail(ErrorCode::kNotFound, fmt::format("there is no object {}", word));
    if (!object) return tl::unexpected(object.error());
    return *object;
}

Expected<FieldValue> parseRefs(const FindObject& find, const std::vector<std::string>& words) {
    RefList refs;
    if (words.size() == 1 && words[0] == "none") return refs;
    for (const std::string& word : words) {
        const Expected<FieldValue> ref = parseRef(find, word);
        if (!ref) return ref;
        refs.push_back(std::get<ObjectId>(*ref));
    }
    return refs;
}

std::vector<std::string> fieldNames(const TypeInfo& type) {
    std::vector<std::string> names;
    for (const FieldInfo& field : type.fields) names.push_back(fmt::format("{} ({})", field.name, type.name));
    return names;
}

/// `known`: "name (Type)".
std::string fieldMeant(const std::string& said, const std::vector<std::string>& known) {
    std::vector<std::string> names;
    for (const std::string& field : known) names.push_back(field.substr(0, field.find(' ')));
    const std::string nearest = nearestName(said, names);
    return nearest.empty() ? nearest : fmt::format(" (did you mean \"{}\"?)", nearest);
}

}  // namespace

Expected<FieldPlace> findFieldOf(const ObjectInfo& object, const std::string& name) {
    std::vector<std::string> known;
    for (const auto& [id, number] : {std::pair(object.id, object.type), std::pair(object.core, object.coreType)}) {
        const TypeInfo* type = id ? findType(number) : nullptr;
        if (!type) continue;
        if (const FieldEntry* field = findField(*type, name)) return FieldPlace{id, type, field};
        const std::vector<std::string> more = fieldNames(*type);
        known.insert(known.end(), more.begin(), more.end());
    }
    return fail(ErrorCode::kNotFound, fmt::format("{} has no field \"{}\"{}; it has {}", object.path, name,
                                                  fieldMeant(name, known), fmt::join(known, ", ")));
}

Expected<FieldValue> parseValue(const FindObject& find, const FieldInfo& field, const std::vector<std::string>& words) {
    if (field.kind == FieldKind::kBlob && field.numbersEach > 0) {
        if (words.size() == 1 && words[0] == "none") return Blob();
        Expected<Blob> elements = parseElements(field, words);
        if (!elements) return failWith("all of it, or none", elements.error());
        return std::move(*elements);
    }
    if (field.kind == FieldKind::kBlob)
        return fail(ErrorCode::kUsage, fmt::format("{} holds bulk data, which cannot be set from here", field.name));
    const std::size_t count = field.kind == FieldKind::kMatrix ? 16 : field.width;
    if (field.kind != FieldKind::kRefs && words.size() != count)
        return fail(ErrorCode::kUsage, fmt::format("{} takes {} {}{}, not {}", field.name, count, wanted(field.kind),
                                                   count == 1 ? "" : "s", words.size()));
    switch (field.kind) {
        case FieldKind::kFloat:
            return parseNumbers<Floats>(field, words);
        case FieldKind::kDouble:
            return parseNumbers<Doubles>(field, words);
        case FieldKind::kInt:
            return parseInteger(field, words[0]);
        case FieldKind::kBool:
            if (words[0] == "true" || words[0] == "1") return true;
            if (words[0] == "false" || words[0] == "0") return false;
            return fail(ErrorCode::kUsage, fmt::format("{}: \"{}\" is neither true nor false", field.name, words[0]));
        case FieldKind::kRefs:
            return parseRefs(find, words);
        case FieldKind::kMatrix:
            return parseMatrix(field, words);
        case FieldKind::kRef:
            return parseRef(find, words[0]);
        case FieldKind::kText:
        case FieldKind::kBlob:
            break;
    }
    return words[0];
}

Expected<std::optional<ArrayPart>> parseArrayPart(const std::string& field) {
    const std::size_t at = field.find('@');
    if (at == std::string::npos) return std::nullopt;
    std::int64_t first = 0;
    // Far beyond any array; its offset in bytes is a number still.
    constexpr std::int64_t kLast = std::int64_t{1} << 48;
    if (!readWholeNumber(std::string_view(field).substr(at + 1), first) || first < 0 || first > kLast)
        return fail(ErrorCode::kUsage, fmt::format("{}: after the @ stands the number of an element, from 0", field));
    return ArrayPart{field.substr(0, at), static_cast<std::uint64_t>(first)};
}

Expected<Blob> parseElements(const FieldInfo& field, const std::vector<std::string>& words) {
    const std::size_t each = field.numbersEach;
    if (each == 0)
        return fail(ErrorCode::kUsage, fmt::format("{} is no array of numbers that could be set in part", field.name));
    if (words.empty() || words.size() % each != 0)
        return fail(ErrorCode::kUsage, fmt::format("{} takes {} number{} for each element, not {}", field.name, each,
                                                   each == 1 ? "" : "s", words.size()));
    std::vector<double> numbers;
    for (const std::string& word : words) {
        const Expected<double> number = finiteNumber(word, field.name);
        if (!number) return tl::unexpected(number.error());
        if (!field.doubles && !(std::abs(*number) <= std::numeric_limits<float>::max()))
            return fail(ErrorCode::kUsage, fmt::format("{}: {} is too large", field.name, word));
        numbers.push_back(*number);
    }
    if (field.doubles) return Blob::of(std::span<const double>(numbers));
    const std::vector<float> floats(numbers.begin(), numbers.end());
    return Blob::of(std::span<const float>(floats));
}

std::string textOf(const FieldValue& value) {
    const auto numbers = [](const auto& v) {
        return fmt::format("{}", fmt::join(v.values.begin(), v.values.begin() + v.width, " "));
    };
    if (const auto* floats = std::get_if<Floats>(&value)) return numbers(*floats);
    if (const auto* doubles = std::get_if<Doubles>(&value)) return numbers(*doubles);
    if (const auto* number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
    if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
    if (const auto* matrix = std::get_if<Matrix>(&value)) return fmt::format("{}", fmt::join(matrix->values, " "));
    const auto name = [](ObjectId id) { return id ? fmt::format("#{}", id.value) : "none"; };
    if (const auto* id = std::get_if<ObjectId>(&value)) return name(*id);
    if (const auto* refs = std::get_if<RefList>(&value)) {
        std::string names;
        for (const ObjectId id : *refs) names.append(names.empty() ? "" : " ").append(name(id));
        return names.empty() ? "none" : names;
    }
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    return fmt::format("{} bytes", std::get<Blob>(value).sizeBytes());
}

const FieldInfo& showField() {
    return *findField(*findType(typeOf<Interest>()), fieldId<&Interest::show>);
}

std::string readableWordOf(const FieldInfo& field, const FieldValue& value) {
    const auto* doubles = std::get_if<Doubles>(&value);
    if (doubles == nullptr) return wordOf(field, value);
    std::string text;
    for (std::size_t i = 0; i < doubles->width; ++i) text += (i > 0 ? " " : "") + readable(doubles->values[i]);
    return text;
}

std::string wordOf(const FieldInfo& field, const FieldValue& value) {
    if (const auto* number = std::get_if<std::int64_t>(&value))
        if (const std::optional<std::string> word = wordOfNumber(field, *number)) return *word;
    if (const auto* array = std::get_if<Blob>(&value); array && field.numbersEach > 0) {
        const std::uint64_t elements = array->sizeBytes() / field.elementBytes();
        return elements == 0 ? std::string("none") : fmt::format("{} element{}", elements, elements == 1 ? "" : "s");
    }
    return textOf(value);
}

}  // namespace tessera
