// A scene as the bytes of a binary file, or of a text that holds what a newer version wrote: object by object.

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <array>
#include <unordered_map>
#include <unordered_set>

#include "common/base/Version.h"
#include "common/scene/ServerNodes.h"
#include "common/scenefile/SceneFile.h"
#include "common/scenefile/SceneSchema.h"
#include "common/scenefile/TextWriter.h"
#include "proto/scene.pb.h"

namespace tessera {
namespace {

namespace pb = google::protobuf;
using pb::internal::WireFormatLite;

class SceneWriter {
public:
    SceneWriter(const Aspect& scene, SceneEncoding encoding, const LaterParts& later)
        : scene_(scene), text_(encoding == SceneEncoding::kText), later_(later) {
        printer_.SetUseShortRepeatedPrimitives(true);
        printer_.SetUseUtf8StringEscaping(true);
        printer_.SetInitialIndentLevel(2);
    }

    Expected<std::string> write() {
        collect();
        // Equal ones too: what is not understood may name any of them.
        for (const Blob& blob : later_.blobs) {
            blobs_.push_back(blob);
            blobNumbers_.try_emplace(blob.id(), static_cast<std::uint32_t>(blobs_.size()));
        }
        for (const ObjectId id : order_)
            if (Expected<void> done = addObject(id); !done) return tl::unexpected(done.error());
        for (const std::string& object : later_.objects) {
            message_->Clear();
            (void)message_->ParsePartialFromString(object);
            addMessage();
        }
        return text_ ? textFile() : binaryFile();
    }

private:
    /// Objects keep the numbers that they have in the file they come from.
    void collect() {
        std::uint32_t highest = 0;
        for (const auto& [id, number] : later_.numbers) highest = std::max(highest, number);
        for (const std::string& object : later_.objects) {
            (void)message_->ParsePartialFromString(object);
            highest =
                std::max(highest, message_->GetReflection()->GetUInt32(*message_, &objectField(SceneSchema::kNumber)));
        }
        ObjectsToSave objects = objectsToSave(scene_);
        order_ = std::move(objects.order);
        numbers_ = std::move(objects.places);
        for (const ObjectId id : order_) {
            const auto known = later_.numbers.find(id);
            numbers_[id] = known != later_.numbers.end() ? known->second : ++highest;
        }
    }

    const pb::FieldDescriptor& objectField(int number) const { return schema_.objectField(number); }

    std::uint32_t blobNumber(const Blob& blob) {
        if (blob.empty()) return 0;
        const auto [at, isNew] = blobNumbers_.try_emplace(blob.id(), static_cast<std::uint32_t>(blobs_.size() + 1));
        if (isNew) blobs_.push_back(blob);
        return at->second;
    }

    Expected<void> addObject(ObjectId id) {
        const Object object = scene_.find(id);
        const SceneSchema::Type& type = schema_.types()[object.info().index];
        pb::Message& out = *message_;
        out.Clear();
        const pb::Reflection& reflection = *out.GetReflection();
        reflection.SetUInt32(&out, &objectField(SceneSchema::kNumber), numbers_[id]);
        if (const Node* node = object.as<Node>())
            for (const ObjectId child : node->children)
                if (!scene_.get<Node>(child)->ofServer)
                    reflection.AddUInt32(&out, &objectField(SceneSchema::kChild), numbers_[child]);
        pb::Message& value = *reflection.MutableMessage(&out, type.inObject);
        for (const SceneSchema::Field& field : type.fields) {
            FieldValue present = field.entry->load(object);
            const auto kept = later_.refs.find({id, field.entry->id});
            if (kept != later_.refs.end() && leadsAsBefore(present, kept->second)) {
                setNumbers(value, field, kept->second);
                continue;
            }
            if (const auto* blob = std::get_if<Blob>(&present); blob && !blob->empty() && !blob->resident())
                return fail(ErrorCode::kRefused,
                            fmt::format("the {} of {} #{} ({} bytes) are not here", field.entry->name,
                                        object.info().name, id.value, blob->sizeBytes()));
            if (const auto word = later_.words.find({id, field.entry->id});
                word != later_.words.end() && present == FieldValue(word->second.read))
                present = word->second.ofFile;
            if (present != field.entry->load(type.info->freshObject())) setValue(value, field, present);
        }
        if (const auto kept = later_.fields.find(id); kept != later_.fields.end()) {
            addUnknown(out, kept->second.ofObject);
            addUnknown(value, kept->second.ofValue);
        }
        addMessage();
        return {};
    }

