#include "common/scenefile/SavedReader.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/wire_format_lite.h>

#include <memory>
#include <new>
#include <unordered_map>

#include "common/base/Utf8.h"
#include "common/scenefile/SceneSchema.h"

namespace tessera {
namespace {

namespace pb = google::protobuf;
using pb::internal::WireFormatLite;

/// Room for a million children. Messages take a small multiple of it, one at a time.
constexpr std::size_t kMaxObjectBytes = std::size_t{8} << 20;
/// What nobody would read further.
constexpr std::size_t kMaxMended = 1000;

tl::unexpected<Error> damaged() {
    return fail(ErrorCode::kBadInput, "what it saved is damaged");
}

/// One field of a message as it lies in the bytes.
struct WireField {
    int number = 0;
    WireFormatLite::WireType kind = WireFormatLite::WIRETYPE_VARINT;
    std::uint64_t value = 0;  ///< of a number
    ByteSpan bytes;           ///< of what has a length
    ByteSpan whole;           ///< with its tag
};

/// Goes through the fields of a message without building anything. False: damaged, or refused by `visit`.
template <typename Visit>
bool forEachWireField(ByteSpan bytes, Visit&& visit) {
    if (bytes.size() > 0x7fffffff) return false;
    pb::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
    for (;;) {
        const int from = in.CurrentPosition();
        const std::uint32_t tag = in.ReadTag();
        if (tag == 0) return in.ConsumedEntireMessage() && static_cast<std::size_t>(from) == bytes.size();
        WireField field;
        field.number = WireFormatLite::GetTagFieldNumber(tag);
        field.kind = WireFormatLite::GetTagWireType(tag);
        std::uint32_t length = 0;
        switch (field.kind) {
            case WireFormatLite::WIRETYPE_VARINT:
                if (!in.ReadVarint64(&field.value)) return false;
                break;
            case WireFormatLite::WIRETYPE_FIXED64:
                if (!in.Skip(8)) return false;
                break;
            case WireFormatLite::WIRETYPE_FIXED32:
                if (!in.Skip(4)) return false;
                break;
            case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
                if (!in.ReadVarint32(&length)) return false;
                const auto start = static_cast<std::size_t>(in.CurrentPosition());
                if (length > bytes.size() - start || !in.Skip(static_cast<int>(length))) return false;
                field.bytes = bytes.subspan(start, length);
                break;
            }
            default:
                return false;  // groups: not used
        }
        if (field.number == 0) return false;
        field.whole =
            bytes.subspan(static_cast<std::size_t>(from), static_cast<std::size_t>(in.CurrentPosition() - from));
        if (!visit(field)) return false;
    }
}

/// A struct of a type that is known at run time only.
class AnyStruct {
public:
    explicit AnyStruct(const TypeInfo& type)
        : type_(type), data_(::operator new(type.size, std::align_val_t(type.alignment))) {
        type_.construct(data_);
    }
    ~AnyStruct() {
        type_.destroy(data_);
        ::operator delete(data_, std::align_val_t(type_.alignment));
    }
    AnyStruct(const AnyStruct&) = delete;
    AnyStruct& operator=(const AnyStruct&) = delete;
    [[nodiscard]] void* data() { return data_; }

private:
    const TypeInfo& type_;
    void* data_;
};

class SavedReader {
public:
    SavedReader(std::span<const Blob> blobs, const SavedOptions& options, ChangeListBuilder& list)
        : blobs_(blobs), options_(options), list_(list), message_(schema_.newMessage(schema_.object())) {}

    Expected<SavedScene> read(ByteSpan bytes) {
        if (Expected<void> found = findObjects(bytes); !found) return tl::unexpected(found.error());
        if (Expected<void> named = giveIds(); !named) return tl::unexpected(named.error());
        for (std::size_t i = 0; i < items_.size(); ++i)
            if (items_[i].type)
                if (Expected<void> done = readItem(i); !done) return tl::unexpected(done.error());
        if (Expected<void> placed = placeAll(); !placed) return tl::unexpected(placed.error());
        finishLater();
        return std::move(result_);
    }

private:
    struct Item {
        ByteSpan bytes;
        const SceneSchema::Type* type = nullptr;  ///< null: a newer version's
        std::uint32_t number = 0;
        ObjectId id;
        std::vector<std::uint32_t> children;
        std::size_t parent = kNone;
    };
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

