#include "common/scenefile/SceneSchema.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/base/Version.h"
#include "common/scene/Text.h"
#include "common/scenefile/SceneFile.h"
#include "common/scenefile/TextForm.h"
#include "proto/scene.pb.h"

namespace tessera {
namespace {

using google::protobuf::DescriptorProto;
using google::protobuf::EnumDescriptorProto;
using google::protobuf::FieldDescriptorProto;
using google::protobuf::FileDescriptorProto;

constexpr const char* kPackage = ".tessera.proto.scene";

std::string numberText(const FieldValue& value) {
    std::string text;
    const auto add = [&](double number) { text += fmt::format("{}{}", text.empty() ? "" : " ", number); };
    if (const auto* floats = std::get_if<Floats>(&value))
        for (std::size_t i = 0; i < floats->width; ++i) text += fmt::format("{}{}", i ? " " : "", floats->values[i]);
    if (const auto* doubles = std::get_if<Doubles>(&value))
        for (std::size_t i = 0; i < doubles->width; ++i) add(doubles->values[i]);
    if (const auto* whole = std::get_if<std::int64_t>(&value)) add(static_cast<double>(*whole));
    if (const auto* flag = std::get_if<bool>(&value)) text = *flag ? "true" : "false";
    if (std::holds_alternative<Matrix>(value)) text = "identity";
    return text;
}

/// What a person must know of a field who sees only the schema.
std::string explain(const TypeInfo& type, const FieldEntry& field) {
    std::vector<std::string> parts;
    switch (field.kind) {
        case FieldKind::kRef:
        case FieldKind::kRefs: {
            const TypeInfo* target = field.refType ? findType(*field.refType) : nullptr;
            parts.push_back(fmt::format("number of {} {}{}", field.kind == FieldKind::kRef ? "an object:" : "objects:",
                                        target            ? target->name
                                        : field.anyObject ? "anything"
                                                          : "any core",
                                        field.kind == FieldKind::kRef ? "; 0: none" : ""));
            break;
        }
        case FieldKind::kBlob:
            parts.emplace_back("number of an array among the file's, from 1; 0: none");
            break;
        case FieldKind::kMatrix:
            parts.emplace_back("16 numbers, column by column");
            break;
        case FieldKind::kFloat:
        case FieldKind::kDouble:
            if (field.quaternion)
                parts.emplace_back("w x y z");
            else if (field.width > 1)
                parts.push_back(fmt::format("{} numbers", field.width));
            break;
        default:
            break;
    }
    if (const std::string_view unit = nameOf(field.measuredIn); !unit.empty()) parts.emplace_back(unit);
    if (std::isfinite(field.least) && field.wordUse != WordUse::kOneOf)
        parts.push_back(std::isfinite(field.greatest) ? fmt::format("{} to {}", field.least, field.greatest)
                                                      : fmt::format("at least {}", field.least));
    if (field.wordUse == WordUse::kNamed || field.wordUse == WordUse::kFlags)
        for (const FieldWord& word : field.words())
            parts.push_back(
                fmt::format("{}{}: {}", field.wordUse == WordUse::kFlags ? "bit " : "", word.number, word.word));
    if (const std::string fresh = numberText(field.load(type.freshObject())); !fresh.empty())
        parts.push_back("absent: " + fresh);
    std::string text;
    for (const std::string& part : parts) text += (text.empty() ? " " : "; ") + part;
    return text;
}

/// Builds one message after the other, with comments.
class Builder {
public:
    explicit Builder(FileDescriptorProto& file) : file_(file), place_(file.message_type_size()) {
        saved_ = file.add_message_type();
        saved_->set_name("Saved");
        comment({},
                " A scene as it is, object by object: types and fields are those of the scene itself. What is absent "
                "has its\n"
                " default. Numbers of types and fields are never given to others.");
    }

