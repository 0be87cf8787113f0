/// Whatever is described (common/request/Members.h) as JSON and back: an object with a key for each member. Heavy: for
/// the .cpp files of this folder.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/json/ChangeJson.h"
#include "common/json/JsonValues.h"
#include "common/request/Check.h"

namespace tessera {

// ---- writing

/// Bytes go beside the text as binaries; lists of changes are written out.
class MemberJsonWriter {
public:
    explicit MemberJsonWriter(Binaries& binaries) : binaries_(binaries) {}

    template <HasMembers T>
    [[nodiscard]] Json write(const T& value) {
        Json json = Json::object();
        put(json, value);
        return json;
    }

private:
    template <HasMembers T>
    void put(Json& json, const T& value) {
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm != MemberForm::kReserved && M::kForm != MemberForm::kRest)
                if (m.when == nullptr || m.when(value)) putMember(json, m, M::of(value));
        });
    }
    template <typename M, typename T>
    void putMember(Json& json, const M& m, const T& value) {
        if constexpr (M::kForm == MemberForm::kSpread) {
            put(json, value);
        } else if constexpr (kIsOptional<T>) {
            if (value) putMember(json, m, *value);
        } else if constexpr (M::kForm == MemberForm::kNumbers) {
            json[std::string(m.name)] = value.x();
            json[std::string(m.second)] = value.y();
        } else if constexpr (M::kForm == MemberForm::kFixed) {
            json[std::string(m.name)] = fmt::format("{:016x}", value.value);
        } else if constexpr (kIsMany<T>) {
            Json list = Json::array();
            for (const auto& each : value) list.push_back(one(m, each));
            json[std::string(m.name)] = std::move(list);
        } else {
            json[std::string(m.name)] = one(m, value);
        }
    }
    template <typename M, typename T>
    [[nodiscard]] Json one(const M& m, const T& value) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kWord)
            return WordsOf<T>::kWords[static_cast<std::size_t>(value)];
        else if constexpr (kIsId<T>)
            return idJson(value);
        else if constexpr (kind == ValueKind::kPlace)
            return Json::array({value.x(), value.y()});
        else if constexpr (kind == ValueKind::kVector)
            return Json::array({value.x(), value.y(), value.z()});
        else if constexpr (kind == ValueKind::kRotation)
            return Json::array({value.w(), value.x(), value.y(), value.z()});
        else if constexpr (kind == ValueKind::kValue)
            return write(value);
        else if constexpr (kind == ValueKind::kBytes)
            return m.holds == Holds::kChanges ? changesJson(value) : binaryJson(value, binaries_);
        else
            return value;
    }
    template <typename Id>
    [[nodiscard]] static Json idJson(Id id) {
        if constexpr (std::is_same_v<Id, ObjectId> || std::is_same_v<Id, ObjectType>)
            return jsonOf(id);
        else
            return id.value;
    }

    Binaries& binaries_;
};

// ---- reading

/// What a request's JSON may speak of beside itself, and what came of it beside its members.
struct JsonSurroundings {
    std::span<const ByteSlice> binaries;
    NamedObject named;
    std::vector<Blob> arrays;  ///< of lists of changes in it: they go before the request
};

class MemberJsonReader {
public:
    explicit MemberJsonReader(JsonSurroundings& around) : around_(around) {}

    [[nodiscard]] const std::optional<ApiError>& fault() const { return place_.fault(); }