    [[nodiscard]] tl::unexpected<Error> failAt(const Item& item, ErrorCode code, std::string_view why) {
        const SavedPlace place = parse(item) ? placeOfParsed(item) : SavedPlace{.number = shownNumber(item)};
        return fail(code, savedObjectText(place, item.type ? item.type->info->name : std::string_view(), why));
    }

    /// Of the object in `message_`.
    [[nodiscard]] SavedPlace placeOfParsed(const Item& item) const {
        const pb::Message& at =
            message_->GetReflection()->GetMessage(*message_, &schema_.objectField(SceneSchema::kAt));
        const auto number = [&](int field) {
            return at.GetReflection()->GetUInt32(at, at.GetDescriptor()->FindFieldByNumber(field));
        };
        return {.number = shownNumber(item), .line = number(1), .column = number(2)};
    }
    [[nodiscard]] std::uint32_t shownNumber(const Item& item) const { return isNamed_ ? 0 : item.number; }

    // ---- what is there

    Expected<void> findObjects(ByteSpan bytes) {
        Expected<void> problem;
        const bool whole = findObjectsIn(bytes, false, problem);
        if (!problem) return problem;
        return whole ? Expected<void>() : damaged();
    }

    /// `quoted`: what a text had to quote is read as though it stood there.
    bool findObjectsIn(ByteSpan bytes, bool quoted, Expected<void>& problem) {
        return forEachWireField(bytes, [&](const WireField& field) {
            const bool hasLength = field.kind == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
            if (field.number == SceneSchema::kRoot && field.kind == WireFormatLite::WIRETYPE_VARINT) {
                rootNumber_ = static_cast<std::uint32_t>(field.value);
            } else if (field.number == SceneSchema::kNamed && field.kind == WireFormatLite::WIRETYPE_VARINT) {
                isNamed_ = field.value != 0;
            } else if (field.number == SceneSchema::kLaterSaved && hasLength) {
                return !quoted && findObjectsIn(field.bytes, true, problem);
            } else if (field.number == SceneSchema::kLaterFile && hasLength) {
                // Beside the message only fields can stand that this version does not know.
                result_.later.ofFile += asText(field.bytes);
                return forEachWireField(field.bytes, [&](const WireField& beside) {
                    return schema_.file().FindFieldByNumber(beside.number) == nullptr;
                });
            } else if (field.number != SceneSchema::kObject || !hasLength) {
                result_.later.ofSaved += asText(field.whole);
            } else {
                Item item;
                item.bytes = field.bytes;
                if (items_.size() >= options_.maxObjects)
                    problem =
                        fail(ErrorCode::kLimit, fmt::format("the scene has more than {} objects", options_.maxObjects));
                else if (field.bytes.size() > kMaxObjectBytes)
                    problem = fail(ErrorCode::kLimit,
                                   fmt::format("one of its objects takes more than {} MiB", kMaxObjectBytes >> 20));
                else if (!lookAt(field.bytes, item, 0))
                    problem = damaged();
                items_.push_back(std::move(item));
                return problem.has_value();
            }
            return true;
        });
    }

    /// Number and type of an object, and nothing else.
    bool lookAt(ByteSpan bytes, Item& item, int depth) {
        return forEachWireField(bytes, [&](const WireField& field) {
            const bool hasLength = field.kind == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
            if (field.number == SceneSchema::kNumber && field.kind == WireFormatLite::WIRETYPE_VARINT)
                item.number = static_cast<std::uint32_t>(field.value);
            if (field.number == SceneSchema::kLater && hasLength && depth == 0 && !lookAt(field.bytes, item, 1))
                return false;
            if (field.number >= SceneSchema::kFirstType && hasLength)
                if (const SceneSchema::Type* type = schema_.findType(field.number)) item.type = type;
            return true;
        });
    }

