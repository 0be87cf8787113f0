#include "client/ctl/TypesText.h"

#include <fmt/format.h>

#include <cmath>

#include "client/ctl/Answer.h"
#include "client/ctl/FieldText.h"
#include "common/base/Hash.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// What a reference leads to.
std::string_view targetText(const FieldInfo& field) {
    if (field.refType) return findType(*field.refType)->name;
    return field.anyObject ? "anything" : "any core";
}

/// "double × 3", "ref to Node", "one of stop, slide".
std::string kindText(const FieldInfo& field) {
    std::string text(nameOf(field.kind));
    if (field.width > 1) text += fmt::format(" × {}", field.width);
    if (field.holdsRefs()) text += fmt::format(" to {}", targetText(field));
    if (field.numbersEach > 0)
        text += fmt::format(", elements of {} {}{}", field.numbersEach, field.doubles ? "double" : "float", field.numbersEach > 1 ? "s" : "");
    if (field.wordUse == WordUse::kNone) return text;
    text = field.wordUse == WordUse::kOneOf ? "one of" : field.wordUse == WordUse::kNamed ? text + ", or" : "any of";
    std::string_view before = " ";
    for (const FieldWord& word : field.words()) {
        text.append(before).append(word.word);
        before = ", ";
    }
    return text;
}

std::string boundsText(const FieldInfo& field) {
    if (field.wordUse == WordUse::kOneOf || field.wordUse == WordUse::kFlags) return "";
    const bool low = std::isfinite(field.least), high = std::isfinite(field.greatest);
    if (low && high) return fmt::format(", {} to {}", field.least, field.greatest);
    return low ? fmt::format(", at least {}", field.least) : "";
}

std::string defaultText(const TypeInfo& type, const FieldEntry& field) {
    const FieldValue value = field.load(type.freshObject());
    if (const auto* number = std::get_if<std::int64_t>(&value))
        if (const std::optional<std::string> word = wordOfNumber(field, *number)) return *word;
    if (const auto* text = std::get_if<std::string>(&value)) return fmt::format("\"{}\"", *text);
    if (const auto* blob = std::get_if<Blob>(&value)) return blob->empty() ? "empty" : "";
    return textOf(value);
}

nlohmann::ordered_json fieldJson(const TypeInfo& type, const FieldEntry& field) {
    nlohmann::ordered_json json = {{"name", field.name},
                                   {"number", field.id.value},
                                   {"kind", nameOf(field.kind)},
                                   {"width", field.width},
                                   {"unit", nameOf(field.measuredIn)}};
    if (field.numbersEach > 0) json[field.doubles ? "doubles_each" : "floats_each"] = field.numbersEach;
    if (field.holdsRefs()) json["to"] = targetText(field);
    json["default"] = valueJson(field.load(type.freshObject()));
    if (std::isfinite(field.least)) json["least"] = field.least;
    if (std::isfinite(field.greatest)) json["greatest"] = field.greatest;
    if (field.wordUse == WordUse::kFlags) json["flags"] = true;
    if (field.wordUse != WordUse::kNone)
        for (const FieldWord& word : field.words()) json["words"][std::string(word.word)] = word.number;
    return json;
}

}  // namespace

std::string typesText() {
    std::string text;
    for (const TypeInfo& type : allTypes()) {
        text += fmt::format("{}{} ({})\n", text.empty() ? "" : "\n", type.name, type.type.value);
        for (const FieldEntry& field : type.fields) {
            text += fmt::format("  {:<20} {}{}", field.name, kindText(field), boundsText(field));
            if (field.measuredIn != Unit::kNone) text += fmt::format("; {}", nameOf(field.measuredIn));
            text += fmt::format("  [{}]\n", defaultText(type, field));
        }
    }
    return text;
}

std::string typesJson() {
    auto types = nlohmann::ordered_json::array();
    for (const TypeInfo& type : allTypes()) {
        auto fields = nlohmann::ordered_json::array();
        for (const FieldEntry& field : type.fields) fields.push_back(fieldJson(type, field));
        types.push_back({{"name", type.name}, {"number", type.type.value}, {"core", type.isCore}, {"fields", std::move(fields)}});
    }
    return jsonLine({{"schema", toHex(schemaHash())}, {"types", std::move(types)}});
}

}  // namespace tessera
