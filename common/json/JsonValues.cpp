#include "common/json/JsonValues.h"

#include <fmt/format.h>

#include <charconv>

#include "common/scene/FieldTable.h"

#include "common/base/HashText.h"

namespace tessera {
namespace {

/// All of a text as a whole number without a sign.
std::optional<std::uint64_t> digitsIn(std::string_view text, int base = 10) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

}  // namespace

std::string_view kindOf(const Json& json) {
    if (json.is_null()) return "null";
    if (json.is_boolean()) return "true or false";
    if (json.is_number()) return "a number";
    if (json.is_string()) return "a text";
    return json.is_array() ? "an array" : "an object";
}

void JsonPlace::refuseType(std::string_view wanted, const Json& json) {
    refuse(ErrorCode::kBadInput, json.is_array()
                                     ? fmt::format("{} was expected, not an array of {}", wanted, json.size())
                                     : fmt::format("{} was expected, not {}", wanted, kindOf(json)));
}

std::optional<double> numberIn(JsonPlace& place, const Json& json) {
    if (json.is_number()) return json.get<double>();
    place.refuseType("a number", json);
    return std::nullopt;
}

std::optional<std::int64_t> signedIn(JsonPlace& place, const Json& json, std::int64_t least, std::int64_t greatest) {
    const bool fits = json.is_number_unsigned()
                          ? json.get<std::uint64_t>() <= std::uint64_t(std::numeric_limits<std::int64_t>::max())
                          : json.is_number_integer();
    if (fits && json.get<std::int64_t>() >= least && json.get<std::int64_t>() <= greatest)
        return json.get<std::int64_t>();
    if (json.is_number())
        place.refuse(ErrorCode::kBadInput,
                     fmt::format("a whole number from {} to {} was expected, not {}", least, greatest, json.dump()));
    else
        place.refuseType("a whole number", json);
    return std::nullopt;
}

std::optional<std::uint64_t> unsignedIn(JsonPlace& place, const Json& json, std::uint64_t greatest) {
    // What was parsed is unsigned from 0 up; what a program has made may be signed.
    if (json.is_number_integer() && (json.is_number_unsigned() || json.get<std::int64_t>() >= 0) &&
        json.get<std::uint64_t>() <= greatest)
        return json.get<std::uint64_t>();
    if (json.is_number())
        place.refuse(ErrorCode::kBadInput,
                     fmt::format("a whole number from 0 to {} was expected, not {}", greatest, json.dump()));
    else
        place.refuseType("a whole number", json);
    return std::nullopt;
}

std::optional<std::uint64_t> hexIn(JsonPlace& place, const Json& json) {
    if (json.is_string())
        if (const auto& text = json.get_ref<const std::string&>(); text.size() == 16)
            if (const std::optional<std::uint64_t> number = digitsIn(text, 16)) return number;
    place.refuseType("a text of 16 hexadecimal digits", json);
    return std::nullopt;
}

std::optional<Hash128> blobIdIn(JsonPlace& place, const Json& json) {
    if (json.is_string())
        if (const std::optional<Hash128> id = hashOfText(json.get_ref<const std::string&>())) return id;
    place.refuseType("a text of 32 hexadecimal digits", json);
    return std::nullopt;
}

std::optional<ObjectId> objectIn(JsonPlace& place, const Json& json, const NamedObject& named) {
    if (json.is_null()) return ObjectId{};
    if (!json.is_string()) {
        const std::optional<std::uint64_t> number = unsignedIn(place, json, kFirstPlaceholder - 1);
        return number ? std::optional(ObjectId(*number)) : std::nullopt;
    }
    const auto& text = json.get_ref<const std::string&>();
    const bool isNumber = text.starts_with('#'), isNew = text.starts_with('$');
    if (isNumber || isNew) {
        const std::optional<std::uint64_t> number = digitsIn(std::string_view(text).substr(1));
        if (number && *number < kFirstPlaceholder) return ObjectId(isNew ? kFirstPlaceholder + *number : *number);
    } else if (named) {
        const Expected<ObjectId> object = named(text, place.path());
        if (object) return *object;
        place.refuse(object.error().code, object.error().message);
        return std::nullopt;
    }
    place.refuse(ErrorCode::kBadInput, fmt::format("\"{}\" names no object: its number, \"#17\", a path "
                                                   "(\"/hall/crane\"), or \"$0\" for the first that is created",
                                                   shortened(text)));
    return std::nullopt;
}

Json jsonOf(ObjectId id) {
    if (!id) return nullptr;
    if (isPlaceholder(id)) return fmt::format("${}", id.value - kFirstPlaceholder);
    return id.value;
}

std::optional<ObjectType> typeIn(JsonPlace& place, const Json& json) {
    if (json.is_null()) return ObjectType{};
    if (json.is_string()) {
        if (const TypeInfo* type = findType(std::string_view(json.get_ref<const std::string&>()))) return type->type;
        place.refuse(ErrorCode::kNotFound,
                     fmt::format("there is no type \"{}\"", shortened(json.get_ref<const std::string&>())));
        return std::nullopt;
    }
    const std::optional<std::uint64_t> number = unsignedIn(place, json, 0xffff);
    return number ? std::optional(ObjectType(static_cast<std::uint16_t>(*number))) : std::nullopt;
}

Json jsonOf(ObjectType type) {
    if (!type) return nullptr;
    const TypeInfo* info = findType(type);
    return info ? Json(info->name) : Json(type.value);
}

std::optional<ByteSlice> binaryIn(JsonPlace& place, const Json& json, std::span<const ByteSlice> binaries) {
    if (!json.is_object() || json.size() != 1 || !json.contains("binary")) {
        place.refuseType("{\"binary\":N}", json);
        return std::nullopt;
    }
    const JsonPlace::Step step(place, "binary");
    if (binaries.empty()) {
        place.refuse(ErrorCode::kBadInput,
                     "no binary frame belongs to this message: it says \"binaries\":N, and N frames follow");
        return std::nullopt;
    }
    const std::optional<std::uint64_t> index = unsignedIn(place, json["binary"], binaries.size() - 1);
    return index ? std::optional(binaries[*index]) : std::nullopt;
}

Json binaryJson(ByteSlice bytes, Binaries& binaries) {
    binaries.push_back(std::move(bytes));
    return {{"binary", binaries.size() - 1}};
}

}  // namespace tessera