    Expected<void> giveIds() {
        std::uint64_t next = options_.firstId;
        for (std::size_t i = 0; i < items_.size(); ++i) {
            Item& item = items_[i];
            if (item.number == 0) return fail(ErrorCode::kBadInput, "one of its objects has no number");
            if (!byNumber_.emplace(item.number, i).second)
                return failAt(item, ErrorCode::kBadInput, "its number is there twice");
            if (item.type && item.number != rootNumber_) item.id = ObjectId{next++};
        }
        const auto root = byNumber_.find(rootNumber_);
        if (root == byNumber_.end() || !items_[root->second].type ||
            items_[root->second].type->info->type != typeOf<Node>())
            return fail(ErrorCode::kBadInput, "what it saved has no root: 'root' must be the number of a Node");
        root_ = root->second;
        // A root that is nothing but the top of the tree becomes the place where the scene is put.
        const Expected<bool> bare = parse(items_[root_]) ? Expected<bool>(isBare()) : Expected<bool>(damaged());
        if (!bare) return tl::unexpected(bare.error());
        rootIsParent_ = *bare;
        items_[root_].id = rootIsParent_ ? options_.parent : ObjectId{next++};
        if (!rootIsParent_)
            result_.notes.push_back(failAt(items_[root_], ErrorCode::kBadInput,
                                           "it is the root, and has a name or a core, as no root has: it stands below "
                                           "the root, and all paths are a level deeper")
                                        .value()
                                        .message);
        result_.created = next - options_.firstId;
        result_.places.resize(result_.created);
        return {};
    }

    // ---- values

    /// The object's message, what a newer version wrote merged in again.
    bool parse(const Item& item) {
        pb::Message& message = *message_;
        const pb::Reflection& reflection = *message.GetReflection();
        if (!message.ParseFromArray(item.bytes.data(), static_cast<int>(item.bytes.size()))) return false;
        for (const int number : {SceneSchema::kLater, SceneSchema::kLaterFields}) {
            const pb::FieldDescriptor* field = &schema_.objectField(number);
            if (!reflection.HasField(message, field)) continue;
            const std::string bytes = reflection.GetString(message, field);
            reflection.ClearField(&message, field);
            pb::Message* target = number == SceneSchema::kLater ? &message
                                  : item.type ? reflection.MutableMessage(&message, item.type->inObject)
                                              : nullptr;
            if (!target || !target->MergeFromString(bytes)) return false;
        }
        return true;
    }

    [[nodiscard]] bool isBare() const {
        const pb::FieldDescriptor* held = items_[root_].type->inObject;
        const pb::Message& node = message_->GetReflection()->GetMessage(*message_, held);
        std::vector<const pb::FieldDescriptor*> set;
        node.GetReflection()->ListFields(node, &set);
        for (const SceneSchema::Field& field : items_[root_].type->fields)
            for (const pb::FieldDescriptor* one : set)
                if (one == field.descriptor && (one->cpp_type() != pb::FieldDescriptor::CPPTYPE_STRING ||
                                                !node.GetReflection()->GetString(node, one).empty()))
                    return false;
        return true;
    }

    Expected<void> readItem(std::size_t index) {
        Item& item = items_[index];
        if (!parse(item)) return failAt(item, ErrorCode::kBadInput, "it is damaged, or its text is no UTF-8");
        const pb::Message& message = *message_;
        const pb::Reflection& reflection = *message.GetReflection();
        const TypeInfo& type = *item.type->info;
        const pb::FieldDescriptor* child = &schema_.objectField(SceneSchema::kChild);
        const int children = reflection.FieldSize(message, child);
        if (children > 0 && type.type != typeOf<Node>())
            return failAt(item, ErrorCode::kBadInput, "only a Node has children");
        for (int i = 0; i < children; ++i) item.children.push_back(reflection.GetRepeatedUInt32(message, child, i));

        const pb::Message& value = reflection.GetMessage(message, item.type->inObject);
        AnyStruct made(type);
        for (const SceneSchema::Field& field : item.type->fields) {
            Expected<void> set = readField(item, value, field, made.data());
            if (!set) return failAt(item, set.error().code, set.error().message);
        }
        keepUnknown(item, message, value);
        if (options_.look)
            if (Expected<void> good = options_.look(item.id, type, made.data()); !good)
                return failAt(item, good.error().code, good.error().message);
        if (index == root_ && rootIsParent_) return {};
        result_.places[item.id.value - options_.firstId] = placeOfParsed(item);
        list_.create(item.id, type.type);
        setAllFields(list_, item.id, Object(type, made.data()));
        return {};
    }

