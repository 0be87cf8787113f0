#include "client/ctl/TypesText.h"

#include <fmt/format.h>

#include <cmath>

#include "client/ctl/Answer.h"
#include "client/ctl/FieldText.h"
#include "common/base/Nearest.h"
#include "common/json/ApiJson.h"
#include "common/json/FieldHelp.h"
#include "common/scene/FieldTable.h"
#include "common/scene/WrittenByServer.h"

namespace tessera {
namespace {

/// "double × 3", "ref to Node", "one of stop, slide".
std::string kindText(const FieldInfo& field) {
    std::string text(nameOf(field.kind));
    if (field.width > 1) text += fmt::format(" × {}", field.width);
    if (field.holdsRefs()) text += fmt::format(" to {}", targetName(field));
    if (field.numbersEach > 0)
        text += fmt::format(", elements of {} {}{}", field.numbersEach, field.doubles ? "double" : "float",
                            field.numbersEach > 1 ? "s" : "");
    if (field.integersEach > 0)
        text += fmt::format(", elements of {} uint{}{}", field.integersEach, 8 * field.integerBytes,
                            field.integersEach > 1 ? "s" : "");
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

std::string fieldText(const TypeInfo& type, const FieldEntry& field) {
    std::string text = fmt::format("  {:<20} {}{}", field.name, kindText(field), boundsText(field));
    if (field.measuredIn != Unit::kNone) text += fmt::format("; {}", nameOf(field.measuredIn));
    if (fieldOfServer(type.type, field.id)) text += "; the server writes it";
    return text + fmt::format("  [{}]\n", defaultText(type, field));
}

Expected<const TypeInfo*> typeOfName(const std::string& name) {
    if (const TypeInfo* type = findType(name)) return type;
    std::vector<std::string> known;
    for (const TypeInfo& type : allTypes()) known.emplace_back(type.name);
    const std::string nearest = nearestName(name, known);
    return fail(ErrorCode::kNotFound, fmt::format("types: there is no type \"{}\"{}; tessera-ctl types lists all", name,
                                                  nearest.empty() ? "" : fmt::format(" (did you mean {}?)", nearest)));
}

}  // namespace

std::string typesText() {
    std::string text;
    for (const TypeInfo& type : allTypes()) {
        text += fmt::format("{}{} ({})\n", text.empty() ? "" : "\n", type.name, type.type.value);
        for (const FieldEntry& field : type.fields) text += fieldText(type, field);
    }
    return text;
}

Expected<std::string> typeText(const std::string& name) {
    const Expected<const TypeInfo*> found = typeOfName(name);
    if (!found) return tl::unexpected(found.error());
    const TypeInfo& type = **found;
    std::string text = fmt::format("{} ({}): {}\n", type.name, type.type.value, helpOfType(type.name));
    if (!type.isCore) text += "It is no core: others name it by its number.\n";
    for (const FieldEntry& field : type.fields)
        text += fmt::format("\n{}      {}\n", fieldText(type, field), helpOfField(type.name, field.name));
    return text;
}

Expected<std::string> typeLine(const std::string& name) {
    const Expected<const TypeInfo*> found = typeOfName(name);
    if (!found) return tl::unexpected(found.error());
    const Json all = typesJson();
    for (const Json& type : all["types"])
        if (type["name"] == (*found)->name) return jsonLine(type);
    return fail(ErrorCode::kNotFound, "types: not told");
}

}  // namespace tessera
