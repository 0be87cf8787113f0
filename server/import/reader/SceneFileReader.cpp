// Tessera's own files: .tsct (text) and .tsc (binary).

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Nearest.h"
#include "common/base/OpenBraces.h"
#include "common/base/Utf8.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/SceneSchema.h"
#include "server/import/SceneFileCheck.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/SceneExpander.h"

namespace tessera {
namespace {

namespace pb = google::protobuf;

/// What stands in quotes behind `before`; empty: the message has no such place.
std::string quotedAfter(std::string_view message, std::string_view before) {
    const std::size_t at = message.find(before);
    if (at == std::string_view::npos) return {};
    const std::string_view rest = message.substr(at + before.size());
    return std::string(rest.substr(0, rest.find('"')));
}

/// The messages inside of each other where these braces are open, the file first; null from where a word is none of
/// ours.
std::vector<const pb::Descriptor*> messagesIn(const std::vector<OpenBrace>& open) {
    std::vector<const pb::Descriptor*> types{&SceneSchema::get().file()};
    for (const OpenBrace& brace : open) {
        const pb::FieldDescriptor* field = types.back() ? types.back()->FindFieldByName(brace.name) : nullptr;
        types.push_back(field ? field->message_type() : nullptr);
    }
    return types;
}

/// Protobuf's message in our words, with the name that was probably meant. `open`: the braces around its place.
std::string explained(const std::string& message, const std::vector<OpenBrace>& open) {
    const auto meant = [](const std::string& word, const std::vector<std::string>& names) {
        const std::string nearest = nearestName(word, names);
        return nearest.empty() ? std::string() : fmt::format("; did you mean '{}'?", nearest);
    };
    const std::vector<const pb::Descriptor*> around = messagesIn(open);
    std::vector<std::string> names;
    if (const std::string field = quotedAfter(message, "\" has no field named \""); !field.empty()) {
        const pb::Descriptor* type =
            SceneSchema::get().pool().FindMessageTypeByName(quotedAfter(message, "Message type \""));
        if (type == nullptr) return message;
        for (int i = 0; i < type->field_count(); ++i) names.push_back(type->field(i)->name());
        std::string hint = meant(field, names);
        // It would be right one or more braces farther out.
        const bool isOuters = std::any_of(around.begin(), around.end() - 1, [&](const pb::Descriptor* outer) {
            return outer != nullptr && outer->FindFieldByName(field) != nullptr;
        });
        if (isOuters) hint = "; " + askForBrace(open.back());
        return fmt::format("{} has no '{}'{}", type->name(), field, hint);
    }
    if (const std::string value = quotedAfter(message, "Unknown enumeration value of \""); !value.empty()) {
        const std::string field = quotedAfter(message, "for field \"");
        const pb::FieldDescriptor* known = around.back() ? around.back()->FindFieldByName(field) : nullptr;
        const pb::EnumDescriptor* words = known ? known->enum_type() : nullptr;
        if (words == nullptr) return message;
        for (int i = 0; i < words->value_count(); ++i) names.push_back(words->value(i)->name());
        return fmt::format("{} cannot be {}{} (it can be {})", field, value, meant(value, names),
                           fmt::join(names, ", "));
    }
    return message;
}

class FirstError : public pb::io::ErrorCollector {
public:
    /// `text` outlives it.
    explicit FirstError(std::string_view text) : source_(text) {}

    void AddError(int line, pb::io::ColumnNumber column, const std::string& message) override {
        if (!text_.empty()) return;
        const std::vector<OpenBrace> open = line >= 0 ? openBraces(source_, line, column) : std::vector<OpenBrace>();
        std::string words = explained(message, open);
        while (!words.empty() && (words.back() == '.' || words.back() == ' ')) words.pop_back();
        if (!words.empty() && words.back() == ':')
            words = open.empty() ? words + " the end of the file" : endsInside(open.back());
        text_ = line >= 0 ? fmt::format("{}:{}: {}", line + 1, column + 1, words) : words;
    }
    void AddWarning(int, pb::io::ColumnNumber, const std::string&) override {}

    [[nodiscard]] const std::string& text() const { return text_; }

private:
    std::string_view source_;
    std::string text_;
};

FolderFiles filesBeside(const std::string& path, const ReadLimits& limits) {
    return FolderFiles(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1)), limits.maxFileBytes);
}