    Expected<void> readField(const Item& item, const pb::Message& message, const SceneSchema::Field& field,
                             void* object) {
        const pb::Reflection& reflection = *message.GetReflection();
        const FieldEntry& entry = *field.entry;
        const pb::FieldDescriptor* at = field.descriptor;
        const int count = at->is_repeated()                  ? reflection.FieldSize(message, at)
                          : reflection.HasField(message, at) ? 1
                                                             : 0;
        if (count == 0) return {};
        FieldValue value;
        switch (entry.kind) {
            case FieldKind::kFloat:
            case FieldKind::kDouble: {
                if (count != entry.width)
                    return fail(ErrorCode::kBadInput,
                                fmt::format("{} has {} numbers, not {}", at->name(), count, entry.width));
                if (entry.kind == FieldKind::kFloat) {
                    Floats numbers{{}, entry.width};
                    for (int i = 0; i < count; ++i)
                        numbers.values[static_cast<std::size_t>(i)] = at->is_repeated()
                                                                          ? reflection.GetRepeatedFloat(message, at, i)
                                                                          : reflection.GetFloat(message, at);
                    value = numbers;
                } else {
                    Doubles numbers{{}, entry.width};
                    for (int i = 0; i < count; ++i)
                        numbers.values[static_cast<std::size_t>(i)] = at->is_repeated()
                                                                          ? reflection.GetRepeatedDouble(message, at, i)
                                                                          : reflection.GetDouble(message, at);
                    value = numbers;
                }
                break;
            }
            case FieldKind::kMatrix: {
                Matrix matrix;
                if (count != 16)
                    return fail(ErrorCode::kBadInput, fmt::format("{} has {} numbers, not 16", at->name(), count));
                for (int i = 0; i < count; ++i)
                    matrix.values[static_cast<std::size_t>(i)] = reflection.GetRepeatedDouble(message, at, i);
                value = matrix;
                break;
            }
            case FieldKind::kInt:
                value = knownWord(item, entry,
                                  at->enum_type() ? std::int64_t{reflection.GetEnumValue(message, at)}
                                                  : reflection.GetInt64(message, at));
                break;
            case FieldKind::kText: {
                std::string text = reflection.GetString(message, at);
                if (text.size() > options_.maxTextBytes)
                    return fail(ErrorCode::kLimit,
                                fmt::format("{} has more than {} bytes", at->name(), options_.maxTextBytes));
                if (!isUtf8(text)) return fail(ErrorCode::kBadInput, at->name() + " is no UTF-8");
                value = std::move(text);
                break;
            }
            case FieldKind::kBlob: {
                const std::uint32_t number = reflection.GetUInt32(message, at);
                if (number > blobs_.size())
                    return fail(ErrorCode::kBadInput,
                                fmt::format("{} names array {}, which does not exist", at->name(), number));
                value = number == 0 ? Blob() : blobs_[number - 1];
                break;
            }
            case FieldKind::kBool:
                value = reflection.GetBool(message, at);
                break;
            case FieldKind::kRef:
            case FieldKind::kRefs: {
                Expected<FieldValue> refs = readRefs(item, message, field, count);
                if (!refs) return tl::unexpected(refs.error());
                value = std::move(*refs);
                break;
            }
        }
        if (const std::string what = takeNearest(entry, value); !what.empty() && result_.mended.size() < kMaxMended)
            result_.mended.push_back(savedObjectText(placeOfParsed(item), item.type->info->name, what));
        if (Expected<void> good = checkValue(entry, value); !good) return good;
        entry.store(object, value);
        return {};
    }

    /// For a newer version's word of an enumeration the default; of flags those that are known.
    std::int64_t knownWord(const Item& item, const FieldEntry& entry, std::int64_t said) {
        std::int64_t known = said;
        if (entry.wordUse == WordUse::kOneOf && !wordOfNumber(entry, said)) {
            known = std::get<std::int64_t>(entry.load(item.type->info->freshObject()));
        } else if (entry.wordUse == WordUse::kFlags) {
            std::int64_t all = 0;
            for (const FieldWord& word : entry.words()) all |= word.number;
            known = said & all;
        }
        if (known != said) {
            result_.later.words[{item.id, entry.id}] = {said, known};
            ++unknown_[fmt::format("{} {} of {}", entry.name, said, item.type->info->name)];
        }
        return known;
    }