    void addSaved() {
        add(*saved_, {}, "object", SceneSchema::kObject, FieldDescriptorProto::TYPE_MESSAGE, true, "", ".Saved.Object");
        add(*saved_, {}, "root", SceneSchema::kRoot, FieldDescriptorProto::TYPE_UINT32, false,
            " Number of the node that stands for the scene; its children are the top level.");
        add(*saved_, {}, "later", SceneSchema::kLaterSaved, FieldDescriptorProto::TYPE_BYTES, false,
            " In text files: what a newer version wrote here.");
        add(*saved_, {}, "later_file", SceneSchema::kLaterFile, FieldDescriptorProto::TYPE_BYTES, false,
            " In text files: what a newer version wrote beside this message.");
        add(*saved_, {}, "named", SceneSchema::kNamed, FieldDescriptorProto::TYPE_BOOL, false,
            " Filled in by the reader of a text file: its numbers say nothing to people.");
    }

    void addObject() {
        DescriptorProto& object = *saved_->add_nested_type();
        object.set_name("Object");
        const std::vector<int> path = {3, saved_->nested_type_size() - 1};
        comment(path, " One object of one type.");
        add(object, path, "number", SceneSchema::kNumber, FieldDescriptorProto::TYPE_UINT32, false,
            " Above 0, each once: how others refer to it.");
        add(object, path, "child", SceneSchema::kChild, FieldDescriptorProto::TYPE_UINT32, true,
            " Of a Node: the numbers of the nodes below it, in their order.");
        add(object, path, "later", SceneSchema::kLater, FieldDescriptorProto::TYPE_BYTES, false,
            " In text files: what a newer version wrote of this object.");
        add(object, path, "later_fields", SceneSchema::kLaterFields, FieldDescriptorProto::TYPE_BYTES, false,
            " In text files: what a newer version wrote of its value.");
        add(object, path, "at", SceneSchema::kAt, FieldDescriptorProto::TYPE_MESSAGE, false,
            " Filled in by the reader of a text file, for messages.", ".Place");
        object.add_oneof_decl()->set_name("value");
        for (const TypeInfo& type : allTypes()) {
            FieldDescriptorProto& field =
                add(object, path, snakeCase(type.name).substr(1), SceneSchema::kFirstType + type.type.value,
                    FieldDescriptorProto::TYPE_MESSAGE, false, "", fmt::format(".Saved.{}", type.name));
            field.set_oneof_index(0);
        }
        addPresence(object);
    }

    /// Of a node that an author writes: those types of cores for which `node` has no message. Numbers are those in
    /// Object.
    void addCore(const DescriptorProto& node) {
        DescriptorProto& core = *saved_->add_nested_type();
        core.set_name("Core");
        const std::vector<int> path = {3, saved_->nested_type_size() - 1};
        comment(
            path,
            " A core as an author writes it. What it refers to has no number here: `material` of the node is its own.");
        core.add_oneof_decl()->set_name("value");
        for (const TypeInfo& type : allTypes()) {
            const std::string message = fmt::format("{}.{}", kPackage, type.name);
            const auto says = [&](const FieldDescriptorProto& field) { return field.type_name() == message; };
            if (!type.isCore || type.type == typeOf<Node>() || std::ranges::any_of(node.field(), says)) continue;
            add(core, path, snakeCase(type.name).substr(1), SceneSchema::kFirstType + type.type.value,
                FieldDescriptorProto::TYPE_MESSAGE, false, "", fmt::format(".Saved.{}", type.name))
                .set_oneof_index(0);
        }
    }

