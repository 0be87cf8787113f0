#include "common/json/ChangeJson.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <initializer_list>

#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

// ---- writing

template <typename Numbers>
Json numbersJson(const Numbers& value) {
    if (value.width == 1) return static_cast<double>(value.values[0]);
    Json list = Json::array();
    for (std::size_t i = 0; i < value.width; ++i) list.push_back(static_cast<double>(value.values[i]));
    return list;
}

Json arrayJson(const Blob& array) {
    if (array.empty()) return nullptr;
    return {{"blob", toHex(array.id())}, {"bytes", array.sizeBytes()}};
}

// ---- reading

/// The keys of an object, and no others.
bool hasOnly(JsonPlace& place, const Json& json, std::initializer_list<std::string_view> known) {
    if (!json.is_object()) {
        place.refuseType("an object", json);
        return false;
    }
    for (const auto& [key, value] : json.items()) {
        if (std::ranges::find(known, std::string_view(key)) != known.end()) continue;
        const JsonPlace::Step step(place, key);
        place.refuse(ErrorCode::kBadInput, fmt::format("there is no such field; there are {}", fmt::join(known, ", ")));
        return false;
    }
    return true;
}

const Json& held(const Json& json, const char* key) {
    static const Json kNothing;
    const auto found = json.find(key);
    return found == json.end() ? kNothing : *found;
}

class ListReader {
public:
    ListReader(JsonPlace& place, std::span<const ByteSlice> binaries, const NamedObject& named,
               std::vector<Blob>& arrays)
        : place_(place), binaries_(binaries), named_(named), arrays_(arrays) {}

    ByteSlice read(const Json& json) {
        if (!hasOnly(place_, json, {"created", "placed", "set", "parts", "destroyed"})) return {};
        each(json, "created", [&](const Json& one) { create(one); });
        each(json, "placed", [&](const Json& one) { put(one); });
        each(json, "set", [&](const Json& one) { set(one); });
        each(json, "parts", [&](const Json& one) { setPart(one); });
        each(json, "destroyed", [&](const Json& one) {
            if (const std::optional<ObjectId> object = objectIn(place_, one, named_)) builder_.destroy(*object);
        });
        if (!place_.sound()) return {};
        return encodeChangeList(builder_.take());
    }

private:
    template <typename Read>
    void each(const Json& json, const char* key, Read&& read) {
        const Json& list = held(json, key);
        if (list.is_null() || !place_.sound()) return;
        const JsonPlace::Step in(place_, key);
        if (!list.is_array()) return place_.refuseType("an array", list);
        for (std::size_t i = 0; i < list.size() && place_.sound(); ++i) {
            const JsonPlace::Step step(place_, i);
            read(list[i]);
        }
    }
    std::optional<ObjectId> object(const Json& json, const char* key) {
        const JsonPlace::Step step(place_, key);
        return objectIn(place_, held(json, key), named_);
    }
    const TypeInfo* type(const Json& json) {
        const JsonPlace::Step step(place_, "type");
        const std::optional<ObjectType> number = typeIn(place_, held(json, "type"));
        if (!number) return nullptr;
        const TypeInfo* info = findType(*number);
        if (info == nullptr) place_.refuse(ErrorCode::kNotFound, "there is no such type");
        return info;
    }
    const FieldEntry* field(const TypeInfo& type, const Json& json) {
        const JsonPlace::Step step(place_, "field");
        const Json& name = held(json, "field");
        if (!name.is_string()) {
            place_.refuseType("a field's name", name);
            return nullptr;
        }
        if (const FieldEntry* entry = findField(type, std::string_view(name.get_ref<const std::string&>())))
            return entry;
        std::vector<std::string_view> known;
        for (const FieldEntry& other : type.fields) known.push_back(other.name);
        place_.refuse(ErrorCode::kNotFound, fmt::format("{} has no field \"{}\"; it has {}", type.name,
                                                        name.get_ref<const std::string&>(), fmt::join(known, ", ")));
        return nullptr;
    }