/// Names the first text that is no UTF-8, whether it stands there so or is written with backslashes. Nobody could read
/// the message else. `around`: where the message stands, for what the parser keeps no place of (lists in brackets).
Expected<void> checkTexts(const pb::Message& message, const pb::TextFormat::ParseInfoTree* places,
                          pb::TextFormat::ParseLocation around = {0, 0}) {
    const pb::Reflection& reflection = *message.GetReflection();
    std::vector<const pb::FieldDescriptor*> present;
    reflection.ListFields(message, &present);
    for (const pb::FieldDescriptor* field : present) {
        const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
        for (int i = 0; i < count; ++i) {
            const int index = field->is_repeated() ? i : -1;
            if (field->type() == pb::FieldDescriptor::TYPE_STRING) {
                std::string scratch;
                const std::string& text = index < 0
                                              ? reflection.GetStringReference(message, field, &scratch)
                                              : reflection.GetRepeatedStringReference(message, field, i, &scratch);
                if (isUtf8(text)) continue;
                pb::TextFormat::ParseLocation at = places ? places->GetLocation(field, index) : around;
                if (at.line < 0) at = around;
                return fail(ErrorCode::kBadInput,
                            fmt::format("{}:{}: this {} is no UTF-8", at.line + 1, at.column + 1, field->name()));
            }
            if (field->message_type() == nullptr) break;
            const pb::Message& inner =
                index < 0 ? reflection.GetMessage(message, field) : reflection.GetRepeatedMessage(message, field, i);
            const pb::TextFormat::ParseLocation at = places ? places->GetLocation(field, index) : around;
            const Expected<void> sound =
                checkTexts(inner, places ? places->GetTreeForNested(field, index) : nullptr, at.line < 0 ? around : at);
            if (!sound) return sound;
        }
    }
    return {};
}

/// Where each saved object stands in the text, for messages of whoever looks at its values.
void notePlaces(pb::Message& file, const pb::TextFormat::ParseInfoTree& places) {
    const SceneSchema& schema = SceneSchema::get();
    const pb::FieldDescriptor* savedField = schema.file().FindFieldByName("saved");
    if (!file.GetReflection()->HasField(file, savedField)) return;
    pb::Message& saved = *file.GetReflection()->MutableMessage(&file, savedField);
    const pb::TextFormat::ParseInfoTree* inside = places.GetTreeForNested(savedField, -1);
    const pb::FieldDescriptor* objectField = saved.GetDescriptor()->FindFieldByNumber(SceneSchema::kObject);
    if (inside == nullptr) return;
    for (int i = 0; i < saved.GetReflection()->FieldSize(saved, objectField); ++i) {
        const pb::TextFormat::ParseLocation at = inside->GetLocation(objectField, i);
        pb::Message& object = *saved.GetReflection()->MutableRepeatedMessage(&saved, objectField, i);
        pb::Message& place = *object.GetReflection()->MutableMessage(&object, &schema.objectField(SceneSchema::kAt));
        const pb::Reflection& reflection = *place.GetReflection();
        reflection.SetUInt32(&place, place.GetDescriptor()->FindFieldByName("line"),
                             static_cast<std::uint32_t>(at.line + 1));
        reflection.SetUInt32(&place, place.GetDescriptor()->FindFieldByName("column"),
                             static_cast<std::uint32_t>(at.column + 1));
    }
}

/// What the text had to quote of a newer version, as the bytes that a binary file has beside what is saved. The rest of
/// what is quoted stays in its fields.
Expected<std::string> takeQuoted(pb::Message& file, const pb::TextFormat::ParseInfoTree& places) {
    const pb::FieldDescriptor* savedField = SceneSchema::get().file().FindFieldByName("saved");
    if (!file.GetReflection()->HasField(file, savedField)) return std::string();
    pb::Message& saved = *file.GetReflection()->MutableMessage(&file, savedField);
    const pb::Reflection& reflection = *saved.GetReflection();
    const auto quoted = [&](int number, auto&& isSound) -> Expected<std::string> {
        const pb::FieldDescriptor* field = saved.GetDescriptor()->FindFieldByNumber(number);
        std::string bytes = reflection.GetString(saved, field);
        if (isSound(bytes)) return bytes;
        const pb::TextFormat::ParseInfoTree* inside = places.GetTreeForNested(savedField, -1);
        const pb::TextFormat::ParseLocation at =
            inside ? inside->GetLocation(field, -1) : pb::TextFormat::ParseLocation();
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}:{}: what {} quotes is damaged", at.line + 1, at.column + 1, field->name()));
    };
    const Expected<std::string> ofSaved = quoted(SceneSchema::kLaterSaved, [](const std::string& bytes) {
        return pb::UnknownFieldSet().ParseFromString(bytes);
    });
    if (!ofSaved) return ofSaved;
    Expected<std::string> beside = quoted(SceneSchema::kLaterFile, [](const std::string& bytes) {
        const Expected<proto::scene::SceneFile> read = parseSceneFile(asBytes(bytes));
        return read && read->saved().empty();  // it would take the place of what is being read
    });
    reflection.ClearField(&saved, saved.GetDescriptor()->FindFieldByNumber(SceneSchema::kLaterFile));
    return beside;
}