    void addType(const TypeInfo& type) {
        DescriptorProto& message = *saved_->add_nested_type();
        message.set_name(std::string(type.name));
        const std::vector<int> path = {3, saved_->nested_type_size() - 1};
        for (const FieldEntry& field : type.fields) addField(message, path, type, field);
        addPresence(message);
    }
    void finish() { addPresence(*saved_); }

private:
    void addField(DescriptorProto& message, const std::vector<int>& path, const TypeInfo& type,
                  const FieldEntry& field) {
        const bool isFloat = field.kind == FieldKind::kFloat;
        const auto with = [&](FieldDescriptorProto::Type kind, bool repeated, const std::string& named = {}) {
            add(message, path, snakeCase(field.name), field.id.value, kind, repeated, explain(type, field), named);
        };
        switch (field.kind) {
            case FieldKind::kFloat:
            case FieldKind::kDouble:
                return with(isFloat ? FieldDescriptorProto::TYPE_FLOAT : FieldDescriptorProto::TYPE_DOUBLE,
                            field.width > 1);
            case FieldKind::kMatrix:
                return with(FieldDescriptorProto::TYPE_DOUBLE, true);
            case FieldKind::kInt:
                if (field.wordUse != WordUse::kOneOf) return with(FieldDescriptorProto::TYPE_INT64, false);
                return with(FieldDescriptorProto::TYPE_ENUM, false,
                            fmt::format(".Saved.{}.{}", type.name, addWords(message, field)));
            case FieldKind::kRef:
            case FieldKind::kRefs:
                return with(FieldDescriptorProto::TYPE_UINT32, field.kind == FieldKind::kRefs);
            case FieldKind::kText:
                return with(FieldDescriptorProto::TYPE_STRING, false);
            case FieldKind::kBlob:
                return with(FieldDescriptorProto::TYPE_UINT32, false);
            case FieldKind::kBool:
                return with(FieldDescriptorProto::TYPE_BOOL, false);
        }
    }

    /// The enumeration of a field's words; returns its name.
    static std::string addWords(DescriptorProto& message, const FieldEntry& field) {
        EnumDescriptorProto& words = *message.add_enum_type();
        std::string name(field.name);
        name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
        words.set_name(name);
        const std::string head = textform::enumHead(snakeCase(field.name));
        const auto addWord = [&](std::int64_t number, const std::string& word) {
            words.add_value()->set_name(head + textform::enumWord(word));
            words.mutable_value(words.value_size() - 1)->set_number(static_cast<int>(number));
        };
        // What is first must be 0.
        const auto zero = std::find_if(field.words().begin(), field.words().end(),
                                       [](const FieldWord& word) { return word.number == 0; });
        addWord(0, zero == field.words().end() ? "unspecified" : std::string(zero->word));
        for (const FieldWord& word : field.words())
            if (word.number != 0) addWord(word.number, std::string(word.word));
        return name;
    }

    FieldDescriptorProto& add(DescriptorProto& message, std::vector<int> path, const std::string& name, int number,
                              FieldDescriptorProto::Type kind, bool repeated, const std::string& text,
                              const std::string& named = {}) {
        FieldDescriptorProto& field = *message.add_field();
        field.set_name(name);
        field.set_number(number);
        field.set_type(kind);
        field.set_label(repeated ? FieldDescriptorProto::LABEL_REPEATED : FieldDescriptorProto::LABEL_OPTIONAL);
        if (!named.empty()) field.set_type_name(kPackage + named);
        if (!text.empty()) {
            path.insert(path.end(), {2, message.field_size() - 1});
            comment(path, text);
        }
        return field;
    }

    /// Whether a number is there is told apart from 0: what is absent has the default of the scene's table.
    static void addPresence(DescriptorProto& message) {
        for (FieldDescriptorProto& field : *message.mutable_field()) {
            if (field.label() == FieldDescriptorProto::LABEL_REPEATED ||
                field.type() == FieldDescriptorProto::TYPE_MESSAGE)
                continue;
            field.set_proto3_optional(true);
            field.set_oneof_index(message.oneof_decl_size());
            message.add_oneof_decl()->set_name("_" + field.name());
        }
    }

    void comment(const std::vector<int>& path, const std::string& text) {
        auto& location = *file_.mutable_source_code_info()->add_location();
        location.add_path(4);
        location.add_path(place_);
        for (const int step : path) location.add_path(step);
        for (int i = 0; i < 3; ++i) location.add_span(0);
        location.set_leading_comments(text + "\n");
    }