    void create(const Json& json) {
        if (!hasOnly(place_, json, {"id", "type"})) return;
        const std::optional<ObjectId> id = object(json, "id");
        const TypeInfo* info = id ? type(json) : nullptr;
        if (info != nullptr) builder_.create(*id, info->type);
    }
    void put(const Json& json) {
        if (!hasOnly(place_, json, {"node", "parent", "index"})) return;
        const std::optional<ObjectId> node = object(json, "node"), parent = object(json, "parent");
        if (!node || !parent) return;
        const JsonPlace::Step step(place_, "index");
        const Json& place = held(json, "index");
        const std::optional<std::uint64_t> index =
            place.is_null() ? Placement::kLast : unsignedIn(place_, place, Placement::kLast);
        if (index) builder_.place(*node, *parent, static_cast<std::uint32_t>(*index));
    }
    void setPart(const Json& json) {
        if (!hasOnly(place_, json, {"object", "type", "field", "offset", "bytes"})) return;
        const std::optional<ObjectId> id = object(json, "object");
        const TypeInfo* info = id ? type(json) : nullptr;
        const FieldEntry* entry = info ? field(*info, json) : nullptr;
        if (entry == nullptr) return;
        if (entry->kind != FieldKind::kBlob)
            return place_.refuse(ErrorCode::kBadInput, fmt::format("{} is no array", entry->name));
        std::optional<std::uint64_t> offset;
        {
            const JsonPlace::Step step(place_, "offset");
            offset = unsignedIn(place_, held(json, "offset"), std::numeric_limits<std::int64_t>::max());
        }
        const JsonPlace::Step step(place_, "bytes");
        const std::optional<ByteSlice> bytes = offset ? binaryIn(place_, held(json, "bytes"), binaries_) : std::nullopt;
        if (!bytes) return;
        if (bytes->empty()) return place_.refuse(ErrorCode::kBadInput, "no bytes");
        builder_.setRange(*id, info->type, entry->id, *offset, blobOf(*bytes));
    }

    void set(const Json& json) {
        if (!hasOnly(place_, json, {"type", "field", "ids", "values"})) return;
        const TypeInfo* info = type(json);
        const FieldEntry* entry = info ? field(*info, json) : nullptr;
        if (entry == nullptr) return;
        const std::vector<ObjectId> ids = idsIn(held(json, "ids"));
        if (!place_.sound()) return;
        const JsonPlace::Step step(place_, "values");
        const Json& values = held(json, "values");
        if (values.is_object()) return setPacked(*info, *entry, ids, values);
        if (!values.is_array() || values.size() != ids.size())
            return place_.refuseType(fmt::format("an array of {} values, one for each id,", ids.size()), values);
        for (std::size_t i = 0; i < ids.size() && place_.sound(); ++i) {
            const JsonPlace::Step at(place_, i);
            if (const std::optional<FieldValue> value = valueIn(*entry, values[i])) put(*info, *entry, ids[i], *value);
        }
    }
    std::vector<ObjectId> idsIn(const Json& json) {
        const JsonPlace::Step step(place_, "ids");
        std::vector<ObjectId> ids;
        if (json.is_object()) {
            const std::optional<ByteSlice> bytes = binaryIn(place_, json, binaries_);
            if (!bytes || !isWhole(*bytes, sizeof(std::uint64_t))) return {};
            ids.resize(bytes->size() / sizeof(std::uint64_t));
            if (!ids.empty()) std::memcpy(static_cast<void*>(ids.data()), bytes->data(), bytes->size());
            return ids;
        }
        if (!json.is_array()) {
            place_.refuseType("an array of ids", json);
            return {};
        }
        for (std::size_t i = 0; i < json.size() && place_.sound(); ++i) {
            const JsonPlace::Step at(place_, i);
            if (const std::optional<ObjectId> id = objectIn(place_, json[i], named_)) ids.push_back(*id);
        }
        return ids;
    }
    bool isWhole(const ByteSlice& bytes, std::size_t each) {
        if (bytes.size() % each == 0) return true;
        place_.refuse(ErrorCode::kBadInput, fmt::format("{} bytes are no whole number of {} each", bytes.size(), each));
        return false;
    }

