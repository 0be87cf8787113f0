/// Single values out of JSON, checked; shared by what reads described members and what reads fields. Inside of this
/// folder.
#pragma once

#include <nlohmann/json.hpp>

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/Utf8.h"
#include "common/change/Value.h"
#include "common/json/Json.h"

namespace tessera {

/// The object that a text means, where it is neither "#17" nor "$0". `path`: the member that says so.
using NamedObject = std::function<Expected<ObjectId>(const std::string& name, const std::string& path)>;

/// The words of somebody, for a message: their beginning, where they are longer than names are.
[[nodiscard]] inline std::string shortened(std::string_view said) {
    constexpr std::size_t kMost = 200;
    return said.size() <= kMost ? std::string(said) : std::string(cutUtf8(said, kMost)) + "…";
}

/// Where one is in what is read, and the first thing that is wrong there.
class JsonPlace {
public:
    /// A step inwards, until it goes: ".name" or "[3]".
    class Step {
    public:
        Step(JsonPlace& place, std::string_view name) : place_(place), before_(place.path_.size()) {
            if (!place.path_.empty()) place.path_ += '.';
            place.path_ += shortened(name);
        }
        Step(JsonPlace& place, std::size_t index) : place_(place), before_(place.path_.size()) {
            place.path_ += '[' + std::to_string(index) + ']';
        }
        ~Step() { place_.path_.resize(before_); }
        Step(const Step&) = delete;
        Step& operator=(const Step&) = delete;

    private:
        JsonPlace& place_;
        std::size_t before_;
    };

    [[nodiscard]] const std::optional<ApiError>& fault() const { return fault_; }
    [[nodiscard]] bool sound() const { return !fault_; }
    [[nodiscard]] const std::string& path() const { return path_; }
    void refuse(ErrorCode code, const std::string& message) {
        if (!fault_) fault_ = ApiError{code, path_.empty() ? message : path_ + ": " + message, path_};
    }
    /// "a number was expected, not a text"
    void refuseType(std::string_view wanted, const Json& json);

private:
    std::string path_;
    std::optional<ApiError> fault_;
};

/// What a JSON value is called in messages: "a text", "a number", …
[[nodiscard]] std::string_view kindOf(const Json& json);

[[nodiscard]] std::optional<double> numberIn(JsonPlace& place, const Json& json);
/// Whole numbers from `least` to `greatest`.
[[nodiscard]] std::optional<std::int64_t> signedIn(JsonPlace& place, const Json& json, std::int64_t least,
                                                   std::int64_t greatest);
[[nodiscard]] std::optional<std::uint64_t> unsignedIn(JsonPlace& place, const Json& json, std::uint64_t greatest);
/// 16 digits: what stands for a hash, and may be beyond what a double holds.
[[nodiscard]] std::optional<std::uint64_t> hexIn(JsonPlace& place, const Json& json);
/// 32 digits.
[[nodiscard]] std::optional<Hash128> blobIdIn(JsonPlace& place, const Json& json);
/// A number, "#17", "$0" (the first object that a proposal creates), a name that `named` knows, or null for none.
[[nodiscard]] std::optional<ObjectId> objectIn(JsonPlace& place, const Json& json, const NamedObject& named);
/// A number, or of a placeholder "$0"; null for none.
[[nodiscard]] Json jsonOf(ObjectId id);
/// A name of the table of types, or its number.
[[nodiscard]] std::optional<ObjectType> typeIn(JsonPlace& place, const Json& json);
[[nodiscard]] Json jsonOf(ObjectType type);
/// `{"binary":N}`: that one of those that came.
[[nodiscard]] std::optional<ByteSlice> binaryIn(JsonPlace& place, const Json& json,
                                                std::span<const ByteSlice> binaries);
/// Puts the bytes beside the text.
[[nodiscard]] Json binaryJson(ByteSlice bytes, Binaries& binaries);

/// Exactly `count` numbers in an array, each given to `take(index, number)`.
template <typename Take>
bool numbersIn(JsonPlace& place, const Json& json, std::size_t count, Take&& take) {
    if (!json.is_array() || json.size() != count) {
        place.refuseType("an array of " + std::to_string(count) + " numbers", json);
        return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const JsonPlace::Step step(place, i);
        const std::optional<double> number = numberIn(place, json[i]);
        if (!number) return false;
        take(i, *number);
    }
    return true;
}

}  // namespace tessera