    FileDescriptorProto& file_;
    const int place_;
    DescriptorProto* saved_ = nullptr;
};

}  // namespace

const SceneSchema& SceneSchema::get() {
    static const SceneSchema schema;
    return schema;
}

SceneSchema::SceneSchema() {
    FileDescriptorProto file;
    proto::scene::SceneFile::descriptor()->file()->CopyTo(&file);
    file.set_name("scene.proto");
    DescriptorProto node;
    const auto spellOut = [](FieldDescriptorProto& field, std::string_view message) {
        field.set_type(FieldDescriptorProto::TYPE_MESSAGE);
        field.set_type_name(fmt::format("{}.{}", kPackage, message));
    };
    for (DescriptorProto& message : *file.mutable_message_type())
        for (FieldDescriptorProto& field : *message.mutable_field()) {
            if (message.name() == "SceneFile" && field.name() == "saved") spellOut(field, "Saved");
            if (message.name() != "Node" || field.name() != "core") continue;
            spellOut(field, "Saved.Core");
            node = message;
        }
    Builder builder(file);
    builder.addSaved();
    builder.addObject();
    builder.addCore(node);
    for (const TypeInfo& type : allTypes()) builder.addType(type);
    builder.finish();

    const google::protobuf::FileDescriptor* built = pool_.BuildFile(file);
    TESSERA_CHECK(built != nullptr, "the table of types has numbers or names that protobuf refuses");
    file_ = built->FindMessageTypeByName("SceneFile");
    object_ = pool_.FindMessageTypeByName("tessera.proto.scene.Saved.Object");
    for (const TypeInfo& info : allTypes()) {
        Type type{&info, object_->FindFieldByNumber(kFirstType + info.type.value), {}};
        for (const FieldEntry& field : info.fields)
            type.fields.push_back({&field, type.inObject->message_type()->FindFieldByNumber(field.id.value)});
        types_.push_back(std::move(type));
    }
    for (const Type& type : types_) byNumber_[type.inObject->number()] = &type;
    const google::protobuf::FileDescriptor& compiled = *proto::scene::SceneFile::descriptor()->file();
    for (int m = 0; m < compiled.message_type_count(); ++m)
        for (int f = 0; f < compiled.message_type(m)->field_count(); ++f)
            twins_[compiled.message_type(m)->field(f)] = built->message_type(m)->field(f);
}

const SceneSchema::Type* SceneSchema::findType(int number) const {
    const auto found = byNumber_.find(number);
    return found == byNumber_.end() ? nullptr : found->second;
}

std::unique_ptr<google::protobuf::Message> SceneSchema::newMessage(const google::protobuf::Descriptor& type) const {
    return std::unique_ptr<google::protobuf::Message>(messages_.GetPrototype(&type)->New());
}

const google::protobuf::FieldDescriptor* SceneSchema::twin(const google::protobuf::FieldDescriptor* generated) const {
    const auto found = twins_.find(generated);
    return found == twins_.end() ? nullptr : found->second;
}

std::string SceneSchema::text() const {
    google::protobuf::DebugStringOptions options;
    options.include_comments = true;
    return fmt::format(
               "// Scene files of Tessera {}: .tsc is this message in protobuf's binary form, .tsct in its text form.\n"
               "// Made from the table of types by tessera-check --schema. `saved` holds any scene; the other fields "
               "are the\n"
               "// authors' way of writing one.\n"
               "//\n"
               "// In a .tsct `saved` is nested instead: objects without numbers, by their types' names, with the "
               "fields "
               "of the\n"
               "// messages Saved.…. A node holds its core and the nodes below it: node {{ name: \"a\" transform {{ … "
               "}} "
               "node {{ … }} }}.\n"
               "// A field that is the number of an object is its id or name, or the object itself: material: "
               "\"steel\", or\n"
               "// material {{ … }}; ids are said first: material {{ id: \"steel\" … }}. An array is [numbers], a text "
               "of its bytes, or\n"
               "// {{ array: N }} of the file that arrays {{ file: \"…\" id: \"…\" }} names, or of those that stand "
               "there as array: \"…\".\n"
               "// Beside the nodes: objects that several use, root {{ … }}, unplaced {{ node {{ … }} }}. Or flat, as "
               "below.\n",
               kVersion) +
           file_->file()->DebugStringWithOptions(options);
}

std::string sceneSchemaText() {
    return SceneSchema::get().text();
}

}  // namespace tessera