    /// Values of a binary, one row behind the other.
    void setPacked(const TypeInfo& info, const FieldEntry& entry, const std::vector<ObjectId>& ids, const Json& json) {
        const std::optional<ByteSlice> bytes = binaryIn(place_, json, binaries_);
        if (!bytes) return;
        switch (entry.kind) {
            case FieldKind::kFloat:
                return rows<float>(entry, ids, *bytes, entry.width, [&](ObjectId id, std::span<const float> row) {
                    put(info, entry, id, packed<Floats>(row));
                });
            case FieldKind::kDouble:
                return rows<double>(entry, ids, *bytes, entry.width, [&](ObjectId id, std::span<const double> row) {
                    put(info, entry, id, packed<Doubles>(row));
                });
            case FieldKind::kInt:
                return rows<std::int64_t>(entry, ids, *bytes, 1, [&](ObjectId id, std::span<const std::int64_t> row) {
                    put(info, entry, id, row[0]);
                });
            case FieldKind::kBool:
                return rows<std::uint8_t>(entry, ids, *bytes, 1, [&](ObjectId id, std::span<const std::uint8_t> row) {
                    put(info, entry, id, row[0] != 0);
                });
            default:
                place_.refuse(ErrorCode::kBadInput,
                              fmt::format("values of {} ({}) are no rows of numbers: they stand in the text",
                                          entry.name, nameOf(entry.kind)));
        }
    }
    template <typename Scalar, typename Take>
    void rows(const FieldEntry& entry, const std::vector<ObjectId>& ids, const ByteSlice& bytes, std::size_t width,
              Take&& take) {
        if (bytes.size() != ids.size() * width * sizeof(Scalar))
            return place_.refuse(
                ErrorCode::kBadInput,
                fmt::format("{} ids want {} bytes, {} numbers of {} bytes each: these are {}", ids.size(),
                            ids.size() * width * sizeof(Scalar), width, sizeof(Scalar), bytes.size()));
        std::vector<Scalar> row(width);
        for (std::size_t i = 0; i < ids.size() && place_.sound(); ++i) {
            std::memcpy(row.data(), bytes.data() + i * width * sizeof(Scalar), width * sizeof(Scalar));
            const JsonPlace::Step at(place_, i);
            take(ids[i], std::span<const Scalar>(row));
        }
        (void)entry;
    }
    template <typename Numbers, typename Scalar>
    static FieldValue packed(std::span<const Scalar> row) {
        Numbers numbers;
        numbers.width = static_cast<std::uint8_t>(row.size());
        std::ranges::copy(row, numbers.values.begin());
        return numbers;
    }
    void put(const TypeInfo& info, const FieldEntry& entry, ObjectId id, const FieldValue& value) {
        if (const Expected<void> sound = checkValue(entry, value); !sound)
            return place_.refuse(sound.error().code, sound.error().message);
        builder_.set(id, info.type, entry.id, value);
    }

    std::optional<FieldValue> valueIn(const FieldEntry& entry, const Json& json) {
        switch (entry.kind) {
            case FieldKind::kFloat:
                return numbers<Floats>(entry, json);
            case FieldKind::kDouble:
                return numbers<Doubles>(entry, json);
            case FieldKind::kInt:
                return wholeNumber(entry, json);
            case FieldKind::kRef: {
                const std::optional<ObjectId> id = objectIn(place_, json, named_);
                return id ? std::optional<FieldValue>(*id) : std::nullopt;
            }
            case FieldKind::kText:
                if (json.is_string()) return json.get<std::string>();
                place_.refuseType("a text", json);
                return std::nullopt;
            case FieldKind::kBlob:
                return array(json);
            case FieldKind::kBool:
                if (json.is_boolean()) return json.get<bool>();
                place_.refuseType("true or false", json);
                return std::nullopt;
            case FieldKind::kRefs:
                return refs(json);
            case FieldKind::kMatrix: {
                Matrix matrix;
                if (!numbersIn(place_, json, matrix.values.size(),
                               [&](std::size_t i, double number) { matrix.values[i] = number; }))
                    return std::nullopt;
                return matrix;
            }
        }
        return std::nullopt;
    }
    template <typename Numbers>
    std::optional<FieldValue> numbers(const FieldEntry& entry, const Json& json) {
        Numbers value;
        value.width = entry.width;
        const auto take = [&](std::size_t i, double number) {
            value.values[i] = static_cast<typename decltype(value.values)::value_type>(number);
        };
        if (entry.width > 1) {
            if (!numbersIn(place_, json, entry.width, take)) return std::nullopt;
        } else {
            const std::optional<double> number = numberIn(place_, json);
            if (!number) return std::nullopt;
            take(0, *number);
        }
        return value;
    }
    std::optional<FieldValue> wholeNumber(const FieldEntry& entry, const Json& json) {
        if (entry.wordUse != WordUse::kNone && json.is_string()) {
            const auto& word = json.get_ref<const std::string&>();
            if (const std::optional<std::int64_t> number = numberOfWord(entry, word)) return *number;
            std::vector<std::string_view> known;
            for (const FieldWord& other : entry.words()) known.push_back(other.word);
            place_.refuse(ErrorCode::kBadInput, fmt::format("\"{}\" is none of {}", word, fmt::join(known, ", ")));
            return std::nullopt;
        }
        const std::optional<std::int64_t> number =
            signedIn(place_, json, std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max());
        return number ? std::optional<FieldValue>(*number) : std::nullopt;
    }
    std::optional<FieldValue> refs(const Json& json) {
        RefList list;
        if (!json.is_array()) {
            place_.refuseType("an array of ids", json);
            return std::nullopt;
        }
        for (std::size_t i = 0; i < json.size(); ++i) {
            const JsonPlace::Step step(place_, i);
            const std::optional<ObjectId> id = objectIn(place_, json[i], named_);
            if (!id) return std::nullopt;
            list.push_back(*id);
        }
        return list;
    }
    std::optional<FieldValue> array(const Json& json) {
        if (json.is_null()) return Blob();
        if (json.is_object() && json.contains("blob")) return knownArray(json);
        const std::optional<ByteSlice> bytes = binaryIn(place_, json, binaries_);
        if (!bytes) return std::nullopt;
        return bytes->empty() ? Blob() : blobOf(*bytes);
    }
    /// One that the server has: by its name.
    std::optional<FieldValue> knownArray(const Json& json) {
        if (!hasOnly(place_, json, {"blob", "bytes"})) return std::nullopt;
        const std::optional<std::uint64_t> bytes =
            unsignedIn(place_, held(json, "bytes"), std::numeric_limits<std::int64_t>::max());
        const std::optional<Hash128> id = blobIdIn(place_, held(json, "blob"));
        if (!id || !bytes) return std::nullopt;
        return Blob::absent(*id, *bytes);
    }
    Blob blobOf(const ByteSlice& bytes) {
        Blob blob(std::make_shared<ByteSlice>(bytes), bytes.bytes());
        arrays_.push_back(blob);
        return blob;
    }