    static void addUnknown(pb::Message& message, const std::string& bytes) {
        pb::UnknownFieldSet fields;
        if (fields.ParseFromString(bytes)) message.GetReflection()->MutableUnknownFields(&message)->MergeFrom(fields);
    }

    /// Whether a field has still the refs that it had beside those that could not be understood.
    bool leadsAsBefore(const FieldValue& value, const std::vector<std::uint32_t>& before) const {
        std::vector<std::uint32_t> present;
        if (const auto* one = std::get_if<ObjectId>(&value); one && *one) present.push_back(numbers_.at(*one));
        if (const auto* list = std::get_if<RefList>(&value))
            for (const ObjectId id : *list) present.push_back(numbers_.at(id));
        // What is present stands there in the same order; the rest are the others.
        std::size_t at = 0;
        for (const std::uint32_t number : before)
            if (at < present.size() && present[at] == number) ++at;
        return at == present.size();
    }

    static void setNumbers(pb::Message& message, const SceneSchema::Field& field,
                           const std::vector<std::uint32_t>& numbers) {
        const pb::Reflection& reflection = *message.GetReflection();
        for (const std::uint32_t number : numbers)
            if (field.descriptor->is_repeated())
                reflection.AddUInt32(&message, field.descriptor, number);
            else
                reflection.SetUInt32(&message, field.descriptor, number);
    }

    void setValue(pb::Message& message, const SceneSchema::Field& field, const FieldValue& value) {
        const pb::Reflection& reflection = *message.GetReflection();
        const pb::FieldDescriptor* at = field.descriptor;
        if (const auto* floats = std::get_if<Floats>(&value)) {
            if (!at->is_repeated()) return reflection.SetFloat(&message, at, floats->values[0]);
            for (std::size_t i = 0; i < floats->width; ++i) reflection.AddFloat(&message, at, floats->values[i]);
        } else if (const auto* doubles = std::get_if<Doubles>(&value)) {
            if (!at->is_repeated()) return reflection.SetDouble(&message, at, doubles->values[0]);
            for (std::size_t i = 0; i < doubles->width; ++i) reflection.AddDouble(&message, at, doubles->values[i]);
        } else if (const auto* matrix = std::get_if<Matrix>(&value)) {
            for (const double number : matrix->values) reflection.AddDouble(&message, at, number);
        } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
            if (at->enum_type())
                reflection.SetEnumValue(&message, at, static_cast<int>(*whole));
            else
                reflection.SetInt64(&message, at, *whole);
        } else if (const auto* ref = std::get_if<ObjectId>(&value)) {
            reflection.SetUInt32(&message, at, *ref ? numbers_.at(*ref) : 0);
        } else if (const auto* refs = std::get_if<RefList>(&value)) {
            for (const ObjectId id : *refs) reflection.AddUInt32(&message, at, numbers_.at(id));
        } else if (const auto* text = std::get_if<std::string>(&value)) {
            reflection.SetString(&message, at, *text);
        } else if (const auto* blob = std::get_if<Blob>(&value)) {
            reflection.SetUInt32(&message, at, blobNumber(*blob));
        } else {
            reflection.SetBool(&message, at, std::get<bool>(value));
        }
    }

    /// What has no name cannot stand in a text: it goes into a field of bytes.
    void moveUnknown(pb::Message& from, int field) {
        pb::UnknownFieldSet& unknown = *from.GetReflection()->MutableUnknownFields(&from);
        if (unknown.empty()) return;
        std::string bytes;
        (void)unknown.SerializeToString(&bytes);
        unknown.Clear();
        message_->GetReflection()->SetString(message_.get(), &objectField(field), bytes);
    }

    void addMessage() {
        // Not through a StringOutputStream on what is there already: it fills the string to its capacity, each time.
        pb::Message& out = *message_;
        if (!text_) {
            std::array<std::uint8_t, 16> head;
            std::uint8_t* end = pb::io::CodedOutputStream::WriteTagToArray(
                WireFormatLite::MakeTag(SceneSchema::kObject, WireFormatLite::WIRETYPE_LENGTH_DELIMITED), head.data());
            end = pb::io::CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(out.ByteSizeLong()), end);
            saved_.append(head.data(), end);
            (void)out.AppendPartialToString(&saved_);
            return;
        }
        const pb::Reflection& reflection = *out.GetReflection();
        if (const auto* held = reflection.GetOneofFieldDescriptor(
                out, objectField(SceneSchema::kNumber).containing_type()->oneof_decl(0)))
            moveUnknown(*reflection.MutableMessage(&out, held), SceneSchema::kLaterFields);
        moveUnknown(out, SceneSchema::kLater);
        std::string lines;
        (void)printer_.PrintToString(out, &lines);
        saved_ += "  object {\n" + lines + "  }\n";
    }