    /// What is not said stays as it is. A key that is no member is refused, and named.
    template <HasMembers T>
    void take(T& value, const Json& json) {
        if (!json.is_object()) return place_.refuseType("an object", json);
        for (const auto& [key, held] : json.items()) {
            if (!place_.sound()) return;
            if (!takeMember(value, key, held)) noSuchMember<T>(key);
        }
        if (place_.sound()) refuseUncalledFor(value, json);
    }
    /// The bounds of the description.
    template <HasMembers T>
    void check(const T& value) {
        if (!place_.sound()) return;
        std::optional<Error> wrong = findFault(value);
        if (!wrong) return;
        // It begins with the member's name, or its path.
        const std::string_view path = std::string_view(wrong->message).substr(0, wrong->message.find_first_of(" :"));
        const bool isMember = [&] {
            std::vector<std::string_view> names;
            namesOf<T>(names);
            return std::ranges::find(names, path.substr(0, path.find('.'))) != names.end();
        }();
        if (isMember) {
            const JsonPlace::Step step(place_, path);
            place_.refuse(wrong->code, std::string(std::string_view(wrong->message).substr(path.size() + 1)));
        } else {
            place_.refuse(wrong->code, wrong->message);
        }
    }

private:
    template <HasMembers T>
    static void namesOf(std::vector<std::string_view>& names) {
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm == MemberForm::kSpread) {
                namesOf<typename M::Type>(names);
            } else if constexpr (M::kForm != MemberForm::kReserved && M::kForm != MemberForm::kRest) {
                names.push_back(m.name);
                if constexpr (M::kForm == MemberForm::kNumbers) names.push_back(m.second);
            }
        });
    }
    template <HasMembers T>
    void noSuchMember(const std::string& key) {
        std::vector<std::string_view> names;
        namesOf<T>(names);
        const JsonPlace::Step step(place_, key);
        place_.refuse(ErrorCode::kBadInput,
                      names.empty() ? "there is no such field, and there are no others"
                                    : fmt::format("there is no such field; there are {}", fmt::join(names, ", ")));
    }
    /// Members that may only be said in some cases.
    template <HasMembers T>
    void refuseUncalledFor(const T& value, const Json& json) {
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm != MemberForm::kReserved) {
                if (!place_.sound()) return;
                if (m.when == nullptr || m.when(value)) {
                    if constexpr (M::kForm == MemberForm::kSpread) refuseUncalledFor(M::of(value), json);
                    return;
                }
                std::vector<std::string_view> names{m.name};
                if constexpr (M::kForm == MemberForm::kSpread) {
                    names.clear();
                    namesOf<typename M::Type>(names);
                }
                for (const std::string_view name : names) {
                    if (!json.contains(std::string(name))) continue;
                    const JsonPlace::Step step(place_, name);
                    return place_.refuse(ErrorCode::kBadInput, fmt::format("is said {} alone", m.whenText));
                }
            }
        });
    }

    template <HasMembers T>
    bool takeMember(T& value, const std::string& key, const Json& json) {
        bool found = false;
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm == MemberForm::kSpread) {
                found = found || takeMember(M::of(value), key, json);
            } else if constexpr (M::kForm != MemberForm::kReserved && M::kForm != MemberForm::kRest) {
                bool second = false;
                if constexpr (M::kForm == MemberForm::kNumbers) second = key == m.second;
                if (found || (key != m.name && !second)) return;
                found = true;
                const JsonPlace::Step step(place_, key);
                takeValue(m, M::of(value), json, second);
            }
        });
        return found;
    }
    template <typename M, typename T>
    void takeValue(const M& m, T& value, const Json& json, bool second) {
        if constexpr (kIsOptional<T>) {
            if (json.is_null()) return value.reset();
            if (!value) value.emplace();
            takeValue(m, *value, json, second);
        } else if constexpr (M::kForm == MemberForm::kNumbers) {
            if (const std::optional<double> number = numberIn(place_, json)) value[second ? 1 : 0] = *number;
        } else if constexpr (M::kForm == MemberForm::kFixed) {
            if (const std::optional<std::uint64_t> number = hexIn(place_, json)) value = T(*number);
        } else if constexpr (kIsMany<T>) {
            if (!json.is_array()) return place_.refuseType("an array", json);
            if (m.most != nullptr && json.size() > ApplicationLimits{}.*m.most)
                return place_.refuse(ErrorCode::kLimit, fmt::format("{} entries; at most {} are allowed", json.size(),
                                                                    ApplicationLimits{}.*m.most));
            value.clear();
            for (std::size_t i = 0; i < json.size() && place_.sound(); ++i) {
                const JsonPlace::Step step(place_, i);
                value.emplace_back();
                takeOne(m, value.back(), json[i]);
            }
        } else {
            takeOne(m, value, json);
        }
    }
    template <typename M, typename T>
    void takeOne(const M& m, T& value, const Json& json) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kBool) {
            if (!json.is_boolean()) return place_.refuseType("true or false", json);
            value = json.get<bool>();
        } else if constexpr (kind == ValueKind::kWord) {
            takeWord(value, json);
        } else if constexpr (std::is_same_v<T, ObjectId>) {
            if (const std::optional<ObjectId> object = objectIn(place_, json, around_.named)) value = *object;
        } else if constexpr (std::is_same_v<T, ObjectType>) {
            if (const std::optional<ObjectType> type = typeIn(place_, json)) value = *type;
        } else if constexpr (kIsId<T>) {
            using Value = decltype(value.value);
            if (const std::optional<std::uint64_t> number = unsignedIn(place_, json, std::numeric_limits<Value>::max()))
                value = T(static_cast<Value>(*number));
        } else if constexpr (kind == ValueKind::kUnsigned) {
            // JavaScript has no whole numbers near 2^64, where the way back from 0 begins.
            if (m.around && json.is_number_integer() && !json.is_number_unsigned())
                value = static_cast<T>(json.get<std::int64_t>());
            else if (const std::optional<std::uint64_t> number =
                         unsignedIn(place_, json, std::numeric_limits<T>::max()))
                value = static_cast<T>(*number);
        } else if constexpr (kind == ValueKind::kSigned) {
            if (const std::optional<std::int64_t> number =
                    signedIn(place_, json, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()))
                value = static_cast<T>(*number);
        } else if constexpr (kind == ValueKind::kNumber) {
            if (const std::optional<double> number = numberIn(place_, json)) value = *number;
        } else if constexpr (kind == ValueKind::kText) {
            if (!json.is_string()) return place_.refuseType("a text", json);
            value = json.get<std::string>();
        } else if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector) {
            numbersIn(place_, json, static_cast<std::size_t>(value.size()),
                      [&](std::size_t i, double number) { value[static_cast<Eigen::Index>(i)] = number; });
        } else if constexpr (kind == ValueKind::kRotation) {
            // Eigen keeps w behind the others.
            numbersIn(place_, json, 4, [&](std::size_t i, double number) {
                value.coeffs()[static_cast<Eigen::Index>((i + 3) % 4)] = number;
            });
        } else if constexpr (kind == ValueKind::kRow) {
            if (!json.is_array() || json.size() != value.size())
                return place_.refuseType(fmt::format("an array of {}", value.size()), json);
            for (std::size_t i = 0; i < value.size() && place_.sound(); ++i) {
                const JsonPlace::Step step(place_, i);
                takeOne(m, value[i], json[i]);
            }
        } else if constexpr (kind == ValueKind::kBytes) {
            if (json.is_null())
                value = {};
            else if (m.holds == Holds::kChanges)
                value = changesIn(place_, json, around_.binaries, around_.named, around_.arrays);
            else if (const std::optional<ByteSlice> bytes = binaryIn(place_, json, around_.binaries))
                value = *bytes;
        } else {
            take(value, json);
        }
    }
    template <typename E>
    void takeWord(E& value, const Json& json) {
        if (json.is_string()) {
            const auto word =
                std::ranges::find(WordsOf<E>::kWords, std::string_view(json.get_ref<const std::string&>()));
            if (word != WordsOf<E>::kWords.end()) {
                value = static_cast<E>(word - WordsOf<E>::kWords.begin());
                return;
            }
            return place_.refuse(ErrorCode::kBadInput,
                                 fmt::format("\"{}\" is none of {}", json.get_ref<const std::string&>(),
                                             fmt::join(WordsOf<E>::kWords, ", ")));
        }
        place_.refuseType(fmt::format("one of the words {}", fmt::join(WordsOf<E>::kWords, ", ")), json);
    }

    JsonSurroundings& around_;
    JsonPlace place_;
};

}  // namespace tessera