    JsonPlace& place_;
    std::span<const ByteSlice> binaries_;
    const NamedObject& named_;
    std::vector<Blob>& arrays_;
    ChangeListBuilder builder_;
};

}  // namespace

Json valueJson(const FieldValue& value) {
    if (const auto* floats = std::get_if<Floats>(&value)) return numbersJson(*floats);
    if (const auto* doubles = std::get_if<Doubles>(&value)) return numbersJson(*doubles);
    if (const auto* number = std::get_if<std::int64_t>(&value)) return *number;
    if (const auto* flag = std::get_if<bool>(&value)) return *flag;
    if (const auto* matrix = std::get_if<Matrix>(&value)) return matrix->values;
    if (const auto* id = std::get_if<ObjectId>(&value)) return jsonOf(*id);
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    if (const auto* array = std::get_if<Blob>(&value)) return arrayJson(*array);
    Json list = Json::array();
    for (const ObjectId id : std::get<RefList>(value)) list.push_back(jsonOf(id));
    return list;
}

Json valueJson(const FieldInfo& field, const FieldValue& value) {
    if (const auto* number = std::get_if<std::int64_t>(&value))
        if (const std::optional<std::string> word = wordOfNumber(field, *number)) return *word;
    return valueJson(value);
}

Json changesJson(const ChangeList& list) {
    Json json = Json::object();
    const auto say = [&](const char* key, const auto& items, auto&& write) {
        if (items.empty()) return;
        Json all = Json::array();
        for (const auto& item : items) all.push_back(write(item));
        json[key] = std::move(all);
    };
    say("created", list.creations, [](const Creation& c) {
        return Json{{"id", jsonOf(c.id)}, {"type", jsonOf(c.type)}};
    });
    say("placed", list.placements, [](const Placement& p) {
        Json place{{"node", jsonOf(p.node)}, {"parent", jsonOf(p.parent)}};
        if (p.index != Placement::kLast) place["index"] = p.index;
        return place;
    });
    Json set = Json::array();
    for (const FieldColumn& column : list.columns) {
        const TypeInfo* type = findType(column.type);
        const FieldEntry* field = type ? findField(*type, column.field) : nullptr;
        if (field == nullptr) continue;
        Json ids = Json::array(), values = Json::array();
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            ids.push_back(jsonOf(column.ids[row]));
            values.push_back(valueJson(*field, column.value(row)));
        }
        set.push_back(
            {{"type", type->name}, {"field", field->name}, {"ids", std::move(ids)}, {"values", std::move(values)}});
    }
    if (!set.empty()) json["set"] = std::move(set);
    say("parts", list.ranges, [](const RangeEdit& range) {
        const TypeInfo* type = findType(range.type);
        const FieldEntry* field = type ? findField(*type, range.field) : nullptr;
        return Json{{"object", jsonOf(range.object)},
                    {"type", jsonOf(range.type)},
                    {"field", field ? Json(field->name) : Json(range.field.value)},
                    {"offset", range.offset},
                    {"bytes", arrayJson(range.bytes)},
                    {"result", arrayJson(range.result)}};
    });
    say("destroyed", list.destructions, [](ObjectId id) { return jsonOf(id); });
    return json;
}

Json changesJson(const ByteSlice& encoded) {
    if (encoded.empty()) return nullptr;
    const Expected<ChangeList> list = decodeChangeList(encoded, BlobStore(), AbsentBlobs::kKeepAbsent);
    return list ? changesJson(*list) : Json(nullptr);
}

ByteSlice changesIn(JsonPlace& place, const Json& json, std::span<const ByteSlice> binaries, const NamedObject& named,
                    std::vector<Blob>& arrays) {
    return ListReader(place, binaries, named, arrays).read(json);
}

}  // namespace tessera
