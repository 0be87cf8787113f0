#include "common/codec/TextFaults.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "common/base/Nearest.h"
#include "common/base/OpenBraces.h"

namespace tessera {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;

/// The text between the first pair of quotes after `before`, where `message` has it.
std::optional<std::string> quotedAfter(std::string_view message, std::string_view before) {
    const std::size_t at = message.find(before);
    if (at == std::string_view::npos) return std::nullopt;
    const std::size_t start = at + before.size();
    const std::size_t end = message.find('"', start);
    if (end == std::string_view::npos) return std::nullopt;
    return std::string(message.substr(start, end - start));
}

std::string listed(const std::vector<std::string>& names) {
    return fmt::format("{}", fmt::join(names, ", "));
}

std::string suggestion(const std::string& wanted, const std::vector<std::string>& known) {
    const std::string nearest = nearestName(wanted, known);
    return nearest.empty() ? fmt::format("known: {}", listed(known))
                           : fmt::format("did you mean \"{}\"? (known: {})", nearest, listed(known));
}

const Descriptor* messageNamed(const std::string& fullName) {
    return google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(fullName);
}

/// The enumeration of the field called `name` somewhere in a message.
const EnumDescriptor* enumOfField(const Descriptor& root, const std::string& name) {
    for (int i = 0; i < root.nested_type_count(); ++i) {
        const FieldDescriptor* field = root.nested_type(i)->FindFieldByName(name);
        if (field != nullptr && field->enum_type() != nullptr) return field->enum_type();
    }
    return nullptr;
}

/// Whether the key would be right outside of the innermost of these braces.
bool isKeyFartherOut(const Descriptor& root, const std::vector<OpenBrace>& open, const std::string& key) {
    const Descriptor* type = &root;
    for (const OpenBrace& brace : open) {
        if (type->FindFieldByName(key) != nullptr) return true;
        const FieldDescriptor* field = type->FindFieldByName(brace.name);
        type = field != nullptr ? field->message_type() : nullptr;
        if (type == nullptr) return false;
    }
    return false;
}

}  // namespace

std::string located(std::string_view file, TextPlace place, std::string_view text) {
    if (place.line < 0) return fmt::format("{}: {}", file, text);
    return fmt::format("{}:{}:{}: {}", file, place.line + 1, std::max(place.column, 0) + 1, text);
}

void FirstTextFault::AddError(int line, google::protobuf::io::ColumnNumber column, const std::string& message) {
    if (!message_.empty()) return;
    place_ = {.line = line, .column = column};
    message_ = message;
    if (const auto key = quotedAfter(message, "has no field named \"")) {
        pointAt(*key);
        std::vector<std::string> known;
        const auto type = quotedAfter(message, "Message type \"");
        const Descriptor* descriptor = type ? messageNamed(*type) : nullptr;
        for (int i = 0; descriptor != nullptr && i < descriptor->field_count(); ++i)
            known.push_back(descriptor->field(i)->name());
        message_ = fmt::format("unknown key \"{}\"; {}", *key, suggestion(*key, known));
        const std::vector<OpenBrace> open = openBraces(text_, line, column);
        if (isKeyFartherOut(root_, open, *key))
            message_ = fmt::format("unknown key \"{}\" here; {}", *key, askForBrace(open.back()));
    } else if (const auto value = quotedAfter(message, "Unknown enumeration value of \"")) {
        pointAt(*value);
        std::vector<std::string> known;
        const auto field = quotedAfter(message, "for field \"");
        const EnumDescriptor* type = field ? enumOfField(root_, *field) : nullptr;
        for (int i = 0; type != nullptr && i < type->value_count(); ++i) known.push_back(type->value(i)->name());
        message_ =
            fmt::format("{} cannot be \"{}\"; {}", field.value_or("this key"), *value, suggestion(*value, known));
    } else if (const auto twice = quotedAfter(message, "Non-repeated field \"")) {
        pointAt(*twice);
        message_ = fmt::format("\"{}\" is given twice here; only one is possible", *twice);
        const std::vector<OpenBrace> open = openBraces(text_, line, column);
        if (isKeyFartherOut(root_, open, *twice)) message_ += ", or " + askForBrace(open.back());
    } else if (const std::size_t end = message.find_last_not_of(". ");
               end != std::string::npos && message[end] == ':') {
        // It got nothing any more.
        const std::vector<OpenBrace> open = openBraces(text_, line, column);
        if (!open.empty()) message_ = endsInside(open.back());
    }
}

/// Protobuf reports the token behind the word that is wrong: goes back to the word, which may stand on an earlier
/// line.
void FirstTextFault::pointAt(const std::string& word) {
    std::size_t offset = 0;
    for (int i = 0; i < place_.line && offset != std::string_view::npos; ++i) {
        offset = text_.find('\n', offset);
        if (offset != std::string_view::npos) ++offset;
    }
    if (offset == std::string_view::npos) return;
    const std::size_t found = text_.rfind(word, offset + static_cast<std::size_t>(std::max(place_.column, 0)));
    if (found == std::string_view::npos) return;
    const std::size_t lineStart = text_.rfind('\n', found) == std::string_view::npos ? 0 : text_.rfind('\n', found) + 1;
    place_.line = static_cast<int>(std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(found), '\n'));
    place_.column = static_cast<int>(found - lineStart);
}

}  // namespace tessera