    Expected<std::string> binaryFile() {
        std::size_t total = saved_.size() + later_.ofSaved.size() + later_.ofFile.size() + 64;
        for (const Blob& blob : blobs_) total += blob.sizeBytes() + 8;
        if (total > kMaxSceneFileBytes) return sceneTooLarge();
        std::string file;
        file.reserve(total);
        {
            pb::io::StringOutputStream stream(&file);
            pb::io::CodedOutputStream coded(&stream);
            const auto tag = [&](int field, WireFormatLite::WireType kind) {
                coded.WriteTag(WireFormatLite::MakeTag(field, kind));
            };
            const auto bytes = [&](int field, ByteSpan content) {
                tag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
                coded.WriteVarint32(static_cast<std::uint32_t>(content.size()));
                if (!content.empty()) coded.WriteRaw(content.data(), static_cast<int>(content.size()));
            };
            tag(proto::scene::SceneFile::kVersionFieldNumber, WireFormatLite::WIRETYPE_VARINT);
            coded.WriteVarint32(1);
            std::string root;
            {
                pb::io::StringOutputStream rootStream(&root);
                pb::io::CodedOutputStream rootCoded(&rootStream);
                rootCoded.WriteTag(WireFormatLite::MakeTag(SceneSchema::kRoot, WireFormatLite::WIRETYPE_VARINT));
                rootCoded.WriteVarint32(numbers_.at(kRootNode));
            }
            saved_ += root + later_.ofSaved;
            bytes(proto::scene::SceneFile::kSavedFieldNumber, asBytes(saved_));
            for (const Blob& blob : blobs_) bytes(proto::scene::SceneFile::kBlobFieldNumber, blob.bytes());
            coded.WriteString(later_.ofFile);
        }
        return file;
    }

    Expected<std::string> textFile() {
        std::string file = fmt::format(
            "# A scene of a newer version than Tessera {}. Objects name each other by their numbers, arrays by their "
            "place below.\n"
            "# What each field means: tessera-check --schema\n"
            "version: 1\nsaved {{\n  root: {}\n",
            kVersion, numbers_.at(kRootNode));
        file += saved_;
        std::string line;
        const auto quote = [&](std::string_view name, const std::string& bytes) {
            if (bytes.empty()) return;
            proto::scene::SceneFile quoted;  // lends its printing of bytes
            quoted.set_saved(bytes);
            (void)printer_.PrintToString(quoted, &line);
            file += fmt::format("  {}{}", name, line.substr(line.find(':')));
        };
        quote("later", later_.ofSaved);
        quote("later_file", later_.ofFile);
        file += "}\n";
        pb::TextFormat::Printer plain;
        for (const Blob& blob : blobs_) {
            if (file.size() + blob.sizeBytes() > kMaxSceneFileBytes) return sceneTooLarge();
            proto::scene::SceneFile one;
            one.add_blob(std::string(asText(blob.bytes())));
            line.clear();
            (void)plain.PrintToString(one, &line);
            file += line;
        }
        if (file.size() > kMaxSceneFileBytes) return sceneTooLarge();
        return file;
    }

    const SceneSchema& schema_ = SceneSchema::get();
    const Aspect& scene_;
    const bool text_;
    const LaterParts& later_;
    pb::TextFormat::Printer printer_;
    std::unique_ptr<pb::Message> message_ = schema_.newMessage(schema_.object());
    std::vector<ObjectId> order_;
    std::unordered_map<ObjectId, std::uint32_t> numbers_;
    std::vector<Blob> blobs_;
    std::unordered_map<BlobId, std::uint32_t> blobNumbers_;
    std::string saved_;
};

}  // namespace

Expected<std::string> writeScene(const Aspect& scene, SceneEncoding encoding, const LaterParts& later) {
    if (encoding == SceneEncoding::kBinary || !later.empty()) return SceneWriter(scene, encoding, later).write();
    const Expected<WrittenText> text = writeNested(scene);
    return text ? textWithArrays(*text) : tl::unexpected(text.error());
}

}  // namespace tessera