    Expected<FieldValue> readRefs(const Item& item, const pb::Message& message, const SceneSchema::Field& field,
                                  int count) {
        const pb::Reflection& reflection = *message.GetReflection();
        const pb::FieldDescriptor* at = field.descriptor;
        std::vector<std::uint32_t> numbers;
        for (int i = 0; i < count; ++i)
            numbers.push_back(at->is_repeated() ? reflection.GetRepeatedUInt32(message, at, i)
                                                : reflection.GetUInt32(message, at));
        RefList ids;
        bool later = false;
        for (const std::uint32_t number : numbers) {
            if (number == 0) {
                if (at->is_repeated()) return fail(ErrorCode::kBadInput, at->name() + " names none among others");
                continue;
            }
            const auto found = byNumber_.find(number);
            if (found == byNumber_.end())
                return fail(ErrorCode::kBadInput,
                            fmt::format("{} names object {}, which does not exist", at->name(), number));
            const Item& target = items_[found->second];
            if (!target.type) {
                later = true;
                continue;
            }
            const TypeInfo& info = *target.type->info;
            if (!field.entry->mayReferTo(info.type, info.isCore))
                return fail(ErrorCode::kBadInput,
                            fmt::format("{} names object {}, which is of type {}", at->name(), number, info.name));
            ids.push_back(target.id);
        }
        if (later) result_.later.refs[{item.id, field.entry->id}] = std::move(numbers);
        if (field.entry->kind == FieldKind::kRefs) return FieldValue(std::move(ids));
        return FieldValue(ids.empty() ? ObjectId() : ids.front());
    }

    // ---- what a newer version wrote

    void keepUnknown(const Item& item, const pb::Message& message, const pb::Message& value) {
        const pb::UnknownFieldSet& ofObject = message.GetReflection()->GetUnknownFields(message);
        const pb::UnknownFieldSet& ofValue = value.GetReflection()->GetUnknownFields(value);
        if (ofObject.empty() && ofValue.empty()) return;
        LaterParts::Fields& kept = result_.later.fields[item.id];
        (void)ofObject.SerializeToString(&kept.ofObject);
        (void)ofValue.SerializeToString(&kept.ofValue);
        for (int i = 0; i < ofValue.field_count(); ++i)
            ++unknown_[fmt::format("field {} of {}", ofValue.field(i).number(), item.type->info->name)];
        for (int i = 0; i < ofObject.field_count(); ++i)
            ++unknown_[fmt::format("field {} of an object", ofObject.field(i).number())];
    }

    void finishLater() {
        LaterParts& later = result_.later;
        for (const Item& item : items_) {
            if (item.type) continue;
            if (!parse(item)) continue;
            std::string name = "objects without a value";
            const pb::UnknownFieldSet& held = message_->GetReflection()->GetUnknownFields(*message_);
            for (int i = 0; i < held.field_count(); ++i)
                if (held.field(i).number() >= SceneSchema::kFirstType)
                    name = fmt::format("objects of type {}", held.field(i).number() - SceneSchema::kFirstType);
            ++unknown_[name];
            message_->GetReflection()->ClearField(message_.get(), &schema_.objectField(SceneSchema::kAt));
            (void)message_->SerializePartialToString(&later.objects.emplace_back());
        }
        if (!later.ofSaved.empty()) ++unknown_["fields beside its objects"];
        later.ofFile += options_.beside;
        if (!later.ofFile.empty()) ++unknown_["fields beside what it saved"];
        for (const auto& [what, times] : unknown_) {
            result_.unknown.push_back(times > 1 ? fmt::format("{} ({} times)", what, times) : what);
            result_.notes.push_back(laterKeptText(result_.unknown.back()));
        }
        if (later.empty()) return;
        later.blobs.assign(blobs_.begin(), blobs_.end());
        for (const Item& item : items_)
            if (item.type) later.numbers[item.id] = item.number;
    }