/// The text with blanks where the part stands: all places stay.
std::string withoutPart(std::string_view text, const SavedPart& part) {
    std::string rest;
    rest.reserve(text.size());
    rest += text.substr(0, part.begin);
    for (const char c : text.substr(part.begin, part.end - part.begin)) rest += c == '\n' || c == '\t' ? c : ' ';
    return rest += text.substr(part.end);
}

Expected<void> addSaved(std::string_view text, const SavedPart& part, const FolderFiles& files, PlainScene& scene) {
    Expected<SavedText> saved = readSavedText(
        text, part,
        {.beside = [&](const std::string& name) { return files.read(name); }, .firstArray = scene.blobs.size() + 1});
    if (!saved) return tl::unexpected(saved.error());
    scene.file.set_saved(std::move(saved->saved));
    for (Bytes& array : saved->arrays) scene.blobs.push_back(std::move(array));
    for (std::string& note : saved->notes) scene.note(std::move(note));
    return {};
}

}  // namespace

Expected<PlainScene> readSceneText(const std::string& path, const ReadLimits& limits) {
    const Expected<Bytes> bytes = readOrdinaryFile(path, limits.maxFileBytes);
    if (!bytes) return fail(bytes.error().code, "the file " + bytes.error().message);
    // By the schema that knows what is saved; what authors write is the same in both.
    const std::unique_ptr<pb::Message> message = SceneSchema::get().newMessage(SceneSchema::get().file());
    // Some editors put a byte-order mark first.
    const std::size_t mark = bytes->size() >= 3 && std::memcmp(bytes->data(), "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    const std::string_view text = asText(*bytes).substr(mark);
    const Expected<std::optional<SavedPart>> nested = findSavedPart(text);
    if (!nested) return tl::unexpected(nested.error());
    const std::string rest = *nested ? withoutPart(text, **nested) : std::string();
    const std::string_view others = *nested ? std::string_view(rest) : text;
    FirstError errors(text);
    pb::TextFormat::ParseInfoTree places;
    pb::TextFormat::Parser parser;
    parser.RecordErrorsTo(&errors);
    parser.WriteLocationsTo(&places);
    parser.SetRecursionLimit(static_cast<int>(limits.maxDepth) + 8);
    pb::io::ArrayInputStream input(others.data(), static_cast<int>(others.size()));
    if (!parser.Parse(&input, message.get()))
        return fail(ErrorCode::kBadInput, errors.text().empty() ? "it is not a Tessera scene" : errors.text());
    if (const Expected<void> sound = checkTexts(*message, &places); !sound) return tl::unexpected(sound.error());
    notePlaces(*message, places);
    const Expected<std::string> beside = takeQuoted(*message, places);
    if (!beside) return tl::unexpected(beside.error());
    std::string binary;
    if (!message->SerializeToString(&binary)) return fail(ErrorCode::kLimit, "it is larger than 2 GiB");
    message->Clear();
    binary += *beside;
    Expected<proto::scene::SceneFile> file = parseSceneFile(asBytes(binary));
    if (!file) return tl::unexpected(file.error());
    binary = std::string();
    const FolderFiles files = filesBeside(path, limits);
    if (*nested && !file->saved().empty()) return fail(ErrorCode::kBadInput, "saved is there twice");
    Expected<PlainScene> scene = SceneExpander(files, limits).expand(std::move(*file), &places);
    if (!scene || !*nested) return scene;
    if (Expected<void> added = addSaved(text, **nested, files, *scene); !added) return tl::unexpected(added.error());
    return scene;
}

Expected<PlainScene> readSceneBinary(const std::string& path, const ReadLimits& limits) {
    const Expected<Bytes> bytes = readOrdinaryFile(path, limits.maxFileBytes);
    if (!bytes) return fail(bytes.error().code, "the file " + bytes.error().message);
    Expected<proto::scene::SceneFile> file = parseSceneFile(*bytes);
    if (!file) return tl::unexpected(file.error());
    const FolderFiles files = filesBeside(path, limits);
    return SceneExpander(files, limits).expand(std::move(*file), nullptr);
}

}  // namespace tessera