    // ---- the tree

    Expected<void> placeAll() {
        for (std::size_t i = 0; i < items_.size(); ++i)
            for (const std::uint32_t number : items_[i].children) {
                const auto found = byNumber_.find(number);
                if (found == byNumber_.end() || !items_[found->second].type ||
                    items_[found->second].type->info->type != typeOf<Node>())
                    return failAt(items_[i], ErrorCode::kBadInput,
                                  fmt::format("its child {} is no Node of this file", number));
                Item& child = items_[found->second];
                if (found->second == root_)
                    return failAt(items_[i], ErrorCode::kBadInput, "the root is among its children");
                if (child.parent != kNone)
                    return failAt(child, ErrorCode::kBadInput, "it has two parents, or is a child twice");
                child.parent = i;
            }
        if (!rootIsParent_) {
            list_.place(items_[root_].id, options_.parent);
            result_.tops.push_back(items_[root_].id);
        }
        std::size_t placed = 0;
        if (Expected<void> done = placeBelow(root_, rootIsParent_ ? 0 : 1, placed); !done) return done;
        // Nodes out of the tree, which something refers to.
        std::size_t nodes = 0;
        for (std::size_t i = 0; i < items_.size(); ++i) {
            if (!items_[i].type || items_[i].type->info->type != typeOf<Node>()) continue;
            ++nodes;
            if (i != root_ && items_[i].parent == kNone)
                if (Expected<void> done = placeBelow(i, 0, placed); !done) return done;
        }
        if (placed == nodes) return {};
        return fail(ErrorCode::kBadInput, "some of its nodes are below themselves");
    }

    Expected<void> placeBelow(std::size_t top, std::size_t depth, std::size_t& placed) {
        std::vector<std::pair<std::size_t, std::size_t>> open = {{top, depth}};
        while (!open.empty()) {
            const auto [at, level] = open.back();
            open.pop_back();
            ++placed;
            const Item& item = items_[at];
            if (!item.children.empty() && level >= options_.maxDepth)
                return failAt(item, ErrorCode::kLimit,
                              fmt::format("nodes are nested deeper than {} levels", options_.maxDepth));
            for (const std::uint32_t number : item.children) {
                const std::size_t child = byNumber_.at(number);
                list_.place(items_[child].id, item.id);
                if (at == root_ && rootIsParent_) result_.tops.push_back(items_[child].id);
                open.emplace_back(child, level + 1);
            }
        }
        return {};
    }

    const SceneSchema& schema_ = SceneSchema::get();
    std::span<const Blob> blobs_;
    const SavedOptions& options_;
    ChangeListBuilder& list_;
    std::unique_ptr<pb::Message> message_;
    SavedScene result_;
    std::vector<Item> items_;
    std::unordered_map<std::uint32_t, std::size_t> byNumber_;
    std::uint32_t rootNumber_ = 0;
    std::size_t root_ = 0;
    bool rootIsParent_ = false;
    bool isNamed_ = false;
    std::map<std::string, std::size_t> unknown_;
};

}  // namespace

std::string laterKeptText(std::string_view what) {
    return fmt::format(
        "a newer version of Tessera wrote {}: not understood; tessera-convert keeps it, a running scene does not",
        what);
}

std::string laterLeftOutText(std::string_view what) {
    return fmt::format("a newer version of Tessera wrote {}: not understood, left out", what);
}

std::string savedObjectText(const SavedPlace& place, std::string_view type, std::string_view why) {
    const std::string at = place.line > 0 ? fmt::format("{}:{}: ", place.line, place.column) : "";
    if (place.number == 0) return fmt::format("{}{}: {}", at, type.empty() ? "object" : type, why);
    return fmt::format("{}object {}{}: {}", at, place.number, type.empty() ? "" : fmt::format(" ({})", type), why);
}

Expected<SavedScene> readSaved(ByteSpan bytes, std::span<const Blob> blobs, const SavedOptions& options,
                               ChangeListBuilder& list) {
    pb::LogSilencer silence;  // what is wrong is said by the error
    return SavedReader(blobs, options, list).read(bytes);
}

}  // namespace tessera
